//! Mean emission of a textured surface: an estimate for importance sampling of emitters.

use glam::{Vec2, Vec3};

use crate::{Image, Material, Primitive, Scene, linear_from_srgb};

/// Texture samples per triangle along each parameter.
const STEPS: u32 = 4;
/// Minimum, as a fraction of the untextured emission, so that triangles whose samples are all black are still selected, rarely.
const LEAST_FRACTION: f32 = 0.01;

/// Mean emitted radiance of a triangle of `primitive`, brightest channel, over its area and texture, nits. Positive if the material
/// is emissive. `corners`: the triangle's vertex indices.
pub fn mean_emission(scene: &Scene, primitive: &Primitive, material: &Material, corners: [usize; 3]) -> f32 {
    let most = material.emissive.max_element();
    let Some(reference) = &material.emissive_texture else { return most };
    let image = &scene.images[scene.textures[reference.texture].image];
    let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
    let uv = corners.map(|i| reference.texture_from_uv.transform_point2(set.get(i).copied().unwrap_or_default()));
    let mut sum = 0.0;
    for i in 0..STEPS * STEPS {
        // Uniform over the area.
        let (u, v) = ((i % STEPS) as f32 + 0.5, (i / STEPS) as f32 + 0.5);
        let (root, v) = ((u / STEPS as f32).sqrt(), v / STEPS as f32);
        let position = (1.0 - root) * uv[0] + root * (1.0 - v) * uv[1] + root * v * uv[2];
        sum += (material.emissive * nearest_texel(image, position)).max_element() / (STEPS * STEPS) as f32;
    }
    sum.max(LEAST_FRACTION * most)
}

fn nearest_texel(image: &Image, uv: Vec2) -> Vec3 {
    let within = uv - uv.floor();
    let x = ((within.x * image.width as f32) as usize).min(image.width as usize - 1);
    let y = ((within.y * image.height as f32) as usize).min(image.height as usize - 1);
    let at = 4 * (y * image.width as usize + x);
    Vec3::from_array(std::array::from_fn(|c| linear_from_srgb(image.rgba[at + c])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Sampler, Texture, TextureRef};

    #[test]
    fn a_texture_scales_a_triangles_emission() {
        let mut scene = Scene { samplers: vec![Sampler::default()], ..Scene::default() };
        scene.images.push(Image { name: String::new(), width: 2, height: 1, rgba: vec![255, 0, 0, 255, 0, 0, 0, 255] });
        scene.textures.push(Texture { image: 0, sampler: 0 });
        let at = |u: [f32; 3]| Primitive { uv0: u.map(|u| Vec2::new(u, 0.5)).to_vec(), ..Primitive::default() };
        let mut lamp = Material { emissive: Vec3::new(8.0, 20.0, 2.0), ..Material::default() };
        let mean = |lamp: &Material, u| mean_emission(&scene, &at(u), lamp, [0, 1, 2]);
        let is_near = |actual: f32, expected: f32| (actual / expected - 1.0).abs() < 1e-5;
        assert!(is_near(mean(&lamp, [0.0; 3]), 20.0));
        lamp.emissive_texture = Some(TextureRef::new(0));
        assert!(is_near(mean(&lamp, [0.2; 3]), 8.0) && is_near(mean(&lamp, [0.7; 3]), 0.2));
        // From u = 0 at the first corner to 1 at the opposite edge: half way is a quarter of the area.
        assert!((mean(&lamp, [0.0, 1.0, 1.0]) - 2.0).abs() < 0.1);
        // The largest emission does not overflow.
        lamp.emissive = Vec3::MAX;
        assert!(mean(&lamp, [0.2; 3]).is_finite());
    }
}
