//! The shaders of this folder, and the data that they share with the host.

use glam::{UVec2, Vec2, Vec3, Vec4};
use lanternfish_gpu::{SharedStruct, WgslType, gpu_constants, gpu_struct};

use crate::shaders::Shaders;

/// The shaders of this folder: files of functions, and what they read.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[],
    &[
        SharedStruct::of::<SoftShadows>(),
        SharedStruct::of::<DrawInstance>(),
        SharedStruct::of::<Material>(),
        SharedStruct::of::<TextureSlot>(),
        SharedStruct::of::<BvhTriangle>(),
        SharedStruct::of::<TracedLevels>(),
        SharedStruct::of::<HitTriangle>(),
        SharedStruct::of::<HitMaterial>(),
        SharedStruct::of::<MaskRecord>(),
        SharedStruct::of::<MaskHeader>(),
    ],
);

gpu_struct! {
    /// Parameters of shadows of area lights.
    pub struct SoftShadows {
        /// Rays from a pixel to each light.
        rays: u32,
    }
}

gpu_struct! {
    /// An instance of a primitive.
    pub struct DrawInstance {
        /// Row of the affine world_from_object.
        row_x: Vec4,
        /// Row of the affine world_from_object.
        row_y: Vec4,
        /// Row of the affine world_from_object.
        row_z: Vec4,
        /// Index into the materials.
        material: u32,
        /// −1 where the transform mirrors, else 1.
        handedness: f32,
        /// Index of the scene's instance.
        instance: u32,
        /// Unused.
        _pad: u32,
    }
}

gpu_struct! {
    /// How a material reads a texture.
    pub struct TextureSlot {
        /// Columns of the linear part of texture_from_uv.
        linear_part: Vec4,
        /// Its offset.
        offset: Vec2,
        /// Index into the texture array.
        texture: u32,
        /// Sampler index times two, plus the set of texture coordinates (0 or 1).
        sampler_and_uv_set: u32,
    }
}

impl WgslType for TextureSlot {
    const WGSL: &'static str = "TextureSlot";
}

gpu_struct! {
    /// A surface.
    pub struct Material {
        /// Linear RGBA.
        base_color: Vec4,
        /// Nits.
        emissive: Vec3,
        /// Multiplies x and y of the normal map.
        normal_scale: f32,
        /// 0: dielectric, 1: metal.
        metallic: f32,
        /// Perceptual roughness.
        perceptual_roughness: f32,
        /// A smaller alpha means no surface, a greater or equal one a solid surface; negative: alpha is the fraction of the surface that is
        /// present. Of a shadow catcher: its radiance where nothing shadows it, nits.
        alpha_cutoff: f32,
        /// Sum of the constants below.
        flags: u32,
        /// Reflectance of the dielectric part at normal incidence (`KHR_materials_ior`, `KHR_materials_specular`), to be clamped at 1 and
        /// weighted by the next field.
        dielectric_f0: Vec3,
        /// Reflectance of the dielectric part at grazing incidence; also the weight of `dielectric_f0`.
        dielectric_f90: f32,
        /// Transmitted fraction of the light that the dielectric part does not reflect (`KHR_materials_transmission`).
        transmission: f32,
        /// Weight of a clear coat (`KHR_materials_clearcoat`).
        coat: f32,
        /// Roughness of the coat.
        coat_roughness: f32,
        /// Multiplies x and y of the coat's normal map.
        coat_normal_scale: f32,
        /// Colour of the sheen (`KHR_materials_sheen`).
        sheen_color: Vec3,
        /// Roughness of the sheen.
        sheen_roughness: f32,
        /// Along the grain, in the tangent's frame; its length is the strength (`KHR_materials_anisotropy`).
        anisotropy: Vec2,
        /// Weight of a thin film (`KHR_materials_iridescence`).
        iridescence: f32,
        /// Index of refraction of the film.
        iridescence_ior: f32,
        /// Thickness of the film, nm; the greatest, if there is a map of it.
        iridescence_thickness: f32,
        /// Index of refraction of the volume below the surface; 1: light passes straight.
        ior: f32,
        /// Thickness of the volume (`KHR_materials_volume`) where its back is not known, m; 0: the surface is thin.
        thickness: f32,
        /// Fraction of the light below the specular layer that is scattered through to the other side
        /// (`KHR_materials_diffuse_transmission`).
        diffuse_transmission: f32,
        /// Absorption coefficient of the volume, 1/m.
        absorption: Vec3,
        /// Index of refraction for blue less that for green, which is `ior`.
        dispersion: f32,
        /// Albedo of the light that is scattered through.
        diffuse_transmission_color: Vec3,
        /// Least thickness of the film, nm, if there is a map of it.
        iridescence_thickness_minimum: f32,
        /// sRGB.
        base_color_map: TextureSlot,
        /// Linear.
        metallic_roughness_map: TextureSlot,
        /// Linear.
        normal_map: TextureSlot,
        /// sRGB.
        emissive_map: TextureSlot,
        /// Linear.
        specular_map: TextureSlot,
        /// sRGB.
        specular_color_map: TextureSlot,
        /// Linear.
        transmission_map: TextureSlot,
        /// Linear.
        diffuse_transmission_map: TextureSlot,
        /// sRGB.
        diffuse_transmission_color_map: TextureSlot,
        /// Linear of a coat; sRGB and alpha of sheen.
        coat_or_sheen_map: TextureSlot,
        /// Linear.
        coat_roughness_or_anisotropy_map: TextureSlot,
        /// Linear.
        coat_normal_or_iridescence_map: TextureSlot,
    }
}

