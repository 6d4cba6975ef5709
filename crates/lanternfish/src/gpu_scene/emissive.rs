//! The triangles that shine, as the light tree knows them.

use glam::{Mat3, Vec2, Vec3};
use lanternfish_scene::{Image, Material, Primitive, Scene, light_tree::Emitter};
use rayon::prelude::*;

use super::{
    Shading,
    hits::turn_of,
    mips::linear_from_srgb,
    tracing::{Part, Source, TracedTriangle},
};
use crate::lights::tree::EmissiveTriangle;

/// Places at which the emission of a textured triangle is estimated, an edge.
const STEPS: u32 = 4;
/// What the places miss is still found, rarely: by this share of what the texture could send.
const LEAST_SHARE: f32 = 0.01;

/// What of a material decides which triangles shine: emission, from both sides, unlit.
pub type Shining = (Vec3, bool, bool);

/// Of every material.
pub fn shining(scene: &Scene) -> Vec<Shining> {
    scene.materials.iter().map(|material| (material.emissive, material.double_sided, material.unlit)).collect()
}

/// Of the traced triangles, in their order. Left out, and found by chance alone: those of alpha masks, which may be holes anywhere, and
/// unlit surfaces, which send no light.
pub fn triangles(scene: &Scene, shading: Shading, parts: &[Part], traced: &[TracedTriangle]) -> Vec<EmissiveTriangle> {
    let shines = |part: &Part| {
        let material = &scene.materials[part.of(scene).1.material];
        let is_unlit = material.unlit && shading == Shading::File;
        (material.emissive.max_element() > 0.0 && !is_unlit).then(|| turn_of(scene, part))
    };
    let turns: Vec<Option<Mat3>> = parts.par_iter().map(shines).collect();
    let emissive = |(triangle, traced): (usize, &TracedTriangle)| {
        let Source { part, triangle: number, record } = traced.source;
        let turn = turns[part as usize].filter(|_| record == 0)?;
        let (_, primitive) = parts[part as usize].of(scene);
        let corners: [usize; 3] = std::array::from_fn(|i| primitive.indices[3 * number as usize + i] as usize);
        let material = &scene.materials[primitive.material];
        let radiance = mean_radiance(scene, primitive, material, corners);
        let front = front_of(material, traced.corners, corners.map(|i| turn * primitive.normals[i]));
        let emitter = Emitter::of_triangle(traced.corners, radiance, front);
        (emitter.power > 0.0).then_some(EmissiveTriangle { triangle: triangle as u32, emitter })
    };
    traced.par_iter().enumerate().filter_map(emissive).collect()
}

/// The side that shines, where there is one: that of the normals (`gpu_scene/hits.wesl`).
fn front_of(material: &Material, [a, b, c]: [Vec3; 3], normals: [Vec3; 3]) -> Option<Vec3> {
    let flat = (b - a).cross(c - a);
    let same_side = normals.map(|normal| normal.dot(flat) > 0.0);
    (!material.double_sided && same_side.iter().all(|side| *side == same_side[0])).then(|| normals.iter().sum())
}

/// Brightest channel of what a triangle sends, nits, over its texture.
fn mean_radiance(scene: &Scene, primitive: &Primitive, material: &Material, corners: [usize; 3]) -> f32 {
    let most = material.emissive.max_element();
    let Some(reference) = &material.emissive_texture else { return most };
    let image = &scene.images[scene.textures[reference.texture].image];
    let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
    let uv = corners.map(|i| reference.texture_from_uv.transform_point2(set.get(i).copied().unwrap_or_default()));
    let mut sum = 0.0;
    for i in 0..STEPS * STEPS {
        let (u, v) = ((i % STEPS) as f32 + 0.5, (i / STEPS) as f32 + 0.5);
        let (root, v) = ((u / STEPS as f32).sqrt(), v / STEPS as f32);
        let place = (1.0 - root) * uv[0] + root * (1.0 - v) * uv[1] + root * v * uv[2];
        sum += (material.emissive * nearest_texel(image, place)).max_element();
    }
    (sum / (STEPS * STEPS) as f32).max(LEAST_SHARE * most)
}

fn nearest_texel(image: &Image, uv: Vec2) -> Vec3 {
    let within = uv - uv.floor();
    let x = ((within.x * image.width as f32) as usize).min(image.width as usize - 1);
    let y = ((within.y * image.height as f32) as usize).min(image.height as usize - 1);
    let at = 4 * (y * image.width as usize + x);
    Vec3::from_array(std::array::from_fn(|c| linear_from_srgb(image.rgba[at + c])))
}
