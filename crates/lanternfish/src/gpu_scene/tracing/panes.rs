//! Panes: thin surfaces that let part of the light pass straight. Each is a mask that is solid nowhere, with a block of
//! what it lets pass.

use glam::Vec3;
use lanternfish_scene::{AlphaMode, Material, Scene};

use super::super::upload::{
    lobes::Shading,
    materials::dielectric_f0,
    mips::{mean, mean_alpha},
};

/// Words of a [`Block`].
pub const PANE_WORDS: usize = 9;

/// Of what enters the surface, the fraction that it transmits (three channels); reflectance at normal incidence (three)
/// and at grazing incidence; the factor of alpha; the alpha from which the surface is there, or -1: alpha is its
/// coverage (`gpu_scene/mask.wesl`).
pub type Block = [f32; PANE_WORDS];

/// A pane's material.
#[derive(Clone, Copy, Debug)]
pub struct Pane {
    /// Index of the material.
    pub material: usize,
    /// Address of its block in the masks.
    pub address: u32,
    // Means of its textures, or ones.
    base_color: Vec3,
    transmission: f32,
    metallic: f32,
    specular: f32,
    specular_color: Vec3,
}

impl Pane {
    /// The pane with this material, whose block is at this address.
    pub fn new(scene: &Scene, index: usize, address: u32) -> Self {
        // What is not transmitted has no colour: of other materials nothing is read.
        let material = match &scene.materials[index] {
            material if material.transmission > 0.0 => material,
            _ => &Material::default(),
        };
        let image = |texture: usize| &scene.images[scene.textures[texture].image];
        let color = |srgb| move |r: lanternfish_scene::TextureRef| mean(image(r.texture), srgb);
        Self {
            material: index,
            address,
            base_color: material.base_color_texture.map_or(Vec3::ONE, color(true)),
            transmission: material.transmission_texture.map_or(1.0, |r| color(false)(r).x),
            metallic: material.metallic_roughness_texture.map_or(1.0, |r| color(false)(r).z),
            specular: material.specular_texture.map_or(1.0, |r| mean_alpha(image(r.texture))),
            specular_color: material.specular_color_texture.map_or(Vec3::ONE, color(true)),
        }
    }

    /// The block, if this is the material now.
    pub fn block(&self, material: &Material, shading: Shading) -> Block {
        let albedo = material.base_color.truncate() * self.base_color;
        let metallic = material.metallic * self.metallic;
        let transmits = shading == Shading::File && !material.unlit;
        let transmission = if transmits { material.transmission * self.transmission } else { 0.0 };
        let f0 = dielectric_f0(material, self.specular_color, self.specular).lerp(albedo, metallic);
        let f90 = (material.specular * self.specular) * (1.0 - metallic) + metallic;
        let tint = albedo * ((1.0 - metallic) * transmission);
        let cutoff = match material.alpha_mode {
            AlphaMode::Opaque | AlphaMode::ShadowCatcher { .. } => f32::MIN,
            AlphaMode::Mask { cutoff } => cutoff.max(0.0),
            AlphaMode::Blend => -1.0,
        };
        [tint.x, tint.y, tint.z, f0.x, f0.y, f0.z, f90, material.base_color.w, cutoff]
    }
}
