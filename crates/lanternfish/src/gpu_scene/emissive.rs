//! The triangles that shine, as the light tree knows them.

use glam::{Mat3, Vec3};
use lanternfish_scene::{Material, Scene, light_tree::Emitter, mean_emission};
use rayon::prelude::*;

use super::{
    Shading,
    hits::turn_of,
    tracing::{Part, Source, TracedTriangle},
};
use crate::lights::tree::EmissiveTriangle;

/// What decides which of a material's triangles shine: its emission, whether both sides emit, whether it is unlit.
pub type Shining = (Vec3, bool, bool);

/// [`Shining`] of every material.
pub fn shining(scene: &Scene) -> Vec<Shining> {
    scene.materials.iter().map(shining_of).collect()
}

/// [`Shining`] of a material.
pub fn shining_of(material: &Material) -> Shining {
    (material.emissive, material.double_sided, material.unlit)
}

/// The traced triangles that shine, in the scene's order: trees over them, and what is chosen in them, are the same whichever BVH
/// holds the triangles. Left out, and found by chance alone: those of alpha masks, which may be
/// holes anywhere, and those of unlit surfaces, whose radiance is their base colour.
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
        let radiance = mean_emission(scene, primitive, material, corners);
        let front = front_of(material, traced.corners, corners.map(|i| turn * primitive.normals[i]));
        let emitter = Emitter::of_triangle(traced.corners, radiance, front);
        (emitter.power > 0.0).then_some(EmissiveTriangle { triangle: triangle as u32, emitter })
    };
    let mut all: Vec<EmissiveTriangle> = traced.par_iter().enumerate().filter_map(emissive).collect();
    all.sort_unstable_by_key(|shining| {
        let Source { part, triangle, .. } = traced[shining.triangle as usize].source;
        (part, triangle)
    });
    all
}

/// The side that shines, where there is one: that of the normals (`gpu_scene/hits.wesl`).
fn front_of(material: &Material, [a, b, c]: [Vec3; 3], normals: [Vec3; 3]) -> Option<Vec3> {
    let flat = (b - a).cross(c - a);
    let same_side = normals.map(|normal| normal.dot(flat) > 0.0);
    (!material.double_sided && same_side.iter().all(|side| *side == same_side[0])).then(|| normals.iter().sum())
}
