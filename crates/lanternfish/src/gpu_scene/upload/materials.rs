//! Materials in the layout that shaders read.

use glam::{Vec2, Vec3, Vec4};
use lanternfish_gpu::{Bindings, GpuError, storage_buffer_of};
use lanternfish_scene::{AlphaMode, LayerTextures, Scene, TextureRef};

use super::{
    super::shaders::{
        ANISOTROPY_MAPPED, BASE_COLOR_MAPPED, CATCHES_SHADOWS, COAT_MAPPED, COAT_NORMAL_MAPPED, COAT_ROUGHNESS_MAPPED,
        DIFFUSE_TRANSMISSION_COLOR_MAPPED, DIFFUSE_TRANSMISSION_MAPPED, EMISSIVE_MAPPED, IRIDESCENCE_MAPPED,
        IRIDESCENCE_THICKNESS_MAPPED, LAMBERT, METALLIC_ROUGHNESS_MAPPED, Material, NORMAL_MAPPED, SCATTERS_THROUGH,
        SHEEN_COLOR_MAPPED, SHEEN_ROUGHNESS_MAPPED, SPECULAR_COLOR_MAPPED, SPECULAR_MAPPED, TRANSMISSION_MAPPED,
        TextureSlot, UNLIT,
    },
    lobes::{MaterialStorage, Shading},
    textures::Textures,
};

/// Name of the uniform buffer with the material of a draw.
pub(in crate::gpu_scene) const MATERIAL_OF_DRAW: &str = "material_of_draw";

/// The materials of a scene on the device: an array if textures are one, else each at an offset that a uniform binding
/// may have.
#[derive(Debug)]
pub(in crate::gpu_scene) struct Materials {
    buffer: wgpu::Buffer,
    /// Bytes between the starts of two materials.
    stride: usize,
}

impl Materials {
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        storage: MaterialStorage,
        textures: &Textures,
    ) -> Result<Self, GpuError> {
        let alignment = if textures.arrays { 1 } else { device.limits().min_uniform_buffer_offset_alignment as usize };
        let stride = size_of::<Material>().next_multiple_of(alignment);
        let packed = packed(scene, storage, textures, stride);
        let buffer = storage_buffer_of(device, "scene/materials", &packed, wgpu::BufferUsages::UNIFORM)?;
        Ok(Self { buffer, stride })
    }

    /// Writes all materials again; their number and their textures must be unchanged.
    pub fn update(&self, queue: &wgpu::Queue, scene: &Scene, storage: MaterialStorage, textures: &Textures) {
        queue.write_buffer(&self.buffer, 0, &packed(scene, storage, textures, self.stride));
    }

    /// Writes one material again, whose textures must be unchanged; returns its size, bytes.
    pub fn set(
        &self,
        queue: &wgpu::Queue,
        index: usize,
        material: &lanternfish_scene::Material,
        storage: MaterialStorage,
        textures: &Textures,
    ) -> u64 {
        let packed = pack(material, storage, textures);
        queue.write_buffer(&self.buffer, (index * self.stride) as u64, bytemuck::bytes_of(&packed));
        size_of::<Material>() as u64
    }

    /// All materials, if textures are one array.
    pub fn all(&self) -> Bindings<'_> {
        Bindings::new().buffer("materials", &self.buffer)
    }

    /// The first material, if textures are not one array; [`Self::offset`] selects another.
    pub fn of_draw(&self) -> Bindings<'_> {
        Bindings::new().resource(
            MATERIAL_OF_DRAW,
            wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &self.buffer,
                offset: 0,
                size: wgpu::BufferSize::new(size_of::<Material>() as u64),
            }),
        )
    }

    /// Offset of a material in the buffer, bytes.
    pub fn offset(&self, material: u32) -> u32 {
        // Bindings have at most 2³² − 1 bytes.
        material * self.stride as u32
    }
}

/// Reflectance at normal incidence of a dielectric, tinted and weighted according to `KHR_materials_specular`, with the
/// texture values `tint` and `weight`.
pub(in crate::gpu_scene) fn dielectric_f0(material: &lanternfish_scene::Material, tint: Vec3, weight: f32) -> Vec3 {
    (tinted_f0(material) * tint).min(Vec3::ONE) * (material.specular * weight)
}

/// The same before clamping and weighting.
fn tinted_f0(material: &lanternfish_scene::Material) -> Vec3 {
    let r = (material.ior - 1.0) / (material.ior + 1.0);
    r * r * material.specular_color
}

