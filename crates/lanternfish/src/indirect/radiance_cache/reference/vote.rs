//! Votes for the sample position of an entry: the largest priority wins.

use glam::{IVec2, UVec2, Vec2, Vec3};

use super::{Table, hashing::entry_at};
use crate::{
    common::random::random_units,
    indirect::radiance_cache::{
        RadianceCacheParameters,
        parameters::{EntrySample, SampledEntry},
        planes::TrianglePlane,
    },
};

/// The largest rank.
pub(in super::super) const LAST_RANK: u32 = 7;
const RANK_SHIFT: u32 = 28;
const FROM_BEHIND: u32 = 1 << 31;
const NOTHING: u32 = u32::MAX;
const NO_SLOT: u32 = u32::MAX;
/// Seed of the jitter of hits of entries' rays.
const SEED: u32 = 34;
/// 2³² over the golden ratio.
const GOLDEN: u32 = 0x9e37_79b9;
/// Bits of a pixel's index in the candidate number of a ray, and of its sample index.
const PLACE_BITS: u32 = 26;
const SAMPLE_BITS: u32 = 5;

/// A permutation of all numbers, different in each update: no two candidates have the same priority, and 0 never wins.
pub(in super::super) fn priority(candidate: u32, update: u32) -> u32 {
    let mut x = candidate ^ update.wrapping_mul(GOLDEN);
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The candidate with this priority.
pub(in super::super) fn candidate(priority: u32, update: u32) -> u32 {
    let undo = |x: u32, shift: u32| (0..32 / shift).fold(x, |y, _| x ^ (y >> shift));
    // The inverses of the factors, modulo 2^32.
    let mut x = undo(priority, 16).wrapping_mul(0x4302_1123);
    x = undo(x, 15).wrapping_mul(0x1d69_e2a5);
    undo(x, 16) ^ update.wrapping_mul(GOLDEN)
}

fn ray_shift(first_sample: u32) -> u32 {
    first_sample.wrapping_mul(GOLDEN) % (1 << (PLACE_BITS + SAMPLE_BITS))
}

/// Priority of a pixel's ray, from the pixel's index, its sample index, and the first of the sample indices that are looked up together.
pub(in super::super) fn ray_priority(pixel: u32, sample: u32, first_sample: u32, update: u32) -> u32 {
    priority((pixel | ((sample - first_sample) << PLACE_BITS)) ^ ray_shift(first_sample), update)
}

/// The ray with this priority: the pixel's index (x), and the sample index (y).
pub(in super::super) fn ray_with(of: u32, first_sample: u32, update: u32) -> UVec2 {
    let number = (candidate(of, update) % (1 << (PLACE_BITS + SAMPLE_BITS))) ^ ray_shift(first_sample);
    UVec2::new(number % (1 << PLACE_BITS), first_sample + (number >> PLACE_BITS))
}

/// Distance in hits from what pixels see: 0 to [`LAST_RANK`].
pub(in super::super) fn rank(sample: EntrySample) -> u32 {
    LAST_RANK - (sample.triangle >> RANK_SHIFT) % 8
}

pub(in super::super) fn with_rank(sample: EntrySample, rank: u32) -> EntrySample {
    let others = sample.triangle & !(LAST_RANK << RANK_SHIFT);
    EntrySample { triangle: others | ((LAST_RANK - rank) << RANK_SHIFT), ..sample }
}

fn snorms(bits: u32) -> Vec2 {
    let half = |bits: u32| (f32::from(bits as u16 as i16) / 32_767.0).max(-1.0);
    Vec2::new(half(bits), half(bits >> 16))
}

fn unit(bits: u32) -> Vec3 {
    let e = snorms(bits);
    let z = 1.0 - e.x.abs() - e.y.abs();
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let folded = Vec2::new((1.0 - e.y.abs()) * sign(e.x), (1.0 - e.x.abs()) * sign(e.y));
    let v = if z >= 0.0 { e } else { folded }.extend(z);
    v / (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

/// Packs two snorms of 16 bits, given as integers.
pub(in super::super) fn snorm_bits(halves: IVec2) -> u32 {
    (halves.x as u32 & 0xffff) | ((halves.y as u32) << 16)
}

/// The hit of a sample's ray, projected onto the triangle's plane; the normal of the side that it hit; and the sample position there, of rank 0.
fn face(sampled: &SampledEntry, planes: &[TrianglePlane]) -> (Vec3, Vec3, EntrySample) {
    let dot = |a: Vec3, b: Vec3| a.x * b.x + a.y * b.y + a.z * b.z;
    let (direction, plane) = (unit(sampled.hit_direction), planes[sampled.triangle as usize]);
    let p_world = sampled.p_world + sampled.distance * direction;
    let normal = unit(plane.normal);
    let on_plane = p_world - (dot(normal, p_world) - plane.offset) * normal;
    let is_behind = dot(normal, direction) > 0.0;
    let (normal, side) = if is_behind { (-normal, FROM_BEHIND) } else { (normal, 0) };
    (on_plane, normal, with_rank(EntrySample { p_world: on_plane, triangle: sampled.triangle | side }, 0))
}

/// Inserts the entries that samples' rays have hit, and votes for each: `intersect`. Returns the number of hits without a slot.
pub(in super::super) fn intersect(
    table: &mut Table,
    sampled: &mut [SampledEntry],
    planes: &[TrianglePlane],
    (eye, parameters): (Vec3, &RadianceCacheParameters),
    update: u32,
) -> u32 {
    let mut lost = 0;
    for sampled in sampled.iter_mut().filter(|sampled| sampled.triangle != NOTHING) {
        let p_world = sampled.p_world + sampled.distance * unit(sampled.hit_direction);
        let [x, y, z] = p_world.to_array().map(f32::to_bits);
        let u = random_units(UVec2::new((x ^ z) & 0xffff, (y ^ z) & 0xffff), update, 0, SEED);
        let (on_plane, normal, _) = face(sampled, planes);
        let slot = table.insert(entry_at(parameters, eye, on_plane, normal, Vec2::new(u.x, u.y)));
        sampled.slot_hit = slot.unwrap_or(NO_SLOT);
        match slot {
            None => lost += 1,
            Some(slot) => {
                let own = priority(table.keys[sampled.slot as usize], update);
                table.votes[slot as usize] = table.votes[slot as usize].max(own);
                sampled.vote = own;
            }
        }
    }
    lost
}

/// The winners set the sample position of the entry that they hit, unless that would raise the entry's rank: `store_hits`.
pub(in super::super) fn select(table: &mut Table, sampled: &mut [SampledEntry], planes: &[TrianglePlane]) {
    for sampled in sampled.iter_mut().filter(|sampled| sampled.vote != 0) {
        let slot = sampled.slot_hit as usize;
        if table.votes[slot] != sampled.vote {
            sampled.vote = 0;
            continue;
        }
        let next = (sampled.rank % 8 + 1).min(LAST_RANK);
        if next <= rank(table.samples[slot]) {
            table.samples[slot] = with_rank(face(sampled, planes).2, next);
        }
    }
}

#[test]
fn priorities_of_successive_candidates_are_in_random_order() {
    let rising = (0..1024).filter(|i| priority(*i, 12_345) < priority(*i + 1, 12_345)).count();
    assert!((450..=575).contains(&rising), "{rising}");
}
