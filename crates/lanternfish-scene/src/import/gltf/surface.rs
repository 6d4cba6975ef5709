//! Material extensions beyond metallic-roughness and emission.

use glam::{Vec3, Vec4};

use super::fault::Result;
use super::glossiness::Glossy;
use super::notes::Notes;
use super::schema::{MaterialExtensions, Root, SpecularGlossiness, TextureInfo};
use super::textures::Textures;
use crate::{Material, TextureRef};

/// Reflectance at normal incidence of a dielectric with IOR 1.5, which `specular_color` multiplies.
const DIELECTRIC_REFLECTANCE: f32 = 0.04;

/// Applies the supported extensions but those of [`super::lobes`] to a material that holds the core's values; notes the unsupported ones.
pub(super) fn apply(
    root: &Root,
    extensions: &MaterialExtensions,
    material: &mut Material,
    textures: &mut Textures,
    notes: &mut Notes,
) -> Result<()> {
    let mut texture = |info: Option<&TextureInfo>, notes: &mut Notes| match info {
        Some(info) => textures.add(root, info, notes),
        None => Ok(None),
    };
    if let Some(ior) = extensions.ior.as_ref().and_then(|extension| extension.ior) {
        // 0 is allowed and means full reflection; values between 0 and 1 are invalid.
        material.ior = if ior == 0.0 { 0.0 } else { ior.clamp(1.0, f32::MAX) };
    }
    if let Some(specular) = &extensions.specular {
        material.specular = specular.specular_factor.unwrap_or(1.0).clamp(0.0, 1.0);
        material.specular_color =
            specular.specular_color_factor.map_or(Vec3::ONE, Vec3::from).clamp(Vec3::ZERO, Vec3::MAX);
        material.specular_texture = texture(specular.specular_texture.as_ref(), notes)?;
        material.specular_color_texture = texture(specular.specular_color_texture.as_ref(), notes)?;
    }
    if let Some(coat) = &extensions.clearcoat
        && let factor = coat.clearcoat_factor.clamp(0.0, 1.0)
        && factor > 0.0
    {
        material.clearcoat = factor;
        material.clearcoat_texture = texture(coat.clearcoat_texture.as_ref(), notes)?;
        material.clearcoat_roughness = coat.clearcoat_roughness_factor.clamp(0.0, 1.0);
        material.clearcoat_roughness_texture = texture(coat.clearcoat_roughness_texture.as_ref(), notes)?;
        let normal = coat.clearcoat_normal_texture.as_ref();
        material.clearcoat_normal_texture = texture(normal.map(|normal| &normal.info), notes)?;
        material.clearcoat_normal_scale =
            normal.and_then(|normal| normal.scale).unwrap_or(1.0).clamp(f32::MIN, f32::MAX);
    }
    if let Some(transmission) = &extensions.transmission
        && let factor = transmission.transmission_factor.clamp(0.0, 1.0)
        && factor > 0.0
    {
        material.transmission_texture = texture(transmission.transmission_texture.as_ref(), notes)?;
        // Metal transmits nothing; a texture may make parts of the surface dielectric.
        if material.metallic < 1.0 || material.metallic_roughness_texture.is_some() {
            material.transmission = factor;
        }
    }
    if let Some(through) = &extensions.diffuse_transmission
        && let factor = through.diffuse_transmission_factor.clamp(0.0, 1.0)
        && factor > 0.0
    {
        material.diffuse_transmission = factor;
        material.diffuse_transmission_texture = texture(through.diffuse_transmission_texture.as_ref(), notes)?;
        let color = through.diffuse_transmission_color_factor.map_or(Vec3::ONE, Vec3::from);
        material.diffuse_transmission_color = color.clamp(Vec3::ZERO, Vec3::ONE);
        material.diffuse_transmission_color_texture =
            texture(through.diffuse_transmission_color_texture.as_ref(), notes)?;
        if material.is_transparent() {
            notes.add("diffuse transmission of transparent surfaces");
        }
    }
    if let Some(volume) = &extensions.volume
        && let thickness = volume.thickness_factor.clamp(0.0, f32::MAX)
        && thickness > 0.0
    {
        if volume.thickness_texture.is_some() {
            notes.add("textures of KHR_materials_volume");
        }
        material.thickness = thickness;
        material.attenuation_color =
            volume.attenuation_color.map_or(Vec3::ONE, Vec3::from).clamp(Vec3::ZERO, Vec3::ONE);
        material.attenuation_distance = volume.attenuation_distance.unwrap_or(f32::INFINITY).max(f32::MIN_POSITIVE);
    }
    if let Some(extension) = &extensions.dispersion {
        material.dispersion = extension.dispersion.clamp(0.0, f32::MAX);
    }
    Ok(())
}

/// Replaces the core's surface by that of `KHR_materials_pbrSpecularGlossiness`, as a dielectric: diffuse becomes the
/// base colour, and specular the reflectance at normal incidence.
///
/// With a specular-glossiness texture the surface is converted when the texture is decoded ([`Glossy`]). The factors have no
/// meaning without it: until then the reflectance is that of glass, and the glossiness is halved.
pub(super) fn convert(
    root: &Root,
    source: &SpecularGlossiness,
    (index, material): (usize, &mut Material),
    textures: &mut Textures,
    notes: &mut Notes,
) -> Result<()> {
    let mut texture = |info: Option<&TextureInfo>| match info {
        Some(info) => textures.add(root, info, notes),
        None => Ok(None),
    };
    material.base_color = source.diffuse_factor.map_or(Vec4::ONE, Vec4::from).clamp(Vec4::ZERO, Vec4::ONE);
    material.base_color_texture = texture(source.diffuse_texture.as_ref())?;
    material.metallic = 0.0;
    material.metallic_roughness_texture = None;
    let glossiness = source.glossiness_factor.unwrap_or(1.0).clamp(0.0, 1.0);
    let specular = source.specular_factor.map_or(Vec3::ONE, Vec3::from).clamp(Vec3::ZERO, Vec3::ONE);
    if source.specular_glossiness_texture.is_some() {
        material.perceptual_roughness = 1.0 - 0.5 * glossiness;
        let Some(texture) = texture(source.specular_glossiness_texture.as_ref())? else { return Ok(()) };
        let is_beside = |other: TextureRef| TextureRef { texture: other.texture, ..texture } == other;
        if material.base_color_texture.is_none_or(is_beside) {
            let diffuse = material.base_color.truncate();
            textures.glossy.push(Glossy { material: index, texture, diffuse, specular, glossiness });
        } else {
            notes.add("specular-glossiness textures that are placed otherwise than the diffuse ones");
        }
        return Ok(());
    }
    material.perceptual_roughness = 1.0 - glossiness;
    material.specular_color = specular / DIELECTRIC_REFLECTANCE;
    // Energy conservation as in the extension: reflected light is not scattered diffusely.
    material.base_color *= (Vec3::ONE - specular.max_element()).extend(1.0);
    Ok(())
}
