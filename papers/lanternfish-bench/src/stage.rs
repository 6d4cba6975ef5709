//! A renderer with its scene on the device, which the next renderer may share.

use std::{cell::RefCell, rc::Rc};

use lanternfish::{GpuScene, RenderError, RenderedImage, Renderer};
use lanternfish_scene::Scene;

use crate::view::View;

/// Scenes on the device that stages have left. A scene is uploaded again only if no renderer before it left one that
/// it can share: of most configurations the upload takes longer than the frames.
#[derive(Clone, Default)]
pub struct Left(Rc<RefCell<Vec<GpuScene>>>);

impl Left {
    /// The scene on the device for this renderer.
    pub fn upload(&self, renderer: &Renderer, scene: &Scene) -> Result<GpuScene, RenderError> {
        let Some(mut left) = self.0.borrow_mut().pop() else { return renderer.upload(scene) };
        match renderer.update(&mut left, scene) {
            Err(RenderError::OtherSettings { .. }) => {
                drop(left);
                renderer.upload(scene)
            }
            done => done.map(|()| left),
        }
    }
}

/// A renderer with its scene on the device.
pub struct Stage {
    pub renderer: Renderer,
    /// None once it is dropped.
    scene: Option<GpuScene>,
    left: Left,
}

impl Stage {
    /// A renderer with this scene.
    pub fn new(renderer: Renderer, scene: &Scene, left: &Left) -> Result<Self, RenderError> {
        let scene = Some(left.upload(&renderer, scene)?);
        Ok(Self { renderer, scene, left: left.clone() })
    }

    /// Renders a frame of the view.
    pub fn frame(&mut self, view: &View) -> Result<RenderedImage, RenderError> {
        let scene = self.scene.as_ref().expect("not dropped");
        self.renderer.render(scene, &view.camera, [view.size.width, view.size.height])
    }

    /// Updates the scene on the device.
    pub fn update(&mut self, scene: &Scene) -> Result<(), RenderError> {
        self.renderer.update(self.scene.as_mut().expect("not dropped"), scene)
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.left.0.borrow_mut().extend(self.scene.take());
    }
}
