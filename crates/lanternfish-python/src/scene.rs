//! A scene that Python builds or loads.

use std::{path::PathBuf, sync::Arc};

use glam::{Vec2, Vec3, Vec4};
use lanternfish::RenderError;
use lanternfish_scene::{
    Camera, Environment, Image, Instance, LoadOptions, Material, Mesh, Primitive, Sampler, Scene, Setting as _,
    Texture, UpAxis, load_with,
};
use numpy::{PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods as _};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{
    check_process, load_failed, log,
    objects::{CameraObject, Rows, affine, camera_object, light, light_object, rows, set_properties},
    render_failed,
};

/// What a `Scene` of the package (`_scene.py`) has: it finds objects by name and checks numbers. Renderers share it
/// until it changes.
#[pyclass]
#[derive(Default)]
pub struct SceneData {
    pub scene: Arc<Scene>,
}

/// The rows of an array of a `Mesh`; none if it has none of this name.
fn vectors<const N: usize, V: From<[f32; N]>>(mesh: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<V>> {
    let array = mesh.getattr(name)?.extract::<Option<PyReadonlyArray2<'_, f32>>>()?;
    let Some(array) = array else { return Ok(Vec::new()) };
    Ok(array.as_slice()?.as_chunks::<N>().0.iter().map(|row| V::from(*row)).collect())
}

/// Normals, each that of the triangles around the vertex, weighted by their area.
fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
        triangle.iter().for_each(|corner| normals[*corner as usize] += (b - a).cross(c - a));
    }
    normals
}

impl SceneData {
    pub fn change(&mut self) -> &mut Scene {
        Arc::make_mut(&mut self.scene)
    }
}

