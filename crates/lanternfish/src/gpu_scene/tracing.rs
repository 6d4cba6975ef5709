//! The surfaces that cast shadows, in world space: triangles, and alpha masks.
//!
//! Panes, thin surfaces that let part of the light pass straight, are masks that are solid nowhere. Other transparent
//! surfaces are left out: they cast no shadow.

use std::collections::{BTreeSet, HashMap};

use glam::{UVec2, Vec2, Vec3};
use lanternfish_scene::{Filter, Instance, Material, Primitive, Scene, Wrap};
use rayon::prelude::*;

use self::{
    levels::{Decided, Level, Place, is_emissive},
    panes::{PANE_WORDS, Pane},
    upper::UpperNodes,
};
use super::{
    shaders::{MaskHeader, MaskRecord, TracedLevels},
    upload::{materials::mask_cutoff, mips},
};

pub mod bvh;
pub mod emissive;
mod footprint;
pub mod hits;
pub mod levels;
mod opacity;
pub mod panes;
pub mod refit;
pub mod tlas;
pub mod upper;

#[cfg(test)]
mod tests;

/// A triangle in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedTriangle {
    /// Corners in world space, m.
    pub corners: [Vec3; 3],
    /// The scene's triangle that it is.
    pub source: Source,
}

/// The scene's triangle that a traced triangle is: all that is needed to transform it again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// Index into [`Tracing::parts`].
    pub part: u32,
    /// Index of the triangle in the part's primitive.
    pub triangle: u32,
    /// 0: solid; else the index of its mask record plus one.
    pub record: u32,
    /// 0: no opacity micromap; else its address in [`Tracing::masks`] and its level (`gpu_scene/mask.wesl`).
    pub opacity: u32,
}

/// A primitive of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index of the primitive in the instance's mesh.
    pub primitive: u32,
    /// The mesh, if its triangles are in its own space: the part stands for those of all its instances.
    pub mesh: Option<u32>,
}

const RECORD_WORDS: usize = size_of::<MaskRecord>() / 4;
const HEADER_WORDS: usize = size_of::<MaskHeader>() / 4;

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

impl Part {
    /// The corners of a triangle, in the space of the tree that it is in.
    fn corners(&self, scene: &Scene, triangle: usize) -> [Vec3; 3] {
        let (instance, primitive) = self.of(scene);
        let corner = |i: usize| primitive.positions[primitive.indices[3 * triangle + i] as usize];
        [0, 1, 2].map(corner).map(|corner| match self.mesh {
            None => instance.world_from_object.transform_point3(corner),
            Some(_) => corner,
        })
    }

    /// The instance and the primitive.
    pub fn of<'s>(&self, scene: &'s Scene) -> (&'s Instance, &'s Primitive) {
        let instance = &scene.instances[self.instance as usize];
        (instance, &scene.meshes[instance.mesh].primitives[self.primitive as usize])
    }
}

