//! What pixels saw in the frames before: while a view moves, noise that differs from frame to frame averages out along its surfaces.

use std::collections::HashMap;

use glam::UVec2;
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, SharedStruct, gpu_struct, texture_of};

use super::LAYERS;
use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::{KEPT_FRAMES, Motion, Surface, ViewKey},
    shaders::{Root, Shaders},
    texture::described,
    view::View,
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[Root::of("indirect/history/mix", &[&[&[], &[DEFERRED]]])],
    &[SharedStruct::of::<HistoryParameters>()],
);

/// Frames do not wait for the device: one that is not whole is not mixed in.
const DEFERRED: Feature = Feature::new("later");

gpu_struct! {
    /// What the pass is told.
    pub struct HistoryParameters {
        /// Pixels of the image before.
        size_before: UVec2,
        /// True if there was one, of this scene.
        is_known: u32,
        /// Frames of the mean that this frame is added to.
        mean_frames: f32,
        /// Frames that the view has rested for before this one, beyond the first.
        rested: f32,
        /// Frames that a pixel knows of at most while its view moves.
        most: f32,
        /// 1: the view is not where it was, and what surfaces mirror is not either.
        has_moved: u32,
        /// 1: the scene has changed a short time ago.
        has_changed: u32,
        /// Frames that what is known counts for at most then.
        frames_after_reset: f32,
        /// Frames whose mean the sums were bounded for; 0: they are not bounded.
        clamped_frames: f32,
        /// Of these, the ones that the image is the mean of in any case.
        requested_frames: f32,
        /// Unused.
        _pad: u32,
    }
}

/// Frames that a pixel knows of at most while its view moves. More: less noise, more lag.
const MOST: f32 = 32.0;
/// Length of the reset window, frames: after a change of the scene the history is clamped, and every cache entry gets a sample in each frame.
pub(super) const RESET_FRAMES: u32 = 8;
const KEPT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Position, 3 × 32-bit float; normal, octahedral, 2 × 16 bits; all zero where nothing is.
const PLACES_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// What a change of the scene, whatever it is, does to what pixels know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HistoryReset {
    /// For so many frames, that of the change among them, it is held to what the pixels around say of now.
    pub lasts: u32,
    /// And counts for so many frames at most. More: less noise, more lag; 0: it is forgotten.
    pub counts: f32,
}

/// The pass, and what each view has kept.
#[derive(Debug)]
pub(crate) struct Histories {
    mix: ComputeKernel,
    /// Compiled for the first frame that does not wait.
    later: Option<ComputeKernel>,
    reset: HistoryReset,
    views: HashMap<ViewKey, Kept>,
}

/// What a view keeps: what its frame makes, and what it reads, which the next frame makes.
#[derive(Debug)]
struct Kept {
    now: Sums,
    before: Sums,
    last_frame: u64,
}

#[derive(Debug)]
struct Sums {
    layers: wgpu::TextureView,
    places: wgpu::TextureView,
    size: UVec2,
}

/// Frames of a view that a pixel may know of, with the one in hand.
pub(super) fn most_history(view: &View) -> f32 {
    (view.random_index as f32 + 1.0).min(MOST)
}

/// What is mixed with the frames before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mix<'a> {
    /// The surface that the sums are of.
    pub surface: &'a Surface,
    /// Its motion since the frame before.
    pub motion: &'a Motion,
    /// The sums of this frame.
    pub found: &'a wgpu::TextureView,
    /// Where the mix goes.
    pub mixed: &'a wgpu::TextureView,
    /// Frames that the image is to be the mean of; 0: one.
    pub requested_frames: f32,
    /// Frames for which the clamp counts; 0: there is none.
    pub clamped_frames: f32,
}

impl Histories {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device, reset: HistoryReset) -> Result<Self, RenderError> {
        Ok(Self { mix: kernel(device, &[])?, later: None, reset, views: HashMap::new() })
    }

    /// Forgets all.
    pub fn forget(&mut self) {
        self.views.clear();
    }

    /// Mixes the sums of a view, `found`, with those of its frames before, into `mixed`. The image is the mean of so many frames
    /// in any case; they were bounded as for a mean of so many, and where fewer are known they are bounded again.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { view, buffer, key, .. }: &ViewContext<'_>,
        &Mix { surface, motion, found, mixed, requested_frames, clamped_frames }: &Mix<'_>,
    ) -> Result<(), RenderError> {
        let number = frame.number();
        self.views.retain(|_, kept| kept.last_frame + KEPT_FRAMES >= number);
        let size = surface.size;
        let new = |frame: &Frame<'_>| Sums::new(frame.device, size);
        let kept =
            self.views.entry(*key).or_insert_with(|| Kept { now: new(frame), before: new(frame), last_frame: 0 });
        let is_first = kept.last_frame == 0;
        kept.last_frame = number;
        std::mem::swap(&mut kept.now, &mut kept.before);
        if kept.now.size != size {
            kept.now = new(frame);
        }
        let before = motion.before.filter(|_| !is_first);
        let uniform = frame.uniform(&HistoryParameters {
            size_before: kept.before.size,
            is_known: u32::from(before.is_some()),
            mean_frames: view.frame_index as f32,
            rested: before.map_or(0, |before| before.rested) as f32,
            most: MOST,
            has_moved: before.map_or(0, |before| u32::from(before.has_moved)),
            frames_after_reset: self.reset.counts,
            has_changed: before.map_or(0, |before| u32::from(before.since_change < self.reset.lasts)),
            clamped_frames,
            requested_frames,
            _pad: 0,
        });
        let bindings = buffer.bindings().with(&surface.bindings()).part("history", &uniform);
        let bindings = bindings.with(&kept.bindings()).texture("filtered_irradiance", found).texture("filtered", mixed);
        let [width, height, _] = self.mix.workgroup_size();
        let groups = [size.x.div_ceil(width), size.y.div_ceil(height), 1];
        match frame.whole() {
            None => frame.dispatch(&self.mix, &bindings, groups),
            Some(capacity_policy) => {
                let later = match &mut self.later {
                    Some(later) => later,
                    none => none.insert(kernel(frame.device, &[DEFERRED])?),
                };
                frame.dispatch(later, &bindings.buffer("capacity_policy", &capacity_policy), groups);
            }
        }
        Ok(())
    }
}

fn kernel(device: &wgpu::Device, features: &[Feature]) -> Result<ComputeKernel, RenderError> {
    let shader = DECLARED.link("indirect/history/mix", features)?;
    Ok(ComputeKernel::new(device, &shader, "mix_history", "indirect/history"))
}

impl Kept {
    fn bindings(&self) -> Bindings<'_> {
        Bindings::new()
            .texture("kept_irradiance", &self.before.layers)
            .texture("kept_places", &self.before.places)
            .texture("irradiance_to_keep", &self.now.layers)
            .texture("places_to_keep", &self.now.places)
    }
}

impl Sums {
    fn new(device: &wgpu::Device, size: UVec2) -> Self {
        let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = |label, format, layers| {
            let flat = described(label, size, format, wgpu::TextureUsages::empty(), 1);
            let size = wgpu::Extent3d { depth_or_array_layers: layers, ..flat.size };
            texture_of(device, &wgpu::TextureDescriptor { size, usage, ..flat })
        };
        Self {
            layers: texture("history/irradiance", KEPT_FORMAT, LAYERS),
            places: texture("history/places", PLACES_FORMAT, 1),
            size,
        }
    }
}
