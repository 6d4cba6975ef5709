//! Conversion of the textures of `KHR_materials_pbrSpecularGlossiness`, texel by texel, as Khronos's converter does it.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::{Image, TextureRef, linear_from_srgb};

/// Reflectance at normal incidence of the dielectric part.
const DIELECTRIC: f32 = 0.04;

/// A material whose textures are converted when they are decoded.
pub(super) struct Glossy {
    /// Index of the material among those that the scene uses.
    pub material: usize,
    /// sRGB specular colour, and glossiness as alpha.
    pub texture: TextureRef,
    pub diffuse: Vec3,
    pub specular: Vec3,
    pub glossiness: f32,
}

impl Glossy {
    /// Memory that the converted images take, bytes.
    pub fn bytes_needed(diffuse: Option<&Image>, specular: &Image) -> u64 {
        let [width, height] = size(diffuse, specular);
        8 * u64::from(width) * u64::from(height)
    }

    /// The images of the base colour, whose alpha is that of the diffuse one, and of metallic and roughness. The smaller image is
    /// resampled (nearest texel).
    pub fn convert(&self, diffuse: Option<&Image>, specular: &Image) -> [Image; 2] {
        let [width, height] = size(diffuse, specular);
        let texel = |image: &Image, i: usize| {
            let x = i % width as usize * image.width as usize / width as usize;
            let y = i / width as usize * image.height as usize / height as usize;
            image.rgba.as_chunks::<4>().0[y * image.width as usize + x]
        };
        let linear = |[r, g, b, a]: [u8; 4]| {
            Vec4::new(linear_from_srgb(r), linear_from_srgb(g), linear_from_srgb(b), f32::from(a) / 255.0)
        };
        let byte = |value: f32| (255.0 * value).round() as u8;
        let convert = |i: usize| {
            let diffuse = diffuse.map_or(Vec4::ONE, |image| linear(texel(image, i)));
            let specular = linear(texel(specular, i));
            let (color, metallic) =
                metal_and_color(self.diffuse * diffuse.truncate(), self.specular * specular.truncate());
            let [r, g, b] = color.to_array().map(|value| byte(encoded(value)));
            let roughness = 1.0 - self.glossiness * specular.w;
            ([r, g, b, byte(diffuse.w)], [0, byte(roughness), byte(metallic), 255])
        };
        let (colors, roughness): (Vec<_>, Vec<_>) =
            (0..width as usize * height as usize).into_par_iter().map(convert).unzip();
        [colors, roughness].map(|texels| Image {
            name: specular.name.clone(),
            width,
            height,
            rgba: texels.into_flattened(),
        })
    }
}

/// Size of the converted images: the larger one's along each axis.
fn size(diffuse: Option<&Image>, specular: &Image) -> [u32; 2] {
    let [width, height] = diffuse.map_or([0; 2], |image| [image.width, image.height]);
    [width.max(specular.width), height.max(specular.height)]
}

/// Base colour and metallic factor that reflect and scatter about as these colours do.
fn metal_and_color(diffuse: Vec3, specular: Vec3) -> (Vec3, f32) {
    let brightness = |color: Vec3| (color * color).dot(Vec3::new(0.299, 0.587, 0.114)).sqrt();
    let scattered = 1.0 - specular.max_element();
    // Metallic m solves: (1 - m) 0.04 + m base = specular, and base (1 - m) 0.96 = diffuse (1 - specular).
    let (of_diffuse, of_specular) = (brightness(diffuse), brightness(specular));
    let half = 0.5 * (of_diffuse * scattered / (1.0 - DIELECTRIC) + of_specular - 2.0 * DIELECTRIC);
    let root = (half * half - DIELECTRIC * (DIELECTRIC - of_specular)).max(0.0).sqrt();
    let metallic = if of_specular < DIELECTRIC { 0.0 } else { ((root - half) / DIELECTRIC).clamp(0.0, 1.0) };
    let as_dielectric = diffuse * (scattered / (1.0 - DIELECTRIC) / (1.0 - metallic).max(1e-6));
    let as_metal = (specular - DIELECTRIC * (1.0 - metallic)) / metallic.max(1e-6);
    (as_dielectric.lerp(as_metal, metallic * metallic).clamp(Vec3::ZERO, Vec3::ONE), metallic)
}

/// The sRGB encoding of a linear value in 0..=1.
fn encoded(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metals_and_dielectrics_are_told_apart_texel_by_texel() {
        let image = |width, rgba: &[[u8; 4]]| Image { name: String::new(), width, height: 1, rgba: rgba.concat() };
        let diffuse = image(2, &[[0, 0, 0, 255], [188, 90, 30, 128]]);
        let specular = image(4, &[[255, 200, 100, 255], [255, 200, 100, 0], [56, 56, 56, 128], [20, 20, 20, 51]]);
        let glossy = Glossy {
            material: 0,
            texture: TextureRef::new(0),
            diffuse: Vec3::ONE,
            specular: Vec3::ONE,
            glossiness: 0.8,
        };
        let [color, roughness] = glossy.convert(Some(&diffuse), &specular);
        let texels = |image: &Image| image.rgba.as_chunks::<4>().0.to_vec();
        assert_eq!(texels(&roughness)[..2], [[0, 51, 255, 255], [0, 255, 255, 255]]);
        assert_eq!(texels(&color)[..2], [[255, 200, 100, 255]; 2]);
        // 56 is a reflectance of 0.04, of glass; less is glass, too.
        assert_eq!((texels(&roughness)[2], texels(&roughness)[3][1..3].to_vec()), ([0, 153, 0, 255], vec![214, 0]));
        assert!(texels(&color)[2].iter().zip([188u8, 90, 30, 128]).all(|(is, was)| is.abs_diff(was) <= 1));
        assert_eq!(Glossy::bytes_needed(Some(&diffuse), &specular), 32);
    }
}
