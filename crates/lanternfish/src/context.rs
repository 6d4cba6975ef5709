//! Inputs of a frame, and of the passes of one of its views.

use glam::Quat;

use crate::{
    gpu_scene::{GpuScene, VisibleDraws},
    prepass::Surface,
    rays::Structures,
    request::{Target, ViewRequest},
    view::{View, ViewBuffer, ViewKey},
};

/// The inputs of a frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameContext<'a> {
    /// The scene of all views.
    pub scene: &'a GpuScene,
    /// The views, in the order of their slots.
    pub views: &'a [View],
    /// True if the frame is added to the mean of the frames before it. The mean is shown, and the rotation of the deep
    /// images' direction set changes between frames.
    pub is_averaged: bool,
    /// The caller's request for each view. If empty, the images are stored for [`crate::Renderer::render`].
    pub requests: &'a [ViewRequest<'a>],
}

impl<'a> FrameContext<'a> {
    /// The key and the target of a view's image; none if the image is stored.
    pub(crate) fn target(&self, slot: usize) -> Option<(u64, Target<'a>)> {
        let request = self.requests.get(slot)?;
        (!matches!(request.target, Target::Own)).then_some((request.key, request.target))
    }

    /// The key of the view; it is the same in every frame.
    pub(crate) fn key(&self, slot: usize) -> ViewKey {
        self.requests.get(slot).map_or(ViewKey::Slot(slot), |request| ViewKey::Key(request.key))
    }

    /// True if the view's light is written as demodulated irradiance ([`Target::Demodulated`]) and not shaded.
    pub(crate) fn is_demodulated(&self, slot: usize) -> bool {
        matches!(self.target(slot), Some((_, Target::Demodulated { .. })))
    }
}

/// One view of a frame after the prepass: the inputs of every later pass.
#[derive(Debug)]
pub struct ViewContext<'a> {
    /// The scene.
    pub scene: &'a GpuScene,
    /// The key of the view; it is the same in every frame.
    pub(crate) key: ViewKey,
    /// The view.
    pub view: View,
    /// The view's uniform buffer.
    pub buffer: ViewBuffer,
    /// The visible draws.
    pub draws: VisibleDraws<'a>,
    /// The G-buffer that the prepass wrote.
    pub surface: Surface,
    /// The G-buffer at the centres of pixels: one sample each. Equal to `surface` if no pass needs it.
    pub center_surface: Surface,
    /// Rotation of this frame's direction sets, from the space of the set to world space.
    pub rotation: Quat,
    /// The acceleration structures of the inexact tracers for the current scene, each beside its settings. The frame
    /// sets them before the first pass with rays; [`TracePass`](crate::rays::TracePass) reads its own.
    pub structures: Structures,
}

impl<'a> ViewContext<'a> {
    /// The context with this single-sampled surface in place of the view's.
    #[doc(hidden)]
    pub fn showing(&self, surface: &Surface) -> ViewContext<'a> {
        ViewContext {
            scene: self.scene,
            key: self.key,
            view: self.view,
            buffer: self.buffer.clone(),
            draws: VisibleDraws { solid: Vec::new(), transparent: Vec::new() },
            surface: surface.clone(),
            center_surface: surface.clone(),
            rotation: self.rotation,
            structures: self.structures.clone(),
        }
    }
}
