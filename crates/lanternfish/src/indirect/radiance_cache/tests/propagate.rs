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
        list.sort_by_key(|entry| table.light[1][entry.of_slot() as usize].w as u32);
        let mut memory = memory_of(&table, &parameters);
        memory.bind(&["scheduled"], &scheduled_words(&list, SLOTS));
        let most = parameters.most;
        for sweep in bounces.steps(2) {
            memory.set("cache_sweep", &[sweep]);
            bench.run(&mut memory, "propagate", "propagate", workgroups(SLOTS));
            propagate::sweep(&mut table, (&sweep, most));
            same_tables(&table_of(&memory, &table), &table)?;
        }
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
    }
    Ok(())
}

#[gpu_test]
fn gpu_propagation_matches_the_reference(gpu: &Gpu) {
    check(gpu, compare);
}
