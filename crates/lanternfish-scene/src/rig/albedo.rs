//! How dark a scene's materials are, and the exposure that shows their shapes.

use glam::{Vec2, Vec3};

use super::luminance;
use crate::{Material, Primitive, Scene, linear_from_srgb};

/// Mean base colour below which objects are dark: their shades are hardly distinct at 0 EV.
const DARK: f32 = 0.05;
/// The most that dark objects are brightened, EV.
const MOST: f32 = 2.0;
/// Base colour from which a surface is bright, and the fraction of all that may be: with more, a longer exposure would whiten what is seen.
const BRIGHT: f32 = 0.4;
const MOST_BRIGHT: f64 = 0.02;
/// Barycentric coordinates of the points of a triangle that are read.
const POINTS: [Vec3; 4] =
    [Vec3::splat(1.0 / 3.0), Vec3::new(0.8, 0.1, 0.1), Vec3::new(0.1, 0.8, 0.1), Vec3::new(0.1, 0.1, 0.8)];
/// Largest number of triangles of a primitive that are read, evenly spaced.
const MOST_TRIANGLES: usize = 1 << 12;

/// Exposure at which the studio shows a scene's materials, EV in steps of 1/8: 0, or up to 2 if their mean base colour is below 0.05
/// and hardly any is bright.
pub fn exposure(scene: &Scene) -> f32 {
    let ev = mean_of_dark(scene).map_or(0.0, |mean| (DARK / mean).log2().clamp(0.0, MOST));
    (8.0 * ev).round() / 8.0
}

/// Mean luminance of the base colours of all surfaces that are not transparent, by area; `None` if there are none, or bright ones among them.
/// Surfaces that need no light count as white.
fn mean_of_dark(scene: &Scene) -> Option<f32> {
    let (mut sum, mut area, mut bright) = (0.0f64, 0.0f64, 0.0f64);
    for instance in &scene.instances {
        for primitive in &scene.meshes[instance.mesh].primitives {
            let material = &scene.materials[primitive.material];
            if material.is_transparent() {
                continue;
            }
            let triangles = primitive.indices.as_chunks::<3>().0;
            let step = triangles.len().div_ceil(MOST_TRIANGLES).max(1);
            for corners in triangles.iter().step_by(step).map(|corners| corners.map(|i| i as usize)) {
                let [a, b, c] = corners.map(|i| instance.world_from_object.transform_point3(primitive.positions[i]));
                let weight = step as f64 * f64::from((b - a).cross(c - a).length());
                for at in POINTS {
                    let color = luminance(base_color(scene, material, primitive, corners, at));
                    sum += weight * f64::from(color) / POINTS.len() as f64;
                    bright += if color > BRIGHT { weight / POINTS.len() as f64 } else { 0.0 };
                }
                area += weight;
            }
        }
    }
    (area > 0.0 && bright <= MOST_BRIGHT * area).then_some((sum / area) as f32)
}

/// The base colour at these barycentric coordinates of a triangle: that of the nearest texel.
fn base_color(scene: &Scene, material: &Material, primitive: &Primitive, corners: [usize; 3], at: Vec3) -> Vec3 {
    let weights = at.to_array();
    if material.unlit {
        return Vec3::ONE;
    }
    let mut color = material.base_color.truncate();
    if !primitive.colors.is_empty() {
        color *= corners.iter().zip(weights).map(|(i, weight)| weight * primitive.colors[*i].truncate()).sum::<Vec3>();
    }
    let Some(map) = material.base_color_texture else { return color };
    let uvs = if map.uv_set == 0 { &primitive.uv0 } else { &primitive.uv1 };
    let uv = |i: usize| uvs.get(i).copied().unwrap_or_default();
    let uv = corners.iter().zip(weights).map(|(i, weight)| weight * uv(*i)).sum::<Vec2>();
    let uv = map.texture_from_uv.transform_point2(uv);
    let image = &scene.images[scene.textures[map.texture].image];
    // Casts to integers saturate.
    let place = |x: f32, size: u32| ((x.rem_euclid(1.0) * size as f32) as usize).min(size as usize - 1);
    let index = place(uv.y, image.height) * image.width as usize + place(uv.x, image.width);
    let [r, g, b, _] = image.rgba.as_chunks::<4>().0[index];
    color * Vec3::from([r, g, b].map(linear_from_srgb))
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;
    use crate::{Image, Instance, Mesh, Sampler, Texture, TextureRef};

    /// A square whose left half is `left`, as a texture, and whose right half is white glass.
    fn square(left: [u8; 3], material: Material) -> Scene {
        let quad = |material, x: f32| Primitive {
            material,
            positions: [[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0], [x, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0)).into(),
            uv0: [[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [0.0, 1.0]].map(Vec2::from).into(),
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        };
        let [r, g, b] = left;
        let image = Image { width: 2, height: 1, rgba: vec![r, g, b, 255, 255, 255, 255, 255], ..Image::default() };
        let glass = Material { transmission: 1.0, ..Material::default() };
        Scene {
            materials: vec![Material { base_color_texture: Some(TextureRef::new(0)), ..material }, glass],
            meshes: vec![Mesh { primitives: vec![quad(0, 0.0), quad(1, 1.0)], ..Mesh::default() }],
            instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: glam::Affine3A::IDENTITY }],
            textures: vec![Texture { image: 0, sampler: 0 }],
            samplers: vec![Sampler::default()],
            images: vec![image],
            ..Scene::default()
        }
    }

    #[test]
    fn dark_materials_are_exposed_longer() {
        let of = |left, material| exposure(&square(left, material));
        let tinted =
            |factor: f32| Material { base_color: Vec4::new(factor, factor, factor, 1.0), ..Material::default() };
        assert_eq!((of([255; 3], tinted(1.0)), of([255; 3], tinted(0.05))), (0.0, 0.0));
        assert_eq!((of([255; 3], tinted(0.025)), of([0; 3], tinted(1.0))), (1.0, 2.0));
        // 63 of 255 is 0.05; the texture's white half is not shown.
        assert_eq!((of([63; 3], tinted(1.0)), of([63; 3], tinted(0.5))), (0.0, 1.0));
        assert_eq!(of([0; 3], Material { unlit: true, ..tinted(1.0) }), 0.0);
        // A label: a white square of 4 % or 1 % of the area beside a black one.
        let with_label = |scale: f32| {
            let mut scene = square([0; 3], tinted(1.0));
            scene.materials.push(Material::default());
            let label = Primitive { material: 2, ..scene.meshes[0].primitives[0].clone() };
            scene.meshes.push(Mesh { primitives: vec![label], ..Mesh::default() });
            let world_from_object = glam::Affine3A::from_scale(Vec3::splat(scale));
            scene.instances.push(Instance { name: String::new(), mesh: 1, world_from_object });
            exposure(&scene)
        };
        assert_eq!((with_label(0.2), with_label(0.1)), (0.0, 2.0));
        let mut dark = square([0; 3], tinted(1.0));
        dark.meshes[0].primitives[0].material = 1;
        assert_eq!(exposure(&dark), 0.0, "all is glass");
        dark.instances.clear();
        assert_eq!(exposure(&dark), 0.0);
    }
}
