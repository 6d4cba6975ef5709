//! Entries read what others send.

use super::*;
use crate::indirect::radiance_cache::{Bounces, reference::propagate};

const SLOTS: u32 = 128;

/// The sweeps of a frame in the order in which the host asks for them, over all entries and over those of a list.
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
        // The last one has as many samples as any.
        list.sort_by_key(|entry| table.light[1][entry.slot as usize].w as u32);
        let mut memory = memory_of(&table, &parameters);
        memory.bind(&["scheduled"], &scheduled_words(&list, SLOTS));
        let most = parameters.most;
        for sweep in bounces.steps(2) {
            memory.set("cache_sweep", &[sweep]);
            bench.run(&mut memory, "propagate", "propagate", workgroups(SLOTS));
            propagate::sweep(&mut table, (&sweep, most));
            same_tables(bench, &table_of(&memory, &table), &table)?;
        }
        for sweep in bounces.steps_of_some(2) {
            memory.set("cache_sweep", &[sweep]);
            bench.run(&mut memory, "propagate", "propagate_scheduled", workgroups(list.len() as u32));
            propagate::sweep_scheduled(&mut table, &list, (&sweep, most));
            same_tables(bench, &table_of(&memory, &table), &table)?;
            if bounces == Bounces::All {
                bench.run(&mut memory, "propagate", "copy_back", workgroups(list.len() as u32));
                propagate::copy_back(&mut table, &list, &sweep);
            }
            same_tables(bench, &table_of(&memory, &table), &table)?;
        }
    }
    Ok(())
}

#[test]
fn light_is_propagated_as_the_references() {
    check(compare);
}

#[test]
fn gpu_light_is_propagated_as_the_references() {
    check_on_gpu("gpu_light_is_propagated_as_the_references", compare);
}
