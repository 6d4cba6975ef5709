//! What of the frame before the prepass compares with.

use std::collections::HashMap;

use glam::Mat4;
use lanternfish_gpu::{Bindings, BufferPart, Feature, Frame, gpu_struct};

use crate::{
    gpu_scene::{GeometryAt, GpuScene},
    view::View,
};

/// How far what pixels show has come since the frame before is written, or read.
pub(crate) const MOTION: Feature = Feature::new("motion");

/// Motion in uv, as `motion.wesl` has it. Steps are at most 1/1024 of the motion, so that 16 pixels are off by less than 1/64 of a
/// pixel, and at least 2⁻²⁴.
pub(crate) const MOTION_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

gpu_struct! {
    /// A view now and in the frame before, through the middles of pixels.
    pub struct ViewMotion {
        /// Of now.
        clip_from_view: Mat4,
        /// Of the frame before.
        previous_clip_from_view: Mat4,
        /// Of the frame before.
        previous_view_from_world: Mat4,
    }
}

/// Which view it is, from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ViewKey {
    /// That of a [`crate::ViewRequest`].
    Key(u64),
    /// Its place among the views of a frame that is rendered into images.
    Slot(usize),
}

/// Frames that a view is remembered for while no frame has it.
pub(crate) const KEPT_FRAMES: u64 = 64;

/// What the views of a renderer's frames have shown last. The frame before is the last one that was recorded with the view, whole or not.
#[derive(Debug, Default)]
pub(crate) struct ShownViews {
    shown: HashMap<ViewKey, Shown>,
    frame: u64,
}

#[derive(Debug)]
struct Shown {
    view: View,
    /// [`GpuScene::generation`].
    generation: u64,
    /// [`GpuScene::revision`].
    revision: u64,
    last_frame: u64,
    /// Which of the frames of a mean it was.
    frame_index: u32,
    /// Frames before it that are known of.
    frames: u32,
    /// Of those, the ones since the scene has changed.
    since_change: u32,
}

/// The frame before, of one view.
#[derive(Debug)]
pub(crate) struct FrameBefore<'s> {
    views: BufferPart,
    geometry: GeometryAt<'s>,
    known: Option<Before>,
    frames: u32,
}

/// What is known of the frame before of a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Before {
    /// Which of the frames of a mean it was.
    pub rested: u32,
    /// True if the view was elsewhere.
    pub has_moved: bool,
    /// Frames since the scene has changed: 0 where the frame in hand is the first after a change.
    pub since_change: u32,
}

/// The motion of what a view shows.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Of surfaces; anything where none is: `motion_at` of `motion.wesl` knows better.
    pub target: wgpu::TextureView,
    /// The frame before; none: the view is new, or shows another scene.
    pub(crate) before: Option<Before>,
    views: BufferPart,
}

impl ShownViews {
    /// A frame begins.
    pub fn begin(&mut self) {
        self.frame += 1;
        let frame = self.frame;
        self.shown.retain(|_, shown| shown.last_frame + KEPT_FRAMES >= frame);
    }

    /// Forgets all: the next frame has none before it.
    pub fn forget(&mut self) {
        self.shown.clear();
    }

    /// What a view of the frame in hand is compared with, and notes what it shows. It is the view itself where nothing is known of it: a
    /// view that is new, a scene that is another, or one that has changed more than once between frames of several renderers.
    pub fn follow<'s>(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &'s GpuScene,
        view: &View,
        key: ViewKey,
    ) -> FrameBefore<'s> {
        let frame_index = view.frame_index;
        let view = view.centered();
        let (generation, revision) = (scene.generation(), scene.revision());
        scene.note_shown();
        let before = self.shown.remove(&key);
        let known = before.and_then(|before| Some((scene.geometry_at(before.generation)?, before)));
        let (previous, geometry, before, frames) = match known {
            None => (view, scene.geometry_now(), None, 0),
            Some((geometry, shown)) => {
                let has_changed = shown.revision != revision || shown.generation != generation;
                let since_change = if has_changed { 0 } else { shown.since_change.saturating_add(1) };
                // Means go on where a view is the same to the last bit.
                let has_moved = frame_index == 0 && !is_where(&view, &shown.view);
                let before = Before { rested: shown.frame_index, has_moved, since_change };
                (shown.view, geometry, Some(before), shown.frames.saturating_add(1))
            }
        };
        let since_change = before.map_or(u32::MAX, |before| before.since_change);
        let last_frame = self.frame;
        let shown = Shown { view, generation, revision, last_frame, frame_index, frames, since_change };
        self.shown.insert(key, shown);
        let views = ViewMotion {
            clip_from_view: view.clip_from_view,
            previous_clip_from_view: previous.clip_from_view,
            previous_view_from_world: previous.view_from_world,
        };
        FrameBefore { views: frame.uniform(&views), geometry, known: before, frames }
    }
}

/// True if a view is where another was, but for the last bits that shifts of frames of a mean leave.
fn is_where(view: &View, other: &View) -> bool {
    let matrices = |view: &View| [view.clip_from_view, view.view_from_world];
    matrices(view).iter().zip(matrices(other)).all(|(now, before)| now.abs_diff_eq(before, 1e-5))
}

impl FrameBefore<'_> {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().part("view_motion", &self.views).buffer("previous_instances", self.geometry.instances)
    }

    /// True if the scene has changed since then.
    pub fn has_just_changed(&self) -> bool {
        self.known.is_some_and(|before| before.since_change == 0)
    }

    /// Frames of the view before the one in hand that are known of.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Where vertices were.
    pub fn positions(&self) -> &wgpu::Buffer {
        self.geometry.positions
    }

    /// What is found by it.
    pub fn found(&self, target: wgpu::TextureView) -> Motion {
        Motion { target, before: self.known, views: self.views.clone() }
    }
}

impl Motion {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("motion_texture", &self.target).part("view_motion", &self.views)
    }
}
