//! The frame in hand, as its passes are given it.

use std::sync::Arc;

use glam::Quat;

use crate::{
    gpu_scene::{GpuScene, VisibleDraws},
    prepass::{Surface, ViewKey},
    rays::TracedStructure,
    request::{Target, ViewRequest},
    view::{View, ViewBuffer},
};

/// What a frame is requested.
#[derive(Clone, Copy, Debug)]
pub struct FrameContext<'a> {
    /// The scene that all views are of.
    pub scene: &'a GpuScene,
    /// The views, in the order of their slots.
    pub views: &'a [View],
    /// Whether the frame is added to the mean of those before it. What is shown is that mean, and deep images are turned from frame to
    /// frame.
    pub is_averaged: bool,
    /// What the caller wants of each view; none: what is shown of them is kept for [`crate::Renderer::render`].
    pub requests: &'a [ViewRequest<'a>],
}

impl<'a> FrameContext<'a> {
    /// Where the image of a view goes, if it is not kept.
    pub(crate) fn target(&self, slot: usize) -> Option<(u64, Target<'a>)> {
        let request = self.requests.get(slot)?;
        (!matches!(request.target, Target::Own)).then_some((request.key, request.target))
    }

    /// Which view it is, from frame to frame.
    pub(crate) fn key(&self, slot: usize) -> ViewKey {
        self.requests.get(slot).map_or(ViewKey::Slot(slot), |request| ViewKey::Key(request.key))
    }

    /// Whether light is summed for a view, and not shaded.
    pub(crate) fn is_summed(&self, slot: usize) -> bool {
        matches!(self.target(slot), Some((_, Target::Sums { .. })))
    }
}

/// One view of a frame once its depth is there: what every pass after the prepass may ask of it.
#[derive(Debug)]
pub struct ViewContext<'a> {
    /// The scene.
    pub scene: &'a GpuScene,
    /// Which view it is, from frame to frame.
    pub(crate) key: ViewKey,
    /// The view.
    pub view: View,
    /// The view on the device.
    pub buffer: ViewBuffer,
    /// What it may show.
    pub draws: VisibleDraws<'a>,
    /// The prepass's result.
    pub surface: Surface,
    /// The same with one sample a pixel; where no pass asks for that, the prepass's result.
    pub middle: Surface,
    /// Rotation of this frame's sets of directions, unit: world space from a set's own.
    pub rotation: Quat,
    /// The structure that inexact tracers go through, of the scene as it stands, if the renderer has one. The frame sets it before the first
    /// pass with rays; [`TracePass`](crate::rays::TracePass) reads it.
    pub structure: Option<Arc<dyn TracedStructure>>,
}

impl<'a> ViewContext<'a> {
    /// The same as if this surface, one sample a pixel, were all that the view shows.
    pub fn showing(&self, surface: &Surface) -> ViewContext<'a> {
        ViewContext {
            scene: self.scene,
            key: self.key,
            view: self.view,
            buffer: self.buffer.clone(),
            draws: VisibleDraws { solid: Vec::new(), transparent: Vec::new() },
            surface: surface.clone(),
            middle: surface.clone(),
            rotation: self.rotation,
            structure: self.structure.clone(),
        }
    }
}
