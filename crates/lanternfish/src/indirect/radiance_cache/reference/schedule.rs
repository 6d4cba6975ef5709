//! Scheduling: the entries that get another sample in an update.

use super::{Table, accumulate::totals, vote};
use crate::indirect::radiance_cache::{
    CacheUpdate, RadianceCacheParameters,
    parameters::{SampledEntry, ScheduledEntry},
};

/// Updates after which an unrequested entry ages to the next rank.
const AGES: u32 = 128;
/// Least samples of an entry of rank 0 that is updated half as often, and a quarter as often.
const WELL_SAMPLED: [u32; 2] = [24, 32];
/// Most halvings of these numbers, by rank.
const MOST_HALVINGS: u32 = 2;

/// True if the update stride schedules this key in this update: one of `stride` keys, a power of two.
pub(in super::super) fn is_in_stride(key: u32, update: u32, stride: u32) -> bool {
    (key / 256 % stride) == update % stride
}

/// True if rays of this sample index vote for this existing entry: for one of `stride` entries. `step` 1: a different
/// subset for each sample index.
pub(in super::super) fn is_voted_for(key: u32, update: u32, sample: u32, stride: u32, step: u32) -> bool {
    is_in_stride(key, update ^ (step * sample), stride)
}

/// Samples of an entry of rank 0 that no ray of pixels has hit since it was last scheduled.
const FEWEST_WITHOUT_HITS: u32 = 2;

/// Samples up to which an entry of this rank is scheduled in every update.
fn fewest(rank: u32, is_hit: bool, parameters: &RadianceCacheParameters) -> u32 {
    match rank {
        0 if !is_hit => parameters.fewest.min(FEWEST_WITHOUT_HITS),
        0 => parameters.fewest,
        1 => (parameters.fewest / 4).max(parameters.fewest.min(4) / 2).max(1),
        _ => (parameters.fewest / 8).max(parameters.fewest.min(4) / 4).max(1),
    }
}

/// The number of an entry's next sample, with the shift of its sequences in the lower half.
fn scheduled(
    table: &Table,
    (slot, is_hit): (usize, bool),
    samples: u32,
    parameters: &RadianceCacheParameters,
) -> ScheduledEntry {
    let number = samples.wrapping_add(parameters.changes) % 65_536;
    let slot_and_bit = slot as u32 | if is_hit { ScheduledEntry::IS_HIT } else { 0 };
    ScheduledEntry { slot: slot_and_bit, sample: table.keys[slot] / 65_536 + number * 65_536 }
}

/// Samples that a new entry takes of the budget, about.
const NEW_SAMPLES: u32 = 3;

/// Of an entry in a frame with a budget; 0: new, 1: hit by pixels' rays, 2 and above: by rank.
fn tier(table: &Table, slot: usize, parameters: &RadianceCacheParameters, remembered: f32) -> Option<usize> {
    let is_hit = table.votes[slot] != 0;
    let is_requested = is_hit || parameters.frame.wrapping_sub(table.requested[slot]) <= parameters.kept;
    let rank = vote::rank(table.samples[slot]) as usize;
    let is_new = table.light[0][slot].w.min(remembered) == 0.0 && rank == 0;
    let by_rank = if is_hit { 1 } else { (rank + 2).min(7) };
    is_requested.then_some(if is_new { 0 } else { by_rank })
}

/// Update stride of each tier: the smallest ones that keep to the budget.
fn strides(table: &Table, parameters: &RadianceCacheParameters, of_update: &CacheUpdate) -> [u32; 8] {
    let mut counts = [0; 8];
    table
        .taken()
        .filter_map(|slot| tier(table, slot, parameters, of_update.remembered))
        .for_each(|tier| counts[tier] += 1);
    let at = |coarseness: u32| {
        [0, 1, 2, 3, 4, 5, 6, 7]
            .map(|tier| if tier == 0 { 1 } else { 1 << (tier + coarseness).saturating_sub(8).min(7) })
    };
    let samples =
        |strides: [u32; 8]| (1..8).map(|tier| counts[tier] / strides[tier]).sum::<u32>() + NEW_SAMPLES * counts[0];
    at((0..15).find(|coarseness| samples(at(*coarseness)) <= of_update.budget).unwrap_or(15))
}

