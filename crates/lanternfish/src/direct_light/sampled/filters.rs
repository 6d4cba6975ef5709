//! The filter of ratios, and what a view's frame leaves for the next one: ratios and remembered visibility.

use glam::UVec2;
use lanternfish_gpu::{ComputeKernel, Feature, Frame, gpu_struct};

use super::{DECLARED, REPROJECTED};
use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::Surface,
    texture::{PingPong, frame_layers, kept_layers, size_of_view},
    view::PerView,
};

gpu_struct! {
    /// Parameters of the filter of ratios.
    pub struct RatioFilter {
        /// Size of the image of the previous frame, pixels.
        size_before: UVec2,
        /// Radius, pixels.
        radius: f32,
        /// Longest history, frames; 0: none.
        most_frames: f32,
    }
}

/// Longest history of ratios, frames: of lights and surfaces that rest, and in a frame in which the scene has changed.
const HISTORY_FRAMES: [f32; 2] = [31.0, 1.0];
/// Radius of the filter in an image of one frame, pixels. It shrinks with the sixth root of the number of averaged
/// frames, as that of [`crate::denoise::smoothing`].
const FILTER_RADIUS: f32 = 8.0;
/// Layers of ratios: of diffuse and of glossy light.
const RATIOS: u32 = 2;
const RATIO_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const MEMORY_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// The filter along x and along y, and what the frames of a view leave.
#[derive(Debug)]
pub(super) struct Filters {
    along: [ComputeKernel; 2],
    has_history: bool,
    views: PerView<Left>,
}

/// What a frame leaves.
#[derive(Clone, Debug)]
pub(super) struct Left {
    /// Bits of visibility.
    pub memory: PingPong,
    /// Ratios, if there is a history.
    ratios: Option<PingPong>,
    /// Number of known earlier frames of the view, if motion is.
    frames: Option<u32>,
}

impl Filters {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, has_history: bool) -> Result<Self, RenderError> {
        let features: &[Feature] = if has_history { &[REPROJECTED] } else { &[] };
        let shader = DECLARED.link("direct_light/sampled/ratio_filter", features)?;
        let along = ["filter_x", "filter_y"];
        let along = along.map(|entry| ComputeKernel::new(device, &shader, entry, "direct_light/filter"));
        Ok(Self { along, has_history, views: PerView::default() })
    }

    /// Takes what the view's last frame has left, and leaves what this one will write. Returns the latter, and whether
    /// the last frame was the one before.
    pub fn follow(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { view, key, .. }: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<(Left, bool), RenderError> {
        let size = surface.size;
        let last = self.views.take(frame, *key);
        let before = surface.motion.as_ref().map(|motion| motion.before.map_or(0, |before| before.frames));
        let is_next = last.as_ref().is_some_and(|last| match (last.frames, before) {
            (Some(last), Some(before)) => last + 1 == before,
            _ => view.frame_index > 0,
        });
        let pixels = u64::from(size.x) * u64::from(size.y);
        let (memory, ratios) = last.map_or((None, None), |last| (Some(last.memory), last.ratios));
        let label = "history/visibility";
        let new = |device: &wgpu::Device| kept_layers(device, label, size, MEMORY_FORMAT, 1);
        let memory = PingPong::next(memory, frame, size, (label, 8 * pixels), new)?;
        let label = "history/ratios";
        let bytes = 8 * u64::from(RATIOS) * pixels;
        let new = |device: &wgpu::Device| kept_layers(device, label, size, RATIO_FORMAT, RATIOS);
        let next = || PingPong::next(ratios, frame, size, (label, bytes), new);
        let ratios = self.has_history.then(next).transpose()?;
        let left = Left { memory, ratios, frames: before };
        self.views.leave(frame, *key, left.clone());
        Ok((left, is_next))
    }

    /// Filters the ratios of a frame. `frames`: over which the image is averaged.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        ViewContext { view, buffer, .. }: &ViewContext<'_>,
        surface: &Surface,
        (left, is_next): (&Left, bool),
        frames: u32,
        [unshadowed, found]: [&wgpu::TextureView; 2],
    ) -> wgpu::TextureView {
        let has_changed =
            surface.motion.as_ref().and_then(|motion| motion.before).is_some_and(|it| it.since_change == 0);
        let has_history = self.has_history && is_next && view.frame_index == 0;
        let filter = frame.uniform(&RatioFilter {
            size_before: left.ratios.as_ref().map_or(UVec2::ONE, |ratios| size_of_view(&ratios.before)),
            radius: FILTER_RADIUS * (frames as f32).powf(-1.0 / 6.0),
            most_frames: if has_history { HISTORY_FRAMES[usize::from(has_changed)] } else { 0.0 },
        });
        let bindings = buffer.bindings().with(&surface.bindings()).part("ratio_filter", &filter);
        let filtered = ratios_target(frame, surface.size);
        let groups = [surface.size.x.div_ceil(8), surface.size.y.div_ceil(8), 1];
        let [along_x, along_y] = &self.along;
        let passed = bindings.clone().texture("found_ratios", found).texture("filtered_ratios", &filtered);
        frame.dispatch(along_x, &passed, groups);
        let mut passed = bindings.texture("found_ratios", &filtered);
        let result = match (&left.ratios, surface.motion.as_ref().and_then(|motion| motion.places.as_ref())) {
            (Some(ratios), Some(places)) => {
                passed = passed
                    .texture("kept_ratios", &ratios.before)
                    .texture("kept_places", &places.before)
                    .texture("unshadowed_direct", unshadowed);
                ratios.now.clone()
            }
            _ => found.clone(),
        };
        frame.dispatch(along_y, &passed.texture("filtered_ratios", &result), groups);
        frame.release_texture(&filtered);
        result
    }
}

/// A transient texture of ratios.
pub(super) fn ratios_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    frame_layers(frame, "direct_light/ratios", size, RATIO_FORMAT, RATIOS)
}
