//! Surfaces: glTF's metallic-roughness model.

use glam::{Affine2, Vec3, Vec4};

/// A surface's material. Each texture multiplies the corresponding factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file, or empty.
    pub name: String,
    /// Linear RGBA.
    pub base_color: Vec4,
    /// sRGB-encoded RGBA.
    pub base_color_texture: Option<TextureRef>,
    /// 0: dielectric, 1: metal.
    pub metallic: f32,
    /// Perceptual roughness; the microfacet `alpha` is its square.
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
    /// Meaning of alpha.
    pub alpha_mode: AlphaMode,
    /// True if back faces are drawn, with the normal flipped towards the viewer.
    pub double_sided: bool,
    /// Index of refraction of the dielectric part: at least 1, or 0 for a mirror. The default, 1.5, gives a reflectance
    /// of 0.04 at normal incidence.
    pub ior: f32,
    /// Multiplies the reflection of the dielectric part, in 0..=1.
    pub specular: f32,
    /// Linear; alpha.
    pub specular_texture: Option<TextureRef>,
    /// Linear; multiplies the dielectric part's reflectance at normal incidence. Not negative; may exceed 1, but the
    /// product with the reflectance is clamped to 1.
    pub specular_color: Vec3,
    /// sRGB-encoded RGB.
    pub specular_color_texture: Option<TextureRef>,
    /// Fraction of the light not reflected by the dielectric part that is transmitted, in 0..=1. It is independent of
    /// alpha, which is the coverage. Above 0 the surface is transparent, whatever its alpha mode
    /// ([`Material::is_transparent`]).
    pub transmission: f32,
    /// Linear; red.
    pub transmission_texture: Option<TextureRef>,
    /// Fraction of the light below the specular layer that the surface scatters through to its other side, not back, in
    /// 0..=1 (`KHR_materials_diffuse_transmission`). What [`Material::transmission`] lets pass is not scattered.
    pub diffuse_transmission: f32,
    /// Linear; alpha.
    pub diffuse_transmission_texture: Option<TextureRef>,
    /// Albedo of the light that is scattered through, linear, in 0..=1.
    pub diffuse_transmission_color: Vec3,
    /// sRGB-encoded RGB.
    pub diffuse_transmission_color_texture: Option<TextureRef>,
    /// Strength of a clear coat of index 1.5 over the surface, in 0..=1 (`KHR_materials_clearcoat`).
    pub clearcoat: f32,
    /// Linear; red.
    pub clearcoat_texture: Option<TextureRef>,
    /// Perceptual roughness of the clear coat, in 0..=1.
    pub clearcoat_roughness: f32,
    /// Linear; green.
    pub clearcoat_roughness_texture: Option<TextureRef>,
    /// Normal map of the clear coat alone: tangent space, linear. Without it the coat's normal is the vertex normal.
    pub clearcoat_normal_texture: Option<TextureRef>,
    /// Multiplies x and y of the coat's normal map.
    pub clearcoat_normal_scale: f32,
    /// Colour of light that fibres above the surface reflect, linear, in 0..=1 (`KHR_materials_sheen`); black: none.
    pub sheen_color: Vec3,
    /// sRGB-encoded RGB.
    pub sheen_color_texture: Option<TextureRef>,
    /// Perceptual roughness of the fibres, in 0..=1: how far from grazing angles they reflect.
    pub sheen_roughness: f32,
    /// Linear; alpha.
    pub sheen_roughness_texture: Option<TextureRef>,
    /// How much rougher the surface is along its grain than across it, in 0..=1 (`KHR_materials_anisotropy`).
    pub anisotropy: f32,
    /// Angle from the tangent to the grain, counter-clockwise in texture coordinates, radians.
    pub anisotropy_rotation: f32,
    /// Linear; red and green: direction from the tangent, which the rotation turns; blue: strength.
    pub anisotropy_texture: Option<TextureRef>,
    /// Fraction of the reflection at normal incidence that a thin film replaces, in 0..=1
    /// (`KHR_materials_iridescence`).
    pub iridescence: f32,
    /// Linear; red.
    pub iridescence_texture: Option<TextureRef>,
    /// Index of refraction of the film, at least 1.
    pub iridescence_ior: f32,
    /// Thickness of the film, nm, not negative; where it has a texture, that of the texture's one.
    pub iridescence_thickness: f32,
    /// Thickness of the film where its texture is zero, nm, not negative.
    pub iridescence_thickness_minimum: f32,
    /// Linear; green: from the minimum (0) to the thickness (1).
    pub iridescence_thickness_texture: Option<TextureRef>,
    /// `KHR_materials_volume`: thickness of the volume below the surface, object space, m, not negative. 0: the surface
    /// is thin-walled. A renderer that traces through closed surfaces only distinguishes 0 from other values.
    pub thickness: f32,
    /// Transmittance of the volume over [`Material::attenuation_distance`], linear, in 0..=1.
    pub attenuation_color: Vec3,
    /// Distance over which the volume's transmittance is [`Material::attenuation_color`], world space, m, > 0; infinite
    /// if the volume absorbs nothing.
    pub attenuation_distance: f32,
    /// `KHR_materials_dispersion`: 20 over the Abbe number of the volume, not negative; 0: all colours are refracted
    /// alike.
    pub dispersion: f32,
    /// `KHR_materials_unlit`: the base colour is the radiance.
    pub unlit: bool,
}

