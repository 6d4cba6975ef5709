//! A scene that Python builds or loads.

use std::{path::PathBuf, sync::Arc};

use glam::{Vec2, Vec3, Vec4};
use lanternfish_scene::{
    Camera, Environment, Image, Instance, LoadOptions, Material, Mesh, Primitive, Sampler, Scene, Setting as _,
    Texture, UpAxis, load_with,
};
use numpy::{PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods as _};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{
    check_process, load_failed, log,
    raw::{RawCamera, RawLight, Rows, affine, rows, set_properties},
};

/// A scene. Renderers share it until it changes.
#[pyclass]
pub struct SceneData {
    pub scene: Arc<Scene>,
}

/// Rows of an array as vectors.
fn vectors<const N: usize, V: From<[f32; N]>>(array: &PyReadonlyArray2<'_, f32>) -> PyResult<Vec<V>> {
    let values = array.as_slice()?.as_chunks::<N>().0;
    Ok(values.iter().map(|row| V::from(*row)).collect())
}

fn optional<const N: usize, V: From<[f32; N]>>(array: Option<&PyReadonlyArray2<'_, f32>>) -> PyResult<Vec<V>> {
    array.map_or(Ok(Vec::new()), vectors)
}

/// Unit normals, each that of the triangles around the vertex, weighted by their area.
fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|corner| normals[*corner as usize] += normal);
    }
    normals
}

impl SceneData {
    fn change(&mut self) -> &mut Scene {
        Arc::make_mut(&mut self.scene)
    }
}

#[pymethods]
impl SceneData {
    #[new]
    fn new() -> Self {
        Self { scene: Arc::default() }
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
        let (rgba, height, width) = (pixels.as_slice()?.to_vec(), pixels.shape()[0], pixels.shape()[1]);
        let scene = self.change();
        if scene.samplers.is_empty() {
            scene.samplers.push(Sampler::default());
        }
        scene.images.push(Image { name, width: width as u32, height: height as u32, rgba });
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

    /// Adds a mesh of one material. Lists are as long as the positions; indices have been checked.
    #[allow(clippy::too_many_arguments, reason = "they are the lists of a primitive")]
    fn add_mesh(
        &mut self,
        positions: PyReadonlyArray2<'_, f32>,
        faces: PyReadonlyArray2<'_, u32>,
        normals: Option<PyReadonlyArray2<'_, f32>>,
        uv: Option<PyReadonlyArray2<'_, f32>>,
        colors: Option<PyReadonlyArray2<'_, f32>>,
        material: usize,
        is_smooth: bool,
        name: String,
    ) -> PyResult<usize> {
        let positions: Vec<Vec3> = vectors::<3, _>(&positions)?;
        let triangles = faces.as_slice()?.as_chunks::<3>().0;
        let normals = match &normals {
            Some(normals) => vectors::<3, Vec3>(normals)?,
            None if is_smooth => smooth_normals(&positions, triangles),
            None => Vec::new(),
        };
        let mut primitive = Primitive {
            material,
            positions,
            normals,
            uv0: optional::<2, Vec2>(uv.as_ref())?,
            colors: optional::<4, Vec4>(colors.as_ref())?,
            indices: triangles.as_flattened().to_vec(),
            ..Primitive::default()
        };
        let uv_set = self.scene.materials.get(material).and_then(Material::tangent_uv_set);
        primitive.complete(uv_set).map_err(load_failed)?;
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

    fn pose(&self, id: usize) -> Rows {
        rows(&self.scene.instances[id - 1].world_from_object)
    }

    fn set_pose(&mut self, id: usize, pose: Rows) {
        self.change().instances[id - 1].world_from_object = affine(&pose);
    }

    fn set_semantic(&mut self, id: usize, class: u32) {
        let scene = self.change();
        scene.semantics.resize(scene.instances.len(), 0);
        scene.semantics[id - 1] = class;
    }

    fn set_lights(&mut self, lights: Vec<RawLight>) -> PyResult<()> {
        self.change().lights = lights.iter().map(RawLight::light).collect::<PyResult<_>>()?;
        Ok(())
    }

    fn lights(&self) -> Vec<RawLight> {
        self.scene.lights.iter().map(RawLight::of).collect()
    }

    fn add_light(&mut self, light: RawLight) -> PyResult<usize> {
        let light = light.light()?;
        let scene = self.change();
        scene.lights.push(light);
        Ok(scene.lights.len() - 1)
    }

    fn add_camera(&mut self, camera: RawCamera, near: f32) -> usize {
        let scene = self.change();
        scene.cameras.push(camera.camera(near));
        scene.cameras.len() - 1
    }

    fn cameras(&self) -> Vec<RawCamera> {
        self.scene.cameras.iter().map(RawCamera::of).collect()
    }

    /// The first camera, or one that frames the scene, as the command line does.
    fn default_camera(&self, py: Python<'_>, aspect: f32) -> RawCamera {
        let scene = &self.scene;
        let first = || scene.cameras.first().cloned();
        RawCamera::of(&py.detach(|| first().unwrap_or_else(|| Camera::overview(scene, None, aspect).0)))
    }

    fn set_sky(&mut self, color: [f32; 3]) {
        let scene = self.change();
        (scene.sky, scene.environment) = (Vec3::from(color), None);
    }

    /// Reads an environment; its sun becomes a light.
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

    /// Name and semantic class of each instance.
    fn instances(&self) -> Vec<(String, u32)> {
        let classes = self.scene.semantics.iter().copied().chain(std::iter::repeat(0));
        self.scene.instances.iter().map(|instance| instance.name.clone()).zip(classes).collect()
    }

    fn materials(&self) -> Vec<String> {
        self.scene.materials.iter().map(|material| material.name.clone()).collect()
    }

    /// Name and duration, s, of each animation.
    fn animations(&self) -> Vec<(String, f32)> {
        self.scene.motion.animations.iter().map(|animation| (animation.name.clone(), animation.duration())).collect()
    }

    /// Moves the scene to a time of an animation.
    fn set_time(&mut self, py: Python<'_>, animation: usize, time: f32) {
        let scene = self.change();
        py.detach(|| scene.pose(animation, time));
    }

    /// Least and greatest corner; none without geometry.
    fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        let bounds = self.scene.bounds();
        (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()])
    }
}
