//! Denoising of demodulated irradiance, from noisy pixel sums to the layers that shading reads.
//!
//! 1. Resolve: upsamples the irradiance of the sampled pixels to the image ([`IndirectResolution`]).
//! 2. Firefly clamp: removes the excess of a pixel over its neighbourhood ([`IndirectClamp`]) and estimates the noise
//!    (`firefly_clamp.wesl`). The excess is redistributed over the pixels around (`collect.wesl`,
//!    `redistribution.wesl`).
//! 3. Temporal accumulation, if there is a history ([`History`]).
//! 4. Edge-stopping filter, along x and along y (`filter.wesl`).

mod pixel_irradiance;

use glam::{UVec2, Vec3};
use lanternfish_gpu::{ComputeKernel, Frame, SharedStruct, gpu_constants, gpu_struct};
use lanternfish_scene::named_enum;

#[cfg(test)]
pub(crate) use self::pixel_irradiance::MOST_IRRADIANCE_BYTES_IN_TESTS;
pub use self::pixel_irradiance::PixelIrradiance;
use super::{
    history::{self, Histories, HistoryReset, Mix, RESET_FRAMES},
    layers::layers_target,
};
use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::Surface,
    settings::History,
    shaders::{Root, Shaders},
    technique::{ParameterInfo, Range},
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::new("denoise/smoothing/firefly_clamp"),
        Root::new("denoise/smoothing/collect"),
        Root::new("denoise/smoothing/redistribution"),
        Root::new("denoise/smoothing/filter"),
    ],
    &[SharedStruct::of::<SmoothingParameters>(), SharedStruct::of::<Clamped>()],
);

gpu_struct! {
    /// Parameters of the passes that process pixel irradiance.
    pub struct SmoothingParameters {
        /// Pixels of the image per sampled pixel, along an edge: 1 or 2.
        scale: u32,
        /// Radius of the filter, pixels.
        radius: u32,
        /// Axis of the filter: 0 is x, 1 is y.
        axis: u32,
        /// Frames of the mean for which the firefly clamp is applied; 0: no clamp.
        clamp_frames: f32,
        /// Radius of the energy redistribution, tiles of `redistribution.wesl`.
        redistribution: u32,
        /// Pixels of the image per pixel of the layers, along an edge: 1 or 2.
        layer_scale: u32,
        /// First row of sampled pixels whose rays' sums are in the buffer.
        first_row: u32,
        /// Number of these rows.
        row_count: u32,
    }
}

gpu_struct! {
    /// Sums of the clamped excess over the pixels of a tile that face one way.
    pub struct Clamped {
        /// Diffuse light at normal incidence.
        diffuse: Vec3,
        /// Number of pixels.
        count: f32,
        /// Diffuse light at grazing incidence.
        diffuse_grazing: Vec3,
        /// Number of rough pixels: glossy light is summed over these only.
        rough_count: f32,
        /// Glossy light at normal incidence.
        glossy: Vec3,
        /// Unused.
        _pad: u32,
        /// Glossy light at grazing incidence.
        glossy_grazing: Vec3,
        /// Unused.
        _pad_2: u32,
        /// Position of the representative pixel, world space, m.
        p_world: Vec3,
        /// Unused.
        _pad_3: u32,
        /// Normal of that pixel, unit.
        normal: Vec3,
        /// Unused.
        _pad_4: u32,
    }
}

named_enum! {
    /// Resolution of indirect light: the pixels from which rays start.
    IndirectResolution {
        /// Every pixel.
        Full = "full": "Every pixel",
        /// Every second pixel of every second row; pixels between them are interpolated along surfaces.
        Half = "half": "Every second pixel of every second row: four times faster, blurred at edges",
    }
}

impl IndirectResolution {
    /// Pixels of the image per sampled pixel, along an edge.
    pub(crate) const fn scale(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
        }
    }
}

named_enum! {
    /// Firefly clamp of indirect light.
    IndirectClamp {
        /// A pixel is limited to the mean of similar neighbours plus five standard deviations. In a mean of n frames
        /// the limit is n times as high, and at least 1 − 8/n of each frame is kept, so that the mean converges to the
        /// correct light. With a filter, the excess is redistributed over the pixels around, except for glossy light of
        /// smooth surfaces.
        On = "on": "At most the mean of similar neighbours plus five standard deviations",
        /// No clamp: the mean over all images is unbiased.
        Off = "off": "No clamp: for the mean of many frames",
    }
}

/// The parameter for [`IndirectResolution`], of every technique that uses [`Smoothing`].
pub const RESOLUTION: ParameterInfo =
    ParameterInfo::new("indirect-resolution", "NAME", Range::Names, "Pixels from which these rays start");
/// The parameter for the filter radius, of every technique that uses [`Smoothing`].
pub const FILTER: ParameterInfo = ParameterInfo::new(
    "indirect-filter",
    "PIXELS",
    Range::Count(0, 64),
    "Filter radius, pixels; 0: no filter. It stops at edges. More: less noise, less detail",
);
/// The parameter for [`IndirectClamp`], of every technique that uses [`Smoothing`].
pub const CLAMP: ParameterInfo = ParameterInfo::new(
    "indirect-clamp",
    "ON|OFF",
    Range::Names,
    "Firefly clamp: limits a pixel by its neighbourhood. Default: on, but off for virtual lights with `quality best`",
);

