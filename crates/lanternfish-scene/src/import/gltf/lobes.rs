//! Sheen, anisotropy and iridescence. A factor is multiplied by its texture's mean where renderers have no place for the texture.

use glam::{Vec2, Vec3, Vec4};

use super::fault::Result;
use super::notes::Notes;
use super::schema::{MaterialExtensions, Root, TextureInfo};
use super::textures::Textures;
use crate::{Image, Material, TextureRef, linear_from_srgb};

/// Applies a mean texel to a material.
type Apply = fn(&mut Material, Vec4);

/// The mean of a texture to be applied to a material.
pub(super) struct Mean {
    /// Index of the material among those that the scene uses.
    material: usize,
    /// Index of the texture.
    texture: usize,
    /// True if red, green and blue are sRGB-encoded.
    is_srgb: bool,
    apply: Apply,
}

impl Mean {
    /// Index of the texture.
    pub fn texture(&self) -> usize {
        self.texture
    }

    /// Applies the mean of `image`.
    pub fn apply(&self, materials: &mut [Material], image: &Image) {
        (self.apply)(&mut materials[self.material], mean_of(image, self.is_srgb));
    }
}

/// Mean of an image's texels, RGBA in 0..=1; red, green and blue are linear if they were `is_srgb`.
fn mean_of(image: &Image, is_srgb: bool) -> Vec4 {
    // A sum over values, of which there are 256, is exact for any number of texels.
    let mut counts = [[0u64; 256]; 4];
    for texel in image.rgba.as_chunks::<4>().0 {
        (0..4).for_each(|channel| counts[channel][usize::from(texel[channel])] += 1);
    }
    let texels = image.rgba.len().max(4) as f64 / 4.0;
    Vec4::from_array(std::array::from_fn(|channel| {
        let linear = |value: usize| match is_srgb && channel < 3 {
            true => f64::from(linear_from_srgb(value as u8)),
            false => value as f64 / 255.0,
        };
        let sum: f64 = (0..256).map(|value| linear(value) * counts[channel][value] as f64).sum();
        (sum / texels) as f32
    }))
}

/// Applies the extensions to `material`, which has its clear coat, and whose index in the scene is `index`.
pub(super) fn apply(
    root: &Root,
    extensions: &MaterialExtensions,
    (index, material): (usize, &mut Material),
    textures: &mut Textures,
    notes: &mut Notes,
) -> Result<()> {
    let mut texture = |info: &Option<TextureInfo>| match info {
        Some(info) => textures.add(root, info, notes),
        None => Ok(None),
    };
    if let Some(sheen) = &extensions.sheen
        && let color = Vec3::from(sheen.sheen_color_factor).clamp(Vec3::ZERO, Vec3::ONE)
        && color != Vec3::ZERO
    {
        (material.sheen_color, material.sheen_roughness) = (color, sheen.sheen_roughness_factor.clamp(0.0, 1.0));
        material.sheen_color_texture = texture(&sheen.sheen_color_texture)?;
        material.sheen_roughness_texture = texture(&sheen.sheen_roughness_texture)?;
    }
    if let Some(grain) = &extensions.anisotropy
        && let strength = grain.anisotropy_strength.clamp(0.0, 1.0)
        && strength > 0.0
    {
        (material.anisotropy, material.anisotropy_rotation) = (strength, finite(grain.anisotropy_rotation));
        material.anisotropy_texture = texture(&grain.anisotropy_texture)?;
    }
    if let Some(film) = &extensions.iridescence
        && let factor = film.iridescence_factor.clamp(0.0, 1.0)
        && factor > 0.0
    {
        let thickness = |nm: Option<f32>, otherwise: f32| finite(nm.unwrap_or(otherwise)).clamp(0.0, 1e6);
        material.iridescence = factor;
        material.iridescence_texture = texture(&film.iridescence_texture)?;
        material.iridescence_ior = film.iridescence_ior.unwrap_or(1.3).clamp(1.0, 10.0);
        material.iridescence_thickness = thickness(film.iridescence_thickness_maximum, 400.0);
        material.iridescence_thickness_minimum = thickness(film.iridescence_thickness_minimum, 100.0);
        material.iridescence_thickness_texture = texture(&film.iridescence_thickness_texture)?;
    }
    let sampled = material.layer_textures();
    let mut replace = |slot: &mut Option<TextureRef>, sampled: Option<TextureRef>, is_srgb, apply: Apply| {
        if sampled.is_none()
            && let Some(reference) = slot.take()
        {
            notes.add("details of textures of sheen, anisotropy and iridescence, whose means are used");
            textures.means.push(Mean { material: index, texture: reference.texture, is_srgb, apply });
        }
    };
    replace(&mut material.sheen_color_texture, sampled.sheen_color, true, |material, texel| {
        material.sheen_color *= texel.truncate();
    });
    replace(&mut material.sheen_roughness_texture, sampled.sheen_roughness, false, |material, texel| {
        material.sheen_roughness *= texel.w;
    });
    replace(&mut material.anisotropy_texture, sampled.anisotropy, false, |material, texel| {
        // Red and green are the direction, in -1..=1; directions that differ weaken their mean.
        let along = 2.0 * Vec2::new(texel.x, texel.y) - 1.0;
        material.anisotropy *= (texel.z * along.length()).min(1.0);
        material.anisotropy_rotation += if along == Vec2::ZERO { 0.0 } else { along.to_angle() };
    });
    replace(&mut material.iridescence_texture, sampled.iridescence, false, |material, texel| {
        material.iridescence *= texel.x;
    });
    replace(&mut material.iridescence_thickness_texture, sampled.iridescence_thickness, false, |material, texel| {
        let [least, most] = [material.iridescence_thickness_minimum, material.iridescence_thickness];
        material.iridescence_thickness = least + (most - least) * texel.y;
    });
    Ok(())
}

fn finite(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}
