//! The comparisons can fail: shaders that are wrong by one are told from the reference.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::*;

/// An edit of a file of `indirect/radiance_cache/`, or of another one below `src/`: what stands there, and what is put in its place.
type Edit = (&'static str, &'static str, &'static str);

fn path(module: &str) -> String {
    if module.contains('/') { module.to_owned() } else { format!("indirect/radiance_cache/{module}") }
}

/// An edited shader may also read out of bounds, which the interpreter refuses.
fn is_found_out(comparison: Comparison, (module, text, by): Edit) -> bool {
    let library = crate::testing::edited_library(&path(module), text, by);
    let compared = || comparison(&Bench::new(library, Runner::Interpreter(Order::Forward)));
    match catch_unwind(AssertUnwindSafe(compared)) {
        Ok(compared) => compared.is_err(),
        Err(panic) => {
            let message = panic.downcast_ref::<String>().map_or("", String::as_str);
            assert!(!message.starts_with(NOT_LINKED), "{module}, {by:?}: {message}");
            true
        }
    }
}

fn check_edits(comparison: Comparison, edits: &[Edit]) {
    let overlooked: Vec<_> = edits.iter().filter(|edit| !is_found_out(comparison, **edit)).collect();
    assert!(overlooked.is_empty(), "{overlooked:#?}");
}

#[test]
fn another_hash_is_found_out() {
    check_edits(
        hashing::compare,
        &[
            ("cell", "MOST_LEVEL = 15", "MOST_LEVEL = 14"),
            ("cell", "LIFT = 0.25", "LIFT = 0.3"),
            ("cell", "LAYERS = 2.0", "LAYERS = 1.0"),
            ("cell", "EXPONENT_OF_ONE = 127", "EXPONENT_OF_ONE = 126"),
            ("cell", "(exponent >> 1u) + 1", "(exponent >> 1u)"),
            ("cell", "(exponent >> 1u)", "(exponent / 2)"),
            ("cell", "(u - 0.5)", "(u + 0.5)"),
            ("cell", "u32(level) << 3u", "u32(level) << 2u"),
            ("cell", "layer << 7u", "layer << 8u"),
            ("cell", "max(words.x, 1u), words.y", "max(words.y, 1u), words.x"),
            ("common/math", "size.y >= size.z", "size.y > size.z"),
            ("common/math", "normal[axis] < 0.0", "normal[axis] > 0.0"),
            ("common/random", "1664525u", "1664527u"),
            ("common/random", "v >> vec4u(16u)", "v >> vec4u(15u)"),
            ("packed_radiance", "LEAST_EXPONENT = 8u", "LEAST_EXPONENT = 9u"),
            ("packed_radiance", "MOST_MANTISSA = 255.0", "MOST_MANTISSA = 254.0"),
            ("packed_radiance", "WHOLE_BITS = 7u", "WHOLE_BITS = 6u"),
            ("packed_radiance", "whole + 0.5", "whole"),
            ("links", "MOST_BITS = 1023.0", "MOST_BITS = 1024.0"),
            ("links", "levels.z << 20u", "levels.z << 21u"),
            ("pack", "light.w > 0.0", "light.w >= 0.0"),
            ("pack", "light.w > 0.0", "light.w > 1.0"),
            ("pack", "slot <= radiance_cache.slot_mask", "slot < radiance_cache.slot_mask"),
            ("words", "key_at(slot) + BUCKET", "key_at(slot) + BUCKET + 1u"),
        ],
    );
}

#[test]
fn another_table_is_found_out() {
    check_edits(
        table::compare_table,
        &[
            ("table", "PROBES = 16u", "PROBES = 15u"),
            ("table", "PROBES = 16u", "PROBES = 17u"),
            ("table", "bucket + probes + 1u", "bucket + probes"),
            ("table", "bucket + probes + 1u", "bucket + probes + 2u"),
            (
                "table",
                "(cell.hash & radiance_cache.slot_mask) / BUCKET",
                "cell.hash & (radiance_cache.slot_mask / BUCKET)",
            ),
            ("table", "slot < BUCKET * (bucket + 1u)", "slot + 1u < BUCKET * (bucket + 1u)"),
            (
                "table",
                "taken.exchanged { cell_hashes[slot] = cell.hash; }",
                "taken.exchanged { cell_hashes[slot] = cell.key; }",
            ),
            ("indirect/sampled/find_cells", "select(3u, 2u, is_there.z)", "select(2u, 3u, is_there.z)"),
            ("indirect/sampled/find_cells", "keys.w == EMPTY", "keys.x != EMPTY"),
            ("indirect/sampled/find_cells", "i < PROBES", "i + 1u < PROBES"),
        ],
    );
}

#[test]
fn another_eviction_is_found_out() {
    check_edits(
        table::compare_migration,
        &[
            ("rehash", "<= radiance_cache.kept", "< radiance_cache.kept"),
            ("rehash", "<= radiance_cache.kept", "<= radiance_cache.kept + 1u"),
            ("rehash", "old >= old_slots()", "old + 1u >= old_slots()"),
            ("rehash", "old_words[key_at(old)], old_hashes[old]", "old_words[key_at(old)], old_words[key_at(old)]"),
            ("rehash", "level <= radiance_cache.bounce_levels", "level < radiance_cache.bounce_levels"),
            ("rehash", "level * old_slots() + old", "level * (radiance_cache.slot_mask + 1u) + old"),
            ("rehash", "select(end, slot, end == NO_SLOT)", "end"),
            ("rehash", "i < LINKS", "i < LINKS - 1u"),
            ("rehash", "step < radiance_cache.earlier_steps", "step + 1u < radiance_cache.earlier_steps"),
            ("rehash", "cell_asked[slot] = old_asked[old]", "cell_asked[slot] = radiance_cache.frame"),
            ("rehash", "radiance_cache.bounce_levels == 0u", "radiance_cache.bounce_levels <= 2u"),
        ],
    );
}

#[test]
fn another_vote_is_found_out() {
    check_edits(
        vote::compare,
        &[
            ("table", "x >> 16u)) * 0x7feb352du", "x >> 15u)) * 0x7feb352du"),
            ("table", "0x846ca68bu", "0x846ca68du"),
            ("table", "x >> 30u", "x >> 31u"),
            ("table", "radiance_cache.update * 0x9e3779b9u);", "(radiance_cache.update + 1u) * 0x9e3779b9u);"),
            ("table", "< lot { atomicMax", "> lot { atomicMax"),
            ("table", "lot != 0u && ", ""),
            ("table", "== lot;", "<= lot;"),
            ("sample", "LAST_GENERATION = 7u", "LAST_GENERATION = 6u"),
            ("sample", "GENERATION_SHIFT = 28u", "GENERATION_SHIFT = 27u"),
            ("sample", "dot(normal, direction) > 0.0", "dot(normal, direction) >= 0.0"),
            ("meet", "generation + 1u", "generation"),
            ("meet", "generation > generation_of", "generation >= generation_of"),
            ("meet", "0xffffu", "0x7fffu"),
            ("meet", "SEED = 34u", "SEED = 33u"),
            ("meet", "has_won = 1u", "has_won = 2u"),
            ("meet", "atomicAdd(&cell_counters[LOST], 1u)", "atomicAdd(&cell_counters[LOST], 2u)"),
            ("indirect/sampled/ray_end", "PLACE_BITS = 26u", "PLACE_BITS = 25u"),
            ("indirect/sampled/ray_end", "ROUND_BITS = 5u", "ROUND_BITS = 4u"),
            ("indirect/sampled/ray_end", "round - sampled.round", "round"),
            ("indirect/sampled/find_cells", "sampled.asking_step * round", "sampled.asking_step + round"),
            ("indirect/sampled/find_cells", "sampled.asking_mask + 1u", "2u * (sampled.asking_mask + 1u)"),
        ],
    );
}

#[test]
fn another_schedule_is_found_out() {
    check_edits(
        schedule::compare,
        &[
            ("cell", "key >> 8u", "key >> 7u"),
            ("cell", "share - 1u", "share"),
            ("due", "FADES = 128u", "FADES = 64u"),
            ("due", "array(24u, 32u)", "array(25u, 32u)"),
            ("due", "array(24u, 32u)", "array(24u, 33u)"),
            ("due", "MOST_HALVINGS = 2u", "MOST_HALVINGS = 1u"),
            ("due", "MOST_HALVINGS), 1u)", "MOST_HALVINGS), 2u)"),
            ("due", "u32(samples) + radiance_cache.changes", "u32(samples)"),
            ("due", "own | (", "(own ^ 1u) | ("),
            ("due", "slot > radiance_cache.slot_mask { return", "slot >= radiance_cache.slot_mask { return"),
            ("due", "radiance_cache.counts == 1u { atomicAdd", "radiance_cache.counts == 0u { atomicAdd"),
            ("due", "atomicStore(&cell_winners[slot], 0u);", ""),
            ("due", "cell_asked[slot] = radiance_cache.frame;", ""),
            ("due", "radiance_cache.fades != 0u && ", ""),
            ("due", "radiance_cache.remembered < radiance_cache.most", "radiance_cache.remembered <= 0.0"),
            ("due", "<= radiance_cache.kept", "< radiance_cache.kept"),
            ("due", "has_changed && !is_asked", "has_changed"),
            ("due", "cell_light[at].w > most", "cell_light[at].w > most + 1.0"),
            ("due", "level <= min(radiance_cache.bounce_levels, 1u)", "level < min(radiance_cache.bounce_levels, 1u)"),
            ("due", "samples < f32(fewest_of(generation))", "samples <= f32(fewest_of(generation))"),
            ("due", "samples >= f32(WELL_KNOWN[0]", "samples > f32(WELL_KNOWN[0]"),
            ("due", "(generation + known)", "generation"),
            ("due", "(generation + known)", "known"),
            ("due", "known), radiance_cache.most_share", "known), 2u * radiance_cache.most_share"),
            ("due", "cell_light[met].w == 0.0", "cell_light[met].w <= 1.0"),
            ("due", "has_won == 1u", "has_won <= 1u"),
            ("due", "count + WORKGROUP - 1u", "count + WORKGROUP"),
            ("due", "groups + WIDTH - 1u", "groups + WIDTH"),
            ("sample", "generation_of(point) < LAST_GENERATION", "generation_of(point) < LAST_GENERATION - 1u"),
            ("sampled_cell", "id.y * WIDTH", "id.y * 2u * WIDTH + WORKGROUP"),
        ],
    );
}

#[test]
fn another_accumulation_is_found_out() {
    check_edits(
        accumulate::compare,
        &[
            ("commit", "radiance_cache.most) + 1.0", "radiance_cache.most) + 2.0"),
            ("commit", "min(before.w, radiance_cache.most)", "min(before.w, radiance_cache.most - 1.0)"),
            ("commit", "vec4f(mean, before.w + 1.0)", "vec4f(mean, before.w + 2.0)"),
            ("commit", "met != NO_SLOT", "met == NO_SLOT"),
            ("commit", "min(levels, 1u)", "0u"),
            ("commit", "before.w > 0.0", "before.w > 1.0"),
            ("commit", "found, before.w == 0.0", "found, before.w <= 1.0"),
            ("commit", "mean, before.w == 0.0", "mean, before.w == 1.0"),
            ("commit", "if levels == 0u", "if levels == 99u"),
            ("keep_link", "samples >= f32(LINKS)", "samples > f32(LINKS)"),
            ("keep_link", "samples < f32(LINKS) + 1.0", "samples < f32(LINKS)"),
            ("keep_link", "earlier_count(samples) + 1.0", "earlier_count(samples)"),
            ("keep_link", "LINKS + LINKS - 1u", "LINKS + LINKS - 2u"),
            ("keep_link", "i > 0u", "i > 1u"),
            ("keep_link", "radiance_cache.read_level + step", "step"),
            ("keep_link", "select(met, slot, met == NO_SLOT)", "slot"),
            ("keep_link", "triangle != NOTHING", "slot_met != NO_SLOT"),
            ("keep_link", "met.w > 0.0", "met.w > 1.0"),
            ("links", "LINKS = 16u", "LINKS = 15u"),
            ("links", "step * (radiance_cache.slot_mask + 1u)", "step * radiance_cache.slot_mask"),
        ],
    );
}

#[test]
fn another_propagation_is_found_out() {
    check_edits(
        propagate::compare,
        &[
            ("relax", "key & 1u", "(key >> 1u) & 1u"),
            ("relax", "(key & 1u) != radiance_cache.turn", "(key & 1u) == radiance_cache.turn"),
            ("relax", "slot > radiance_cache.slot_mask", "slot >= radiance_cache.slot_mask / 2u"),
            ("relax", "place < due.count", "place + 1u < due.count"),
            ("relax", "place >= due.count", "place + 1u >= due.count"),
            ("relax", "min(u32(by_itself.w), LINKS)", "LINKS"),
            ("relax", "i < count", "i + 1u < count"),
            ("relax", "met.w > 0.0", "met.w > 1.0"),
            ("relax", "earlier_at(radiance_cache.step, slot)", "earlier_at(0u, slot)"),
            ("relax", "f32(count) + earlier, 1.0", "f32(count) + earlier, 2.0"),
            ("relax", "level_at(1u, slot)", "level_at(0u, slot)"),
            ("relax", "link.reflectance == 0u", "link.reflectance <= 1u || i == 3u"),
            ("links", "radiance_cache.most) - f32(LINKS)", "radiance_cache.most) - f32(LINKS + 1u)"),
            ("bounce_levels", "radiance_cache.slot_mask + 1u", "radiance_cache.slot_mask"),
        ],
    );
}

/// Texts as they are pass, and an edit of what is not there is refused.
#[test]
fn edits_are_made() {
    let same_again = ("cell", "MOST_LEVEL = 15", "MOST_LEVEL = 16 - 1");
    assert!(!is_found_out(hashing::compare, same_again));
    let edit = |module: &str, text: &str| catch_unwind(|| crate::testing::edited_library(module, text, "")).is_err();
    assert!(edit("indirect/radiance_cache/cell", "MOST_LEVEL = 99") && edit("indirect/radiance_cache/nothing", "cell"));
}
