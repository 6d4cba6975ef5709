//! Estimate of the memory of an upload, before it is allocated.

use lanternfish_limits::memory::{Budget, TooMuch};
use lanternfish_scene::{Scene, bvh};

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

/// An error if this process may not allocate the memory that uploading `scene` for `parts` needs.
pub fn check(scene: &Scene, shading: Shading, parts: Parts) -> Result<(), TooMuch> {
    let places = if parts.instances { places(scene) } else { Vec::new() };
    let (mut vertices, mut draws, mut triangles) = (0u64, 0u64, 0u64);
    let of_mesh: Vec<(u64, u64)> = scene
        .meshes
        .iter()
        .map(|mesh| {
            let traced = mesh.primitives.iter().filter(|p| scene.materials[p.material].casts_shadow());
            vertices += mesh.primitives.iter().map(|p| (p.positions.len() + p.indices.len()) as u64).sum::<u64>();
            (mesh.primitives.len() as u64, traced.map(|primitive| primitive.indices.len() as u64 / 3).sum())
        })
        .collect();
    let mut counted = vec![false; scene.meshes.len()];
    for (index, instance) in scene.instances.iter().enumerate() {
        draws += of_mesh[instance.mesh].0;
        let traced = of_mesh[instance.mesh].1;
        triangles += match places.get(index) {
            _ if !parts.rays() => 0,
            None | Some(Place::Flat) => traced,
            // A box, its transform, and once the mesh's triangles.
            Some(Place::Level) if !std::mem::replace(&mut counted[instance.mesh], true) => 2 + traced,
            Some(Place::Level) => 2,
            Some(Place::Nowhere) => 0,
        };
    }
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
        let stored: u64 = of_mesh.iter().map(|(_, traced)| traced).sum();
        let levels = match parts.bvh && triangles > 4 * stored {
            true => format!(" (with `shadows two-level` and `indirect none` {stored} triangles)"),
            false => String::new(),
        };
        format!("{triangles} placed triangles{levels}, {draws} draws and {texels:.0} MB of textures need")
    })
}
