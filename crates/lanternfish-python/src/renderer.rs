//! A renderer that keeps a scene on the device.

use std::{
    mem,
    ops::ControlFlow,
    sync::{Arc, Mutex, PoisonError},
};

use glam::Affine3A;
use lanternfish::{
    Aovs, GpuScene, RenderError, RenderedImage, Renderer, Sent,
    settings::{Exposure, Occlusion},
};
use lanternfish_scene::{Camera, Light, Scene, Setting as _, memory::Budget, near_plane, rig};
use pyo3::{
    exceptions::{PyMemoryError, PyValueError},
    prelude::*,
    types::PyDict,
};

use crate::{
    check_process,
    device::{Device, OfProcess},
    log,
    objects::{CameraObject, Rows, affine, light},
    outputs::{DISPLAY, LIT, Outputs, SURFACES},
    render_failed,
    scene::SceneData,
    settings::{add_rig, chosen_settings},
    step,
};

/// A scene with a camera at one time: of `Renderer.moment`.
#[pyclass(frozen)]
pub struct Moment(OfProcess<lanternfish::Moment>);

/// What a `Renderer` of the package (`_renderer.py`) has beside its scene, which it passes. It lets threads in one after
/// another: nothing waits for the mutex, which is there since passes are not `Sync`.
#[pyclass]
pub struct RendererData(OfProcess<Mutex<State>>);

struct State {
    renderer: Renderer,
    uploaded: Option<GpuScene>,
    /// The rig for scenes without light, by name; `auto` chooses it.
    light_rig: String,
    /// The rig that was added, and the camera around which it is.
    added: Option<(rig::LightRig, Camera)>,
    /// True if the next display image sets the exposure of all.
    is_metered: bool,
    /// Exposure at which white is white in the rig.
    exposure_of_rig: Option<f32>,
    near: f32,
    /// Instances that have moved since the last image.
    moved: Vec<(usize, Affine3A)>,
    /// Bytes that the last moves sent to the device.
    sent_bytes: u64,
}

impl RendererData {
    fn state(&mut self) -> &mut State {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs `work` without the interpreter's lock.
    fn work<R: Send>(&mut self, py: Python<'_>, work: impl FnOnce(&mut State) -> PyResult<R> + Send) -> PyResult<R> {
        check_process()?;
        let done = py.detach(|| work(self.state()));
        log::tell(py)?;
        done
    }
}

impl State {
    /// Uploads the scene with its light, or sends what has moved.
    fn prepare(&mut self, scene: &mut Arc<Scene>, camera: &Camera) -> PyResult<()> {
        let moved = mem::take(&mut self.moved);
        if self.uploaded.is_none() {
            let settings = self.renderer.settings();
            if settings.image.debug_view.is_none() {
                let reaches = settings.indirect.sees_environment() || settings.occlusion != Occlusion::NONE;
                let (rig, exposure) = add_rig(scene, camera, &self.light_rig, reaches)?;
                (self.added, self.exposure_of_rig) = (rig.map(|rig| (rig, camera.clone())), exposure);
            }
            self.uploaded = Some(self.renderer.upload(scene).map_err(render_failed)?);
        } else if !moved.is_empty() {
            self.sent_bytes = self.change(scene, |renderer, uploaded| renderer.move_instances(uploaded, &moved))?;
        }
        Ok(())
    }

    /// Sends the changed scene.
    fn update(&mut self, scene: &Scene) -> PyResult<()> {
        self.moved.clear();
        let Some(uploaded) = &mut self.uploaded else { return Ok(()) };
        self.renderer.update(uploaded, scene).map_err(render_failed)
    }

    /// Sends a change of one thing alone, where the device can take it. Returns the number of bytes.
    fn change(
        &mut self,
        scene: &Scene,
        change: impl FnOnce(&Renderer, &mut GpuScene) -> Result<Sent, RenderError>,
    ) -> PyResult<u64> {
        match self.uploaded.as_mut().map(|uploaded| change(&self.renderer, uploaded)) {
            Some(Err(RenderError::NeedsUpdate { .. })) => self.update(scene).map(|()| 0),
            sent => sent.map_or(Ok(0), |sent| sent.map(|sent| sent.bytes)).map_err(render_failed),
        }
    }