/// Indirect light goes on changing for some frames after a change of the scene.
const RESET_WINDOW: HistoryReset = HistoryReset { lasts: RESET_FRAMES, counts: 4.0, deviations: 0.25, restarts: true };
/// Pixels of filter radius per tile of redistribution radius. Fewer: less noise, and light farther from its correct
/// position.
const REDISTRIBUTE: u32 = 2;

gpu_constants! {
    /// Edge of a redistribution tile, pixels.
    const TILE: u32 = 8;
    /// Number of facing directions of surfaces.
    const FACINGS: u32 = 6;
}

/// Largest radius of the filter, pixels.
pub const MOST_RADIUS: u32 = 64;

/// How noisy layers of one frame are smoothed.
#[derive(Clone, Copy, Debug)]
pub struct Smoothed(SmoothingParameters);

impl Smoothed {
    /// With a filter of this radius in an image of one frame, pixels; it shrinks with the sixth root of `frames`.
    /// `clamps`: fireflies are clamped.
    pub fn new(radius: u32, clamps: bool, frames: u32) -> Self {
        let clamp_frames = if clamps { frames as f32 } else { 0.0 };
        // Over n frames the variance is proportional to 1/(n radius²), and the error of blurring grows with radius²:
        // the sum of both squared is least for a radius that shrinks with the sixth root of n [Silverman1986, §4.3].
        // With the root of n the noise would never fall.
        let radius = (radius as f32 * (frames as f32).powf(-1.0 / 6.0)) as u32;
        let redistribution = radius.div_ceil(REDISTRIBUTE);
        Self(SmoothingParameters {
            scale: 1,
            radius,
            axis: 0,
            clamp_frames,
            redistribution,
            layer_scale: 1,
            first_row: 0,
            row_count: 0,
        })
    }
}

/// The passes.
#[derive(Debug)]
pub struct Smoothing {
    firefly_clamp: ComputeKernel,
    collect: ComputeKernel,
    redistribution: ComputeKernel,
    add: ComputeKernel,
    resolve: ComputeKernel,
    filter: ComputeKernel,
    histories: Option<Histories>,
}

