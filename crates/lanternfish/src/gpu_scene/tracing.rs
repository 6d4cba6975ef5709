//! The surfaces that cast shadows, in world space: triangles, and alpha masks.
//!
//! Panes, thin surfaces that let part of the light pass straight, are masks that are solid nowhere. Other transparent
//! surfaces are left out: they cast no shadow.

use std::collections::{BTreeSet, HashMap};

use glam::{Vec2, Vec3};
use lanternfish_scene::{Instance, Scene};
use rayon::prelude::*;

pub use self::triangles::{Part, Source, TracedTriangle, pose};
use self::{
    levels::{Decided, Level, Place, is_emissive},
    masks::{RECORD_WORDS, mask_record, pack_masks},
    panes::{PANE_WORDS, Pane},
    upper::UpperNodes,
};
use super::{
    shaders::{MaskRecord, TracedLevels},
    upload::{lobes::Shading, materials::mask_cutoff},
};

pub mod bvh;
pub mod emissive;
mod footprint;
pub mod hits;
pub mod levels;
mod masks;
mod opacity;
pub mod panes;
pub mod refit;
pub mod tlas;
mod triangles;
pub mod upper;

#[cfg(test)]
mod tests;

/// All surfaces that occlude light.
#[derive(Debug, Default)]
pub struct Tracing {
    /// In no particular order before [`Tracing::reorder`].
    pub triangles: Vec<TracedTriangle>,
    /// Parts to which [`Source`]s refer.
    pub parts: Vec<Part>,
    /// Instances with a tree below them: see `levels.rs`.
    pub levels: Vec<Level>,
    /// Nodes of the tree over them, and its triangles, if there are any.
    pub upper: UpperNodes,
    pub upper_count: usize,
    /// Ids that hits can have: see `gpu_scene/placed.wesl`.
    pub id_count: u64,
    /// Words: a [`MaskRecord`] for each masked triangle; opacity micromaps, after [`Tracing::decide_opacity`]; a
    /// [`MaskHeader`] for each way of reading an image; a [`panes::Block`] for each pane's material; the images' alpha,
    /// a byte a texel, each aligned to a word.
    pub masks: Vec<u32>,
    /// The panes' materials.
    pub panes: Vec<Pane>,
    /// Number of triangles with a record.
    pub record_count: usize,
    /// For each opacity micromap, by its reference, the convex hull of what is not empty: weights of a triangle's
    /// second and third corner.
    pub hulls: HashMap<u32, Vec<Vec2>>,
}

impl Tracing {
    /// Gathers the triangles of every instance, except those that have a vertex twice or a vertex that is not finite. A
    /// triangle whose transformed corners are not finite becomes a point.
    ///
    /// If the masks take more than `mask_bytes`, the largest are halved in resolution until they fit. Records and one
    /// word per mask are kept in any case.
    pub fn new(scene: &Scene, mask_bytes: u64) -> Self {
        let parts = (0..).zip(&scene.instances).flat_map(|i| parts_of(scene, i, None)).collect();
        Self::of_parts(scene, parts, mask_bytes)
    }

    /// The same in two levels. If hits are shaded, instances of emissive surfaces have these in the upper tree, where
    /// each triangle is a leaf of the light tree. `decided`: see [`levels::places`].
    pub fn in_levels(scene: &Scene, mask_bytes: u64, has_hits: bool, decided: &Decided) -> Self {
        let is_flat = |part: &Part| has_hits && is_emissive(&scene.materials[part.of(scene).1.material]);
        let (mut parts, mut levels, mut meshes) = (Vec::new(), Vec::new(), BTreeSet::new());
        for ((index, instance), place) in (0..).zip(&scene.instances).zip(levels::places(scene, has_hits, decided)) {
            let mesh = instance.mesh as u32;
            match place {
                Place::Flat => parts.extend(parts_of(scene, (index, instance), None)),
                Place::Level | Place::Nowhere => {
                    levels.push(Level::new(scene, index));
                    parts.extend(parts_of(scene, (index, instance), None).filter(is_flat));
                    if meshes.insert(mesh) {
                        parts.extend(parts_of(scene, (index, instance), Some(mesh)).filter(|part| !is_flat(part)));
                    }
                }
            }
        }
        Self { levels, ..Self::of_parts(scene, parts, mask_bytes) }
    }

    fn of_parts(scene: &Scene, parts: Vec<Part>, mask_bytes: u64) -> Self {
        let gathered: Vec<(Vec<TracedTriangle>, Vec<MaskRecord>)> =
            (0..parts.len() as u32).into_par_iter().map(|part| gather(scene, &parts, part)).collect();

        let mut triangles = Vec::with_capacity(gathered.iter().map(|(t, _)| t.len()).sum());
        let mut records = Vec::new();
        for (of_part, part_records) in gathered {
            let first = records.len() as u32;
            triangles.extend(of_part.into_iter().map(|mut triangle| {
                triangle.source.record += if triangle.source.record == 0 { 0 } else { first };
                triangle
            }));
            records.extend(part_records);
        }
        let (masks, panes) = pack_masks(scene, &mut records, mask_bytes);
        let record_count = records.len();
        Self { triangles, parts, masks, panes, record_count, ..Self::default() }
    }