    /// An image; the first display image sets the exposure of all.
    fn image(
        &mut self,
        camera: &Camera,
        size: [u32; 2],
        has_display: bool,
        tell: impl Fn(usize) -> PyResult<()>,
    ) -> PyResult<RenderedImage> {
        let is_metered = self.is_metered && has_display;
        if let Some(ev) = self.exposure_of_rig.filter(|_| is_metered) {
            self.renderer.set_exposure(Exposure::Ev(ev)).map_err(render_failed)?;
        }
        let mut told = Ok(());
        let tell = |frames: u32| {
            told = tell(frames as usize);
            if told.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let uploaded = self.uploaded.as_ref().expect("it was prepared");
        let rendered = self.renderer.render_frames(uploaded, &[(camera, size)], tell);
        told?;
        let image = rendered.map_err(render_failed)?.remove(0);
        if let Some(ev) = image.exposure.filter(|_| is_metered) {
            self.renderer.set_exposure(Exposure::Ev(ev)).map_err(render_failed)?;
            self.is_metered = false;
        }
        Ok(image)
    }
}

#[pymethods]
impl RendererData {
    #[new]
    fn new(
        py: Python<'_>,
        device: &Device,
        scene: &SceneData,
        quality: &str,
        light_rig: String,
        values: Vec<(String, String)>,
    ) -> PyResult<Self> {
        check_process()?;
        let settings = chosen_settings(quality, &values)?;
        let is_metered = settings.image.exposure == Exposure::Auto;
        if light_rig != "auto" {
            let read = rig::LightRig::Studio.read(&light_rig);
            read.map_err(|what| PyValueError::new_err(format!("light_rig: {what}, or auto")))?;
        }
        let made = py.detach(|| {
            scene.scene.validate().map_err(RenderError::from)?;
            let renderer = Renderer::with_engine(device.engine(), settings.for_scene(&scene.scene))?;
            Ok::<_, RenderError>((renderer, near_plane(&scene.scene.bounds())))
        });
        log::tell(py)?;
        let (renderer, near) = made.map_err(render_failed)?;
        let (uploaded, added, exposure_of_rig, moved, sent_bytes) = (None, None, None, Vec::new(), 0);
        let state =
            State { renderer, uploaded, light_rig, added, is_metered, exposure_of_rig, near, moved, sent_bytes };
        Ok(Self(OfProcess::new(Mutex::new(state))))
    }

