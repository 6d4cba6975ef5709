//! Estimate of the memory of an upload, before it is allocated.

use lanternfish_limits::memory::{Budget, TooMuch};
use lanternfish_scene::{Image, Primitive, Scene, bvh};

use super::{
    super::{
        shaders::{BvhTriangle, DrawInstance, HitTriangle},
        tracing::{
            TracedTriangle,
            levels::{Decided, Place, is_emissive, places},
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

/// Levels of textures that are left out at most.
const MOST_SKIPPED: u32 = 4;

/// Vertices and indices, draws, and triangles that rays are traced through.
fn counts(scene: &Scene, parts: Parts) -> [u64; 3] {
    let places = if parts.instances { places(scene, parts.hits, &Decided::new()) } else { Vec::new() };
    let (mut vertices, mut draws, mut triangles) = (0u64, 0u64, 0u64);
    // Primitives, traced triangles, and those of them that every instance has in the upper tree.
    let of_mesh: Vec<(u64, u64, u64)> = scene
        .meshes
        .iter()
        .map(|mesh| {
            let traced = mesh.primitives.iter().filter(|p| scene.materials[p.material].casts_shadow());
            let count = |primitive: &Primitive| primitive.indices.len() as u64 / 3;
            let is_lit = |p: &&Primitive| parts.hits && is_emissive(&scene.materials[p.material]);
            let emissive = traced.clone().filter(is_lit).map(count).sum();
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
            // Its two elements, and once the mesh's triangles.
            Some(_) if !std::mem::replace(&mut counted[instance.mesh], true) => 2 + traced,
            Some(_) => 2 + emissive,
        };
    }
    [vertices, draws, triangles]
}

/// Least number of triangles for two levels: a tree over fewer is built within seconds.
const MANY: u64 = 1 << 21;
/// Least number of triangles in one level over their number in two.
const COPIES: u64 = 4;

/// True if a scene has so many copies that two levels serve it better than one. Not if anything bends or is animated:
/// the host would pose all that is in world space in every frame. Not for a scene that names what it lacks.
pub fn is_of_copies(scene: &Scene) -> bool {
    let mut primitives = scene.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let is_still =
        |primitive: &Primitive| primitive.material < scene.materials.len() && primitive.deformation.is_none();
    if !scene.motion.animations.is_empty()
        || !primitives.all(is_still)
        || scene.instances.iter().any(|instance| instance.mesh >= scene.meshes.len())
    {
        return false;
    }
    let [.., flat] = counts(scene, Parts::BVH);
    flat >= MANY && flat >= COPIES * counts(scene, Parts::INSTANCES | Parts::HITS)[2]
}

/// Memory that an upload takes at its peak, bytes, by what takes it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct MemoryPlan {
    /// Vertices and indices.
    pub vertices: u64,
    /// Draws of primitives.
    pub draws: u64,
    /// Triangles and trees that rays are traced through.
    pub rays: u64,
    /// Textures with their levels.
    pub textures: u64,
    /// Levels of textures that are left out, the largest first, so that the rest fits.
    pub skipped_levels: u32,
    /// Number of triangles that rays are traced through.
    pub traced_triangles: u64,
    /// True if they are in two levels.
    pub in_levels: bool,
}

impl MemoryPlan {
    /// The sum, bytes.
    pub fn total(&self) -> u64 {
        [self.vertices, self.draws, self.rays, self.textures].into_iter().fold(0, u64::saturating_add)
    }

    fn new(scene: &Scene, shading: Shading, parts: Parts, skipped_levels: u32) -> Self {
        let [vertices, draws, traced_triangles] = counts(scene, parts);
        Self {
            vertices: vertices.saturating_mul(BYTES_PER_VERTEX),
            draws: draws.saturating_mul(BYTES_PER_DRAW),
            rays: traced_triangles.saturating_mul(BYTES_PER_TRACED),
            textures: bytes_of_textures(scene, shading, skipped_levels),
            skipped_levels,
            traced_triangles,
            in_levels: parts.instances,
        }
    }
}

/// Bytes of all textures without so many of their largest levels, which exist while the smaller ones are made.
fn bytes_of_textures(scene: &Scene, shading: Shading, skipped_levels: u32) -> u64 {
    let images: Vec<u64> = textures::read(scene, shading)
        .into_iter()
        .map(|(image, _)| {
            let Image { width, height, .. } = scene.images[image];
            4 * u64::from((width >> skipped_levels).max(1)) * u64::from((height >> skipped_levels).max(1))
        })
        .collect();
    let stored = images.iter().sum::<u64>().saturating_mul(COPIES_OF_TEXELS);
    match skipped_levels {
        0 => stored,
        _ => stored + (images.iter().max().unwrap_or(&0) << (2 * skipped_levels)) * textures::BATCH as u64 / 2,
    }
}

/// What uploading `scene` for `parts` takes. If it exceeds the budget, textures are halved, four times at most; an
/// error if that does not suffice.
pub fn plan(scene: &Scene, shading: Shading, parts: Parts, budget: &Budget) -> Result<MemoryPlan, TooMuch> {
    let of = |skipped: u32| MemoryPlan::new(scene, shading, parts, skipped);
    let fits = |plan: &MemoryPlan| budget.check(plan.total(), String::new).is_ok();
    if let Some(plan) = (0..=MOST_SKIPPED).map(of).find(fits) {
        return Ok(plan);
    }
    let whole = of(0);
    budget.check(whole.total(), || {
        let texels = whole.textures as f64 / COPIES_OF_TEXELS as f64 / 1e6;
        let MemoryPlan { traced_triangles, .. } = whole;
        // What helps, where most are copies.
        let [_, draws, stored] = counts(scene, Parts { bvh: false, instances: true, ..parts });
        let levels = match parts.bvh && traced_triangles > COPIES * stored {
            true => format!(" (with `shadows two-level` {stored} triangles)"),
            false => String::new(),
        };
        format!("{traced_triangles} placed triangles{levels}, {draws} draws and {texels:.0} MB of textures need")
    })?;
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::generate::demo;

    use super::*;

    #[test]
    fn textures_are_halved_until_a_scene_fits() {
        let mut scene = demo("street").unwrap();
        let parts = Parts::INSTANCES | Parts::HITS;
        let plan_of = |scene: &Scene, bytes| plan(scene, Shading::File, parts, &Budget::of(bytes));
        for image in &mut scene.images {
            (image.width, image.height) = (2048, 2048);
        }
        let whole = plan_of(&scene, u64::MAX).unwrap();
        assert_eq!((whole.skipped_levels, whole.in_levels), (0, true));
        let rest = whole.total() - whole.textures;
        let mut fewer = plan_of(&scene, whole.total() - 1).unwrap();
        for skipped in 1..=MOST_SKIPPED {
            assert_eq!((fewer.skipped_levels, fewer.total() - fewer.textures), (skipped, rest));
            assert!(fewer.textures < whole.textures / 2, "{fewer:?}");
            let Ok(next) = plan_of(&scene, fewer.total() - 1) else { break };
            fewer = next;
        }
        assert_eq!(fewer.skipped_levels, MOST_SKIPPED);
        let error = plan_of(&scene, rest).unwrap_err().to_string();
        assert!(error.contains("MB of textures need"), "{error}");
        // One level names two as the remedy.
        let error = plan(&scene, Shading::File, Parts::HITS | Parts::BVH, &Budget::of(rest)).unwrap_err().to_string();
        assert!(error.contains("with `shadows two-level`"), "{error}");
    }
}