gpu_constants! {
    /// The base colour is the radiance.
    pub const UNLIT: u32 = 1;
    /// The base colour is a diffuse albedo; there are no other terms.
    pub const LAMBERT: u32 = 2;
    /// There is a normal map, and tangents.
    pub const NORMAL_MAPPED: u32 = 4;
    /// There is a metallic-roughness map.
    pub const METALLIC_ROUGHNESS_MAPPED: u32 = 8;
    /// There is an emissive map.
    pub const EMISSIVE_MAPPED: u32 = 16;
    /// There is a base colour map.
    pub const BASE_COLOR_MAPPED: u32 = 32;
    /// There is a map of each of these.
    pub const SPECULAR_MAPPED: u32 = 64;
    pub const SPECULAR_COLOR_MAPPED: u32 = 128;
    pub const TRANSMISSION_MAPPED: u32 = 256;
    pub const COAT_MAPPED: u32 = 512;
    pub const COAT_ROUGHNESS_MAPPED: u32 = 1024;
    pub const COAT_NORMAL_MAPPED: u32 = 2048;
    /// The surface is thin, and scatters the light that it transmits.
    pub const SCATTERS_THROUGH: u32 = 4096;
    /// There is a map of each of these.
    pub const DIFFUSE_TRANSMISSION_MAPPED: u32 = 8192;
    pub const DIFFUSE_TRANSMISSION_COLOR_MAPPED: u32 = 16384;
    pub const SHEEN_COLOR_MAPPED: u32 = 32768;
    pub const SHEEN_ROUGHNESS_MAPPED: u32 = 65536;
    pub const ANISOTROPY_MAPPED: u32 = 131072;
    pub const IRIDESCENCE_MAPPED: u32 = 262144;
    pub const IRIDESCENCE_THICKNESS_MAPPED: u32 = 524288;
    /// Over a hidden background the surface shows only the shadows on it.
    pub const CATCHES_SHADOWS: u32 = 1048576;
}

gpu_struct! {
    /// A triangle in the layout of the traversal; world space, m.
    pub struct BvhTriangle {
        /// First corner.
        a: Vec3,
        /// 0: solid; else the index of its mask record plus one.
        record: u32,
        /// Second corner.
        b: Vec3,
        /// 0: not emissive; else its leaf in the tree over emissive triangles plus one.
        light_leaf: u32,
        /// Third corner.
        c: Vec3,
        /// 0: no opacity micromap; else its address in the masks and its level.
        opacity: u32,
    }
}

