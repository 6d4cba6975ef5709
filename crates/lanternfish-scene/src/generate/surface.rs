//! Assembly of procedural scenes: materials with textures, meshes of several parts, instances.

use glam::{Affine3A, Vec3, Vec4};

use super::build::Shape;
use crate::{AlphaMode, Image, Instance, Material, Mesh, Sampler, Scene, Texture, TextureRef};

/// A material in the form that mesh building needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Size of one repeat of the texture, m.
    pub texture_size: f32,
    /// True if tangents are needed.
    pub normal_mapped: bool,
}

/// The parameters of a material that is not yet in a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Finish {
    pub name: &'static str,
    /// Linear.
    pub color: Vec3,
    pub alpha: f32,
    pub alpha_mode: Option<AlphaMode>,
    pub roughness: f32,
    pub metallic: f32,
    pub emissive: Vec3,
    pub double_sided: bool,
    /// Indices into [`Scene::textures`]: colour, normal.
    pub color_texture: Option<usize>,
    pub normal_texture: Option<usize>,
    /// Size of one repeat of the textures, m.
    pub texture_size: f32,
}

impl Finish {
    /// A plain opaque dielectric.
    pub fn new(name: &'static str, color: [f32; 3], roughness: f32) -> Self {
        Self { name, color: Vec3::from(color), alpha: 1.0, roughness, texture_size: 1.0, ..Self::default() }
    }
}

/// A scene under construction.
#[derive(Debug, Default)]
pub(crate) struct Workshop {
    pub scene: Scene,
}

impl Workshop {
    /// Adds a repeating image; returns the texture's index.
    pub fn texture(&mut self, image: Image) -> usize {
        if self.scene.samplers.is_empty() {
            self.scene.samplers.push(Sampler::default());
        }
        self.scene.images.push(image);
        self.scene.textures.push(Texture { image: self.scene.images.len() - 1, sampler: 0 });
        self.scene.textures.len() - 1
    }

    /// Adds a material.
    pub fn surface(&mut self, finish: Finish) -> Surface {
        self.scene.materials.push(Material {
            name: finish.name.to_owned(),
            base_color: finish.color.extend(finish.alpha),
            base_color_texture: finish.color_texture.map(TextureRef::new),
            metallic: finish.metallic,
            perceptual_roughness: finish.roughness,
            normal_texture: finish.normal_texture.map(TextureRef::new),
            emissive: finish.emissive,
            alpha_mode: finish.alpha_mode.unwrap_or(AlphaMode::Opaque),
            double_sided: finish.double_sided,
            ..Material::default()
        });
        Surface {
            material: self.scene.materials.len() - 1,
            texture_size: finish.texture_size,
            normal_mapped: finish.normal_texture.is_some(),
        }
    }

    /// Adds a mesh of the given parts; returns its index.
    pub fn mesh(&mut self, name: &str, parts: impl IntoIterator<Item = (Surface, Shape)>) -> usize {
        let primitives = parts.into_iter().map(|(surface, shape)| surface.primitive(shape)).collect();
        self.scene.meshes.push(Mesh { name: name.to_owned(), primitives });
        self.scene.meshes.len() - 1
    }

    /// Adds an instance of a mesh, with the mesh's name.
    pub fn place(&mut self, mesh: usize, world_from_object: Affine3A) {
        let name = self.scene.meshes[mesh].name.clone();
        self.scene.instances.push(Instance { name, mesh, world_from_object });
    }

    /// Adds an instance of a mesh, rotated by `angle` about +y (radians; 0 leaves +z, π/2 takes +z to +x).
    pub fn place_at(&mut self, mesh: usize, position: Vec3, angle: f32) {
        self.place(mesh, Affine3A::from_rotation_translation(glam::Quat::from_rotation_y(angle), position));
    }

    /// Adds a mesh of one part and one instance with the identity transform.
    pub fn add(&mut self, name: &str, surface: Surface, shape: Shape) {
        let mesh = self.mesh(name, [(surface, shape)]);
        self.place(mesh, Affine3A::IDENTITY);
    }
}

/// A colour as RGBA bytes; `color` is sRGB-encoded, 0..=1.
pub(crate) fn rgba(color: Vec4) -> [u8; 4] {
    color.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}