    /// Where the instances are, for shaders.
    pub fn shader_levels(&self) -> TracedLevels {
        let [upper_count, first_instance, instance_count] =
            [self.upper_count, self.triangles.len(), self.levels.len()].map(|count| count as u32);
        match instance_count {
            0 => TracedLevels::ONE,
            _ => TracedLevels { upper_count, first_instance, instance_count, ..TracedLevels::ONE },
        }
    }

    /// Writes the blocks of the panes.
    pub fn write_panes(&mut self, scene: &Scene, shading: Shading) {
        for pane in &self.panes {
            let block = pane.block(&scene.materials[pane.material], shading);
            self.masks[pane.address as usize..][..PANE_WORDS].copy_from_slice(bytemuck::cast_slice(&block));
        }
    }

    /// Reorders the triangles, and the mask records with them.
    pub fn reorder(&mut self, order: &[u32]) {
        self.triangles = order.iter().map(|i| self.triangles[*i as usize]).collect();
        let records: &mut [MaskRecord] = bytemuck::cast_slice_mut(&mut self.masks[..RECORD_WORDS * self.record_count]);
        let old = records.to_vec();
        let masked = self.triangles.iter_mut().filter(|triangle| triangle.source.record > 0);
        for ((triangle, record), number) in masked.zip(records).zip(1..) {
            *record = old[triangle.source.record as usize - 1];
            triangle.source.record = number;
        }
    }
}

/// The parts of an instance that rays meet; of `mesh` in its own space.
fn parts_of<'s>(
    scene: &'s Scene,
    (index, instance): (u32, &'s Instance),
    mesh: Option<u32>,
) -> impl Iterator<Item = Part> + 's {
    let primitives = (0..).zip(&scene.meshes[instance.mesh].primitives);
    let traced = primitives.filter(|(_, p)| scene.materials[p.material].casts_shadow());
    traced.map(move |(primitive, _)| Part { instance: index, primitive, mesh })
}

/// Panics unless both hold the same triangles in the same order, with corners within a few roundings: a device may fuse
/// a product and a sum.
#[cfg(test)]
pub fn assert_same_corners(actual: &[TracedTriangle], expected: &[TracedTriangle]) {
    assert_eq!(actual.len(), expected.len());
    for (actual, expected) in actual.iter().zip(expected) {
        assert_eq!(actual.source, expected.source);
        for (a, b) in actual.corners.iter().zip(expected.corners) {
            assert!(a.distance(b) <= 1e-6 * b.abs().max_element().max(1.0), "{actual:?} {expected:?}");
        }
    }
}

/// Pixels that differ between images of scenes whose traced triangles are these. If a device has rounded corners
/// differently from the host, rays draw other noise: then none if the means agree within 2 %, and all if not.
#[cfg(test)]
pub fn differing(images: [&[[f32; 4]]; 2], triangles: [&[TracedTriangle]; 2]) -> usize {
    let [a, b] = images;
    if triangles[0] == triangles[1] {
        return a.iter().zip(b).filter(|(a, b)| a != b).count();
    }
    let sum = |image: &[[f32; 4]]| image.iter().map(|pixel| f64::from(pixel[0] + pixel[1] + pixel[2])).sum::<f64>();
    if (sum(a) / sum(b) - 1.0).abs() < 0.02 { 0 } else { a.len() }
}

fn gather(scene: &Scene, parts: &[Part], part: u32) -> (Vec<TracedTriangle>, Vec<MaskRecord>) {
    let (_, primitive) = parts[part as usize].of(scene);
    let material = &scene.materials[primitive.material];
    let mut triangles = Vec::with_capacity(primitive.indices.len() / 3);
    let mut records = Vec::new();
    for (triangle, indices) in primitive.indices.as_chunks::<3>().0.iter().enumerate() {
        let corners = parts[part as usize].corners(scene, triangle);
        // A line or a point may become a triangle when it moves or deforms; a triangle that has a vertex twice cannot.
        let [a, b, c] = *indices;
        let is_finite = indices.iter().all(|i| primitive.positions[*i as usize].is_finite());
        if a == b || b == c || c == a || !is_finite {
            continue;
        }
        let is_finite = corners.iter().all(|corner| corner.is_finite());
        let corners = if is_finite { corners } else { [Vec3::ZERO; 3] };
        let mut record = 0;
        if mask_cutoff(material).is_some() || material.is_pane() {
            records.push(mask_record(primitive, material, *indices));
            record = records.len() as u32;
        }
        triangles
            .push(TracedTriangle { corners, source: Source { part, triangle: triangle as u32, record, opacity: 0 } });
    }
    (triangles, records)
}
