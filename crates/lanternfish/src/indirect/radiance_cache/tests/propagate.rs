//! Propagation of radiance between entries.

use super::*;
use crate::indirect::radiance_cache::{Bounces, reference::propagate};

const SLOTS: u32 = 128;

/// The sweeps of a frame in the order of the host, over all entries and over those of a list.
pub(super) fn compare(bench: &Bench) -> Compared {
    for bounces in [Bounces::UpTo(2), Bounces::UpTo(4), Bounces::All] {
        let parameters = RadianceCacheParameters {
            bounce_levels: bounces.levels(),
            first_level: bounces.first_level(),
            earlier_steps: bounces.earlier_steps(),
            ..parameters(SLOTS)
        };
        let mut random = Random::new(81 + u64::from(bounces.levels()));
        let mut table = random_table(&mut random, SLOTS, 70, &parameters);
        let mut list = random_list(&mut random, &table, 0.4);
        // The last entry has the largest number of samples.
        list.sort_by_key(|entry| table.light[0][entry.of_slot() as usize].w as u32);
        let mut memory = memory_of(&table, &parameters);
        memory.bind(&["scheduled"], &scheduled_words(&list, SLOTS));
        let most = parameters.most;
        memory.bind(&["next_sweeps"], &[0u32; 6]);
        sweep(bench, &mut memory, &mut table, (&bounces.steps(2), most))?;
        for sweep in bounces.steps_of_some(2) {
            memory.set("cache_sweep", &[sweep]);
            bench.run(&mut memory, "propagate", "propagate_scheduled", workgroups(list.len() as u32));
            propagate::sweep_scheduled(&mut table, &list, (&sweep, most));
            same_tables(&table_of(&memory, &table), &table)?;
        }
        let copy = bounces.copy_after(&bounces.steps_of_some(1));
        memory.set("cache_sweep", &[copy]);
        bench.run(&mut memory, "propagate", "pack_scheduled", workgroups(list.len() as u32));
        propagate::pack(&mut table, list.iter().map(|entry| entry.of_slot() as usize), &copy);
        same_tables(&table_of(&memory, &table), &table)?;
        // Until nothing changes.
        let ends = sweep(bench, &mut memory, &mut table, (&bounces.steps(12), most))?;
        assert!(ends > 0 || bounces != Bounces::All, "every sweep changes entries");
    }
    Ok(())
}

/// Sweeps over all entries, and the workgroups of the next ones. Returns the number of sweeps in which nothing changes.
fn sweep(
    bench: &Bench,
    memory: &mut Memory,
    table: &mut Table,
    (sweeps, most): (&[CacheSweep], f32),
) -> Result<u32, String> {
    let mut ends = 0;
    for sweep in sweeps {
        memory.set("cache_sweep", &[CacheSweep { next: 3, ..*sweep }]);
        memory.set("next_sweeps", &[0u32; 6]);
        bench.run(memory, "propagate", "propagate", workgroups(SLOTS));
        let has_changed = propagate::sweep(table, (sweep, most));
        same_tables(&table_of(memory, table), table)?;
        let [x, y, z] = if has_changed { workgroups(SLOTS) } else { [0; 3] };
        same("workgroups of the next sweeps along", &memory.get::<u32>("next_sweeps"), &[0, 0, 0, x, y, z])?;
        ends += u32::from(!has_changed);
    }
    Ok(ends)
}

#[gpu_test]
fn gpu_propagation_matches_the_reference(gpu: &Gpu) {
    check(gpu, compare);
}
