//! What a renderer works with, while no other thread does.

use std::{mem, ops::ControlFlow, sync::Arc};

use glam::Affine3A;
use lanternfish::{
    GpuScene, RenderError, RenderedImage, Renderer,
    settings::{Exposure, Occlusion},
};
use lanternfish_scene::{Camera, Scene, rig};
use pyo3::prelude::*;

use crate::settings::add_rig;

/// Why work ended.
pub enum Failure {
    Render(RenderError),
    Python(PyErr),
}

impl From<RenderError> for Failure {
    fn from(error: RenderError) -> Self {
        Self::Render(error)
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

/// The renderer and its scene.
pub struct State {
    pub renderer: Renderer,
    /// As it is on the device, but for what waits.
    pub scene: Arc<Scene>,
    pub uploaded: Option<GpuScene>,
    /// The rig for scenes without light, by name; `auto` chooses it.
    pub light_rig: String,
    /// The rig that was added, and the camera around which it is.
    pub added: Option<(rig::LightRig, Camera)>,
    /// True if the next display image sets the exposure of all.
    pub is_metered: bool,
    /// Exposure at which white is white in the rig.
    pub exposure_of_rig: Option<f32>,
    pub near: f32,
    /// Instances that have moved since the last image.
    pub moved: Vec<(usize, Affine3A)>,
    /// Bytes that the last moves sent to the device.
    pub sent_bytes: u64,
}

impl State {
    /// Uploads the scene with its light, or sends what has moved.
    pub fn prepare(&mut self, camera: &Camera) -> Result<(), Failure> {
        let moved = mem::take(&mut self.moved);
        let Some(uploaded) = &mut self.uploaded else {
            let settings = self.renderer.settings();
            if settings.image.debug_view.is_none() {
                let reaches = settings.indirect.sees_environment() || settings.occlusion != Occlusion::NONE;
                let (rig, exposure) = add_rig(&mut self.scene, camera, &self.light_rig, reaches)?;
                (self.added, self.exposure_of_rig) = (rig.map(|rig| (rig, camera.clone())), exposure);
            }
            self.uploaded = Some(self.renderer.upload(&self.scene)?);
            return Ok(());
        };
        if moved.is_empty() {
            return Ok(());
        }
        self.sent_bytes = 0;
        match self.renderer.move_instances(uploaded, &moved) {
            Ok(sent) => self.sent_bytes = sent.bytes,
            Err(RenderError::NeedsUpdate { .. }) => self.renderer.update(uploaded, &self.scene)?,
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    /// Sends the changed scene.
    pub fn update(&mut self) -> Result<(), Failure> {
        self.moved.clear();
        if let Some(uploaded) = &mut self.uploaded {
            self.renderer.update(uploaded, &self.scene)?;
        }
        Ok(())
    }

    /// A change of one thing, which the device may take alone.
    pub fn change(
        &mut self,
        change: impl FnOnce(&Renderer, &mut GpuScene) -> Result<lanternfish::Sent, RenderError>,
    ) -> Result<(), Failure> {
        let Some(uploaded) = &mut self.uploaded else { return Ok(()) };
        match change(&self.renderer, uploaded) {
            Err(RenderError::NeedsUpdate { .. }) => self.update(),
            result => Ok(result.map(|_| ())?),
        }
    }

    pub fn image(
        &mut self,
        camera: &Camera,
        size: [u32; 2],
        has_display: bool,
        mut tell: impl FnMut(usize) -> PyResult<()>,
    ) -> Result<RenderedImage, Failure> {
        let is_metered = self.is_metered && has_display;
        if let Some(ev) = self.exposure_of_rig.filter(|_| is_metered) {
            self.renderer.set_exposure(Exposure::Ev(ev))?;
        }
        let mut failure = None;
        let tell = |frames: u32| match tell(frames as usize) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                failure = Some(error);
                ControlFlow::Break(())
            }
        };
        let uploaded = self.uploaded.as_ref().expect("it was prepared");
        let rendered = self.renderer.render_frames(uploaded, &[(camera, size)], tell);
        if let Some(error) = failure {
            return Err(error.into());
        }
        let image = rendered?.remove(0);
        if let Some(ev) = image.exposure.filter(|_| is_metered) {
            self.renderer.set_exposure(Exposure::Ev(ev))?;
            self.is_metered = false;
        }
        Ok(image)
    }
}