impl Smoothing {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, history: History) -> Result<Self, RenderError> {
        let kernel = |file: &str, entry: &str, label: &str| {
            let shader = DECLARED.link(&format!("denoise/smoothing/{file}"), &[])?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, label))
        };
        Ok(Self {
            firefly_clamp: kernel("firefly_clamp", "firefly_clamp", "indirect/firefly_clamp")?,
            collect: kernel("collect", "collect", "indirect/collect")?,
            redistribution: kernel("redistribution", "redistribution", "indirect/redistribution")?,
            add: kernel("redistribution", "add", "indirect/add")?,
            resolve: kernel("filter", "resolve", "indirect/resolve")?,
            filter: kernel("filter", "filter_axis", "indirect/filter")?,
            histories: match history {
                History::Off => None,
                History::On => Some(Histories::new(device, RESET_WINDOW, "indirect")?),
            },
        })
    }

    /// Records the passes that turn the finished sums of a view's surface into the layers that shading reads.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        irradiance: &PixelIrradiance,
    ) -> Result<wgpu::TextureView, RenderError> {
        let found = layers_target(frame, irradiance.rendering);
        self.resolve(frame, view, surface, irradiance, &found);
        self.record_layers(frame, view, surface, &Smoothed(irradiance.parameters), found)
    }

    /// Records the pass from the finished sums of a view's surface, or of some of its rows, to layers, which are not
    /// smoothed.
    pub(crate) fn resolve(
        &self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        irradiance: &PixelIrradiance,
        layers: &wgpu::TextureView,
    ) {
        let surfaces = view.buffer.bindings().with(&surface.bindings());
        let resolving = surfaces.with(&irradiance.bindings()).buffer("finished_irradiance", &irradiance.irradiance);
        let rows = irradiance.parameters.scale * irradiance.size.y;
        let size = UVec2::new(irradiance.rendering.x, rows.min(irradiance.rendering.y));
        frame.dispatch(&self.resolve, &resolving.texture("filtered", layers), groups(&self.resolve, size));
        frame.release(&irradiance.irradiance);
    }

    /// Records the passes that smooth the finished sums at the resolution of the rays. Returns layers of that size.
    pub(crate) fn record_small(
        &self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        irradiance: &PixelIrradiance,
    ) -> wgpu::TextureView {
        let PixelIrradiance { size, parameters, .. } = *irradiance;
        let small = SmoothingParameters {
            layer_scale: parameters.scale,
            radius: parameters.radius.div_ceil(parameters.scale),
            ..parameters
        };
        let [mut current, mut next] = std::array::from_fn(|_| layers_target(frame, size));
        let surfaces = view.buffer.bindings().with(&surface.bindings());
        let uniform = frame.uniform(&small);
        let resolving =
            surfaces.clone().part("smoothing", &uniform).buffer("finished_irradiance", &irradiance.irradiance);
        frame.dispatch(&self.resolve, &resolving.texture("filtered", &current), groups(&self.resolve, size));
        for (kernel, axis) in [(&self.firefly_clamp, 0), (&self.filter, 0), (&self.filter, 1)] {
            let uniform = frame.uniform(&SmoothingParameters { axis, ..small });
            let smoothing = surfaces.clone().part("smoothing", &uniform).texture("filtered_irradiance", &current);
            frame.dispatch(kernel, &smoothing.texture("filtered", &next), groups(kernel, size));
            std::mem::swap(&mut current, &mut next);
        }
        current
    }

    /// Records the accumulation of layers without noise with their history, if there is one.
    pub(crate) fn accumulated(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        found: wgpu::TextureView,
    ) -> Result<wgpu::TextureView, RenderError> {
        let Some((histories, motion)) = self.histories.as_mut().zip(surface.motion.as_ref()) else { return Ok(found) };
        let mix = Mix { surface, motion, found: &found, requested_frames: 0.0, clamped_frames: 0.0 };
        let mixed = histories.record(frame, view, &mix)?;
        frame.release_texture(&found);
        Ok(mixed)
    }

    /// Records the passes for layers of one frame, whose alphas `layers.wesl` describes.
    pub(crate) fn record_layers(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        &Smoothed(mut parameters): &Smoothed,
        found: wgpu::TextureView,
    ) -> Result<wgpu::TextureView, RenderError> {
        let surfaces = view.buffer.bindings().with(&surface.bindings());
        let requested_frames = parameters.clamp_frames;
        let accumulated = self.histories.as_mut().zip(surface.motion.as_ref());
        if parameters.clamp_frames > 0.0 && accumulated.is_some() {
            // A frame is a fraction of the accumulated history, as of a mean.
            parameters.clamp_frames = parameters.clamp_frames.max(history::most_history(&view.view));
        }
        let rendering = surface.size;
        let layers = [found, layers_target(frame, rendering)];
        let [mut current, mut next] = [&layers[0], &layers[1]];
        let smooth = |frame: &mut Frame<'_>, kernel: &ComputeKernel, axis, [from, to]: [&wgpu::TextureView; 2]| {
            let uniform = frame.uniform(&SmoothingParameters { axis, ..parameters });
            let smoothing = surfaces.clone().part("smoothing", &uniform).texture("filtered_irradiance", from);
            frame.dispatch(kernel, &smoothing.texture("filtered", to), groups(kernel, rendering));
        };
        let is_filtered = parameters.radius > 0;
        if is_filtered || parameters.clamp_frames > 0.0 || accumulated.is_some() {
            smooth(frame, &self.firefly_clamp, 0, [current, next]);
            std::mem::swap(&mut current, &mut next);
            if parameters.redistribution > 0 && parameters.clamp_frames > 0.0 {
                let tiles = rendering.map(|side| side.div_ceil(TILE));
                let bytes = size_of::<Clamped>() as u64 * u64::from(FACINGS * tiles.x * tiles.y);
                let buffers =
                    [frame.scratch("indirect/cut_off", bytes)?, frame.scratch("indirect/redistribution", bytes)?];
                let uniform = frame.uniform(&parameters);
                let spreading = surfaces
                    .clone()
                    .part("smoothing", &uniform)
                    .texture("unclamped_irradiance", next)
                    .texture("filtered_irradiance", current)
                    .buffer("cut_off", &buffers[0])
                    .buffer("redistribute_light", &buffers[1]);
                frame.dispatch(&self.collect, &spreading, [tiles.x, tiles.y, 1]);
                frame.dispatch(
                    &self.redistribution,
                    &spreading,
                    [tiles.x.div_ceil(TILE), tiles.y.div_ceil(TILE), FACINGS],
                );
                let adding = surfaces
                    .clone()
                    .part("smoothing", &uniform)
                    .texture("filtered_irradiance", current)
                    .buffer("redistribute_light", &buffers[1]);
                frame.dispatch(&self.add, &adding.texture("filtered", next), groups(&self.add, rendering));
                std::mem::swap(&mut current, &mut next);
            }
        }
        let mut mixed = None;
        if let Some((histories, motion)) = accumulated {
            let clamped_frames = parameters.clamp_frames;
            let mix = Mix { surface, motion, found: current, requested_frames, clamped_frames };
            mixed = Some(histories.record(frame, view, &mix)?);
        }
        if is_filtered {
            smooth(frame, &self.filter, 0, [mixed.as_ref().unwrap_or(current), next]);
            smooth(frame, &self.filter, 1, [next, current]);
            mixed = None;
        }
        frame.release_texture(next);
        if mixed.is_some() {
            frame.release_texture(current);
        }
        Ok(mixed.unwrap_or_else(|| current.clone()))
    }
}

/// Workgroups of a pass over an image of this size.
fn groups(kernel: &ComputeKernel, size: UVec2) -> [u32; 3] {
    let [width, height, _] = kernel.workgroup_size();
    [size.x.div_ceil(width), size.y.div_ceil(height), 1]
}