impl Material {
    /// True if surfaces behind it are visible through it. It is then drawn after all opaque surfaces, from far to near.
    #[doc(hidden)]
    pub fn is_transparent(&self) -> bool {
        self.alpha_mode == AlphaMode::Blend || self.transmission > 0.0
    }

    /// True if it transmits light without scattering or refracting it: thin-walled, and so smooth that no blur is
    /// visible.
    #[doc(hidden)]
    pub fn is_thin_dielectric(&self) -> bool {
        const MOST_ROUGHNESS: f32 = 0.03;
        self.transmission > 0.0
            && self.metallic < 1.0
            && self.thickness == 0.0
            && self.perceptual_roughness <= MOST_ROUGHNESS
    }

    /// True if light passes it straight, in part: alpha-blended without transmission, or a thin dielectric.
    #[doc(hidden)]
    pub fn is_pane(&self) -> bool {
        self.is_thin_dielectric() || (self.alpha_mode == AlphaMode::Blend && self.transmission == 0.0)
    }

    /// True if shadow rays meet it: it stops light, or it is a pane.
    #[doc(hidden)]
    pub fn casts_shadow(&self) -> bool {
        !self.is_transparent() || self.is_pane()
    }

    /// Index of refraction for red, green and blue light, at least 1.
    #[doc(hidden)]
    pub fn channel_iors(&self) -> [f32; 3] {
        let excess = (self.ior - 1.0).max(0.0);
        let half_spread = (0.025 * self.dispersion).min(1.0) * excess;
        [self.ior - half_spread, self.ior, self.ior + half_spread].map(|ior| ior.max(1.0))
    }

    /// True if it has lobes beyond the metallic-roughness model: a clear coat, sheen, a grain or a film. Renderers may
    /// shade it by other code.
    #[doc(hidden)]
    pub fn is_layered(&self) -> bool {
        let has_lobe = self.clearcoat > 0.0 || self.sheen_color != Vec3::ZERO;
        !self.unlit && (has_lobe || self.anisotropy > 0.0 || self.iridescence > 0.0)
    }

    /// True if it scatters light from behind towards the viewer. Transparent surfaces do not.
    #[doc(hidden)]
    pub fn scatters_from_behind(&self) -> bool {
        self.diffuse_transmission > 0.0 && self.metallic < 1.0 && !self.unlit && !self.is_transparent()
    }

    /// True if it has a clear coat.
    #[doc(hidden)]
    pub fn is_coated(&self) -> bool {
        self.clearcoat > 0.0 && !self.unlit
    }

    /// Set of texture coordinates along which its tangents run; `None`: it has no normal map and no grain. All normal
    /// maps and the grain share the same tangents.
    #[doc(hidden)]
    pub fn tangent_uv_set(&self) -> Option<u32> {
        let of_map = self.normal_texture.or(self.clearcoat_normal_texture).map(|texture| texture.uv_set);
        let of_grain = self.anisotropy_texture.map_or(0, |texture| texture.uv_set);
        of_map.or((self.anisotropy > 0.0).then_some(of_grain))
    }

    /// The textures that renderers sample of sheen, anisotropy and iridescence.
    #[doc(hidden)]
    pub fn layer_textures(&self) -> LayerTextures {
        let in_place = |coat: Option<TextureRef>, first: Option<TextureRef>, second: Option<TextureRef>| match coat {
            Some(_) => [None; 2],
            None => [first, second.filter(|second| first.is_none_or(|first| first == *second))],
        };
        let [sheen_color, sheen_roughness] =
            in_place(self.clearcoat_texture, self.sheen_color_texture, self.sheen_roughness_texture);
        let [anisotropy, _] = in_place(self.clearcoat_roughness_texture, self.anisotropy_texture, None);
        let [iridescence, iridescence_thickness] =
            in_place(self.clearcoat_normal_texture, self.iridescence_texture, self.iridescence_thickness_texture);
        LayerTextures { sheen_color, sheen_roughness, anisotropy, iridescence, iridescence_thickness }
    }

