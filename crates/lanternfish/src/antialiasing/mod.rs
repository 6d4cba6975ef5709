//! Temporal antialiasing: the mean of jittered frames along surfaces, while the view and the scene move.

#[cfg(test)]
mod tests;

use glam::Vec2;
use lanternfish_gpu::{Feature, Frame, RasterPipeline, RasterState, SharedStruct, gpu_struct};

use crate::{
    context::ViewContext,
    error::RenderError,
    output::cover,
    shaders::{Root, Shaders},
    texture::{PingPong, RADIANCE_FORMAT, Radiance, target},
    view::{PerView, View, jitter_of_frame},
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[Root::of("antialiasing/resolve", &[&[&[], &[DEFERRED]]])],
    &[SharedStruct::of::<AntialiasingParameters>()],
);

/// Deferred readback: an incomplete frame leaves the history unchanged.
const DEFERRED: Feature = Feature::new("later");

gpu_struct! {
    /// Parameters of the pass.
    pub struct AntialiasingParameters {
        /// Subpixel jitter of this frame, pixels, x right and y down.
        jitter: Vec2,
        /// Weight of this frame.
        weight: f32,
        /// 1: there is a history of this view.
        has_history: u32,
    }
}

/// Least weight of a frame. Lower: smoother edges and less noise; ghosts and blur last longer.
const LEAST_WEIGHT: f32 = 0.1;
/// Number of different points of a pixel. More: smoother edges at rest, and edges that tremble where the history is
/// short.
const POINTS: u32 = 16;
/// Width of the area over which textures are filtered, pixels: the points filter them again. Less: sharper, more
/// flicker.
const TEXTURE_WIDTH: f32 = 0.5;
/// Frames without a change before a change of light that restarts the history. Less: edges in flickering light have
/// steps.
const UNCHANGED: u32 = 8;
/// Bytes of a pixel in one of a view's two textures.
const BYTES_PER_PIXEL: u64 = 8;
const LABEL: &str = "antialiasing";

/// The pass, and the history of each view.
#[derive(Debug)]
pub struct TemporalAntialiasing {
    pipeline: RasterPipeline,
    /// Compiled for the first frame with deferred readback.
    later: Option<RasterPipeline>,
    sampler: wgpu::Sampler,
    histories: PerView<ViewHistory>,
}

/// The history of a view.
#[derive(Debug)]
struct ViewHistory {
    radiance: PingPong,
    /// Number of frames in it, with the last one.
    frames: u32,
}

/// Shifts a view by the subpixel jitter of a frame, and narrows the filter of its textures. `frames`: number of its
/// known earlier frames.
pub(crate) fn jitter(view: &mut View, frames: u32) {
    if frames > 0 {
        view.shift(jitter_of(view, frames));
        view.texture_width = TEXTURE_WIDTH;
    }
}

/// Subpixel jitter of a view after this number of known earlier frames, pixels, x right and y down. The first frame has
/// none.
fn jitter_of(view: &View, frames: u32) -> Vec2 {
    let point = if frames == 0 { Vec2::ZERO } else { jitter_of_frame(2 + (frames - 1) % POINTS) };
    view.jitter_extent() * point
}

impl TemporalAntialiasing {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some(LABEL),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Ok(Self { pipeline: pipeline(device, &[])?, later: None, sampler, histories: PerView::default() })
    }

    /// Discards the history of all views.
    pub fn reset(&mut self) {
        self.histories.clear();
    }

    /// Returns the antialiased radiance of a view's frame, which also is the history of the next one: linear, nits;
    /// alpha is the coverage of surfaces. The view is jittered.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { view, buffer, key, center_surface, .. }: &ViewContext<'_>,
        radiance: &Radiance,
    ) -> Result<wgpu::TextureView, RenderError> {
        let Some(motion) = &center_surface.motion else { unreachable!("the settings request motion") };
        let size = view.size;
        let new = |device: &wgpu::Device| target(device, LABEL, size, RADIANCE_FORMAT, wgpu::TextureUsages::COPY_SRC);
        let last = self.histories.take(frame, *key);
        // The history of a view that is new or shows another scene is of other surfaces.
        let frames = last.as_ref().filter(|_| motion.before.is_some()).map_or(0, |last| last.frames);
        // After a single change of light alone, clipping would leave bright edges of the former light.
        let is_relit = motion.before.is_some_and(|before| {
            before.since_change == 0 && before.unchanged >= UNCHANGED && !before.has_other_triangles
        });
        let counted = if is_relit { 0 } else { frames };
        let bytes = BYTES_PER_PIXEL * u64::from(size.x) * u64::from(size.y);
        let radiances = PingPong::next(last.map(|last| last.radiance), frame, size, (LABEL, bytes), new)?;
        let history = ViewHistory { radiance: radiances.clone(), frames: counted.saturating_add(1) };
        self.histories.leave(frame, *key, history);
        let parameters = frame.uniform(&AntialiasingParameters {
            jitter: jitter_of(view, view.random_index),
            weight: (1.0 / (counted as f32 + 1.0)).max(LEAST_WEIGHT),
            has_history: u32::from(frames > 0),
        });
        let bindings = buffer
            .bindings()
            .with(&center_surface.bindings())
            .part("antialiasing", &parameters)
            .texture("radiance_texture", &radiance.target)
            .texture("history_texture", &radiances.before)
            .sampler("history_sampler", &self.sampler);
        match frame.completeness_buffer() {
            None => cover(frame, &self.pipeline, LABEL, &bindings, &radiances.now),
            Some(capacity_policy) => {
                let later = match &mut self.later {
                    Some(later) => later,
                    none => none.insert(pipeline(frame.device, &[DEFERRED])?),
                };
                cover(frame, later, LABEL, &bindings.buffer("capacity_policy", &capacity_policy), &radiances.now);
            }
        }
        Ok(radiances.now)
    }
}

fn pipeline(device: &wgpu::Device, features: &[Feature]) -> Result<RasterPipeline, RenderError> {
    let shader = DECLARED.link("antialiasing/resolve", features)?;
    let state = RasterState { targets: &[Some(RADIANCE_FORMAT.into())], ..Default::default() };
    Ok(RasterPipeline::new(device, &shader, "vertex", "fragment", LABEL, &state))
}
