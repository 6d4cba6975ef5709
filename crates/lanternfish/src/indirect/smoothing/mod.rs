//! From the noisy sums of what reaches each pixel to the layers that shading reads.
//!
//! 1. Resolve: sums of the pixels that were looked at become the image's ([`IndirectResolution`]).
//! 2. Bound: what a pixel has beyond those around it is cut off ([`IndirectClamp`]), and how noisy it is found (`firefly_clamp.wesl`); what was cut off is
//!    spread over the pixels around (`redistribution.wesl`).
//! 3. Mix with what the frames before have found, where that is kept ([`History`]).
//! 4. Filter, along x and along y (`filter.wesl`).

use glam::{UVec2, Vec3};
use lanternfish_gpu::{Bindings, BufferPart, ComputeKernel, Frame, SharedStruct, gpu_constants, gpu_struct};
use lanternfish_scene::named_enum;

use super::{
    history::{self, Histories, HistoryReset, Mix, RESET_FRAMES},
    layers_target,
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
        Root::new("indirect/smoothing/firefly_clamp"),
        Root::new("indirect/smoothing/redistribution"),
        Root::new("indirect/smoothing/filter"),
    ],
    &[SharedStruct::of::<SmoothingParameters>(), SharedStruct::of::<Clamped>()],
);

gpu_struct! {
    /// What the passes that work on pixels' sums are told.
    pub struct SmoothingParameters {
        /// Pixels of the image over samples' own, along an edge: 1 or 2.
        scale: u32,
        /// Radius of the filter: pixels to each side.
        radius: u32,
        /// Axis of the filter: 0 is x, 1 is y.
        axis: u32,
        /// Frames whose mean the image is, where a pixel's sums are bounded by those around it; 0: they are not.
        clamp_frames: f32,
        /// How far what is above that is spread, tiles of `redistribution.wesl`.
        redistribution: u32,
    }
}

gpu_struct! {
    /// What was cut off of the pixels of a tile that face one way: sums.
    pub struct Clamped {
        /// Of diffuse light at normal incidence.
        diffuse: Vec3,
        /// Number of pixels.
        count: f32,
        /// Of diffuse light at grazing incidence.
        diffuse_grazing: Vec3,
        /// How many of them are rough: glossy light is of those alone.
        rough_count: f32,
        /// Of glossy light at normal incidence.
        glossy: Vec3,
        /// Unused.
        _pad: u32,
        /// Of glossy light at grazing incidence.
        glossy_grazing: Vec3,
        /// Unused.
        _pad_2: u32,
        /// Position of one of them, world space, m.
        p_world: Vec3,
        /// Unused.
        _pad_3: u32,
        /// Its normal, unit.
        normal: Vec3,
        /// Unused.
        _pad_4: u32,
    }
}

named_enum! {
    /// Where rays of indirect light start.
    IndirectResolution {
        /// From every pixel.
        Full = "full": "From every pixel",
        /// From every second pixel of every second row; between them light is interpolated along surfaces.
        Half = "half": "From every second pixel of every second row: four times faster, blurred at edges",
    }
}

impl IndirectResolution {
    /// Pixels of the image over those that are looked at, along an edge.
    pub(crate) const fn scale(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
        }
    }
}

named_enum! {
    /// True if what a pixel's rays bring is bounded by its neighbours.
    IndirectClamp {
        /// By the mean of the pixels around it whose surfaces are like its own, and five standard deviations; by n times as much in a
        /// mean of n frames, of each of which 1 − 8/n is kept at least: the mean of many is right. Where there is a filter, what is beyond that is
        /// spread over the pixels around, but for what smooth surfaces mirror.
        On = "on": "Limit: mean of similar pixels around plus five standard deviations",
        /// It is not: the mean of all images is right.
        Off = "off": "No limit, for means of many frames",
    }
}

/// A parameter of every technique whose sums are smoothed: [`IndirectResolution`].
pub const RESOLUTION: ParameterInfo =
    ParameterInfo::new("indirect-resolution", "NAME", Range::Names, "Pixels from which these rays start");
/// A parameter of every technique whose sums are smoothed: the filter's radius.
pub const FILTER: ParameterInfo = ParameterInfo::new(
    "indirect-filter",
    "PIXELS",
    Range::Count(0, 64),
    "Filter radius, pixels; 0: no filter. It stops at edges. More: less noise, less detail",
);
/// A parameter of every technique whose sums are smoothed: [`IndirectClamp`].
pub const CLAMP: ParameterInfo = ParameterInfo::new(
    "indirect-clamp",
    "ON|OFF",
    Range::Names,
    "Firefly clamp: limits a pixel by its neighbourhood. Default: on, but off for virtual lights with `quality best`",
);

/// What other surfaces send goes on changing for some frames.
const RESET_WINDOW: HistoryReset = HistoryReset { lasts: RESET_FRAMES, counts: 4.0 };
/// Pixels of the filter's radius for which what is cut off is spread by one more tile. Fewer: less noise, and light farther from where it belongs.
const REDISTRIBUTE: u32 = 2;

gpu_constants! {
    /// Edge of those tiles, pixels.
    const TILE: u32 = 8;
    /// Ways that surfaces face.
    const FACINGS: u32 = 6;
}

/// Bytes of a pixel's sums: `PackedIrradiance`.
const IRRADIANCE_BYTES: u64 = 48;
/// Largest reach of the filter, pixels.
pub const MOST_RADIUS: u32 = 64;

/// The sums of the pixels that are looked at, for one frame.
#[derive(Debug)]
pub struct PixelIrradiance {
    /// One each, row by row, bound under the name that the shader gives it.
    pub irradiance: wgpu::Buffer,
    /// Number of pixels that are read, across and down.
    pub size: UVec2,
    /// Size of the image.
    rendering: UVec2,
    parameters: SmoothingParameters,
    /// Those of resolve, as a uniform: what looks for light reads the scale.
    uniform: BufferPart,
}

