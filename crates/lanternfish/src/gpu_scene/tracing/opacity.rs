//! Opacity micromaps: where masked triangles are solid or empty, decided once at upload [Gruen2020].
//!
//! 1. Records of equal texture coordinates, alpha factors and header share one map, so all instances of a mesh do.
//! 2. A triangle is divided into 4ᵏ subtriangles, equal in barycentric coordinates. Each is solid, empty, or unknown, by all texels that the
//!    texture's filter reads at any of its points. Every rounding error makes it unknown, so rays hit exactly what they would without maps.
//! 3. A triangle that is solid everywhere loses its record, and one that is empty everywhere is removed. The others keep their record and
//!    get their map's address. Rays read the texture only in unknown subtriangles (`gpu_scene/mask.wesl`).
//!    Panes keep their record without a map.
//! 4. The BVH is built over boxes around what is not empty: leaves fill a third of their cards.

use std::collections::HashMap;

use foldhash::fast::FixedState;
use glam::{DVec2, Vec2, Vec3A, Vec3Swizzles};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::{
    super::shaders::{MaskHeader, MaskRecord},
    Tracing,
    footprint::{Mask, Opacity, subtriangles},
    masks::{HEADER_WORDS, RECORD_WORDS},
    triangles::TracedTriangle,
};

#[cfg(test)]
mod tests;

/// Bits of a map's reference that store its level; the address is above.
const LEVEL_BITS: u32 = 3;
/// Maximum number of divisions of a triangle's sides in half: 1024 subtriangles, 256 bytes.
const MAX_LEVEL: u32 = 5;
/// Texels per subtriangle at which division stops.
const TEXELS: f64 = 32.0;
/// Maximum size of all maps, words. Levels are reduced until they fit.
const MAX_WORDS: u64 = 1 << 23;
/// Maximum number of texels that are read for all maps: about 0.3 s of one core. The triangles with the largest footprints get no map.
const MAX_TEXELS: f64 = (1u64 << 28) as f64;
/// Subtriangles per word of a map.
const PER_WORD: usize = 16;

/// Distance by which the box around what is not empty exceeds it, relative to the triangle's box: far above the error of a hit's barycentric
/// coordinates.
const PAD: f32 = 1.0 / 64.0;

/// Opacity of a triangle.
enum Decision {
    /// Solid or empty everywhere.
    Uniform(Opacity),
    /// None: the texture is read everywhere.
    Mixed(Option<Map>),
}

/// An opacity micromap.
struct Map {
    level: u32,
    /// States of the subtriangles.
    words: Vec<u32>,
    /// Convex hull of the subtriangles that are not empty: weights of the second and third corner.
    hull: Vec<Vec2>,
}

impl Tracing {
    /// Decides where masked triangles are solid. Triangles that are empty everywhere are removed, those that are solid everywhere are no
    /// longer masked, and the others get maps, as far as all masks fit `mask_bytes`.
    pub fn decide_opacity(&mut self, mask_bytes: u64) {
        if self.record_count == 0 {
            return;
        }
        let first_header = RECORD_WORDS * self.record_count;
        let records: Vec<MaskRecord> = bytemuck::cast_slice(&self.masks[..first_header]).to_vec();
        let (distinct, of_record) = distinct(&records);
        let space = (mask_bytes / 4).saturating_sub(self.masks.len() as u64).min(MAX_WORDS);
        let decisions = decisions(&self.masks, &distinct, space);

        // Maps follow the records that are left.
        let is_mixed = |record: usize| matches!(decisions[of_record[record] as usize], Decision::Mixed(_));
        let kept: Vec<usize> = (0..records.len()).filter(|record| is_mixed(*record)).collect();
        let mut words: Vec<u32> = vec![0; RECORD_WORDS * kept.len()];
        let mut references = vec![0; distinct.len()];
        for (reference, decision) in references.iter_mut().zip(&decisions) {
            if let Decision::Mixed(Some(Map { level, words: states, hull })) = decision
                && words.len() < 1 << (u32::BITS - LEVEL_BITS)
            {
                *reference = ((words.len() as u32) << LEVEL_BITS) | level;
                words.extend(states);
                self.hulls.insert(*reference, hull.clone());
            }
        }

        // Headers and texels move.
        let moved = |address: u32| (address as usize - first_header + words.len()) as u32;
        let mut headers: Vec<u32> = distinct.iter().map(|record| record.header).collect();
        headers.sort_unstable();
        headers.dedup();
        let mut rest = self.masks[first_header..].to_vec();
        for header in headers {
            let at = header as usize - first_header;
            let header: &mut [MaskHeader] = bytemuck::cast_slice_mut(&mut rest[at..at + HEADER_WORDS]);
            header[0].texels = moved(header[0].texels);
            if header[0].pane > 0 {
                header[0].pane = moved(header[0].pane);
            }
        }
        self.panes.iter_mut().for_each(|pane| pane.address = moved(pane.address));
        let left: Vec<MaskRecord> =
            kept.iter().map(|i| MaskRecord { header: moved(records[*i].header), ..records[*i] }).collect();
        words[..RECORD_WORDS * left.len()].copy_from_slice(bytemuck::cast_slice(&left));
        words.extend(rest);
        (self.masks, self.record_count) = (words, left.len());

        let mut numbers = vec![0; records.len()];
        kept.iter().zip(1..).for_each(|(record, number)| numbers[*record] = number);
        self.triangles.retain_mut(|triangle| {
            let source = &mut triangle.source;
            let Some(record) = (source.record as usize).checked_sub(1) else { return true };
            let map = of_record[record] as usize;
            (source.record, source.opacity) = (numbers[record], references[map]);
            !matches!(decisions[map], Decision::Uniform(Opacity::Empty))
        });
    }

