//! Accumulation of samples in their entries.

use glam::{Vec3, Vec4};

use super::{LISTED, Table, rgbe};
use crate::indirect::radiance_cache::{
    RadianceCacheParameters,
    parameters::{Link, SampledEntry},
};

const NOTHING: u32 = u32::MAX;
const NO_SLOT: u32 = u32::MAX;

fn mix(a: Vec3, b: Vec3, ratio: f32) -> Vec3 {
    a * (1.0 - ratio) + b * ratio
}

/// Weight of a sample in the mean of an entry with so many samples: constant from the sample `most` on.
fn weight(samples: f32, most: f32) -> f32 {
    1.0 / (samples.min(most) + 1.0)
}

/// Levels that hold the total: two with all bounces.
pub(in super::super) fn totals(parameters: &RadianceCacheParameters) -> &'static [usize] {
    if parameters.bounce_levels == 2 && parameters.first_level == 0 { &[0, 2] } else { &[0] }
}

/// Adds each sample to its entry's mean: `accumulate`.
pub(in super::super) fn accumulate(table: &mut Table, sampled: &[SampledEntry], parameters: &RadianceCacheParameters) {
    for sampled in sampled {
        let slot = sampled.slot as usize;
        if sampled.slot_hit != NO_SLOT {
            // The winner for the entry that was hit is determined.
            table.requested[sampled.slot_hit as usize] = parameters.frame;
            table.votes[sampled.slot_hit as usize] = 0;
        }
        let level = parameters.bounce_levels.min(1) as usize;
        let before = table.light[level][slot];
        let is_new = before.w == 0.0;
        let mut sent = sampled.reflected + sampled.sent;
        if !sent.to_array().iter().all(|x| *x < 3e38) {
            sent = if is_new { Vec3::ZERO } else { before.truncate() };
        }
        let mixed = mix(before.truncate(), sent, weight(before.w, parameters.most));
        let mean = if is_new { sent } else { mixed };
        table.light[level][slot] = mean.extend(before.w + 1.0);
        let ratio = if is_new { 1.0 } else { weight(before.w, parameters.most) };
        remember(table, sampled, ratio, parameters);
        if level == 0 {
            table.rgbe[slot] = rgbe::pack(mean);
            continue;
        }
        let all = if is_new { mean } else { table.light[0][slot].truncate() };
        let samples = table.light[0][slot].w + 1.0;
        for total in totals(parameters) {
            table.light[*total][slot] = all.extend(samples);
        }
    }
}

/// Adds what a sample's light brought to the known parts of its entry's mean, of which the sample has a fraction `ratio`: `remember`.
fn remember(table: &mut Table, sampled: &SampledEntry, ratio: f32, parameters: &RadianceCacheParameters) {
    let (slot, light) = (sampled.slot as usize, sampled.rank >> 3);
    let brought = ratio * sampled.reflected;
    let known = &mut table.light[1 + parameters.bounce_levels as usize..];
    for part in &mut *known {
        let rgb = if ratio == 1.0 { Vec3::ZERO } else { (1.0 - ratio) * part[slot].truncate() };
        part[slot] = rgb.extend(part[slot].w);
    }
    let value = |part: &Vec<Vec4>| match part[slot].w as u32 == light {
        true => -1.0,
        false => part[slot].truncate().dot(LUMINANCE),
    };
    let Some(least) = known.iter_mut().min_by(|a, b| value(a).total_cmp(&value(b))) else { return };
    let is_known = value(least) < 0.0;
    if light != 0 && brought.dot(LUMINANCE) > value(least) {
        let before = if is_known { least[slot].truncate() } else { Vec3::ZERO };
        least[slot] = (brought + before).extend(light as f32);
    }
}

/// Weights of the channels in luminance.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Number of hits that the mean of earlier hits represents, in an entry with so many samples.
pub(in super::super) fn earlier_count(samples: f32, most: f32) -> f32 {
    (samples.min(most) - LISTED as f32).max(0.0)
}

/// Square roots of three channels, 10 bits each.
pub(in super::super) fn pack_reflectance(reflectance: Vec3) -> u32 {
    let level = |x: f32| (1023.0 * x.clamp(0.0, 1.0).sqrt()).round_ties_even() as u32;
    let [r, g, b] = reflectance.to_array().map(level);
    r + (g << 10) + (b << 20)
}

pub(in super::super) fn unpack_reflectance(bits: u32) -> Vec3 {
    let root = |shift: u32| (bits >> shift & 1023) as f32 / 1023.0;
    Vec3::new(root(0), root(10), root(20)).map(|x| x * x)
}

/// Inserts each sample's hit at the head of its entry's hit list; the radiance of the last hit of a full list goes into the mean of earlier hits:
/// `append_hit`.
pub(in super::super) fn append_hits(table: &mut Table, sampled: &[SampledEntry], parameters: &RadianceCacheParameters) {
    for sampled in sampled {
        let slot = sampled.slot as usize;
        let samples = table.light[0][slot].w;
        if samples >= LISTED as f32 {
            drop_last(table, slot, samples, parameters);
        }
        table.hits[slot].rotate_right(1);
        let is_there = sampled.triangle != NOTHING;
        table.hits[slot][0] = Link {
            slot: if sampled.slot_hit == NO_SLOT { sampled.slot } else { sampled.slot_hit },
            reflectance: if is_there { pack_reflectance(sampled.reflectance) } else { 0 },
        };
    }
}

fn drop_last(table: &mut Table, slot: usize, samples: f32, parameters: &RadianceCacheParameters) {
    let last = table.hits[slot][LISTED - 1];
    for step in 0..parameters.earlier_steps as usize {
        let light = &table.light[parameters.first_level as usize + step];
        let brought = unpack_reflectance(last.reflectance) * outgoing(light, last.slot as usize, slot);
        let mean = &mut table.earlier[step][slot];
        let ratio = 1.0 / (earlier_count(samples, parameters.most) + 1.0);
        // The first hit that leaves the list initializes the mean.
        let mixed = if samples < LISTED as f32 + 1.0 { brought } else { mix(mean.truncate(), brought, ratio) };
        *mean = mixed.extend(0.0);
    }
}

/// Outgoing radiance of an entry, as another one reads it: that of the reader if the entry has no samples.
pub(in super::super) fn outgoing(light: &[Vec4], of: usize, reader: usize) -> Vec3 {
    light[if light[of].w > 0.0 { of } else { reader }].truncate()
}
