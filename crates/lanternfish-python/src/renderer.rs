//! A renderer that keeps a scene on the device.

use std::{
    cell::Cell,
    sync::{Arc, Mutex, PoisonError},
};

use lanternfish::{Aovs, RenderError, RenderedImage, Renderer, settings::Exposure};
use lanternfish_scene::{Light, Setting as _, memory::Budget, near_plane, rig};
use pyo3::{
    exceptions::{PyMemoryError, PyValueError},
    prelude::*,
    types::PyDict,
};

use crate::{
    Error, check_process,
    device::{Device, OfProcess},
    log,
    outputs::Outputs,
    raw::{RawCamera, RawLight, Rows, affine, set_properties},
    render_failed,
    scene::SceneData,
    settings::chosen_settings,
    state::{Failure, State},
    step,
};

/// A scene with a camera at one time.
#[pyclass(frozen)]
pub struct Moment(OfProcess<lanternfish::Moment>);

/// The renderer, which threads use one after another; none once it is closed.
#[pyclass(frozen)]
pub struct RendererData(OfProcess<Mutex<Option<State>>>);

thread_local! {
    static IS_BUSY: Cell<bool> = const { Cell::new(false) };
}

/// A thread that works, and would wait for itself.
struct Busy;

impl Busy {
    fn new() -> PyResult<Self> {
        check_process()?;
        match IS_BUSY.replace(true) {
            false => Ok(Self),
            true => Err(Error::new_err("a renderer is used within its own progress: let the call return first")),
        }
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        IS_BUSY.set(false);
    }
}

