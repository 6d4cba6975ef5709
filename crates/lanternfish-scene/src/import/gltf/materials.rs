//! Import of materials.

use glam::{Vec3, Vec4};

use super::fault::{Place, Result};
use super::notes::Notes;
use super::schema::{self, MetallicRoughness, Root, TextureInfo};
use super::textures::Textures;
use super::{lobes, surface};
use crate::{AlphaMode, Material};

/// The file's material `index`; its textures are added to `textures`. Factors outside the format's range are clamped.
/// `kept`: the index that it gets in the scene.
pub(super) fn read(
    root: &Root,
    index: usize,
    kept: usize,
    textures: &mut Textures,
    notes: &mut Notes,
) -> Result<Material> {
    read_material(root, &root.materials[index], kept, textures, notes).place(|| format!("materials[{index}]"))
}

fn read_material(
    root: &Root,
    material: &schema::Material,
    kept: usize,
    textures: &mut Textures,
    notes: &mut Notes,
) -> Result<Material> {
    let no_surface = MetallicRoughness::default();
    let surface = material.pbr_metallic_roughness.as_ref().unwrap_or(&no_surface);
    let (normal, occlusion) = (&material.normal_texture, &material.occlusion_texture);
    let strength = material.extensions.emissive_strength.as_ref().and_then(|extension| extension.emissive_strength);
    let alpha_mode = match material.alpha_mode.as_deref() {
        Some("OPAQUE") | None => AlphaMode::Opaque,
        Some("MASK") => AlphaMode::Mask { cutoff: material.alpha_cutoff.unwrap_or(0.5) },
        Some("BLEND") => AlphaMode::Blend,
        Some(_) => {
            notes.add("alpha modes of unknown value");
            AlphaMode::Opaque
        }
    };
    let mut texture = |info: Option<&TextureInfo>| match info {
        Some(info) => textures.add(root, info, notes),
        None => Ok(None),
    };
    let mut read = Material {
        name: material.name.clone(),
        base_color: surface.base_color_factor.map_or(Vec4::ONE, Vec4::from).clamp(Vec4::ZERO, Vec4::ONE),
        base_color_texture: texture(surface.base_color_texture.as_ref())?,
        metallic: surface.metallic_factor.unwrap_or(1.0).clamp(0.0, 1.0),
        perceptual_roughness: surface.roughness_factor.unwrap_or(1.0).clamp(0.0, 1.0),
        metallic_roughness_texture: texture(surface.metallic_roughness_texture.as_ref())?,
        normal_texture: texture(normal.as_ref().map(|normal| &normal.info))?,
        normal_scale: normal.as_ref().and_then(|normal| normal.scale).unwrap_or(1.0).clamp(f32::MIN, f32::MAX),
        occlusion_texture: texture(occlusion.as_ref().map(|occlusion| &occlusion.info))?,
        occlusion_strength: occlusion.as_ref().and_then(|occlusion| occlusion.strength).unwrap_or(1.0).clamp(0.0, 1.0),
        emissive: (Vec3::from(material.emissive_factor) * strength.unwrap_or(1.0)).clamp(Vec3::ZERO, Vec3::MAX),
        emissive_texture: texture(material.emissive_texture.as_ref())?,
        alpha_mode,
        double_sided: material.double_sided,
        unlit: material.extensions.unlit.is_some(),
        ..Material::default()
    };
    // If the file also has core values, those are the author's own conversion.
    if let Some(source) = &material.extensions.specular_glossiness
        && (material.pbr_metallic_roughness.is_none() || is_required(root, "KHR_materials_pbrSpecularGlossiness"))
    {
        surface::convert(root, source, (kept, &mut read), textures, notes)?;
    }
    // Unlit materials have no other extensions.
    if !read.unlit {
        surface::apply(root, &material.extensions, &mut read, textures, notes)?;
        lobes::apply(root, &material.extensions, (kept, &mut read), textures, notes)?;
    }
    Ok(read)
}

fn is_required(root: &Root, extension: &str) -> bool {
    root.extensions_required.iter().any(|name| name == extension)
}
