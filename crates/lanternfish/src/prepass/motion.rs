//! What of the frame before the prepass compares with.

use std::collections::HashMap;

use glam::Mat4;
use lanternfish_gpu::{Bindings, BufferPart, Feature, Frame, gpu_struct};

use crate::{
    gpu_scene::{GeometryAt, GpuScene},
    view::View,
};

/// How far what pixels show has come since the frame before is written, or read.
pub(crate) const MOTION: Feature = Feature("motion");

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
    /// Its place among the views of a frame that is rendered into pictures.
    Slot(usize),
}

/// Frames that a view is remembered for while no frame has it.
const KEPT_FRAMES: u64 = 64;

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
    last_frame: u64,
}

/// The frame before, of one view.
#[derive(Debug)]
pub(crate) struct FrameBefore<'s> {
    views: BufferPart,
    geometry: GeometryAt<'s>,
}

/// The motion of what a view shows.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Of surfaces; anything where none is: `motion_at` of `motion.wesl` knows better.
    pub target: wgpu::TextureView,
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
        let view = view.centered();
        let shown = Shown { view, generation: scene.generation(), last_frame: self.frame };
        let before = self.shown.insert(key, shown);
        scene.note_shown();
        let known = before.and_then(|before| Some((before.view, scene.geometry_at(before.generation)?)));
        let (previous, geometry) = known.unwrap_or_else(|| (view, scene.geometry_now()));
        let views = ViewMotion {
            clip_from_view: view.clip_from_view,
            previous_clip_from_view: previous.clip_from_view,
            previous_view_from_world: previous.view_from_world,
        };
        FrameBefore { views: frame.uniform(&views), geometry }
    }
}

impl FrameBefore<'_> {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().part("view_motion", &self.views).buffer("previous_instances", self.geometry.instances)
    }

    /// Where vertices were.
    pub fn positions(&self) -> &wgpu::Buffer {
        self.geometry.positions
    }

    /// What is found by it.
    pub fn found(&self, target: wgpu::TextureView) -> Motion {
        Motion { target, views: self.views.clone() }
    }
}

impl Motion {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("motion_texture", &self.target).part("view_motion", &self.views)
    }
}
