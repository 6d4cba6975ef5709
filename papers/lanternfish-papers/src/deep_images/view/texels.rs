//! One image's texels as numbers and as images: the number of fragments, one layer's depth, or all fragments blended.

use glam::UVec2;
use lanternfish::{
    RenderError,
    output::{DISPLAY_FORMAT, fullscreen},
};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Frame, RasterPipeline, RasterState, gpu_constants, storage_buffer, uniform_buffer_of,
};

use super::{
    super::{images::DeepImages, settings::DeepImageSettings, shaders::DECLARED},
    check_store, invocation_index,
    shared::{TexelQuery, TexelScale},
};

gpu_constants! {
    /// Number of a texel whose list ends before the layer.
    pub(super) const NO_FRAGMENT: f32 = 3e38;
}

/// The colour scale of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Colors {
    /// White at the first number, dark grey at the second; dark blue if there is no number.
    Grey(f32, f32),
    /// Black for 0, then blue, cyan, green, yellow, and red for this number.
    Heat(f32),
}

/// A number of each texel of an image.
#[derive(Clone, Debug)]
pub struct TexelValues {
    /// Texels across and down.
    pub resolution: u32,
    /// By rows of texels, as the lists are; `None` if a list ends before the layer.
    pub values: Vec<Option<f32>>,
    /// True if images are turned by half a turn so that +y of the world is upwards.
    turned: bool,
    buffer: wgpu::Buffer,
}

impl TexelValues {
    /// The least and the greatest number; `None` without any.
    pub fn extent(&self) -> Option<(f32, f32)> {
        let join = |(low, high): (f32, f32), number: &f32| (low.min(*number), high.max(*number));
        let mut numbers = self.values.iter().flatten();
        let first = *numbers.next()?;
        Some(numbers.fold((first, first), join))
    }

    /// The mean of the numbers; 0 without any.
    pub fn mean(&self) -> f64 {
        let numbers = || self.values.iter().flatten();
        numbers().map(|number| f64::from(*number)).sum::<f64>() / numbers().count().max(1) as f64
    }
}

/// The passes.
#[derive(Debug)]
pub struct TexelViews {
    count: ComputeKernel,
    layer: ComputeKernel,
    transparent: ComputeKernel,
    paint: RasterPipeline,
}

impl TexelViews {
    /// Compiles the passes for images of these settings: linear arrays.
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        check_store(settings)?;
        let texels = DECLARED.link("deep_images/view/texels", &settings.fragment_features())?;
        let paint = DECLARED.link("deep_images/view/paint", &[])?;
        let state = RasterState { targets: &[Some(DISPLAY_FORMAT.into())], ..Default::default() };
        Ok(Self {
            count: ComputeKernel::new(device, &texels, "count", "deep_images/view/count"),
            layer: ComputeKernel::new(device, &texels, "layer", "deep_images/view/layer"),
            transparent: ComputeKernel::new(device, &texels, "transparent", "deep_images/view/transparent"),
            paint: RasterPipeline::new(device, &paint, "vertex", "fragment", "deep_images/view/paint", &state),
        })
    }

    /// Fragments of every texel of an image. An error if there is no such image.
    pub fn counts(&self, frame: &mut Frame<'_>, images: &DeepImages, image: u32) -> Result<TexelValues, RenderError> {
        self.read(frame, images, image, &self.count, 0)
    }

    /// Darkness, 0 to 1, of every texel of an image whose fragments are transparent surfaces, blended from the first to the last
    /// [Archer2019, fig. 6]: fragments of one surface that are in a list twice darken it. An error if there is no such image.
    pub fn transparent(
        &self,
        frame: &mut Frame<'_>,
        images: &DeepImages,
        image: u32,
    ) -> Result<TexelValues, RenderError> {
        self.read(frame, images, image, &self.transparent, 0)
    }

    /// Depth of one fragment of every texel of an image, m along the image's axis from the scene's middle. Layer 0 is the first
    /// fragment of each list, -1 the last.
    ///
    /// An error if there is no such image, or if no list of it is long enough.
    pub fn layer(
        &self,
        frame: &mut Frame<'_>,
        images: &DeepImages,
        image: u32,
        layer: i32,
    ) -> Result<TexelValues, RenderError> {
        let depths = self.read(frame, images, image, &self.layer, layer)?;
        if depths.extent().is_some() {
            return Ok(depths);
        }
        let deepest = self.counts(frame, images, image)?.extent().map_or(0.0, |(_, most)| most);
        let known = match deepest as u32 {
            0 => format!("image {image} has no fragments"),
            n => format!(
                "the longest list of image {image} holds {n}, layers 0 to {}, or -1 to -{n} from its end",
                n - 1
            ),
        };
        Err(RenderError::NoSuch { what: "layer", number: layer.into(), known })
    }

    fn read(
        &self,
        frame: &mut Frame<'_>,
        images: &DeepImages,
        image: u32,
        kernel: &ComputeKernel,
        layer: i32,
    ) -> Result<TexelValues, RenderError> {
        let (chunk, image_of_chunk) = invocation_index(images, image)?;
        let resolution = chunk.grid.resolution;
        let texels = resolution as usize * resolution as usize;
        let buffer = storage_buffer(frame.device, kernel.label(), 4 * texels as u64)?;
        let query = TexelQuery { image: image_of_chunk, layer };
        let query = uniform_buffer_of(frame.device, kernel.label(), &query);
        let own = Bindings::new().buffer("texel_query", &query).buffer("texel_numbers", &buffer);
        let [width, height, _] = kernel.workgroup_size();
        let groups = [resolution.div_ceil(width), resolution.div_ceil(height), 1];
        frame.dispatch(kernel, &chunk.bindings(&images.frames).with(&own), groups);
        let numbers = frame.read_now::<f32>(&buffer, texels)?;
        let values = numbers.into_iter().map(|number| (number != NO_FRAGMENT).then_some(number)).collect();
        // Rows follow the frame's y; seen along z with x to the right that is downwards.
        let turned = images.directions.frame(image).y_axis.y > 0.0;
        Ok(TexelValues { resolution, values, turned, buffer })
    }

    /// A square image of the numbers, seen along the image's axis, rotated by 180° if that turns +y of the world upwards. Each texel is
    /// `upscale` pixels across and down, at least 1.
    ///
    /// An error if the device's texture limit is exceeded.
    pub fn paint(
        &self,
        frame: &mut Frame<'_>,
        texels: &TexelValues,
        colors: Colors,
        upscale: u32,
    ) -> Result<wgpu::TextureView, RenderError> {
        let limit = frame.device.limits().max_texture_dimension_2d;
        let edge = texels.resolution.saturating_mul(upscale);
        if !(1..=limit).contains(&edge) {
            return Err(RenderError::Size { width: edge, height: edge, limit });
        }
        let (lowest, highest, colors) = match colors {
            Colors::Grey(white, dark) => (white, dark, 0),
            Colors::Heat(red) => (0.0, red, 1),
        };
        let (resolution, turned) = (texels.resolution, u32::from(texels.turned));
        let scale = TexelScale { lowest, highest, resolution, upscale, turned, colors };
        let scale = uniform_buffer_of(frame.device, "deep_images/view/paint", &scale);
        let bindings = Bindings::new().buffer("texel_scale", &scale).buffer("texel_numbers", &texels.buffer);
        Ok(fullscreen(frame, &self.paint, "deep_images/view/paint", &bindings, UVec2::splat(edge)))
    }
}
