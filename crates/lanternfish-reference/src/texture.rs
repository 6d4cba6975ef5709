//! Texture sampling at the finest mip level.

use glam::{Vec2, Vec4};
use lanternfish_scene::{Filter, Image, Primitive, Scene, TextureRef, Wrap};

/// Linear value of an sRGB byte (IEC 61966-2-1).
pub(crate) struct Srgb([f32; 256]);

impl Srgb {
    pub fn new() -> Self {
        Self(std::array::from_fn(|byte| {
            let encoded = byte as f64 / 255.0;
            let linear = if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) };
            linear as f32
        }))
    }
}

/// How texels are stored.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Encoding {
    /// Red, green and blue as sRGB, alpha linear.
    Srgb,
    Linear,
}

/// Texture coordinates of `reference` at a point of a triangle.
pub(crate) fn coordinates(reference: &TextureRef, primitive: &Primitive, corners: [u32; 3], weights: [f32; 3]) -> Vec2 {
    let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
    let at = |corner: usize| set.get(corners[corner] as usize).copied().unwrap_or_default() * weights[corner];
    reference.texture_from_uv.transform_point2(at(0) + at(1) + at(2))
}

/// Samples the texture at `uv` with its sampler's magnification filter.
pub(crate) fn sample(scene: &Scene, srgb: &Srgb, reference: &TextureRef, encoding: Encoding, uv: Vec2) -> Vec4 {
    let texture = scene.textures[reference.texture];
    let (image, sampler) = (&scene.images[texture.image], scene.samplers[texture.sampler]);
    let fetch = |x: f32, y: f32| {
        let x = wrap(sampler.wrap_u, x, image.width);
        let y = wrap(sampler.wrap_v, y, image.height);
        texel(image, srgb, encoding, x, y)
    };
    let position = uv * Vec2::new(image.width as f32, image.height as f32);
    if sampler.mag == Filter::Nearest {
        return fetch(position.x.floor(), position.y.floor());
    }
    let position = position - 0.5;
    let first = position.floor();
    let part = position - first;
    let top = fetch(first.x, first.y).lerp(fetch(first.x + 1.0, first.y), part.x);
    let bottom = fetch(first.x, first.y + 1.0).lerp(fetch(first.x + 1.0, first.y + 1.0), part.x);
    top.lerp(bottom, part.y)
}

/// Applies a wrap mode to the texel coordinate `at` of an axis with `size` texels.
fn wrap(mode: Wrap, at: f32, size: u32) -> u32 {
    // Coordinates beyond the range of i64 have no fractional precision, so any texel is acceptable.
    let (at, size) = (at as i64, i64::from(size));
    let at = match mode {
        Wrap::Repeat => at.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let at = at.rem_euclid(2 * size);
            at.min(2 * size - 1 - at)
        }
        Wrap::ClampToEdge => at.clamp(0, size - 1),
    };
    at as u32
}

fn texel(image: &Image, srgb: &Srgb, encoding: Encoding, x: u32, y: u32) -> Vec4 {
    let first = 4 * (y as usize * image.width as usize + x as usize);
    let bytes = &image.rgba[first..first + 4];
    let alpha = f32::from(bytes[3]) / 255.0;
    let [red, green, blue] = [bytes[0], bytes[1], bytes[2]].map(|byte| match encoding {
        Encoding::Srgb => srgb.0[byte as usize],
        Encoding::Linear => f32::from(byte) / 255.0,
    });
    Vec4::new(red, green, blue, alpha)
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::{Sampler, Texture};

    use super::*;

    /// Two by one texels: red 0 and 255.
    fn scene(sampler: Sampler) -> Scene {
        let image = Image { name: String::new(), width: 2, height: 1, rgba: vec![0, 0, 0, 255, 255, 0, 0, 51] };
        Scene {
            images: vec![image],
            samplers: vec![sampler],
            textures: vec![Texture { image: 0, sampler: 0 }],
            ..Scene::default()
        }
    }

    fn red(sampler: Sampler, u: f32) -> f32 {
        sample(&scene(sampler), &Srgb::new(), &TextureRef::new(0), Encoding::Linear, Vec2::new(u, 0.5)).x
    }

    #[test]
    fn texels_are_interpolated_between_centres_and_wrapped() {
        let linear = Sampler::default();
        // Centres are at 0.25 and 0.75; the image repeats between 0.75 and 1.25.
        for (u, value) in [(0.25, 0.0), (0.75, 1.0), (0.5, 0.5), (0.0, 0.5), (1.25, 0.0), (-0.25, 1.0), (0.9375, 0.625)]
        {
            assert!((red(linear, u) - value).abs() < 1e-6, "{u}: {}", red(linear, u));
        }
        let clamped = Sampler { wrap_u: Wrap::ClampToEdge, ..linear };
        assert_eq!((red(clamped, -3.0), red(clamped, 9.0)), (0.0, 1.0));
        let mirrored = Sampler { wrap_u: Wrap::MirroredRepeat, ..linear };
        assert_eq!((red(mirrored, 1.25), red(mirrored, 1.75), red(mirrored, -0.25)), (1.0, 0.0, 0.0));
        let nearest = Sampler { mag: Filter::Nearest, ..linear };
        assert_eq!((red(nearest, 0.49), red(nearest, 0.51)), (0.0, 1.0));
    }

    #[test]
    fn srgb_is_decoded_before_filtering_and_alpha_is_linear() {
        let scene = scene(Sampler::default());
        let at = |u| sample(&scene, &Srgb::new(), &TextureRef::new(0), Encoding::Srgb, Vec2::new(u, 0.5));
        assert!((at(0.5).x - 0.5).abs() < 1e-6 && (at(0.75).w - 0.2).abs() < 1e-6);
        assert!((Srgb::new().0[188] - 0.502_886_5).abs() < 1e-6, "{}", Srgb::new().0[188]);
    }
}