#[pymethods]
impl SceneData {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, up: &str, scene: Option<String>, variant: Option<String>) -> PyResult<Self> {
        check_process()?;
        let mut axis = UpAxis::default();
        axis.read(up).map_err(|what| PyValueError::new_err(format!("up: {what}")))?;
        let options = LoadOptions { scene, variant, up: axis, ..LoadOptions::default() };
        let loaded = py.detach(|| load_with(&path, &options)).map_err(load_failed);
        log::tell(py)?;
        Ok(Self { scene: Arc::new(loaded?) })
    }

    fn copy(&self) -> Self {
        Self { scene: Arc::clone(&self.scene) }
    }

    /// Adds an image, RGBA, and returns its texture.
    fn add_texture(&mut self, pixels: PyReadonlyArray3<'_, u8>, name: String) -> PyResult<usize> {
        let (rgba, height, width) = (pixels.as_slice()?.to_vec(), pixels.shape()[0] as u32, pixels.shape()[1] as u32);
        let scene = self.change();
        if scene.samplers.is_empty() {
            scene.samplers.push(Sampler::default());
        }
        scene.images.push(Image { name, width, height, rgba });
        scene.textures.push(Texture { image: scene.images.len() - 1, sampler: 0 });
        Ok(scene.textures.len() - 1)
    }

    fn add_material(&mut self, properties: &Bound<'_, PyDict>) -> PyResult<usize> {
        let mut material = Material::default();
        set_properties(&mut material, properties)?;
        let scene = self.change();
        scene.materials.push(material);
        Ok(scene.materials.len() - 1)
    }

    /// Changes properties of a material.
    fn set_material(&mut self, index: usize, changes: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut material = self.scene.materials[index].clone();
        set_properties(&mut material, changes)?;
        self.change().materials[index] = material;
        Ok(())
    }

    /// Adds a `Mesh` with a material of the scene.
    fn add_mesh(&mut self, mesh: &Bound<'_, PyAny>, material: usize) -> PyResult<usize> {
        let (positions, mut normals) = (vectors(mesh, "vertices")?, vectors(mesh, "normals")?);
        let faces = mesh.getattr("faces")?.extract::<PyReadonlyArray2<'_, u32>>()?;
        let triangles = faces.as_slice()?.as_chunks::<3>().0;
        if normals.is_empty() && mesh.getattr("smooth")?.is_truthy()? {
            normals = smooth_normals(&positions, triangles);
        }
        let (uv0, colors): (Vec<Vec2>, Vec<Vec4>) = (vectors(mesh, "uv")?, vectors(mesh, "colors")?);
        let indices = triangles.as_flattened().to_vec();
        let mut primitive = Primitive { material, positions, normals, uv0, colors, indices, ..Primitive::default() };
        let uv_set = self.scene.materials.get(material).and_then(Material::tangent_uv_set);
        primitive.complete(uv_set).map_err(load_failed)?;
        let name = mesh.getattr("name")?.extract()?;
        let scene = self.change();
        scene.meshes.push(Mesh { name, primitives: vec![primitive] });
        Ok(scene.meshes.len() - 1)
    }

    /// Places a mesh and returns the number of the instance, from 1 on.
    fn add_instance(&mut self, mesh: usize, pose: Rows, name: String, semantic: u32) -> usize {
        let scene = self.change();
        scene.instances.push(Instance { name, mesh, world_from_object: affine(&pose) });
        scene.semantics.resize(scene.instances.len() - 1, 0);
        scene.semantics.push(semantic);
        scene.instances.len()
    }

    /// Names of the instances.
    #[getter]
    fn names(&self) -> Vec<&str> {
        self.scene.instances.iter().map(|instance| instance.name.as_str()).collect()
    }

    /// Their semantic classes.
    #[getter]
    fn classes(&self) -> Vec<u32> {
        let given = self.scene.semantics.iter().copied();
        given.chain(std::iter::repeat(0)).take(self.scene.instances.len()).collect()
    }

    fn pose(&self, id: usize) -> Rows {
        rows(&self.scene.instances[id - 1].world_from_object)
    }

    pub fn set_pose(&mut self, id: usize, pose: Rows) {
        self.change().instances[id - 1].world_from_object = affine(&pose);
    }

    fn set_semantic(&mut self, id: usize, class: u32) {
        let scene = self.change();
        scene.semantics.resize(scene.instances.len(), 0);
        scene.semantics[id - 1] = class;
    }

    #[getter]
    fn lights<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        self.scene.lights.iter().map(|light| light_object(py, light)).collect()
    }

    #[setter]
    fn set_lights(&mut self, lights: Vec<Bound<'_, PyAny>>) -> PyResult<()> {
        self.change().lights = lights.iter().map(light).collect::<PyResult<_>>()?;
        Ok(())
    }

    #[getter]
    fn light_names(&self) -> Vec<&str> {
        self.scene.lights.iter().map(|light| light.name.as_str()).collect()
    }

    fn set_light(&mut self, index: usize, object: &Bound<'_, PyAny>) -> PyResult<()> {
        self.change().lights[index] = light(object)?;
        Ok(())
    }

    fn add_light(&mut self, object: &Bound<'_, PyAny>) -> PyResult<usize> {
        let light = light(object)?;
        let scene = self.change();
        scene.lights.push(light);
        Ok(scene.lights.len() - 1)
    }

    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        self.scene.cameras.iter().map(|camera| camera_object(py, camera)).collect()
    }

    fn add_camera(&mut self, object: CameraObject) -> usize {
        let scene = self.change();
        scene.cameras.push(object.camera(0.01));
        scene.cameras.len() - 1
    }

    /// The first camera, or one that frames the scene, as the command line does.
    fn default_camera<'py>(&self, py: Python<'py>, aspect: f32) -> PyResult<Bound<'py, PyAny>> {
        let first = self.scene.cameras.first().cloned();
        let framing = || Camera::overview(&self.scene, None, aspect).0;
        camera_object(py, &py.detach(|| first.unwrap_or_else(framing)))
    }

    fn set_sky(&mut self, color: [f32; 3]) {
        let scene = self.change();
        (scene.sky, scene.environment) = (Vec3::from(color), None);
    }

    /// Reads an environment; its sun becomes a light. `rotation`: radians.
    fn load_environment(&mut self, py: Python<'_>, path: PathBuf, rotation: f32, scale: f32) -> PyResult<()> {
        let mut environment = py.detach(|| Environment::load(&path)).map_err(load_failed)?;
        environment.rotation = rotation;
        environment.pixels.iter_mut().for_each(|pixel| *pixel *= scale);
        log::tell(py)?;
        let sun = environment.take_sun();
        let scene = self.change();
        scene.lights.extend(sun);
        scene.environment = Some(environment);
        Ok(())
    }

    #[getter]
    fn materials(&self) -> Vec<&str> {
        self.scene.materials.iter().map(|material| material.name.as_str()).collect()
    }

    /// Name and duration, s, of each animation.
    #[getter]
    fn animations(&self) -> Vec<(&str, f32)> {
        self.scene.motion.animations.iter().map(|animation| (animation.name.as_str(), animation.duration())).collect()
    }

    /// Moves the scene to a time of an animation.
    fn set_time(&mut self, py: Python<'_>, number: usize, time: f32) -> PyResult<()> {
        let count = self.scene.motion.animations.len();
        if number >= count {
            return Err(render_failed(RenderError::NoAnimation { number, count }));
        }
        py.detach(|| self.change().pose(number, time));
        Ok(())
    }

    /// Least and greatest corner; none without geometry.
    #[getter]
    fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        let bounds = self.scene.bounds();
        (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()])
    }
}
