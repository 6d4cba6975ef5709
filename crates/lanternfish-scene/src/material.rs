//! Surfaces: glTF's metallic-roughness model.

use glam::{Affine2, Vec3, Vec4};

/// A surface. Textures multiply the factors beside them.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The file's name for it, or empty.
    pub name: String,
    /// Linear RGBA.
    pub base_color: Vec4,
    /// sRGB-encoded RGBA.
    pub base_color_texture: Option<TextureRef>,
    /// 0: dielectric, 1: metal.
    pub metallic: f32,
    /// The artist's roughness; `alpha` is its square.
    pub perceptual_roughness: f32,
    /// Linear; green: roughness, blue: metallic.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent space, linear.
    pub normal_texture: Option<TextureRef>,
    /// Multiplies x and y of the normal map.
    pub normal_scale: f32,
    /// Linear; red: 1 is unoccluded. For indirect light only.
    pub occlusion_texture: Option<TextureRef>,
    /// 0: ignore the occlusion texture, 1: apply it fully.
    pub occlusion_strength: f32,
    /// Emitted radiance, nits, linear (factor times `KHR_materials_emissive_strength`).
    pub emissive: Vec3,
    /// sRGB-encoded RGB.
    pub emissive_texture: Option<TextureRef>,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// True if back faces are drawn, with the normal turned to the viewer.
    pub double_sided: bool,
    /// Index of refraction of what is not metal: at least 1, or 0 for a mirror. At 1.5, the default, it reflects 0.04
    /// of the light that falls on it from the front.
    pub ior: f32,
    /// Multiplies what is reflected where the surface is no metal, in 0..=1.
    pub specular: f32,
    /// Linear; alpha.
    pub specular_texture: Option<TextureRef>,
    /// Linear; multiplies the reflectance from the front where the surface is no metal. Not negative; may exceed 1,
    /// where the product with the reflectance is to be cut at 1.
    pub specular_color: Vec3,
    /// sRGB-encoded RGB.
    pub specular_color_texture: Option<TextureRef>,
    /// Share of light that passes through what is not metal, of what it does not reflect, in 0..=1. Alpha is apart from it: it
    /// says where the surface is. Above 0 the surface is blended, whatever its alpha mode ([`Material::is_transparent`]).
    pub transmission: f32,
    /// Linear; red.
    pub transmission_texture: Option<TextureRef>,
    /// How much of a clear coat of index 1.5 lies over the surface, in 0..=1 (`KHR_materials_clearcoat`). Its normal is the
    /// vertices', whatever the normal map is.
    pub clearcoat: f32,
    /// Linear; red.
    pub clearcoat_texture: Option<TextureRef>,
    /// The coat's own, in 0..=1.
    pub clearcoat_roughness: f32,
    /// Linear; green.
    pub clearcoat_roughness_texture: Option<TextureRef>,
    /// `KHR_materials_volume`: how thick the body below the surface is, in object space, m, not negative. 0: the surface
    /// is a thin sheet. For a renderer that traces through closed surfaces, only whether it is 0 matters.
    pub thickness: f32,
    /// What white light becomes after [`Material::attenuation_distance`] in the body, linear, in 0..=1.
    pub attenuation_color: Vec3,
    /// Distance after which light in the body has become [`Material::attenuation_color`], world space, m, > 0; infinite
    /// where the body absorbs nothing.
    pub attenuation_distance: f32,
    /// `KHR_materials_unlit`: the base colour is the radiance.
    pub unlit: bool,
}

impl Material {
    /// Whether what is behind the surface shows through it, so that it is drawn after everything else, far to near.
    pub fn is_transparent(&self) -> bool {
        self.alpha_mode == AlphaMode::Blend || self.transmission > 0.0
    }
}

impl Default for Material {
    /// glTF's default material: white, metallic 1, roughness 1.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            perceptual_roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            ior: 1.5,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            clearcoat: 0.0,
            clearcoat_texture: None,
            clearcoat_roughness: 0.0,
            clearcoat_roughness_texture: None,
            thickness: 0.0,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            unlit: false,
        }
    }
}

/// What a material's alpha means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Ignored: the surface is solid.
    Opaque,
    /// The surface is there where alpha >= cutoff.
    Mask {
        /// 0.5 unless the file says otherwise.
        cutoff: f32,
    },
    /// Covers what is behind it by alpha.
    Blend,
}

/// How a material reads a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`crate::Scene::textures`].
    pub texture: usize,
    /// 0 or 1: which texture coordinates.
    pub uv_set: u32,
    /// `KHR_texture_transform`: applied to the texture coordinates.
    pub texture_from_uv: Affine2,
}

impl TextureRef {
    /// The texture through its first coordinates, untransformed.
    pub fn new(texture: usize) -> Self {
        Self { texture, uv_set: 0, texture_from_uv: Affine2::IDENTITY }
    }
}
