//! Propagation of radiance along hit lists.

use glam::Vec3;

use super::{
    LISTED, Table,
    accumulate::{earlier_count, outgoing, unpack_reflectance},
    rgbe,
};
use crate::indirect::radiance_cache::parameters::{CacheSweep, ScheduledEntry};

/// A sweep without colours: every entry reads.
const ALL: u32 = 2;

/// Colour of an entry: in a sweep, entries of one colour read, and those of the other do not change.
pub(in super::super) fn color(key: u32) -> u32 {
    key % 2
}

/// One sweep over all entries: `propagate`. `most`: of the cache's parameters. True if any has changed.
pub(in super::super) fn sweep(table: &mut Table, (of_sweep, most): (&CacheSweep, f32)) -> bool {
    let [from, to] = [of_sweep.read_level, of_sweep.written_level].map(|level| level as usize);
    let taken: Vec<usize> = table.taken().collect();
    let mut has_changed = false;
    for slot in taken {
        if of_sweep.turn == ALL || color(table.keys[slot]) == of_sweep.turn {
            has_changed |= read_hits(table, slot, (of_sweep, most));
        } else {
            table.light[to][slot] = table.light[from][slot];
        }
    }
    has_changed
}

/// One sweep over the entries of a list: `propagate_scheduled`.
pub(in super::super) fn sweep_scheduled(
    table: &mut Table,
    list: &[ScheduledEntry],
    (of_sweep, most): (&CacheSweep, f32),
) {
    for entry in list {
        read_hits(table, entry.of_slot() as usize, (of_sweep, most));
    }
}

/// Copies the total of these entries from one level to another, and packs it: `pack`, `pack_scheduled`.
pub(in super::super) fn pack(table: &mut Table, slots: impl IntoIterator<Item = usize>, copy: &CacheSweep) {
    for slot in slots {
        let light = table.light[copy.read_level as usize][slot];
        table.light[copy.written_level as usize][slot] = light;
        table.rgbe[slot] = if light.w > 0.0 { rgbe::pack(light.truncate()) } else { 0 };
    }
}

/// Outgoing radiance of an entry: the mean of its own samples, plus the mean over its hits of the outgoing radiance there, reflected.
/// True if it has changed by more than 1 %.
fn read_hits(table: &mut Table, slot: usize, (of_sweep, most): (&CacheSweep, f32)) -> bool {
    let (direct, samples) = (table.light[1][slot].truncate(), table.light[0][slot].w);
    let light = &table.light[of_sweep.read_level as usize];
    let listed = (samples as usize).min(LISTED);
    let hits = table.hits[slot][..listed].iter().filter(|hit| hit.reflectance != 0);
    let mut sum = hits.fold(Vec3::ZERO, |sum, hit| {
        sum + unpack_reflectance(hit.reflectance) * outgoing(light, hit.slot as usize, slot)
    });
    let earlier = earlier_count(samples, most);
    if earlier > 0.0 {
        sum += earlier * table.earlier[of_sweep.step as usize][slot].truncate();
    }
    let from_others = sum / (listed as f32 + earlier).max(1.0);
    let (before, sent) = (light[slot].truncate(), direct + from_others);
    table.light[of_sweep.written_level as usize][slot] = sent.extend(samples);
    (sent - before).abs().max_element() > 0.01 * sent.max_element()
}
