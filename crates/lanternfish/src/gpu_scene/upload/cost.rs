//! Estimate of the memory of an upload, before it is allocated.

use std::collections::BTreeSet;

use lanternfish_limits::memory::{Budget, TooMuch};
use lanternfish_scene::{Primitive, Scene, bvh};

use super::{
    super::{
        shaders::{BvhTriangle, DrawInstance, HitTriangle},
        tracing::{
            TracedTriangle,
            levels::{Place, places},
        },
    },
    lobes::Shading,
    parts::Parts,
    textures,
};

/// Bytes per vertex or index: packed on the host, and in the buffer.
const BYTES_PER_VERTEX: u64 = 160;
/// Copies of each texel and its mip levels: on the host, staged, and in the texture.
const COPIES_OF_TEXELS: u64 = 4;
/// Bytes per triangle for rays: gathered per part and together, sorted, packed, in the buffers.
const BYTES_PER_TRACED: u64 = bvh::BYTES_PER_BOX
    + (3 * size_of::<TracedTriangle>() + 2 * size_of::<BvhTriangle>() + 2 * size_of::<HitTriangle>()) as u64;
/// Bytes per placed primitive: its draw, and twice its shader data.
const BYTES_PER_DRAW: u64 = 2 * size_of::<DrawInstance>() as u64 + 96;

/// Vertices and indices, draws, and triangles that rays are traced through.
fn counts(scene: &Scene, parts: Parts) -> [u64; 3] {
    let places = if parts.instances { places(scene, &BTreeSet::new()) } else { Vec::new() };
    let (mut vertices, mut draws, mut triangles) = (0u64, 0u64, 0u64);
    // Primitives, traced triangles, and those of them that every instance has in the upper tree.
    let of_mesh: Vec<(u64, u64, u64)> = scene
        .meshes
        .iter()
        .map(|mesh| {
            let traced = mesh.primitives.iter().filter(|p| scene.materials[p.material].casts_shadow());
            let count = |primitive: &Primitive| primitive.indices.len() as u64 / 3;
            let is_emissive = |p: &&Primitive| parts.hits && scene.materials[p.material].emissive.max_element() > 0.0;
            let emissive = traced.clone().filter(is_emissive).map(count).sum();
            vertices += mesh.primitives.iter().map(|p| (p.positions.len() + p.indices.len()) as u64).sum::<u64>();
            (mesh.primitives.len() as u64, traced.map(count).sum(), emissive)
        })
        .collect();
    let mut counted = vec![false; scene.meshes.len()];
    for (index, instance) in scene.instances.iter().enumerate() {
        let (primitives, traced, emissive) = of_mesh[instance.mesh];
        draws += primitives;
        triangles += match places.get(index) {
            _ if !parts.rays() => 0,
            None | Some(Place::Flat) => traced,
            // A box, its two other elements, and once the mesh's triangles.
            Some(Place::Level) if !std::mem::replace(&mut counted[instance.mesh], true) => 3 + traced,
            Some(Place::Level) => 3 + emissive,
            Some(Place::Nowhere) => 0,
        };
    }
    [vertices, draws, triangles]
}

/// Triangles from which on two levels are chosen, and their number in one level over that in two: below, one tree is built within seconds.
const MANY: u64 = 1 << 20;
const COPIES: u64 = 4;

/// True if a valid scene has so many copies that two levels serve it better than one.
pub fn is_of_copies(scene: &Scene) -> bool {
    let [.., flat] = counts(scene, Parts::BVH);
    flat >= MANY && flat >= COPIES * counts(scene, Parts::INSTANCES | Parts::HITS)[2]
}

/// An error if this process may not allocate the memory that uploading `scene` for `parts` needs.
pub fn check(scene: &Scene, shading: Shading, parts: Parts) -> Result<(), TooMuch> {
    let [vertices, draws, triangles] = counts(scene, parts);
    let texels: u64 =
        textures::read(scene, shading).into_iter().map(|(image, _)| scene.images[image].rgba.len() as u64).sum();
    let bytes = [
        vertices.saturating_mul(BYTES_PER_VERTEX),
        draws.saturating_mul(BYTES_PER_DRAW),
        triangles.saturating_mul(BYTES_PER_TRACED),
        texels.saturating_mul(COPIES_OF_TEXELS),
    ];
    Budget::of_process().check(bytes.into_iter().fold(0, u64::saturating_add), || {
        let texels = texels as f64 / 1e6;
        // What helps, where most are copies.
        let [.., stored] = counts(scene, Parts { bvh: false, instances: true, ..parts });
        let levels = match parts.bvh && triangles > COPIES * stored {
            true => format!(" (with `shadows two-level` {stored} triangles)"),
            false => String::new(),
        };
        format!("{triangles} placed triangles{levels}, {draws} draws and {texels:.0} MB of textures need")
    })
}