impl RendererData {
    /// Runs `work` without the interpreter's lock.
    fn work<R: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut State) -> Result<R, Failure> + Send) -> PyResult<R> {
        let _busy = Busy::new()?;
        let done = py.detach(|| {
            let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let closed = || Failure::Python(Error::new_err("the renderer is closed: make another one"));
            work(state.as_mut().ok_or_else(closed)?)
        });
        log::tell(py)?;
        done.map_err(|failure| match failure {
            Failure::Render(error) => render_failed(error),
            Failure::Python(error) => error,
        })
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
        let scene = Arc::clone(&scene.scene);
        let made = py.detach(|| {
            scene.validate().map_err(RenderError::from)?;
            let renderer = Renderer::with_engine(device.engine(), settings.for_scene(&scene))?;
            Ok::<_, RenderError>((renderer, near_plane(&scene.bounds())))
        });
        log::tell(py)?;
        let (renderer, near) = made.map_err(render_failed)?;
        let (uploaded, added, exposure_of_rig, moved) = (None, None, None, Vec::new());
        let state = State {
            renderer,
            scene,
            uploaded,
            light_rig,
            added,
            is_metered,
            exposure_of_rig,
            near,
            moved,
            sent_bytes: 0,
        };
        Ok(Self(OfProcess::new(Mutex::new(Some(state)))))
    }

    /// Renders each camera's image.
    fn render<'py>(
        &self,
        py: Python<'py>,
        cameras: Vec<RawCamera>,
        size: [u32; 2],
        outputs: Vec<String>,
        towards: Option<&Moment>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut outputs = Outputs::new(&outputs)?;
        let count = cameras.len();
        let [width, height] = size.map(|side| side as usize);
        let bytes =
            (count * width).saturating_mul(height) as u64 * (Aovs::BYTES_PER_PIXEL + RenderedImage::BYTES_PER_PIXEL);
        let need = Budget::of_process().check(bytes, || format!("{count} images of {width}x{height} pixels need"));
        need.map_err(|need| PyMemoryError::new_err(format!("{need}; render fewer at a time")))?;
        let outputs = self.work(py, |state| {
            let frames = state.renderer.settings().image.accumulate as usize;
            for (index, camera) in cameras.iter().enumerate() {
                let camera = camera.camera(state.near);
                state.prepare(&camera)?;
                let tell = |done: usize| step(progress.as_ref(), index * frames + done, count * frames);
                let image = match outputs.have_light() {
                    true => Some(state.image(&camera, size, outputs.have_display(), tell)?),
                    false => None,
                };
                let State { renderer, uploaded, scene, .. } = &mut *state;
                let uploaded = uploaded.as_ref().expect("it was prepared");
                let aovs = match outputs.have_surfaces() {
                    true => Some(renderer.aovs(uploaded, &camera, size, towards.map(|moment| &*moment.0))?),
                    false => None,
                };
                let class = |id: u32| id.checked_sub(1).and_then(|index| scene.semantics.get(index as usize).copied());
                outputs.add(image.as_ref(), aovs.as_ref(), |id| class(id).unwrap_or(0));
                if frames == 1 || image.is_none() {
                    step(progress.as_ref(), (index + 1) * frames, count * frames)?;
                }
            }
            Ok(outputs)
        })?;
        let arrays = PyDict::new(py);
        for (name, array) in outputs.arrays(py, [count, height, width])? {
            arrays.set_item(name, array)?;
        }
        Ok(arrays)
    }

    /// The scene as it is, for motion towards or from it.
    fn moment(&self, py: Python<'_>, camera: RawCamera) -> PyResult<Moment> {
        self.work(py, |state| {
            let camera = camera.camera(state.near);
            state.prepare(&camera)?;
            let uploaded = state.uploaded.as_ref().expect("it was prepared");
            Ok(Moment(OfProcess::new(state.renderer.moment(uploaded, &camera))))
        })
    }

    /// Moves instances, by their numbers from 1 on, at the next image.
    fn set_poses(&self, py: Python<'_>, poses: Vec<(usize, Rows)>) -> PyResult<()> {
        self.work(py, |state| {
            let scene = Arc::make_mut(&mut state.scene);
            for (id, pose) in &poses {
                scene.instances[id - 1].world_from_object = affine(pose);
                state.moved.push((id - 1, affine(pose)));
            }
            Ok(())
        })
    }

    /// Replaces a light of the scene.
    fn set_light(&self, py: Python<'_>, index: usize, light: RawLight) -> PyResult<()> {
        let light = light.light()?;
        self.work(py, |state| {
            Arc::make_mut(&mut state.scene).lights[index] = light.clone();
            state.change(|renderer, uploaded| renderer.set_light(uploaded, index, &light))
        })
    }

    /// Replaces all lights but those of a rig.
    fn set_lights(&self, py: Python<'_>, lights: Vec<RawLight>) -> PyResult<()> {
        let mut lights = lights.iter().map(RawLight::light).collect::<PyResult<Vec<Light>>>()?;
        self.work(py, |state| {
            let of_rig = |light: &&Light| state.added.is_some() && light.name.ends_with(" of the rig");
            lights.extend(state.scene.lights.iter().filter(of_rig).cloned());
            Arc::make_mut(&mut state.scene).lights = lights;
            state.update()
        })
    }

    /// Changes properties of a material.
    fn set_material(&self, py: Python<'_>, index: usize, changes: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut material = self.work(py, |state| Ok(state.scene.materials[index].clone()))?;
        set_properties(&mut material, changes)?;
        self.work(py, |state| {
            Arc::make_mut(&mut state.scene).materials[index] = material.clone();
            state.change(|renderer, uploaded| renderer.set_material(uploaded, index, &material))
        })
    }

    /// Takes the scene as it is now, with the rig that was added.
    fn update(&self, py: Python<'_>, scene: &SceneData) -> PyResult<()> {
        let scene = Arc::clone(&scene.scene);
        self.work(py, |state| {
            scene.validate().map_err(RenderError::from)?;
            (state.scene, state.near) = (Arc::clone(&scene), near_plane(&scene.bounds()));
            if let Some((rig, camera)) = &state.added {
                rig.add(Arc::make_mut(&mut state.scene), camera, 1.0);
            }
            state.update()
        })
    }

    /// Moves the scene to a time of an animation.
    fn set_time(&self, py: Python<'_>, animation: usize, time: f32) -> PyResult<()> {
        self.work(py, |state| {
            let count = state.scene.motion.animations.len();
            if animation >= count {
                return Err(RenderError::NoAnimation { number: animation, count }.into());
            }
            Arc::make_mut(&mut state.scene).pose(animation, time);
            state.update()
        })
    }

    /// The scene as it is, with what a rig added.
    fn scene(&self, py: Python<'_>) -> PyResult<SceneData> {
        self.work(py, |state| Ok(SceneData { scene: Arc::clone(&state.scene) }))
    }

    /// Exposure of display images, EV; none until the first image was metered.
    #[getter]
    fn exposure(&self, py: Python<'_>) -> PyResult<Option<f32>> {
        self.work(py, |state| match state.renderer.settings().image.exposure {
            Exposure::Ev(ev) => Ok(Some(ev)),
            Exposure::Auto => Ok(None),
        })
    }

    #[setter]
    fn set_exposure(&self, py: Python<'_>, value: &str) -> PyResult<()> {
        let mut exposure = Exposure::Auto;
        exposure.read(value).map_err(|what| PyValueError::new_err(format!("exposure: {what}")))?;
        self.work(py, |state| {
            state.is_metered = exposure == Exposure::Auto;
            Ok(state.renderer.set_exposure(exposure)?)
        })
    }

    #[getter]
    fn sent_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        self.work(py, |state| Ok(state.sent_bytes))
    }

    /// Frees what it holds.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let _busy = Busy::new()?;
        py.detach(|| drop(self.0.lock().unwrap_or_else(PoisonError::into_inner).take()));
        Ok(())
    }
}
