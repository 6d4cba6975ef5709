//! The package's `Camera`, `Light` and `Material` (`_objects.py`), which were checked when they were made.

use glam::{Affine3A, Mat4, Vec3};
use lanternfish_scene::{AlphaMode, Camera, Light, LightKind, Material, Projection, TextureRef};
use pyo3::{call::PyCallArgs, exceptions::PyValueError, prelude::*, types::PyDict};

/// A matrix, row by row.
pub type Rows = [[f32; 4]; 4];

/// A transform to world space.
pub fn affine(rows: &Rows) -> Affine3A {
    Affine3A::from_mat4(Mat4::from_cols_array_2d(rows).transpose())
}

pub fn rows(transform: &Affine3A) -> Rows {
    Mat4::from(*transform).transpose().to_cols_array_2d()
}

/// An object of a class of the package.
fn object<'py>(py: Python<'py>, class: &str, values: impl PyCallArgs<'py>) -> PyResult<Bound<'py, PyAny>> {
    py.import("lanternfish")?.getattr(class)?.call1(values)
}

/// What a `Camera` has.
#[derive(FromPyObject)]
pub struct CameraObject {
    name: String,
    /// World from camera, OpenGL's axes.
    pose: Rows,
    /// Degrees.
    fov_y: Option<f64>,
    #[pyo3(attribute("_slopes"))]
    slopes: Option<[f32; 4]>,
    /// Half the height, near and far plane, m.
    #[pyo3(attribute("_orthographic"))]
    orthographic: Option<[f32; 3]>,
    near: Option<f32>,
}

impl CameraObject {
    /// `usual_near`: the near plane, m, if it names none.
    pub fn camera(&self, usual_near: f32) -> Camera {
        let near = self.near.unwrap_or(usual_near);
        let projection = match (self.slopes, self.orthographic) {
            (Some([left, right, bottom, top]), _) => Projection::Frustum { left, right, bottom, top, near },
            (_, Some([half_height, near, far])) => Projection::Orthographic { half_height, near, far },
            _ => Projection::Perspective { fov_y: self.fov_y.unwrap_or(f64::NAN).to_radians() as f32, near },
        };
        Camera { name: self.name.clone(), world_from_camera: affine(&self.pose), projection }
    }
}

/// A `Camera`.
pub fn camera_object<'py>(py: Python<'py>, camera: &Camera) -> PyResult<Bound<'py, PyAny>> {
    let (fov_y, near, slopes, orthographic) = match camera.projection {
        Projection::Perspective { fov_y, near } => (Some(f64::from(fov_y).to_degrees()), Some(near), None, None),
        Projection::Frustum { left, right, bottom, top, near } => {
            (None, Some(near), Some([left, right, bottom, top]), None)
        }
        Projection::Orthographic { half_height, near, far } => (None, None, None, Some([half_height, near, far])),
    };
    let (pose, size) = (rows(&camera.world_from_camera), None::<[u32; 2]>);
    object(py, "Camera", (pose, fov_y, near, "opengl", &camera.name, size, slopes, orthographic))
}

/// The light that a `Light` is.
pub fn light(object: &Bound<'_, PyAny>) -> PyResult<Light> {
    let vector = |name: &str| Ok::<_, PyErr>(Vec3::from(object.getattr(name)?.extract::<[f32; 3]>()?));
    let pair = |name: &str| object.getattr(name)?.extract::<[f32; 2]>();
    let (position, intensity, right) = (vector("position")?, vector("intensity")?, vector("right")?);
    let direction = vector("direction")?.try_normalize().unwrap_or(Vec3::NEG_Y);
    let (size, [inner_angle, outer_angle]) = (pair("size")?, pair("angles")?.map(f32::to_radians));
    let point = Light { direction, range: object.getattr("range")?.extract()?, ..Light::point(position, intensity) };
    let kind = match object.getattr("kind")?.extract::<String>()?.as_str() {
        "point" => LightKind::Point,
        "spot" => LightKind::Spot { inner_angle, outer_angle },
        "directional" => LightKind::Directional,
        "disk" => LightKind::Disk { radius: 0.5 * size[0] },
        "rectangle" => Light::rectangle(position, direction, right, size, intensity).kind,
        kind => return Err(PyValueError::new_err(format!("there is no light {kind:?}"))),
    };
    let light = if kind == LightKind::Directional { Light::directional(direction, intensity) } else { point };
    Ok(Light { name: object.getattr("name")?.extract()?, kind, ..light })
}

/// A `Light`.
pub fn light_object<'py>(py: Python<'py>, light: &Light) -> PyResult<Bound<'py, PyAny>> {
    let none = [0.0; 2];
    let (kind, angles, size, right) = match light.kind {
        LightKind::Point => ("point", none, none, Vec3::X),
        LightKind::Spot { inner_angle, outer_angle } => {
            ("spot", [inner_angle, outer_angle].map(f32::to_degrees), none, Vec3::X)
        }
        LightKind::Directional => ("directional", none, none, Vec3::X),
        LightKind::Disk { radius } => ("disk", none, [2.0 * radius; 2], Vec3::X),
        LightKind::Rectangle { half_width, half_height, right } => {
            ("rectangle", none, [2.0 * half_width, 2.0 * half_height], right)
        }
    };
    let [intensity, position, direction, right] =
        [light.intensity, light.position, light.direction, right].map(|vector| vector.to_array());
    object(py, "Light", (kind, intensity, position, direction, light.range, angles, size, right, &light.name))
}

/// Sets properties by the names of a `Material`'s fields. Textures are indices in the scene's list.
pub fn set_properties(material: &mut Material, properties: &Bound<'_, PyDict>) -> PyResult<()> {
    let texture = |value: Bound<'_, PyAny>| Ok::<_, PyErr>(Some(TextureRef::new(value.extract()?)));
    for (name, value) in properties {
        match name.extract::<String>()?.as_str() {
            "name" => material.name = value.extract()?,
            "base_color" => material.base_color = value.extract::<[f32; 4]>()?.into(),
            "metallic" => material.metallic = value.extract()?,
            "roughness" => material.perceptual_roughness = value.extract()?,
            "emissive" => material.emissive = value.extract::<[f32; 3]>()?.into(),
            // The cutoff follows its mode.
            "alpha_mode" => {
                material.alpha_mode = match value.extract::<String>()?.as_str() {
                    "opaque" => AlphaMode::Opaque,
                    "mask" => AlphaMode::Mask { cutoff: 0.5 },
                    "blend" => AlphaMode::Blend,
                    _ => return Err(PyValueError::new_err("alpha_mode: expected opaque, mask or blend")),
                }
            }
            "alpha_cutoff" => {
                if let AlphaMode::Mask { cutoff } = &mut material.alpha_mode {
                    *cutoff = value.extract()?;
                }
            }
            "double_sided" => material.double_sided = value.extract()?,
            "ior" => material.ior = value.extract()?,
            "transmission" => material.transmission = value.extract()?,
            "thickness" => material.thickness = value.extract()?,
            "clearcoat" => material.clearcoat = value.extract()?,
            "unlit" => material.unlit = value.extract()?,
            "normal_scale" => material.normal_scale = value.extract()?,
            "base_color_texture" => material.base_color_texture = texture(value)?,
            "metallic_roughness_texture" => material.metallic_roughness_texture = texture(value)?,
            "normal_texture" => material.normal_texture = texture(value)?,
            "emissive_texture" => material.emissive_texture = texture(value)?,
            name => return Err(PyValueError::new_err(format!("a material has no {name:?}"))),
        }
    }
    Ok(())
}