    /// Box around all points of a triangle that rays may hit, world space, m.
    pub fn bounds(&self, triangle: &TracedTriangle) -> Aabb {
        let [a, b, c] = triangle.corners.map(Vec3A::from);
        let all = Aabb::new(a.min(b).min(c), a.max(b).max(c));
        let Some(hull) = self.hulls.get(&triangle.source.opacity) else { return all };
        let mut bounds = Aabb::empty();
        hull.iter().for_each(|p| _ = bounds.extend(a + p.x * (b - a) + p.y * (c - a)));
        let rounding = 4.0 * f32::EPSILON * all.min.abs().max(all.max.abs());
        let pad = PAD * all.diagonal() + rounding;
        Aabb::new((bounds.min - pad).max(all.min), (bounds.max + pad).min(all.max))
    }
}

/// Convex hull of the subtriangles that are not empty: weights of the second and third corner, counter-clockwise.
fn hull(level: u32, states: &[Opacity]) -> Vec<Vec2> {
    let occupied = subtriangles(level).zip(states).filter(|(_, state)| **state != Opacity::Empty);
    let mut points: Vec<Vec2> = occupied.flat_map(|(corners, _)| corners.map(|w| w.as_vec3().yz())).collect();
    points.sort_unstable_by(|a, b| (a.x, a.y).partial_cmp(&(b.x, b.y)).expect("multiples of the subtriangles' size"));
    points.dedup();
    let mut hull: Vec<Vec2> = Vec::new();
    for pass in 0..2 {
        let first = hull.len();
        for point in &points {
            while let [.., a, b] = hull[first..]
                && (b - a).perp_dot(*point - a) <= 0.0
            {
                hull.pop();
            }
            hull.push(*point);
        }
        // The last point is the first of the other half.
        hull.pop();
        if pass == 0 {
            points.reverse();
        }
    }
    hull
}

/// The distinct records, and the index of each record among them.
fn distinct(records: &[MaskRecord]) -> (Vec<MaskRecord>, Vec<u32>) {
    let mut indices: HashMap<[u32; RECORD_WORDS], u32, FixedState> = HashMap::default();
    let mut distinct = Vec::new();
    let of_record = records
        .iter()
        .map(|record| {
            *indices.entry(bytemuck::cast(*record)).or_insert_with(|| {
                distinct.push(*record);
                distinct.len() as u32 - 1
            })
        })
        .collect();
    (distinct, of_record)
}

/// The decision for each record. All maps together have at most `space` words.
fn decisions(words: &[u32], records: &[MaskRecord], space: u64) -> Vec<Decision> {
    let mut masks: HashMap<u32, Mask<'_>> = HashMap::new();
    for record in records {
        masks.entry(record.header).or_insert_with(|| Mask::new(words, record.header));
    }
    let area = |mask: &Mask<'_>, record| if mask.is_pane() { 0.0 } else { mask.area(record) };
    let texels: Vec<f64> = records.iter().map(|record| area(&masks[&record.header], record)).collect();
    let mut most = f64::MAX;
    let read = |most: f64| texels.iter().filter(|texels| **texels <= most).sum::<f64>();
    while read(most) > MAX_TEXELS {
        most = texels.iter().copied().filter(|texels| *texels <= most).fold(0.0, f64::max) / 2.0;
    }

    let level = |texels: f64, max: u32| (0..max).find(|level| texels <= TEXELS * subtriangle_count(*level) as f64);
    let level = |texels: f64, max: u32| level(texels, max).unwrap_or(max);
    let size = |max: u32| texels.iter().map(|texels| map_words(level(*texels, max)) as u64).sum::<u64>();
    let max_level = (0..=MAX_LEVEL).rev().find(|max| size(*max) <= space);
    let decide = |(record, texels): (&MaskRecord, &f64)| {
        let mask = &masks[&record.header];
        if mask.is_pane() {
            return Decision::Mixed(None);
        }
        if let Some(uniform) = mask.of_everything(record) {
            return Decision::Uniform(uniform);
        }
        if *texels > most {
            return Decision::Mixed(None);
        }
        let level = level(*texels, max_level.unwrap_or(0));
        let states: Vec<Opacity> = subtriangles(level).map(|corners| mask.opacity(record, corners)).collect();
        match states.iter().all(|state| *state == states[0]) {
            true if states[0] != Opacity::Unknown => Decision::Uniform(states[0]),
            true => Decision::Mixed(None),
            false => {
                Decision::Mixed(max_level.map(|_| Map { level, words: packed(&states), hull: hull(level, &states) }))
            }
        }
    };
    records.par_iter().zip(&texels).map(decide).collect()
}

fn subtriangle_count(level: u32) -> usize {
    1 << (2 * level)
}

fn map_words(level: u32) -> usize {
    subtriangle_count(level).div_ceil(PER_WORD)
}

/// Two bits for each state, the first in the lowest bits.
fn packed(states: &[Opacity]) -> Vec<u32> {
    let word = |states: &[Opacity]| states.iter().rev().fold(0, |word, state| (word << 2) | *state as u32);
    states.chunks(PER_WORD).map(word).collect()
}

/// Texture coordinates of a record's corners.
pub(super) fn coordinates(record: &MaskRecord) -> [DVec2; 3] {
    [record.uv_a, record.uv_b, record.uv_c].map(|uv| uv.as_dvec2())
}
