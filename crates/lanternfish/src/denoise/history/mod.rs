//! Temporal accumulation along surfaces: while a view moves, noise that differs from frame to frame averages out.

use glam::UVec2;
use lanternfish_gpu::{ComputeKernel, Feature, Frame, SharedStruct, gpu_struct};

use super::layers::{LAYERS, layers_target};
use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::{Motion, PreviousFrame, Surface},
    shaders::{Root, Shaders},
    texture::{PingPong, kept_layers, size_of_view},
    view::{PerView, View},
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[Root::of("denoise/history/mix", &[&[&[], &[DEFERRED]]])],
    &[SharedStruct::of::<HistoryParameters>()],
);

/// The readback of list lengths is deferred: a frame that is not complete is not accumulated.
const DEFERRED: Feature = Feature::new("later");

gpu_struct! {
    /// Parameters of the pass.
    pub struct HistoryParameters {
        /// Size of the image of the previous frame, pixels.
        size_before: UVec2,
        /// 1: there was a previous frame of this scene.
        is_known: u32,
        /// Frames in the mean (progressive rendering) to which this frame is added.
        mean_frames: f32,
        /// Frames before this one for which the view has been at rest, beyond the first.
        rested: f32,
        /// Longest history of a pixel while the view moves, frames.
        most: f32,
        /// 1: the view has moved, and with it the reflections in surfaces.
        has_moved: u32,
        /// 1: the frame is in the reset window after a change of the scene.
        has_changed: u32,
        /// Longest history in the reset window, frames.
        frames_after_reset: f32,
        /// Frames of the mean for which the firefly clamp was applied; 0: no clamp.
        clamped_frames: f32,
        /// Of these, the frames over which the image is averaged in any case.
        requested_frames: f32,
        /// Largest distance of the history from the neighbourhood's mean in the reset window, standard deviations.
        reset_deviations: f32,
    }
}

/// Longest history of a pixel while the view moves, frames. More: less noise, more lag.
const MOST: f32 = 32.0;
/// Length of the reset window after a change of the scene, frames. In the window, the history of pixels is clamped, and
/// every entry of the radiance cache gets a sample per frame.
pub(crate) const RESET_FRAMES: u32 = 8;
/// Largest distance of a restarted history from the neighbourhood's mean after its first frame, standard deviations.
const LATER_DEVIATIONS: f32 = 4.0;
const KEPT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// Effect of any change of the scene on the history of pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HistoryReset {
    /// Length of the reset window, frames, with that of the change: the history is clamped to the neighbourhood in this
    /// frame.
    pub lasts: u32,
    /// Longest history in the reset window, frames. More: less noise, more lag; 0: the history is discarded.
    pub counts: f32,
    /// Largest distance of the history from the mean of the neighbourhood in the reset window, standard deviations.
    /// More: less noise, more lag.
    pub deviations: f32,
    /// After a single change, the history has the frames since then, and only its first is clamped to `deviations`.
    pub restarts: bool,
}

impl HistoryReset {
    /// Longest history, frames, and its largest distance from the neighbourhood's mean, standard deviations.
    fn limits(&self, before: &PreviousFrame) -> (f32, f32) {
        match before.since_change {
            _ if !self.restarts || before.unchanged < self.lasts => (self.counts, self.deviations),
            0 => (1.0, self.deviations),
            since => (since as f32, LATER_DEVIATIONS),
        }
    }
}

/// The pass, and the history of each view.
#[derive(Debug)]
pub(crate) struct Histories {
    mix: ComputeKernel,
    /// Compiled at the first frame with deferred readback.
    mix_deferred: Option<ComputeKernel>,
    label: String,
    reset: HistoryReset,
    views: PerView<ViewHistory>,
}

/// History of a view.
#[derive(Debug)]
struct ViewHistory {
    layers: PingPong,
    /// Number of known frames of the view before the last one that was accumulated.
    frames: u32,
}

/// Longest possible history of a pixel of this view, frames, with the current one.
pub(super) fn most_history(view: &View) -> f32 {
    (view.random_index as f32 + 1.0).min(MOST)
}

/// Inputs and output of the accumulation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mix<'a> {
    /// The surface that the irradiance belongs to.
    pub surface: &'a Surface,
    /// Its motion since the previous frame.
    pub motion: &'a Motion,
    /// Irradiance estimate of this frame.
    pub found: &'a wgpu::TextureView,
    /// Frames over which the image is to be averaged; 0: one.
    pub requested_frames: f32,
    /// Frames of the mean for which the firefly clamp was applied; 0: no clamp.
    pub clamped_frames: f32,
}