/// The first list of an update, from all entries; also cuts histories: `choose`.
pub(in super::super) fn choose(
    table: &mut Table,
    parameters: &RadianceCacheParameters,
    of_update: &CacheUpdate,
) -> Vec<ScheduledEntry> {
    let taken: Vec<usize> = table.taken().collect();
    let strides = strides(table, parameters, of_update);
    taken.into_iter().filter_map(|slot| choose_one(table, slot, parameters, of_update, strides)).collect()
}

fn choose_one(
    table: &mut Table,
    slot: usize,
    parameters: &RadianceCacheParameters,
    of_update: &CacheUpdate,
    strides: [u32; 8],
) -> Option<ScheduledEntry> {
    let RadianceCacheParameters { most_fraction, most, .. } = *parameters;
    let CacheUpdate { update, fraction, remembered, ages, .. } = *of_update;
    let key = table.keys[slot];
    let is_hit = table.votes[slot] != 0;
    let tier = tier(table, slot, parameters, remembered);
    if is_hit {
        table.requested[slot] = parameters.frame;
        table.votes[slot] = 0;
    } else if ages != 0 && is_in_stride(key, update, AGES) {
        let rank = vote::rank(table.samples[slot]);
        table.samples[slot] = vote::with_rank(table.samples[slot], (rank + 1).min(vote::LAST_RANK));
    }
    let has_changed = remembered < most;
    let is_requested = parameters.frame.wrapping_sub(table.requested[slot]) <= parameters.kept;
    if has_changed {
        // The history is cut, or reset.
        let cut = if is_requested { remembered } else { 0.0 };
        let direct = (parameters.bounce_levels > 0).then_some(&1);
        for level in totals(parameters).iter().chain(direct) {
            table.light[*level][slot].w = table.light[*level][slot].w.min(cut);
        }
    }
    let samples = table.light[0][slot].w as u32;
    let rank = vote::rank(table.samples[slot]);
    let halvings = rank.min(MOST_HALVINGS);
    let halved_rate = WELL_SAMPLED.iter().filter(|well| samples >= **well >> halvings).count() as u32;
    let stride = if fraction == 0 { 0 } else { (fraction << (rank + halved_rate)).min(most_fraction) };
    let is_in_own_stride = fraction != 0 && is_in_stride(key, update, fraction) && is_in_stride(key, update, stride);
    if let Some(tier) = tier.filter(|_| of_update.budget > 0) {
        return is_in_stride(key, update, strides[tier]).then(|| scheduled(table, (slot, is_hit), samples, parameters));
    }
    let is_scheduled = is_requested && (samples < fewest(rank, is_hit, parameters) || is_in_own_stride);
    is_scheduled.then(|| scheduled(table, (slot, is_hit), samples, parameters))
}

/// A further list of an update: entries of the previous list that still have too few samples, and new entries that
/// these have hit: `choose_again`.
pub(in super::super) fn choose_again(
    table: &Table,
    before: &[ScheduledEntry],
    sampled: &[SampledEntry],
    parameters: &RadianceCacheParameters,
) -> Vec<ScheduledEntry> {
    let mut list = Vec::new();
    for (entry, sampled) in before.iter().zip(sampled) {
        let (slot, is_hit) = (entry.of_slot() as usize, entry.slot != entry.of_slot());
        let samples = table.light[0][slot].w as u32;
        if samples < fewest(vote::rank(table.samples[slot]), is_hit, parameters) {
            list.push(scheduled(table, (slot, is_hit), samples, parameters));
        }
        let hit = sampled.slot_hit as usize;
        if sampled.vote != 0 && table.light[0][hit].w == 0.0 {
            list.push(scheduled(table, (hit, false), 0, parameters));
        }
    }
    list
}

/// Workgroups along x, y and z for a list of this length, at least one; and those for two rays of each entry.
pub(in super::super) fn workgroups(count: u32) -> [u32; 6] {
    let groups = count.max(1).div_ceil(64);
    let [x, y] = [groups.min(1024), groups.div_ceil(1024)];
    [x, y, 1, x, y, 2]
}
