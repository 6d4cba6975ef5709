//! Inserting, looking up and evicting entries.

use super::*;

const SLOTS: u32 = 1024;

/// The last entries have no slot if all hashes select a few buckets.
fn compare_insertions(bench: &Bench, count: usize, homes: u32) -> Compared {
    let mut random = Random::new(41);
    let entries = random_entries(&mut random, count, homes);
    // Some are inserted twice.
    let inserted: Vec<Entry> = entries.iter().chain(&entries[..count / 4]).copied().collect();
    let mut expected = Table::new(SLOTS, 1, 0);
    inserted.iter().for_each(|entry| _ = expected.insert(*entry));
    let mut memory = memory_of(&Table::new(SLOTS, 1, 0), &parameters(SLOTS));
    let queries: Vec<_> = inserted.iter().map(|entry| [entry.key, entry.hash, 0, 0]).collect();
    let actual = bench.evaluate(&mut memory, "testing/radiance_cache", "insert", &queries, 1);
    let actual: Vec<u32> = actual.iter().map(|answer| answer[0]).collect();
    let table = table_of(&memory, &expected);
    // The set of entries without a slot depends on the order; their number does not.
    let kept = kept(&table)?;
    for (entry, slot) in inserted.iter().zip(&actual) {
        let is_right = match *slot {
            u32::MAX => table.is_full_for(*entry) && !kept.contains_key(&entry.key),
            slot => table.find(*entry) == Some(slot),
        };
        if !is_right {
            return Err(format!("{entry:?} was reported in slot {slot}"));
        }
    }
    if expected.taken().count() == count {
        same("key", &kept.keys().collect::<Vec<_>>(), &super::kept(&expected)?.keys().collect::<Vec<_>>())?;
    } else if table.taken().count() != expected.taken().count() {
        return Err(format!("{} entries for {}", table.taken().count(), expected.taken().count()));
    }
    compare_searches(bench, &table, &inserted)
}

/// Compares lookups in a table.
fn compare_searches(bench: &Bench, table: &Table, inserted: &[Entry]) -> Compared {
    let mut random = Random::new(42);
    let others = random_entries(&mut random, 300, SLOTS / 4);
    let all: Vec<Entry> = inserted.iter().chain(&others).copied().collect();
    let queries: Vec<_> = all.iter().map(|entry| [entry.key, entry.hash, 0, 0]).collect();
    let mut memory = memory_of(table, &parameters(SLOTS));
    let actual = bench.evaluate(&mut memory, "testing/radiance_cache", "look_up", &queries, 1);
    let actual: Vec<Option<u32>> = actual.iter().map(|answer| Some(answer[0]).filter(|slot| *slot < SLOTS)).collect();
    same("slot of lookup", &actual, &all.iter().map(|entry| table.find(*entry)).collect::<Vec<_>>())
}

pub(super) fn compare_table(bench: &Bench) -> Compared {
    compare_insertions(bench, 400, SLOTS / 4)?;
    // Full buckets, after which others are probed: 64 slots per home bucket. The last entries are lost.
    compare_insertions(bench, 75, 1)?;
    compare_insertions(bench, 500, 4)
}

/// Entries migrate to a table of the same size, a larger one, or one that is too small for them.
pub(super) fn compare_migration(bench: &Bench) -> Compared {
    for (slots, new_slots, entries, levels) in
        [(256, 256, 150, 2), (256, 512, 180, 3), (256, 256, 140, 0), (128, 128, 90, 2)]
    {
        let mut random = Random::new(43 + u64::from(new_slots + levels));
        let steps = u32::from(levels > 0) + u32::from(levels == 3);
        let kept = if new_slots > slots { u32::MAX } else { 128 };
        let parameters =
            RadianceCacheParameters { bounce_levels: levels, earlier_steps: steps, kept, ..parameters(new_slots) };
        let old = random_table(&mut random, slots, entries, &parameters);
        let empty = Table::new(new_slots, 5 + levels as usize, steps as usize);
        let mut memory = memory_of(&empty, &parameters);
        bind_table(&mut memory, &old, "old_", "old_earlier");
        // The other names are bound to the words of the new table.
        memory.bind(&["moved_to"], &vec![0u32; slots as usize]);
        for entry in ["rehash", "migrate", "migrate_hits"] {
            bench.run(&mut memory, "rehash", entry, workgroups(slots));
        }
        let (expected, _) = old.migrate(new_slots, &parameters);
        let staying = expected.taken().count();
        assert!(if kept == 128 { staying < entries } else { staying == entries }, "{staying} of {entries}");
        same_tables(&table_of(&memory, &expected), &expected)?;
        let moved_to: Vec<u32> = memory.get("moved_to");
        let moves = |slot: usize| old.is_kept(slot, &parameters);
        let moved: Vec<bool> = moved_to.iter().map(|slot| *slot != u32::MAX).collect();
        same("whether it moves: slot", &moved, &(0..slots as usize).map(moves).collect::<Vec<_>>())?;
    }
    Ok(())
}

#[gpu_test]
fn gpu_table_matches_the_reference(gpu: &Gpu) {
    check(gpu, compare_table);
}

#[gpu_test]
fn gpu_migration_matches_the_reference(gpu: &Gpu) {
    check(gpu, compare_migration);
}