impl Histories {
    /// Compiles the pass.
    /// `folder`: the first part of its label.
    pub fn new(device: &wgpu::Device, reset: HistoryReset, folder: &str) -> Result<Self, RenderError> {
        let label = format!("{folder}/history");
        Ok(Self { mix: kernel(device, &[], &label)?, mix_deferred: None, label, reset, views: PerView::default() })
    }

    /// Accumulates the estimate of a view with its history, and returns the layers of the result for later passes of
    /// the frame: outside a mean of frames those of the history, which is not the pool's. Their alphas hold noise
    /// (layers 0 and 2) and history lengths. Pixels whose history is shorter than `clamped_frames` are clamped again
    /// for their own length.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { view, buffer, key, .. }: &ViewContext<'_>,
        &Mix { surface, motion, found: estimate, requested_frames, clamped_frames }: &Mix<'_>,
    ) -> Result<wgpu::TextureView, RenderError> {
        let Some(places) = &motion.places else { unreachable!("the settings request a history") };
        let size = surface.size;
        let last = self.views.take(frame, *key);
        // The places are those of the frame before; the layers must be, too.
        let last_frames = last.as_ref().map(|last| last.frames);
        let before = motion.before.filter(|before| last_frames.is_some_and(|frames| frames + 1 == before.frames));
        let bytes = BYTES_PER_PIXEL * u64::from(size.x) * u64::from(size.y);
        let new = |device: &wgpu::Device| kept_layers(device, "history/irradiance", size, KEPT_FORMAT, LAYERS);
        let layers = PingPong::next(last.map(|last| last.layers), frame, size, ("history", bytes), new)?;
        let frames = motion.before.map_or(0, |before| before.frames);
        self.views.leave(frame, *key, ViewHistory { layers: layers.clone(), frames });
        // Outside a mean of frames the history is the result, and nothing is written to `mixed`.
        let is_of_mean = view.frame_index > 0;
        let mixed = layers_target(frame, if is_of_mean { size } else { UVec2::ONE });
        let (frames_after_reset, reset_deviations) =
            before.map_or_else(Default::default, |before| self.reset.limits(&before));
        let uniform = frame.uniform(&HistoryParameters {
            size_before: size_of_view(&layers.before),
            is_known: u32::from(before.is_some()),
            mean_frames: view.frame_index as f32,
            rested: before.map_or(0, |before| before.rested) as f32,
            most: MOST,
            has_moved: before.map_or(0, |before| u32::from(before.has_moved)),
            frames_after_reset,
            has_changed: before.map_or(0, |before| u32::from(before.since_change < self.reset.lasts)),
            clamped_frames,
            requested_frames,
            reset_deviations,
        });
        let bindings = buffer.bindings().with(&surface.bindings()).part("history", &uniform);
        let bindings = bindings
            .texture("kept_places", &places.before)
            .texture("places_to_keep", &places.now)
            .texture("kept_irradiance", &layers.before)
            .texture("irradiance_to_keep", &layers.now)
            .texture("filtered_irradiance", estimate)
            .texture("filtered", &mixed);
        let [width, height, _] = self.mix.workgroup_size();
        let groups = [size.x.div_ceil(width), size.y.div_ceil(height), 1];
        match frame.completeness_buffer() {
            None => frame.dispatch(&self.mix, &bindings, groups),
            Some(capacity_policy) => {
                let mix = match &mut self.mix_deferred {
                    Some(mix) => mix,
                    none => none.insert(kernel(frame.device, &[DEFERRED], &self.label)?),
                };
                frame.dispatch(mix, &bindings.buffer("capacity_policy", &capacity_policy), groups);
            }
        }
        Ok(if is_of_mean { mixed } else { layers.now })
    }
}

fn kernel(device: &wgpu::Device, features: &[Feature], label: &str) -> Result<ComputeKernel, RenderError> {
    let shader = DECLARED.link("denoise/history/mix", features)?;
    Ok(ComputeKernel::new(device, &shader, "mix_history", label))
}

/// Bytes of a pixel in the layers of a frame.
const BYTES_PER_PIXEL: u64 = 8 * LAYERS as u64;