/// Indices of refraction up to this one do not refract light, as in the path tracer.
const LEAST_IOR: f32 = 1.001;

/// Absorption coefficient of a material's volume, 1/m; 0 for thin surfaces. A black attenuation colour transmits 1e-20.
fn absorption(material: &lanternfish_scene::Material) -> Vec3 {
    if material.thickness == 0.0 {
        return Vec3::ZERO;
    }
    material.attenuation_color.map(|color| -color.max(1e-20).ln() / material.attenuation_distance)
}

/// True for a thin surface that is too rough to transmit light straight.
fn scatters_through(material: &lanternfish_scene::Material) -> bool {
    material.transmission > 0.0 && material.thickness == 0.0 && !material.is_thin_dielectric()
}

/// All materials, one for each `stride` bytes.
fn packed(scene: &Scene, storage: MaterialStorage, textures: &Textures, stride: usize) -> Vec<u8> {
    let mut packed = vec![0; stride * scene.materials.len().max(1)];
    for (bytes, material) in packed.chunks_exact_mut(stride).zip(&scene.materials) {
        let material = pack(material, storage, textures);
        bytes[..size_of::<Material>()].copy_from_slice(bytemuck::bytes_of(&material));
    }
    packed
}

fn pack(material: &lanternfish_scene::Material, storage: MaterialStorage, textures: &Textures) -> Material {
    let flag = |on: bool, bit: u32| if on { bit } else { 0 };
    let MaterialStorage { shading, light_unit } = storage;
    let file = shading == Shading::File;
    let slot = |reference: &Option<TextureRef>, srgb: bool| match reference {
        Some(reference) => {
            let linear = reference.texture_from_uv.matrix2;
            let (texture, sampler) = textures.slot(reference.texture, srgb);
            TextureSlot {
                linear_part: Vec4::new(linear.x_axis.x, linear.x_axis.y, linear.y_axis.x, linear.y_axis.y),
                offset: reference.texture_from_uv.translation,
                texture,
                sampler_and_uv_set: 2 * sampler + reference.uv_set,
            }
        }
        None => TextureSlot::default(),
    };
    let scatters_from_behind = file && material.scatters_from_behind();
    let iors = material.channel_iors();
    let LayerTextures { sheen_color, sheen_roughness, anisotropy, iridescence, iridescence_thickness } =
        material.layer_textures();
    Material {
        base_color: material.base_color,
        emissive: material.emissive / light_unit,
        normal_scale: material.normal_scale,
        metallic: material.metallic,
        perceptual_roughness: material.perceptual_roughness,
        alpha_cutoff: match material.alpha_mode {
            AlphaMode::Opaque => 0.0,
            AlphaMode::Mask { cutoff } => cutoff.max(0.0),
            AlphaMode::Blend => -1.0,
            AlphaMode::ShadowCatcher { unshadowed } => unshadowed / light_unit,
        },
        flags: flag(shading == Shading::BaseColor || (file && material.unlit), UNLIT)
            | flag(shading == Shading::Lambert, LAMBERT)
            | flag(file && material.normal_texture.is_some(), NORMAL_MAPPED)
            | flag(file && material.metallic_roughness_texture.is_some(), METALLIC_ROUGHNESS_MAPPED)
            | flag(material.emissive_texture.is_some(), EMISSIVE_MAPPED)
            | flag(material.base_color_texture.is_some(), BASE_COLOR_MAPPED)
            | flag(file && material.specular_texture.is_some(), SPECULAR_MAPPED)
            | flag(file && material.specular_color_texture.is_some(), SPECULAR_COLOR_MAPPED)
            | flag(file && material.transmission_texture.is_some(), TRANSMISSION_MAPPED)
            | flag(file && material.clearcoat_texture.is_some(), COAT_MAPPED)
            | flag(file && material.clearcoat_roughness_texture.is_some(), COAT_ROUGHNESS_MAPPED)
            | flag(file && material.clearcoat_normal_texture.is_some(), COAT_NORMAL_MAPPED)
            | flag(file && sheen_color.is_some(), SHEEN_COLOR_MAPPED)
            | flag(file && sheen_roughness.is_some(), SHEEN_ROUGHNESS_MAPPED)
            | flag(file && anisotropy.is_some(), ANISOTROPY_MAPPED)
            | flag(file && iridescence.is_some(), IRIDESCENCE_MAPPED)
            | flag(file && iridescence_thickness.is_some(), IRIDESCENCE_THICKNESS_MAPPED)
            | flag(file && scatters_through(material), SCATTERS_THROUGH)
            | flag(matches!(material.alpha_mode, AlphaMode::ShadowCatcher { .. }), CATCHES_SHADOWS)
            | flag(
                scatters_from_behind && material.diffuse_transmission_texture.is_some(),
                DIFFUSE_TRANSMISSION_MAPPED,
            )
            | flag(material.diffuse_transmission_color_texture.is_some(), DIFFUSE_TRANSMISSION_COLOR_MAPPED),
        dielectric_f0: tinted_f0(material),
        dielectric_f90: material.specular,
        transmission: if file { material.transmission } else { 0.0 },
        coat: if file { material.clearcoat } else { 0.0 },
        coat_roughness: material.clearcoat_roughness,
        coat_normal_scale: material.clearcoat_normal_scale,
        sheen_color: if file { material.sheen_color } else { Vec3::ZERO },
        sheen_roughness: material.sheen_roughness,
        anisotropy: if file { material.anisotropy } else { 0.0 } * Vec2::from_angle(material.anisotropy_rotation),
        iridescence: if file { material.iridescence } else { 0.0 },
        iridescence_ior: material.iridescence_ior,
        iridescence_thickness: material.iridescence_thickness,
        ior: if material.thickness > 0.0 && material.ior > LEAST_IOR { material.ior } else { 1.0 },
        thickness: material.thickness,
        diffuse_transmission: if scatters_from_behind { material.diffuse_transmission } else { 0.0 },
        absorption: absorption(material),
        dispersion: if material.thickness > 0.0 { iors[2] - iors[1] } else { 0.0 },
        diffuse_transmission_color: material.diffuse_transmission_color,
        iridescence_thickness_minimum: material.iridescence_thickness_minimum,
        base_color_map: slot(&material.base_color_texture, true),
        metallic_roughness_map: slot(&material.metallic_roughness_texture, false),
        normal_map: slot(&material.normal_texture, false),
        emissive_map: slot(&material.emissive_texture, true),
        specular_map: slot(&material.specular_texture, false),
        specular_color_map: slot(&material.specular_color_texture, true),
        transmission_map: slot(&material.transmission_texture, false),
        diffuse_transmission_map: slot(&material.diffuse_transmission_texture, false),
        diffuse_transmission_color_map: slot(&material.diffuse_transmission_color_texture, true),
        coat_or_sheen_map: match sheen_color.or(sheen_roughness) {
            None => slot(&material.clearcoat_texture, false),
            sheen => slot(&sheen, true),
        },
        coat_roughness_or_anisotropy_map: slot(&material.clearcoat_roughness_texture.or(anisotropy), false),
        coat_normal_or_iridescence_map: slot(
            &material.clearcoat_normal_texture.or(iridescence).or(iridescence_thickness),
            false,
        ),
    }
}

