//! Cameras, lights and materials as dictionaries of numbers: what the package's Python classes are made of.

use glam::{Affine3A, Mat4, Vec3};
use lanternfish_scene::{AlphaMode, Camera, Light, LightKind, Material, Projection, TextureRef};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

/// A matrix, row by row.
pub type Rows = [[f32; 4]; 4];

/// A transform to world space. Python has checked that the numbers are finite, and the last row.
pub fn affine(rows: &Rows) -> Affine3A {
    Affine3A::from_mat4(Mat4::from_cols_array_2d(rows).transpose())
}

pub fn rows(transform: &Affine3A) -> Rows {
    Mat4::from(*transform).transpose().to_cols_array_2d()
}

/// A camera. One of `fov_y`, `slopes` and `orthographic` is given.
#[derive(FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub struct RawCamera {
    name: String,
    /// World from camera, OpenGL's axes.
    pose: Rows,
    /// Radians.
    fov_y: Option<f32>,
    /// Left, right, bottom, top.
    slopes: Option<[f32; 4]>,
    /// Half the height, near and far plane, m.
    orthographic: Option<[f32; 3]>,
    /// Near plane, m; none: one that suits the scene.
    near: Option<f32>,
}

impl RawCamera {
    pub fn of(camera: &Camera) -> Self {
        let (name, pose) = (camera.name.clone(), rows(&camera.world_from_camera));
        let none = Self { name, pose, fov_y: None, slopes: None, orthographic: None, near: None };
        match camera.projection {
            Projection::Perspective { fov_y, near } => Self { fov_y: Some(fov_y), near: Some(near), ..none },
            Projection::Frustum { left, right, bottom, top, near } => {
                Self { slopes: Some([left, right, bottom, top]), near: Some(near), ..none }
            }
            Projection::Orthographic { half_height, near, far } => {
                Self { orthographic: Some([half_height, near, far]), ..none }
            }
        }
    }

    pub fn camera(&self, usual_near: f32) -> Camera {
        let near = self.near.unwrap_or(usual_near);
        let projection = match (self.slopes, self.orthographic) {
            (Some([left, right, bottom, top]), _) => Projection::Frustum { left, right, bottom, top, near },
            (_, Some([half_height, near, far])) => Projection::Orthographic { half_height, near, far },
            _ => Projection::Perspective { fov_y: self.fov_y.unwrap_or(f32::NAN), near },
        };
        Camera { name: self.name.clone(), world_from_camera: affine(&self.pose), projection }
    }
}

/// A light. Fields that its kind lacks have any value.
#[derive(FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub struct RawLight {
    name: String,
    kind: String,
    position: [f32; 3],
    direction: [f32; 3],
    /// Red, green, blue: cd, lx or nits.
    intensity: [f32; 3],
    range: Option<f32>,
    /// Inner and outer angle of a spot, degrees.
    angles: [f32; 2],
    /// Width and height of a rectangle, twice the radius of a disk, m.
    size: [f32; 2],
    /// Direction of a rectangle's width.
    right: [f32; 3],
}

impl RawLight {
    pub fn of(light: &Light) -> Self {
        let (mut angles, mut size, mut across) = ([0.0; 2], [0.0; 2], Vec3::X);
        let kind = match light.kind {
            LightKind::Point => "point",
            LightKind::Spot { inner_angle, outer_angle } => {
                angles = [inner_angle, outer_angle].map(f32::to_degrees);
                "spot"
            }
            LightKind::Directional => "directional",
            LightKind::Disk { radius } => {
                size = [2.0 * radius; 2];
                "disk"
            }
            LightKind::Rectangle { half_width, half_height, right } => {
                (size, across) = ([2.0 * half_width, 2.0 * half_height], right);
                "rectangle"
            }
        };
        let [position, direction, intensity, right] =
            [light.position, light.direction, light.intensity, across].map(|v| v.to_array());
        let (name, kind, range) = (light.name.clone(), kind.to_owned(), light.range);
        Self { name, kind, position, direction, intensity, range, angles, size, right }
    }

    pub fn light(&self) -> PyResult<Light> {
        let [position, direction, intensity, right] =
            [self.position, self.direction, self.intensity, self.right].map(Vec3::from);
        let direction = direction.try_normalize().unwrap_or(Vec3::NEG_Y);
        let ([width, height], [inner_angle, outer_angle]) = (self.size, self.angles.map(f32::to_radians));
        let point = Light { direction, range: self.range, ..Light::point(position, intensity) };
        let light = match self.kind.as_str() {
            "point" => point,
            "spot" => Light { kind: LightKind::Spot { inner_angle, outer_angle }, ..point },
            "directional" => Light::directional(direction, intensity),
            "disk" => Light { range: self.range, ..Light::disk(position, direction, 0.5 * width, intensity) },
            "rectangle" => {
                let rectangle = Light::rectangle(position, direction, right, [width, height], intensity);
                Light { range: self.range, ..rectangle }
            }
            kind => return Err(PyValueError::new_err(format!("there is no light {kind:?}"))),
        };
        Ok(Light { name: self.name.clone(), ..light })
    }
}

/// Sets properties of a material by the names of `Material`'s fields in Python. Textures are indices in the scene's list, or none.
pub fn set_properties(material: &mut Material, properties: &Bound<'_, PyDict>) -> PyResult<()> {
    let texture = |value: Bound<'_, PyAny>| Ok::<_, PyErr>(value.extract::<Option<usize>>()?.map(TextureRef::new));
    for (name, value) in properties {
        let name: String = name.extract()?;
        match name.as_str() {
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
            _ => return Err(PyValueError::new_err(format!("a material has no {name:?}"))),
        }
    }
    Ok(())
}