    /// The arrays of each camera's image.
    #[allow(clippy::too_many_arguments, reason = "Python calls it by position, from one place")]
    fn render(
        &mut self,
        py: Python<'_>,
        scene: &mut SceneData,
        cameras: Vec<CameraObject>,
        size: [u32; 2],
        outputs: Vec<String>,
        towards: Option<&Moment>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Vec<Py<PyDict>>> {
        let (outputs, count, [width, height]) = (Outputs::new(&outputs)?, cameras.len(), size);
        let pixels = (count as u64 * u64::from(width)).saturating_mul(u64::from(height));
        let bytes = pixels.saturating_mul(Aovs::BYTES_PER_PIXEL + RenderedImage::BYTES_PER_PIXEL);
        let need = Budget::of_process().check(bytes, || format!("{count} images of {width}x{height} pixels need"));
        need.map_err(|need| PyMemoryError::new_err(format!("{need}; render fewer at a time")))?;
        self.work(py, |state| {
            let frames = state.renderer.settings().image.accumulate as usize;
            let image = |(index, camera): (usize, &CameraObject)| {
                let camera = camera.camera(state.near);
                state.prepare(&mut scene.scene, &camera)?;
                let tell = |done: usize| step(progress.as_ref(), index * frames + done, count * frames);
                let image = match outputs.have(LIT) {
                    true => Some(state.image(&camera, size, outputs.have(DISPLAY), tell)?),
                    false => None,
                };
                let uploaded = state.uploaded.as_ref().expect("it was prepared");
                let surfaces = || state.renderer.aovs(uploaded, &camera, size, towards.map(|moment| &*moment.0));
                let surfaces = outputs.have(SURFACES).then(surfaces).transpose().map_err(render_failed)?;
                let arrays = outputs.arrays(size, image.as_ref(), surfaces.as_ref(), &scene.scene.semantics)?;
                if frames == 1 || image.is_none() {
                    tell(frames)?;
                }
                Ok(arrays)
            };
            cameras.iter().enumerate().map(image).collect()
        })
    }

    /// The scene as it is, for motion towards or from it.
    fn moment(&mut self, py: Python<'_>, scene: &mut SceneData, camera: CameraObject) -> PyResult<Moment> {
        self.work(py, |state| {
            let camera = camera.camera(state.near);
            state.prepare(&mut scene.scene, &camera)?;
            let uploaded = state.uploaded.as_ref().expect("it was prepared");
            Ok(Moment(OfProcess::new(state.renderer.moment(uploaded, &camera))))
        })
    }

    /// Moves instances, by their numbers from 1 on, at the next image.
    fn set_poses(&mut self, scene: &mut SceneData, poses: Vec<(usize, Rows)>) {
        for (id, pose) in poses {
            scene.set_pose(id, pose);
            self.state().moved.push((id - 1, affine(&pose)));
        }
    }

    /// Sends a light that has changed.
    fn send_light(&mut self, py: Python<'_>, scene: &SceneData, index: usize) -> PyResult<u64> {
        let new = &scene.scene.lights[index];
        self.work(py, |state| state.change(&scene.scene, |renderer, uploaded| renderer.set_light(uploaded, index, new)))
    }

    /// Sends a material that has changed.
    fn send_material(&mut self, py: Python<'_>, scene: &SceneData, index: usize) -> PyResult<u64> {
        let new = &scene.scene.materials[index];
        self.work(py, |state| {
            state.change(&scene.scene, |renderer, uploaded| renderer.set_material(uploaded, index, new))
        })
    }

    /// Sends whatever has changed.
    fn send(&mut self, py: Python<'_>, scene: &SceneData) -> PyResult<()> {
        self.work(py, |state| state.update(&scene.scene))
    }

    /// Replaces all lights but those of a rig.
    fn set_lights(&mut self, py: Python<'_>, scene: &mut SceneData, lights: Vec<Bound<'_, PyAny>>) -> PyResult<()> {
        let mut lights = lights.iter().map(light).collect::<PyResult<Vec<Light>>>()?;
        let has_rig = self.state().added.is_some();
        let of_rig = |light: &&Light| has_rig && light.name.ends_with(" of the rig");
        lights.extend(scene.scene.lights.iter().filter(of_rig).cloned());
        scene.change().lights = lights;
        self.send(py, scene)
    }

    /// Takes another scene, and adds the rig that was added.
    fn update(&mut self, py: Python<'_>, scene: &mut SceneData) -> PyResult<()> {
        self.work(py, |state| {
            scene.scene.validate().map_err(render_failed)?;
            state.near = near_plane(&scene.scene.bounds());
            if let Some((rig, camera)) = &state.added {
                rig.add(scene.change(), camera, 1.0);
            }
            state.update(&scene.scene)
        })
    }

    /// Exposure of display images, EV; none until the first image was metered.
    #[getter]
    fn exposure(&mut self) -> Option<f32> {
        match self.state().renderer.settings().image.exposure {
            Exposure::Ev(ev) => Some(ev),
            Exposure::Auto => None,
        }
    }

    #[setter]
    fn set_exposure(&mut self, value: &str) -> PyResult<()> {
        let mut exposure = Exposure::Auto;
        exposure.read(value).map_err(|what| PyValueError::new_err(format!("exposure: {what}")))?;
        self.state().is_metered = exposure == Exposure::Auto;
        self.state().renderer.set_exposure(exposure).map_err(render_failed)
    }

    #[getter]
    fn sent_bytes(&mut self) -> u64 {
        self.state().sent_bytes
    }
}