/// Alpha of a material's base colour (factor times texture) from which a masked surface is solid.
pub fn mask_cutoff(material: &lanternfish_scene::Material) -> Option<f32> {
    match material.alpha_mode {
        AlphaMode::Mask { cutoff } => Some(cutoff),
        AlphaMode::Opaque | AlphaMode::Blend | AlphaMode::ShadowCatcher { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectrics_reflect_what_index_and_specular_say() {
        let f0 = |ior, specular, specular_color| {
            let material = lanternfish_scene::Material { ior, specular, specular_color, ..Default::default() };
            dielectric_f0(&material, Vec3::ONE, 1.0)
        };
        // ((n − 1) / (n + 1))²: 0.04 for glass, 0.02 for water, 1 for the mirror that KHR_materials_ior writes as 0.
        assert!((f0(1.5, 1.0, Vec3::ONE) - 0.04).abs().max_element() < 1e-6);
        assert!((f0(1.333, 1.0, Vec3::ONE) - 0.0204).abs().max_element() < 1e-4);
        assert_eq!(f0(0.0, 1.0, Vec3::ONE), Vec3::ONE);
        // The colour is clamped at one before the weight applies.
        assert!((f0(1.5, 0.5, Vec3::new(0.5, 1.0, 100.0)) - Vec3::new(0.01, 0.02, 0.5)).abs().max_element() < 1e-6);
    }
}
