//! The emissive triangles, as emitters of the light tree.

use glam::{Mat3, Vec3};
use lanternfish_scene::{Material, Scene, light_tree::Emitter, mean_emission};
use rayon::prelude::*;

use super::{
    super::upload::{
        lobes::{MaterialStorage, Shading},
        materials::mask_cutoff,
    },
    hits::normal_matrix_of,
    triangles::{Part, Source, TracedTriangle},
};
use crate::lights::tree::EmissiveTriangle;

/// Maximum number of emissive triangles in the light tree: 64 MB of nodes, half of what every adapter binds.
const MOST: usize = 1 << 20;

/// The properties that determine a material's emissive triangles: its emission, whether both sides emit, whether it is unlit.
pub type Shining = (Vec3, bool, bool);

/// [`Shining`] of every material.
pub fn shining(scene: &Scene) -> Vec<Shining> {
    scene.materials.iter().map(shining_of).collect()
}

/// [`Shining`] of a material.
pub fn shining_of(material: &Material) -> Shining {
    (material.emissive, material.double_sided, material.unlit)
}

/// The emissive traced triangles, in the scene's order: trees over them, and choices in these trees, do not depend on the BVH. Left
/// out are those of alpha masks, which may have holes anywhere, and of unlit surfaces, whose radiance is their base colour: only BSDF samples hit
/// them; those of panes, which no ray of indirect light hits; and all but the most powerful [`MOST`].
pub fn triangles(
    scene: &Scene,
    storage: MaterialStorage,
    parts: &[Part],
    traced: &[TracedTriangle],
) -> Vec<EmissiveTriangle> {
    let matrix_if_emissive = |part: &Part| {
        let material = &scene.materials[part.of(scene).1.material];
        let is_unlit = material.unlit && storage.shading == Shading::File;
        let is_masked = mask_cutoff(material).is_some() || material.is_pane();
        (material.emissive.max_element() > 0.0 && !is_unlit && !is_masked).then(|| normal_matrix_of(scene, part))
    };
    let normal_matrices: Vec<Option<Mat3>> = parts.par_iter().map(matrix_if_emissive).collect();
    let emissive = |(triangle, traced): (usize, &TracedTriangle)| {
        let Source { part, triangle: number, .. } = traced.source;
        // An instance's box is of no part.
        let normal_matrix = normal_matrices.get(part as usize).copied()??;
        let (_, primitive) = parts[part as usize].of(scene);
        let corners: [usize; 3] = std::array::from_fn(|i| primitive.indices[3 * number as usize + i] as usize);
        let material = &scene.materials[primitive.material];
        let radiance = mean_emission(scene, primitive, material, corners) / storage.light_unit;
        let front = front_of(material, traced.corners, corners.map(|i| normal_matrix * primitive.normals[i]));
        let emitter = Emitter::of_triangle(traced.corners, radiance, front);
        (emitter.power > 0.0).then_some(EmissiveTriangle { triangle: triangle as u32, emitter })
    };
    let mut all: Vec<EmissiveTriangle> = traced.par_iter().enumerate().filter_map(emissive).collect();
    keep_most_powerful(&mut all, MOST);
    all.sort_unstable_by_key(|shining| {
        let Source { part, triangle, .. } = traced[shining.triangle as usize].source;
        (part, triangle)
    });
    all
}

/// Leaves out all but so many of the most powerful triangles: only BSDF samples hit the others.
fn keep_most_powerful(all: &mut Vec<EmissiveTriangle>, most: usize) {
    if all.len() > most {
        let more_powerful = |a: &EmissiveTriangle, b: &EmissiveTriangle| {
            b.emitter.power.total_cmp(&a.emitter.power).then(a.triangle.cmp(&b.triangle))
        };
        all.select_nth_unstable_by(most, more_powerful);
        tracing::warn!("{} triangles emit light; only the {most} most powerful are sampled", all.len());
        all.truncate(most);
    }
}

/// Direction of the emissive side, if only one emits: that of the normals (`gpu_scene/hits.wesl`).
fn front_of(material: &Material, [a, b, c]: [Vec3; 3], normals: [Vec3; 3]) -> Option<Vec3> {
    let flat = (b - a).cross(c - a);
    let same_side = normals.map(|normal| normal.dot(flat) > 0.0);
    (!material.double_sided && same_side.iter().all(|side| *side == same_side[0])).then(|| normals.iter().sum())
}

#[cfg(test)]
#[test]
fn the_most_powerful_triangles_are_kept() {
    let of = |(triangle, radiance): (u32, f32)| {
        let emitter = Emitter::of_triangle([Vec3::ZERO, Vec3::X, Vec3::Y], radiance, None);
        EmissiveTriangle { triangle, emitter }
    };
    let all: Vec<_> = [(0, 1.0), (1, 3.0), (2, 2.0), (3, 3.0), (4, 2.0)].map(of).into();
    let kept = |most| {
        let mut all = all.clone();
        keep_most_powerful(&mut all, most);
        let mut kept: Vec<_> = all.iter().map(|shining| shining.triangle).collect();
        kept.sort_unstable();
        kept
    };
    assert_eq!((kept(5), kept(3), kept(1)), (vec![0, 1, 2, 3, 4], vec![1, 2, 3], vec![1]));
}