gpu_struct! {
    /// Where the instances of a scene in two levels are among the BVH's triangles. In one level no triangle is behind the upper tree's.
    pub struct TracedLevels {
        /// Elements of the upper tree.
        upper_count: u32,
        /// Index of the first instance's element with its inverse.
        first_instance: u32,
        /// Number of instances.
        instance_count: u32,
        /// Unused.
        _pad: u32,
    }
}

impl TracedLevels {
    /// Those of a scene in one level.
    pub const ONE: Self = Self { upper_count: u32::MAX, first_instance: u32::MAX, instance_count: 0, _pad: 0 };
}

gpu_struct! {
    /// Shading data of a triangle, in the order of the BVH's leaves.
    pub struct HitTriangle {
        /// Texture coordinates of the first corner: two half floats.
        uv_a: u32,
        /// Texture coordinates of the second corner.
        uv_b: u32,
        /// Texture coordinates of the third corner.
        uv_c: u32,
        /// Index of its [`HitMaterial`].
        material: u32,
        /// Normal of the first corner, world space, octahedral: two snorms of 16 bits.
        normal_a: u32,
        /// Normal of the second corner.
        normal_b: u32,
        /// Normal of the third corner.
        normal_c: u32,
        /// Multiplies the base colour, linear RGBA, four unorms of 8 bits: the mean of the corners'.
        color: u32,
    }
}

gpu_struct! {
    /// Shading data of a material at hits.
    pub struct HitMaterial {
        /// Base colour, linear.
        base_color: Vec3,
        /// Layer of the hit textures that multiplies the base colour; [`NO_LAYER`]: none.
        base_color_layer: u32,
        /// Emitted radiance, nits.
        emissive: Vec3,
        /// Layer of the hit textures that multiplies the emission; [`NO_LAYER`]: none.
        emissive_layer: u32,
        /// Reflectance of the dielectric part, at normal incidence.
        dielectric_f0: Vec3,
        /// Reflectance of the dielectric part, at grazing incidence.
        dielectric_f90: f32,
        /// Metallic factor times the mean of its texture.
        metallic: f32,
        /// Perceptual roughness times the mean of its texture.
        perceptual_roughness: f32,
        /// Sum of `UNLIT`, `LAMBERT` of `material.wesl` and of [`EMITS_FROM_BACK`].
        flags: u32,
        /// Fraction of the scattered light that comes through from the other side (`KHR_materials_diffuse_transmission`).
        through: f32,
    }
}

gpu_constants! {
    /// In place of a layer: there is no texture.
    pub const NO_LAYER: u32 = 0xffffffff;
    /// Flag of a material that also emits from its back.
    pub const EMITS_FROM_BACK: u32 = 256;
}

gpu_struct! {
    /// A masked triangle's data for its mask.
    pub struct MaskRecord {
        /// Texture coordinates of the first corner.
        uv_a: Vec2,
        /// Texture coordinates of the second corner.
        uv_b: Vec2,
        /// Texture coordinates of the third corner.
        uv_c: Vec2,
        /// Factor of the mask's alpha at the first corner.
        alpha_a: f32,
        /// Factor of the mask's alpha at the second corner.
        alpha_b: f32,
        /// Factor of the mask's alpha at the third corner.
        alpha_c: f32,
        /// Address of the mask's header, words.
        header: u32,
    }
}

gpu_struct! {
    /// How an image's alpha is read as a mask.
    pub struct MaskHeader {
        /// Size of the mask, texels: the image's, or less if it was halved to fit.
        size: UVec2,
        /// Wrap modes along u and v: constants in `mask.wesl`.
        wrap: UVec2,
        /// 1: bilinear filter, 0: nearest texel.
        linear_filter: u32,
        /// Alpha from which the surface is solid. That of a pane is out of reach.
        cutoff: f32,
        /// Address of the first word of texels.
        texels: u32,
        /// Address of what a pane lets pass (`tracing/panes.rs`); 0: the surface is no pane.
        pane: u32,
    }
}