impl PixelIrradiance {
    /// Capacity for the sums of an image of this size. `radius`: of the filter, pixels, in an image of `frames` frames.
    pub fn new(
        frame: &mut Frame<'_>,
        rendering: UVec2,
        resolution: IndirectResolution,
        radius: u32,
        clamp: IndirectClamp,
        frames: u32,
    ) -> Result<Self, RenderError> {
        let scale = resolution.scale();
        let size = rendering.map(|side| side.div_ceil(scale));
        let clamp_frames = if clamp == IndirectClamp::On { frames as f32 } else { 0.0 };
        // Noise falls with the number of frames, and as much smaller is the area that light must be averaged over.
        let radius = (radius as f32 / (frames as f32).sqrt()) as u32;
        let parameters =
            SmoothingParameters { scale, radius, axis: 0, clamp_frames, redistribution: radius.div_ceil(REDISTRIBUTE) };
        let bytes = IRRADIANCE_BYTES * u64::from(size.x) * u64::from(size.y);
        let irradiance = frame.scratch("indirect/irradiance", bytes)?;
        Ok(Self { irradiance, size, rendering, parameters, uniform: frame.uniform(&parameters) })
    }

    /// Bindings of `pixel.wesl`, beside the view's and the surface's.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().part("smoothing", &self.uniform)
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
            let shader = DECLARED.link(&format!("indirect/smoothing/{file}"), &[])?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, label))
        };
        Ok(Self {
            firefly_clamp: kernel("firefly_clamp", "firefly_clamp", "indirect/firefly_clamp")?,
            collect: kernel("redistribution", "collect", "indirect/collect")?,
            redistribution: kernel("redistribution", "redistribution", "indirect/redistribution")?,
            add: kernel("redistribution", "add", "indirect/add")?,
            resolve: kernel("filter", "resolve", "indirect/resolve")?,
            filter: kernel("filter", "filter_axis", "indirect/filter")?,
            histories: match history {
                History::Off => None,
                History::On => Some(Histories::new(device, RESET_WINDOW)?),
            },
        })
    }

    /// Forgets what frames have found.
    pub fn forget(&mut self) {
        self.histories.iter_mut().for_each(Histories::forget);
    }

    /// The layers that the finished sums of a surface that a view shows become.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
        irradiance: &PixelIrradiance,
    ) -> Result<wgpu::TextureView, RenderError> {
        let surfaces = view.buffer.bindings().with(&surface.bindings());
        let mut parameters = irradiance.parameters;
        let requested_frames = parameters.clamp_frames;
        let followed = self.histories.as_mut().zip(surface.motion.as_ref());
        if parameters.clamp_frames > 0.0 && followed.is_some() {
            // A frame is a share of what will be known, as of a mean.
            parameters.clamp_frames = parameters.clamp_frames.max(history::most_history(&view.view));
        }
        let layers = [(); 2].map(|()| layers_target(frame, irradiance.rendering));
        let [width, height, _] = self.filter.workgroup_size();
        let pixels = [irradiance.rendering.x.div_ceil(width), irradiance.rendering.y.div_ceil(height), 1];
        let [mut found, mut next] = [&layers[0], &layers[1]];
        let resolving =
            surfaces.clone().with(&irradiance.bindings()).buffer("finished_irradiance", &irradiance.irradiance);
        frame.dispatch(&self.resolve, &resolving.texture("filtered", found), pixels);
        let smooth = |frame: &mut Frame<'_>, kernel: &ComputeKernel, axis, [from, to]: [&wgpu::TextureView; 2]| {
            let uniform = frame.uniform(&SmoothingParameters { axis, ..parameters });
            let smoothing = surfaces.clone().part("smoothing", &uniform).texture("filtered_irradiance", from);
            frame.dispatch(kernel, &smoothing.texture("filtered", to), pixels);
        };
        let is_filtered = parameters.radius > 0;
        if is_filtered || parameters.clamp_frames > 0.0 || followed.is_some() {
            smooth(frame, &self.firefly_clamp, 0, [found, next]);
            std::mem::swap(&mut found, &mut next);
            if parameters.redistribution > 0 && parameters.clamp_frames > 0.0 {
                let tiles = irradiance.rendering.map(|side| side.div_ceil(TILE));
                let bytes = size_of::<Clamped>() as u64 * u64::from(FACINGS * tiles.x * tiles.y);
                let buffers =
                    [frame.scratch("indirect/cut_off", bytes)?, frame.scratch("indirect/redistribution", bytes)?];
                let uniform = frame.uniform(&parameters);
                let spreading = surfaces
                    .clone()
                    .part("smoothing", &uniform)
                    .texture("unclamped_irradiance", next)
                    .texture("filtered_irradiance", found)
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
                    .texture("filtered_irradiance", found)
                    .buffer("redistribute_light", &buffers[1]);
                frame.dispatch(&self.add, &adding.texture("filtered", next), pixels);
                std::mem::swap(&mut found, &mut next);
            }
        }
        if let Some((histories, motion)) = followed {
            let clamped_frames = parameters.clamp_frames;
            let mix = Mix { surface, motion, found, mixed: next, requested_frames, clamped_frames };
            histories.record(frame, view, &mix)?;
            std::mem::swap(&mut found, &mut next);
        }
        for axis in [0, 1].into_iter().filter(|_| is_filtered) {
            smooth(frame, &self.filter, axis, [found, next]);
            std::mem::swap(&mut found, &mut next);
        }
        Ok(found.clone())
    }
}