/// Triangles of these sources with the scene's current transforms, world space, in the same order. A triangle whose
/// corners are not finite becomes a point: no ray hits it; so does an instance's box, which is of no part.
pub fn pose(scene: &Scene, parts: &[Part], sources: &[Source]) -> Vec<TracedTriangle> {
    let pose_triangle = |source: &Source| {
        let corners = parts.get(source.part as usize).map(|part| part.corners(scene, source.triangle as usize));
        let finite = corners.filter(|corners| corners.iter().all(|corner| corner.is_finite()));
        TracedTriangle { corners: finite.unwrap_or_default(), source: *source }
    };
    sources.par_iter().map(pose_triangle).collect()
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

/// The header is the index of the material until [`pack_masks`] assigns addresses.
fn mask_record(primitive: &Primitive, material: &Material, triangle: [u32; 3]) -> MaskRecord {
    let [uv_a, uv_b, uv_c] = triangle.map(|i| {
        let Some(reference) = &material.base_color_texture else { return Vec2::ZERO };
        let set = if reference.uv_set == 1 { &primitive.uv1 } else { &primitive.uv0 };
        reference.texture_from_uv.transform_point2(set.get(i as usize).copied().unwrap_or_default())
    });
    let vertex_alpha = |i: u32| primitive.colors.get(i as usize).map_or(1.0, |c| c.w);
    // The block of a pane has its material's alpha, which may change.
    let factor = if material.is_pane() { 1.0 } else { material.base_color.w };
    let [alpha_a, alpha_b, alpha_c] = triangle.map(|i| factor * vertex_alpha(i));
    MaskRecord { uv_a, uv_b, uv_c, alpha_a, alpha_b, alpha_c, header: primitive.material as u32 }
}

/// An image's alpha.
struct MaskImage {
    /// `None`: one opaque texel, for materials without a texture.
    image: Option<usize>,
    /// Size after halving, texels.
    size: UVec2,
    /// Number of halvings of each side.
    halvings: u32,
}

/// [`Tracing::masks`], where blocks of panes are still empty, and [`Tracing::panes`]. Writes the headers' addresses
/// into the records.
fn pack_masks(scene: &Scene, records: &mut [MaskRecord], mask_bytes: u64) -> (Vec<u32>, Vec<Pane>) {
    // Equal headers and equal images are stored once each, in the order of their first use.
    let mut images = Vec::new();
    let mut headers = Vec::new();
    let mut header_of_material: HashMap<u32, usize> = HashMap::new();
    for record in records.iter_mut() {
        let header = *header_of_material
            .entry(record.header)
            .or_insert_with(|| header_index(scene, record.header as usize, &mut headers, &mut images));
        record.header = header as u32;
    }

    // Addresses.
    let first_header = RECORD_WORDS * records.len();
    let first_pane = first_header + HEADER_WORDS * headers.len();
    let of_panes = headers.iter_mut().filter(|header| header.pane > 0);
    let place = |(header, at): (&mut MaskHeader, usize)| {
        Pane::new(scene, std::mem::replace(&mut header.pane, at as u32) as usize - 1, at as u32)
    };
    let panes: Vec<Pane> = of_panes.zip((first_pane..).step_by(PANE_WORDS)).map(place).collect();
    let first_texel = first_pane + PANE_WORDS * panes.len();
    for record in records.iter_mut() {
        record.header = (first_header + HEADER_WORDS * record.header as usize) as u32;
    }
    fit(&mut images, (mask_bytes / 4).saturating_sub(first_texel as u64) as usize);
    let mut total = first_texel;
    let mut reserve = |image: &MaskImage| {
        total += image.words();
        (total - image.words()) as u32
    };
    let addresses: Vec<u32> = images.iter().map(&mut reserve).collect();
    for header in &mut headers {
        let image = header.texels as usize;
        (header.size, header.texels) = (images[image].size, addresses[image]);
    }

    let mut words = vec![0; total];
    words[..first_header].copy_from_slice(bytemuck::cast_slice(records));
    words[first_header..first_pane].copy_from_slice(bytemuck::cast_slice(&headers));
    let mut rest = &mut words[first_texel..];
    let slots: Vec<&mut [u32]> = images
        .iter()
        .map(|image| {
            let (slot, after) = std::mem::take(&mut rest).split_at_mut(image.words());
            rest = after;
            slot
        })
        .collect();
    images.par_iter().zip(slots).for_each(|(image, slot)| {
        let alpha = image.alpha(scene);
        bytemuck::cast_slice_mut(slot)[..alpha.len()].copy_from_slice(&alpha);
    });
    (words, panes)
}

/// Index of a material's header. Until addresses are known, its `texels` is the index of its image, and its `pane` that
/// of its material plus one.
fn header_index(scene: &Scene, index: usize, headers: &mut Vec<MaskHeader>, images: &mut Vec<MaskImage>) -> usize {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    };
    let material = &scene.materials[index];
    let mut header = MaskHeader { cutoff: mask_cutoff(material).unwrap_or(0.0), ..MaskHeader::default() };
    if material.is_pane() {
        (header.cutoff, header.pane) = (f32::MAX, index as u32 + 1);
    }
    let texture = material.base_color_texture.as_ref().map(|reference| scene.textures[reference.texture]);
    if let Some(texture) = texture {
        let sampler = scene.samplers[texture.sampler];
        header.wrap = UVec2::new(wrap(sampler.wrap_u), wrap(sampler.wrap_v));
        header.linear_filter = u32::from(sampler.mag == Filter::Linear);
    }
    let image = texture.map(|texture| texture.image);
    header.texels = images.iter().position(|other| other.image == image).unwrap_or_else(|| {
        let size = image.map_or(UVec2::ONE, |i| UVec2::new(scene.images[i].width, scene.images[i].height));
        images.push(MaskImage { image, size, halvings: 0 });
        images.len() - 1
    }) as u32;
    headers.iter().position(|other| *other == header).unwrap_or_else(|| {
        headers.push(header);
        headers.len() - 1
    })
}

/// Halves the largest images until all together take at most this many words, or one each.
fn fit(images: &mut [MaskImage], budget_words: usize) {
    let mut words: usize = images.iter().map(MaskImage::words).sum();
    while words > budget_words {
        let Some(largest) = images.iter_mut().max_by_key(|image| image.words()).filter(|image| image.words() > 1)
        else {
            break;
        };
        words -= largest.words();
        largest.size = (largest.size / 2).max(UVec2::ONE);
        largest.halvings += 1;
        words += largest.words();
    }
    let halved = images.iter().filter(|image| image.halvings > 0).count();
    if halved > 0 {
        tracing::warn!(
            halved,
            masks = images.len(),
            most_halvings = images.iter().map(|image| image.halvings).max(),
            bytes = 4 * words,
            "alpha masks for rays are reduced in resolution: they do not fit one binding of this device"
        );
    }
}

impl MaskImage {
    /// Words of its texels, four a word.
    fn words(&self) -> usize {
        (self.size.x as usize * self.size.y as usize).div_ceil(4)
    }

    /// Its texels, row by row.
    fn alpha(&self, scene: &Scene) -> Vec<u8> {
        let Some(image) = self.image else { return vec![255] };
        let image = &scene.images[image];
        let alpha: Vec<u8> = image.rgba.as_chunks::<4>().0.iter().map(|texel| texel[3]).collect();
        let halve = |(alpha, width, height): (Vec<u8>, u32, u32), _| mips::half_alpha(&alpha, width, height);
        (0..self.halvings).fold((alpha, image.width, image.height), halve).0
    }
}
