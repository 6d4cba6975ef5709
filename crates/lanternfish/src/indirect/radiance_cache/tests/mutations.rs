//! Mutation tests: the comparisons detect shaders with an error.

use std::ops::Range;

use super::*;

/// An edit of a file of `indirect/radiance_cache/`, or of another one below `src/`: module, old text and new text.
type Edit = (&'static str, &'static str, &'static str);

/// Edits that each comparison must detect.
const EDITS: [(Comparison, &[Edit]); 7] = [
    (
        hashing::compare,
        &[
            ("hashing", "MOST_LEVEL = 15", "MOST_LEVEL = 14"),
            ("hashing", "LIFT = 0.25", "LIFT = 0.3"),
            ("hashing", "LAYERS = 2.0", "LAYERS = 1.0"),
            ("hashing", "EXPONENT_OF_ONE = 127", "EXPONENT_OF_ONE = 126"),
            ("hashing", "(exponent >> 1u) + 1", "(exponent >> 1u)"),
            ("hashing", "(exponent >> 1u)", "(exponent / 2)"),
            ("hashing", "(u - 0.5)", "(u + 0.5)"),
            ("hashing", "0.499 *", "0.3 *"),
            ("hashing", "normal) + 0.5 - index", "normal) - index"),
            ("hashing", "way - dot(way, normal) * normal", "way"),
            ("hashing", "u32(level) << 3u", "u32(level) << 2u"),
            ("hashing", "layer << 7u", "layer << 8u"),
            ("hashing", "max(words.x, 1u), words.y", "max(words.y, 1u), words.x"),
            ("common/math", "size.y >= size.z", "size.y > size.z"),
            ("common/math", "normal[axis] < 0.0", "normal[axis] > 0.0"),
            ("common/random", "1664525u", "1664527u"),
            ("common/random", "v >> vec4u(16u)", "v >> vec4u(15u)"),
            ("rgbe", "LEAST_EXPONENT = 8u", "LEAST_EXPONENT = 9u"),
            ("rgbe", "MOST_MANTISSA = 255.0", "MOST_MANTISSA = 254.0"),
            ("rgbe", "WHOLE_BITS = 7u", "WHOLE_BITS = 6u"),
            ("rgbe", "whole + 0.5", "whole"),
            ("accumulate", "MOST_BITS = 1023.0", "MOST_BITS = 1024.0"),
            ("accumulate", "levels.z << 20u", "levels.z << 21u"),
            ("propagate", "light.w > 0.0", "light.w >= 0.0"),
            ("propagate", "light.w > 0.0", "light.w > 1.0"),
            ("propagate", "slot <= radiance_cache.slot_mask", "slot < radiance_cache.slot_mask"),
            ("table", "key_at(slot) + BUCKET", "key_at(slot) + BUCKET + 1u"),
        ],
    ),
    (
        table::compare_table,
        &[
            ("table", "PROBES = 16u", "PROBES = 15u"),
            ("table", "PROBES = 16u", "PROBES = 17u"),
            ("table", "i < PROBES", "i + 1u < PROBES"),
            ("table", "bucket + probes + 1u", "bucket + probes"),
            ("table", "bucket + probes + 1u", "bucket + probes + 2u"),
            (
                "table",
                "(entry.hash & radiance_cache.slot_mask) / BUCKET",
                "entry.hash & (radiance_cache.slot_mask / BUCKET)",
            ),
            ("table", "slot < BUCKET * (bucket + 1u)", "slot + 1u < BUCKET * (bucket + 1u)"),
            (
                "table",
                "taken.exchanged { entry_hashes[slot] = entry.hash; }",
                "taken.exchanged { entry_hashes[slot] = entry.key; }",
            ),
            ("table", "select(3u, 2u, is_there.z)", "select(2u, 3u, is_there.z)"),
            ("table", "keys.w == EMPTY", "keys.x != EMPTY"),
        ],
    ),
    (
        table::compare_migration,
        &[
            ("rehash", "<= radiance_cache.kept", "< radiance_cache.kept"),
            ("rehash", "<= radiance_cache.kept", "<= radiance_cache.kept + 1u"),
            ("rehash", "old >= old_slots()", "old + 1u >= old_slots()"),
            ("rehash", "old_words[key_at(old)], old_hashes[old]", "old_words[key_at(old)], old_words[key_at(old)]"),
            ("rehash", "level <= radiance_cache.bounce_levels +", "level < radiance_cache.bounce_levels +"),
            ("rehash", "level * old_slots() + old", "level * (radiance_cache.slot_mask + 1u) + old"),
            ("rehash", "select(end, slot, end == NO_SLOT)", "end"),
            ("rehash", "i < HITS", "i < HITS - 1u"),
            ("rehash", "step < radiance_cache.earlier_steps", "step + 1u < radiance_cache.earlier_steps"),
            ("rehash", "entry_votes[slot] = old_votes[old]", "entry_votes[slot] = radiance_cache.frame"),
            ("rehash", "radiance_cache.bounce_levels == 0u", "radiance_cache.bounce_levels <= 2u"),
        ],
    ),
    (
        vote::compare,
        &[
            ("vote", "x >> 16u)) * 0x7feb352du", "x >> 15u)) * 0x7feb352du"),
            ("vote", "0x846ca68bu", "0x846ca68du"),
            ("vote", "x >> 30u", "x >> 31u"),
            ("vote", "cache_update.update * 0x9e3779b9u);", "(cache_update.update + 1u) * 0x9e3779b9u);"),
            ("vote", "< priority { atomicMax", "> priority { atomicMax"),
            ("vote", "priority != 0u && ", ""),
            ("vote", "== priority;", "<= priority;"),
            ("vote", "LAST_RANK = 7u", "LAST_RANK = 6u"),
            ("vote", "RANK_SHIFT = 28u", "RANK_SHIFT = 27u"),
            ("planes", "dot(normal, direction) > 0.0", "dot(normal, direction) >= 0.0"),
            ("intersect", "LAST_RANK) + 1u", "LAST_RANK)"),
            ("intersect", "rank > rank_of", "rank >= rank_of"),
            ("intersect", "0xffffu", "0x7fffu"),
            ("intersect", "SEED = 34u", "SEED = 33u"),
            ("intersect", "].vote = 0u", "].vote = 1u"),
            ("intersect", "].vote = own", "].vote = 1u"),
            ("intersect", "atomicAdd(&entry_counters[LOST], 1u)", "atomicAdd(&entry_counters[LOST], 2u)"),
            ("indirect/sampled/hit_point", "PLACE_BITS = 26u", "PLACE_BITS = 25u"),
            ("indirect/sampled/hit_point", "SAMPLE_BITS = 5u", "SAMPLE_BITS = 4u"),
            ("indirect/sampled/hit_point", "sample - sample_slots.round", "sample"),
            ("vote", "step * sample", "step + sample"),
            ("vote", "mask + 1u", "2u * (mask + 1u)"),
        ],
    ),
    (
        schedule::compare,
        &[
            ("hashing", "key >> 8u", "key >> 7u"),
            ("hashing", "stride - 1u", "stride"),
            ("schedule", "AGES = 128u", "AGES = 64u"),
            ("schedule", "array(24u, 32u)", "array(25u, 32u)"),
            ("schedule", "array(24u, 32u)", "array(24u, 33u)"),
            ("schedule", "MOST_HALVINGS = 2u", "MOST_HALVINGS = 1u"),
            ("schedule", ">> halvings, 1u)", ">> halvings, 2u)"),
            ("schedule", "(halvings + 1u)", "halvings"),
            ("schedule", "FEWEST = 4u", "FEWEST = 2u"),
            ("schedule", "u32(samples) + radiance_cache.changes", "u32(samples)"),
            ("schedule", "own | (", "(own ^ 1u) | ("),
            ("schedule", "slot > radiance_cache.slot_mask { return", "slot >= radiance_cache.slot_mask { return"),
            ("schedule", "cache_update.counts == 1u { atomicAdd", "cache_update.counts == 0u { atomicAdd"),
            ("schedule", "atomicStore(&entry_winners[slot], 0u);", ""),
            ("schedule", "entry_votes[slot] = radiance_cache.frame;", ""),
            ("schedule", "cache_update.ages != 0u && ", ""),
            ("schedule", "cache_update.remembered < radiance_cache.most", "cache_update.remembered <= 0.0"),
            ("schedule", "<= radiance_cache.kept", "< radiance_cache.kept"),
            ("schedule", "has_changed && !is_requested", "has_changed"),
            ("schedule", "entry_light[at].w > candidate.most", "entry_light[at].w > candidate.most + 1.0"),
            ("schedule", "level <= last_counted_level()", "level < last_counted_level()"),
            ("table", "min(radiance_cache.bounce_levels, 1u)", "1u"),
            ("schedule", "samples < f32(fewest_of(rank, candidate", "samples <= f32(fewest_of(rank, candidate"),
            ("schedule", "radiance_cache.fewest, is_hit)", "radiance_cache.fewest, !is_hit)"),
            ("schedule", "FEWEST_WITHOUT_HITS = 2u", "FEWEST_WITHOUT_HITS = 3u"),
            ("schedule", "select(0u, IS_HIT, candidate.is_hit)", "IS_HIT"),
            ("schedule", "hit_bit, entry.sample & 0xffffu", "0u, entry.sample & 0xffffu"),
            ("schedule", "samples >= f32(WELL_SAMPLED[0]", "samples > f32(WELL_SAMPLED[0]"),
            ("schedule", "(rank + known)", "rank"),
            ("schedule", "(rank + known)", "known"),
            ("schedule", "known), radiance_cache.most_fraction", "known), 2u * radiance_cache.most_fraction"),
            ("schedule", "NEW_SAMPLES = 3u", "NEW_SAMPLES = 300u"),
            ("schedule", "count <= cache_update.budget", "count <= 2u * cache_update.budget"),
            ("schedule", "candidate.rank + 2u", "candidate.rank + 1u"),
            ("schedule", "TIERS), 0)), 7u)", "TIERS), 0)), 5u)"),
            ("schedule", "entry_light[hit].w == 0.0", "entry_light[hit].w <= 1.0"),
            ("schedule", "vote != 0u", "vote <= 1u"),
            ("schedule", "index % WORKGROUP == 0u", "index % WORKGROUP == 1u"),
            ("schedule", "require_workgroups(index + 1u)", "require_workgroups(index)"),
            ("schedule", "slot == 0u { require_workgroups(1u); }", "slot == 1000u { require_workgroups(1u); }"),
            ("schedule", "index == 0u { require_workgroups(1u); }", "index == 1000u { require_workgroups(1u); }"),
            ("common/list_workgroups", "count + WORKGROUP - 1u", "count"),
            ("common/list_workgroups", "groups + WIDTH - 1u", "groups + WIDTH"),
            ("vote", "rank_of(point) < LAST_RANK", "rank_of(point) < LAST_RANK - 1u"),
            ("bindings", "id.y * WIDTH", "id.y * 2u * WIDTH + WORKGROUP"),
        ],
    ),
    (
        accumulate::compare,
        &[
            ("accumulate", "radiance_cache.most) + 1.0", "radiance_cache.most) + 2.0"),
            ("accumulate", "min(before.w, radiance_cache.most)", "min(before.w, radiance_cache.most - 1.0)"),
            ("accumulate", "vec4f(mean, before.w + 1.0)", "vec4f(mean, before.w + 2.0)"),
            ("accumulate", "left * known.rgb", "known.rgb"),
            ("accumulate", "value < least", "value > least"),
            ("accumulate", "luminance(brought) <= least", "luminance(brought) > least"),
            ("accumulate", "entry_light[slot].w + 1.0", "before.w + 1.0"),
            ("accumulate", "met != NO_SLOT", "met == NO_SLOT"),
            ("accumulate", "min(levels, 1u)", "0u"),
            ("accumulate", "before.w > 0.0", "before.w > 1.0"),
            ("accumulate", "found, before.w == 0.0", "found, before.w <= 1.0"),
            ("accumulate", "mean, before.w == 0.0", "mean, before.w == 1.0"),
            ("accumulate", "if levels == 0u", "if levels == 99u"),
            ("accumulate", "samples >= f32(HITS)", "samples > f32(HITS)"),
            ("accumulate", "samples < f32(HITS) + 1.0", "samples < f32(HITS)"),
            ("accumulate", "earlier_count(samples) + 1.0", "earlier_count(samples)"),
            ("accumulate", "HITS + HITS - 1u", "HITS + HITS - 2u"),
            ("accumulate", "i > 0u", "i > 1u"),
            ("accumulate", "i < LIST_HEADER", "i + 1u < LIST_HEADER"),
            ("accumulate", "cache_update.counts == 1u", "cache_update.counts == 0u"),
            ("accumulate", "if has_two_totals()", "if radiance_cache.bounce_levels > 1u"),
            ("accumulate", "if has_two_totals()", "if levels == 99u"),
            ("accumulate", "radiance_cache.first_level + step", "step"),
            ("intersect", "select(slot, own, slot == NO_SLOT)", "own"),
            ("intersect", "triangle != NOTHING { link", "slot_hit != NO_SLOT { link"),
            ("accumulate", "met.w > 0.0", "met.w > 1.0"),
            ("host", "HITS: u32 = 16", "HITS: u32 = 15"),
            ("accumulate", "step * (radiance_cache.slot_mask + 1u)", "step * radiance_cache.slot_mask"),
        ],
    ),
    (
        propagate::compare,
        &[
            ("propagate", "key & 1u", "(key >> 1u) & 1u"),
            ("propagate", "(key & 1u) != cache_sweep.turn", "(key & 1u) == cache_sweep.turn"),
            ("propagate", "slot > radiance_cache.slot_mask", "slot >= radiance_cache.slot_mask / 2u"),
            ("propagate", "index < scheduled.count { _", "index + 1u < scheduled.count { _"),
            ("propagate", "index < scheduled.count { pack_slot", "index + 1u < scheduled.count { pack_slot"),
            (
                "propagate",
                "level_at(cache_sweep.written_level, slot)] = light",
                "level_at(cache_sweep.read_level, slot)] = light",
            ),
            ("propagate", "min(u32(samples), HITS)", "HITS"),
            ("propagate", "entry_light[slot].w;", "entry_light[level_at(1u, slot)].w;"),
            ("propagate", "LEAST_CHANGE = 0.01", "LEAST_CHANGE = 0.001"),
            ("propagate", "i < count", "i + 1u < count"),
            ("propagate", "there.w > 0.0", "there.w > 1.0"),
            ("propagate", "earlier_at(cache_sweep.step, slot)", "earlier_at(0u, slot)"),
            ("propagate", "f32(count) + earlier, 1.0", "f32(count) + earlier, 2.0"),
            ("propagate", "level_at(1u, slot)", "level_at(0u, slot)"),
            ("propagate", "hit.reflectance == 0u", "hit.reflectance <= 1u || i == 3u"),
            ("accumulate", "radiance_cache.most) - f32(HITS)", "radiance_cache.most) - f32(HITS + 1u)"),
            ("table", "radiance_cache.slot_mask + 1u", "radiance_cache.slot_mask"),
        ],
    ),
];

/// Edits that are not detected, of one in `every` edits of each of these comparisons.
fn undetected(gpu: &'static Gpu, comparisons: Range<usize>, every: usize) -> Vec<Edit> {
    let is_undetected = |comparison: Comparison, (module, text, by): Edit| {
        let path = if module.contains('/') { module.to_owned() } else { format!("indirect/radiance_cache/{module}") };
        comparison(&Bench::new(gpu, edited_library(&path, text, by))).is_ok()
    };
    let of = |(comparison, edits): &(Comparison, &'static [Edit])| {
        let edits = edits.iter().copied().step_by(every);
        edits.filter(|edit| is_undetected(*comparison, *edit)).collect::<Vec<_>>()
    };
    EDITS[comparisons].iter().flat_map(of).collect()
}

#[gpu_test]
fn gpu_wrong_shaders_are_detected(gpu: &Gpu) {
    assert_eq!(undetected(gpu, 0..EDITS.len(), 100), []);
}

#[gpu_test(full)]
fn gpu_every_wrong_table_and_vote_is_detected(gpu: &Gpu) {
    assert_eq!(undetected(gpu, 0..4, 1), []);
}

#[gpu_test(full)]
fn gpu_every_wrong_schedule_and_mean_is_detected(gpu: &Gpu) {
    assert_eq!(undetected(gpu, 4..EDITS.len(), 1), []);
}

/// An edit of a missing text or file is refused.
#[test]
fn edits_are_made() {
    for (module, text) in [("indirect/radiance_cache/hashing", "MOST_LEVEL = 99"), ("indirect/nothing", "LIFT")] {
        assert!(std::panic::catch_unwind(|| edited_library(module, text, "")).is_err(), "{module}");
    }
}