    /// Number of its references to textures.
    #[doc(hidden)]
    pub const TEXTURES: usize = 18;

    /// All references to textures.
    #[doc(hidden)]
    pub fn textures(&self) -> [Option<TextureRef>; Self::TEXTURES] {
        self.clone().texture_slots().map(|slot| *slot)
    }

    /// The same, to be changed.
    pub(crate) fn texture_slots(&mut self) -> [&mut Option<TextureRef>; Self::TEXTURES] {
        [
            &mut self.base_color_texture,
            &mut self.metallic_roughness_texture,
            &mut self.normal_texture,
            &mut self.occlusion_texture,
            &mut self.emissive_texture,
            &mut self.specular_texture,
            &mut self.specular_color_texture,
            &mut self.transmission_texture,
            &mut self.diffuse_transmission_texture,
            &mut self.diffuse_transmission_color_texture,
            &mut self.clearcoat_texture,
            &mut self.clearcoat_roughness_texture,
            &mut self.clearcoat_normal_texture,
            &mut self.sheen_color_texture,
            &mut self.sheen_roughness_texture,
            &mut self.anisotropy_texture,
            &mut self.iridescence_texture,
            &mut self.iridescence_thickness_texture,
        ]
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
            diffuse_transmission: 0.0,
            diffuse_transmission_texture: None,
            diffuse_transmission_color: Vec3::ONE,
            diffuse_transmission_color_texture: None,
            clearcoat: 0.0,
            clearcoat_texture: None,
            clearcoat_roughness: 0.0,
            clearcoat_roughness_texture: None,
            clearcoat_normal_texture: None,
            clearcoat_normal_scale: 1.0,
            sheen_color: Vec3::ZERO,
            sheen_color_texture: None,
            sheen_roughness: 0.0,
            sheen_roughness_texture: None,
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            anisotropy_texture: None,
            iridescence: 0.0,
            iridescence_texture: None,
            iridescence_ior: 1.3,
            iridescence_thickness: 400.0,
            iridescence_thickness_minimum: 100.0,
            iridescence_thickness_texture: None,
            thickness: 0.0,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            dispersion: 0.0,
            unlit: false,
        }
    }
}

/// Meaning of a material's alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored: the surface is opaque.
    Opaque,
    /// The surface exists where alpha >= cutoff.
    Mask {
        /// Alpha threshold, 0.5 by default.
        cutoff: f32,
    },
    /// The surface is blended over its background by alpha.
    Blend,
    /// Opaque to light. In an image whose background is hidden it shows only the shadows on it: black, as opaque as
    /// light is missing, times alpha.
    ShadowCatcher {
        /// Radiance where nothing shadows it, nits, the mean of the channels; above 0.
        unshadowed: f32,
    },
}

/// Textures of sheen, anisotropy and iridescence that renderers sample. A shader has three places for them and for
/// those of a clear coat: sheen's need the place of the coat's, that of anisotropy the place of the coat's roughness,
/// and those of iridescence the place of the coat's normal. Two textures in one place must be the same.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerTextures {
    /// Of [`Material::sheen_color_texture`].
    pub sheen_color: Option<TextureRef>,
    /// Of [`Material::sheen_roughness_texture`].
    pub sheen_roughness: Option<TextureRef>,
    /// Of [`Material::anisotropy_texture`].
    pub anisotropy: Option<TextureRef>,
    /// Of [`Material::iridescence_texture`].
    pub iridescence: Option<TextureRef>,
    /// Of [`Material::iridescence_thickness_texture`].
    pub iridescence_thickness: Option<TextureRef>,
}

/// How a material reads a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`crate::Scene::textures`].
    pub texture: usize,
    /// Set of texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// `KHR_texture_transform`: applied to the texture coordinates.
    pub texture_from_uv: Affine2,
}

impl TextureRef {
    /// A reference with the first set of texture coordinates and without a transform.
    pub fn new(texture: usize) -> Self {
        Self { texture, uv_set: 0, texture_from_uv: Affine2::IDENTITY }
    }
}
