//! Fragments as a point cloud, seen by a camera [Archer2019, fig. 6; Aalund2015, fig. 3].

use lanternfish::{
    RenderError,
    gpu_scene::{GpuScene, Parts},
    output::DISPLAY_FORMAT,
    prepass::DEPTH_FORMAT,
    texture::target,
    view::View,
};
use lanternfish_gpu::{Bindings, Frame, RasterPipeline, RasterState, uniform_buffer_of};

use super::{
    super::{
        images::DeepImages,
        settings::{DeepImageSettings, DeepSearch},
        shaders::DECLARED,
    },
    check_store, invocation_index,
    shared::PointRange,
};

/// Size of points: the larger of the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSize {
    /// Diameter in texel widths. More: fewer gaps; more occlusion of points behind, and larger silhouettes.
    pub texels: f32,
    /// Minimum diameter of a point, pixels. More: far points stay visible, and merge.
    pub least_pixels: f32,
}

impl PointSize {
    /// For this many images at once: 1.5 times the distance between points of a surface that all of them see, which shrinks with the square
    /// root of their number, but at most half a texel.
    pub fn for_images(count: usize) -> Self {
        Self { texels: (1.5 / (count.max(1) as f32).sqrt()).min(0.5), least_pixels: 1.5 }
    }
}

/// The result of [`PointCloud::record`].
#[derive(Debug)]
pub struct PointImage {
    /// [`DISPLAY_FORMAT`]; black where there is no point.
    pub display: wgpu::TextureView,
    /// [`DEPTH_FORMAT`], of the points' middles; 0 where there is no point.
    pub depth: wgpu::TextureView,
}

/// The pass that draws the cloud.
#[derive(Debug)]
pub struct PointCloud {
    pipeline: RasterPipeline,
}

impl PointCloud {
    /// Compiles the pass for images of these settings: linear arrays with triangles.
    pub fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        check_store(settings)?;
        if !settings.payload {
            return Err(RenderError::Together { setting: "a point cloud", needed: "deep images with triangles" });
        }
        let depth = wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let targets = [Some(DISPLAY_FORMAT.into())];
        // All fragments are shown, so nothing is searched.
        let every_fragment = DeepImageSettings { search: DeepSearch::Bisection, ..*settings };
        let state = RasterState { depth: Some(depth), targets: &targets, ..Default::default() };
        let shader = DECLARED.link("deep_images/view/points", &every_fragment.fragment_features())?;
        let pipeline = RasterPipeline::new(device, &shader, "vertex", "fragment", "deep_images/view/points", &state);
        Ok(Self { pipeline })
    }

    /// Draws the fragments of all images, or of one, as round points tinted by their triangles' normals: red is ±x, green ±y, blue ±z; lit
    /// from the eye, darker with distance. `scene`: the scene of the images.
    ///
    /// An error if there is no such image, or if the device cannot draw an image of this size or this many points.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        images: &DeepImages,
        image: Option<u32>,
        view: &View,
        size: PointSize,
    ) -> Result<PointImage, RenderError> {
        let limit = frame.device.limits().max_texture_dimension_2d;
        if view.size.min_element() == 0 || view.size.max_element() > limit {
            return Err(RenderError::Size { width: view.size.x, height: view.size.y, limit });
        }
        scene.check_parts(frame.device, Parts::BVH)?;
        // Lists of each chunk that are drawn.
        let drawn = match image {
            None => images.chunks.iter().map(|chunk| (chunk, 0, chunk.list_count())).collect(),
            Some(image) => {
                let (chunk, image) = invocation_index(images, image)?;
                let lists = chunk.grid.resolution * chunk.grid.resolution;
                vec![(chunk, image * lists, lists)]
            }
        };
        let rendering =
            |label: &str, format| target(frame.device, label, view.size, format, wgpu::TextureUsages::COPY_SRC);
        let (display, depth) = (rendering("points", DISPLAY_FORMAT), rendering("points_depth", DEPTH_FORMAT));
        let view_buffer = view.record(frame);
        let scene_bindings = scene.bindings();
        for (i, (chunk, first_list, list_count)) in drawn.into_iter().enumerate() {
            // The number of one image's fragments is unknown here: the shader drops the excess vertices.
            let vertices = u32::try_from(6 * chunk.fragments).map_err(|_| RenderError::Overflow {
                list: "deep_images/view/points",
                needed: chunk.fragments,
                limit: u64::from(u32::MAX / 6),
                remedy: "use fewer or coarser deep images",
            })?;
            let radius = 0.5 * size.texels / chunk.grid.texels_per_metre;
            let range = PointRange { first_list, list_count, radius, least_pixels: 0.5 * size.least_pixels };
            let range = uniform_buffer_of(frame.device, "deep_images/view/points", &range);
            let bindings = chunk
                .bindings(&images.frames)
                .with(&view_buffer.bindings())
                .with(&scene_bindings)
                .with(&Bindings::new().buffer("point_range", &range));
            let fresh = i == 0;
            let color = wgpu::RenderPassColorAttachment {
                view: &display,
                depth_slice: None,
                resolve_target: None,
                ops: operations(fresh, wgpu::Color::BLACK),
            };
            let depth = wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(operations(fresh, 0.0)),
                stencil_ops: None,
            };
            frame.render("deep_images/view/points", &[Some(color)], Some(depth), |groups, pass| {
                self.pipeline.set(pass);
                self.pipeline.bind(groups, pass, &bindings, 4);
                pass.draw(0..vertices, 0..1);
            });
        }
        Ok(PointImage { display, depth })
    }
}

/// The first pass clears, later ones add.
fn operations<V>(first: bool, clear: V) -> wgpu::Operations<V> {
    let load = if first { wgpu::LoadOp::Clear(clear) } else { wgpu::LoadOp::Load };
    wgpu::Operations { load, store: wgpu::StoreOp::Store }
}
