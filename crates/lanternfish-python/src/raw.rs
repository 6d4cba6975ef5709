//! Cameras, lights and materials as dictionaries of numbers: what the package's Python classes are made of.

use glam::{Affine3A, Mat4, Vec3, Vec4};
use lanternfish_scene::{AlphaMode, Camera, Light, LightKind, Material, Projection, TextureRef};
use pyo3::{exceptions::PyValueError, prelude::*};

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

/// A material. Textures are indices in the scene's list.
#[derive(FromPyObject, IntoPyObject)]
#[pyo3(from_item_all)]
pub struct RawMaterial {
    name: String,
    base_color: [f32; 4],
    metallic: f32,
    roughness: f32,
    emissive: [f32; 3],
    alpha_mode: String,
    alpha_cutoff: f32,
    double_sided: bool,
    ior: f32,
    transmission: f32,
    thickness: f32,
    clearcoat: f32,
    unlit: bool,
    normal_scale: f32,
    base_color_texture: Option<usize>,
    metallic_roughness_texture: Option<usize>,
    normal_texture: Option<usize>,
    emissive_texture: Option<usize>,
}

impl RawMaterial {
    pub fn of(material: &Material) -> Self {
        let index = |texture: Option<TextureRef>| texture.map(|texture| texture.texture);
        let (alpha_mode, alpha_cutoff) = match material.alpha_mode {
            AlphaMode::Opaque => ("opaque", 0.5),
            AlphaMode::Mask { cutoff } => ("mask", cutoff),
            AlphaMode::Blend => ("blend", 0.5),
        };
        Self {
            name: material.name.clone(),
            base_color: material.base_color.to_array(),
            metallic: material.metallic,
            roughness: material.perceptual_roughness,
            emissive: material.emissive.to_array(),
            alpha_mode: alpha_mode.to_owned(),
            alpha_cutoff,
            double_sided: material.double_sided,
            ior: material.ior,
            transmission: material.transmission,
            thickness: material.thickness,
            clearcoat: material.clearcoat,
            unlit: material.unlit,
            normal_scale: material.normal_scale,
            base_color_texture: index(material.base_color_texture),
            metallic_roughness_texture: index(material.metallic_roughness_texture),
            normal_texture: index(material.normal_texture),
            emissive_texture: index(material.emissive_texture),
        }
    }

    /// The material with these properties, and otherwise those of `before`.
    pub fn over(&self, before: &Material) -> PyResult<Material> {
        // A texture that stays keeps its coordinates.
        let texture = |now: Option<usize>, before: Option<TextureRef>| {
            now.map(|now| before.filter(|before| before.texture == now).unwrap_or(TextureRef::new(now)))
        };
        let alpha_mode = match self.alpha_mode.as_str() {
            "opaque" => AlphaMode::Opaque,
            "mask" => AlphaMode::Mask { cutoff: self.alpha_cutoff },
            "blend" => AlphaMode::Blend,
            mode => return Err(PyValueError::new_err(format!("alpha_mode {mode:?}: expected opaque, mask or blend"))),
        };
        Ok(Material {
            name: self.name.clone(),
            base_color: Vec4::from(self.base_color),
            metallic: self.metallic,
            perceptual_roughness: self.roughness,
            emissive: Vec3::from(self.emissive),
            alpha_mode,
            double_sided: self.double_sided,
            ior: self.ior,
            transmission: self.transmission,
            thickness: self.thickness,
            clearcoat: self.clearcoat,
            unlit: self.unlit,
            normal_scale: self.normal_scale,
            base_color_texture: texture(self.base_color_texture, before.base_color_texture),
            metallic_roughness_texture: texture(self.metallic_roughness_texture, before.metallic_roughness_texture),
            normal_texture: texture(self.normal_texture, before.normal_texture),
            emissive_texture: texture(self.emissive_texture, before.emissive_texture),
            ..before.clone()
        })
    }
}
