//! Scheduling of entries.

use super::*;
use crate::indirect::radiance_cache::reference::schedule;

const SLOTS: u32 = 256;

/// Parameters of frames of every kind.
fn frames() -> Vec<(RadianceCacheParameters, CacheUpdate)> {
    let (frame, update) = (parameters(SLOTS), UPDATE);
    let first = RadianceCacheParameters { fewest: 16, ..frame };
    let of_first = CacheUpdate { fraction: 0, ages: 0, ..update };
    let is_reset = RadianceCacheParameters { most_fraction: 1, ..frame };
    let mut frames = vec![
        (frame, update),
        (RadianceCacheParameters { bounce_levels: 0, earlier_steps: 0, ..frame }, update),
        (frame, CacheUpdate { fraction: 1, ..update }),
        (is_reset, CacheUpdate { fraction: 1, ..update }),
        // A single change, and one of many.
        (is_reset, CacheUpdate { remembered: 0.0, fraction: 1, ..update }),
        (
            RadianceCacheParameters { changes: 65_533, ..is_reset },
            CacheUpdate { remembered: 3.0, fraction: 1, ..update },
        ),
        (is_reset, CacheUpdate { remembered: 3.0, fraction: 1, budget: 10, ..update }),
        (is_reset, CacheUpdate { remembered: 3.0, fraction: 1, budget: 40, ..update }),
        (is_reset, CacheUpdate { fraction: 1, budget: 70, ..update }),
        (is_reset, CacheUpdate { fraction: 1, budget: 1000, ..update }),
        (first, of_first),
        (RadianceCacheParameters { fewest: 128, ..first }, CacheUpdate { counts: 0, ..of_first }),
        (RadianceCacheParameters { fewest: 1, ..frame }, update),
    ];
    frames.extend((0..8).map(|i| (first, CacheUpdate { update: 7 * i, ..of_first })));
    // Successive updates.
    let following = |i| CacheUpdate { update: update.update + i, fraction: if i < 10 { 8 } else { 1 }, ..update };
    frames.extend((1..20).map(|i| (frame, following(i))));
    let one_bounce = RadianceCacheParameters { bounce_levels: 0, earlier_steps: 0, ..is_reset };
    frames.push((one_bounce, CacheUpdate { remembered: 0.0, ..update }));
    frames
}

fn sorted(mut list: Vec<ScheduledEntry>) -> Vec<[u32; 2]> {
    list.sort_by_key(|entry| entry.of_slot());
    list.iter().map(|entry| [entry.slot, entry.sample]).collect()
}

/// The lists of an update's first and second sample.
fn compare_lists(
    bench: &Bench,
    frame: usize,
    (parameters, update): &(RadianceCacheParameters, CacheUpdate),
) -> Compared {
    let mut random = Random::new(61 + frame as u64);
    let mut table = random_table(&mut random, SLOTS, 160, parameters);
    let entries = table.taken().count() as u32;
    let mut memory = memory_of(&table, parameters);
    // Nothing beyond the table's levels changes.
    let (light, beyond) = (table.light.concat(), vec![Vec4::INFINITY; SLOTS as usize]);
    memory.set("entry_light", &[light.clone(), beyond.clone()].concat());
    memory.set("cache_update", &[*update]);
    let empty = vec![0u32; LIST_HEADER + 2 * SLOTS as usize];
    memory.bind(&["found_scheduled"], &empty);
    memory.bind(&["scheduled"], &scheduled_words(&[], SLOTS));
    memory.bind(&["sampled_entries"], &vec![SampledEntry::default(); SLOTS as usize]);
    if update.budget > 0 {
        bench.run(&mut memory, "schedule", "classify", workgroups(SLOTS));
    }
    bench.run(&mut memory, "schedule", "choose", workgroups(SLOTS));
    let list = schedule::choose(&mut table, parameters, update);
    let words: Vec<u32> = memory.get("found_scheduled");
    let actual = list_of(&words);
    same("scheduled entry", &sorted(actual), &sorted(list.clone()))?;
    same_tables(&table_of(&memory, &table), &table)?;
    same("radiance beyond the levels", &memory.get::<Vec4>("entry_light")[light.len()..], &beyond)?;
    let count = list.len() as u32;
    same("workgroups along", &words[..6], &schedule::workgroups(count))?;
    same("number of entries", &words[6..8], &[count, if update.counts == 1 { entries } else { 0 }])?;

    // After the first samples.
    for entry in &list {
        let level = parameters.bounce_levels.min(1) as usize;
        table.light[level][entry.of_slot() as usize].w += 1.0;
        table.light[0][entry.of_slot() as usize].w = table.light[level][entry.of_slot() as usize].w;
    }
    let mut samples = random_samples(&mut random, &table, &list);
    // Each entry has one winner.
    let mut is_winner = std::collections::BTreeSet::new();
    samples.iter_mut().for_each(|sample| sample.vote &= u32::from(is_winner.insert(sample.slot_hit)));
    memory.set("entry_light", &table.light.concat());
    memory.set("scheduled", &scheduled_words(&list, SLOTS));
    samples.resize(SLOTS as usize, SampledEntry::default());
    memory.set("sampled_entries", &samples);
    memory.set("found_scheduled", &empty);
    bench.run(&mut memory, "schedule", "choose_again", workgroups(count.max(1)));
    let again = schedule::choose_again(&table, &list, &samples, parameters);
    let words: Vec<u32> = memory.get("found_scheduled");
    same("workgroups along", &words[..6], &schedule::workgroups(again.len() as u32))?;
    same("entry that is scheduled again", &sorted(list_of(&words)), &sorted(again))
}

pub(super) fn compare(bench: &Bench) -> Compared {
    frames().iter().enumerate().try_for_each(|(frame, told)| compare_lists(bench, frame, told))?;
    compare_lengths(bench)
}

/// Lists around the lengths of workgroups and of rows of them, which grow by one entry.
fn compare_lengths(bench: &Bench) -> Compared {
    // A list that stays empty has a workgroup, too.
    let mut memory = memory_of(&Table::new(64, 3, 1), &parameters(64));
    memory.bind(&["scheduled"], &scheduled_words(&[], 64));
    memory.bind(&["sampled_entries"], &[SampledEntry::default()]);
    for entry in ["choose", "choose_again"] {
        memory.bind(&["found_scheduled"], &[0u32; LIST_HEADER + 2]);
        bench.run(&mut memory, "schedule", entry, workgroups(64));
        same("workgroups along", &memory.get::<u32>("found_scheduled")[..6], &schedule::workgroups(0))?;
    }
    for count in [0, 1, 63, 64, 65, 65_472, 65_535, 65_536, 65_537, 131_073] {
        let (mut random, parameters) = (Random::new(63), RadianceCacheParameters { fewest: 128, ..parameters(64) });
        let mut table = random_table(&mut random, 64, 1, &parameters);
        let slot = table.taken().next().expect("it has one entry");
        (table.votes[slot], table.light[0][slot].w) = (1, 0.0);
        let mut memory = memory_of(&table, &parameters);
        let mut words = vec![0; LIST_HEADER + 2 * (count as usize + 1)];
        words[..6].copy_from_slice(&schedule::workgroups(count));
        words[6] = count;
        memory.bind(&["found_scheduled"], &words);
        bench.run(&mut memory, "schedule", "choose", workgroups(64));
        let words: Vec<u32> = memory.get("found_scheduled");
        same(&format!("workgroups of {count} and one along"), &words[..6], &schedule::workgroups(count + 1))?;
    }
    Ok(())
}

/// Successive updates of the reference keep to a budget, and each requested entry gets its turn.
#[test]
fn a_budget_is_kept_and_every_entry_gets_its_turn() {
    let (mut random, parameters, budget) = (Random::new(64), parameters(8192), 300);
    let table = random_table(&mut random, 8192, 4000, &parameters);
    let mut visited = std::collections::BTreeSet::new();
    for frame in 0..128 {
        let update = CacheUpdate { update: 5 * frame, fraction: 1, remembered: 5.0, budget, ..UPDATE };
        let list = schedule::choose(&mut table.clone(), &parameters, &update);
        assert!((budget / 3..budget + budget / 10).contains(&(list.len() as u32)), "{} in {frame}", list.len());
        visited.extend(list.iter().map(|entry| entry.of_slot() as usize));
    }
    let is_requested = |slot: &usize| table.votes[*slot] != 0 || table.is_kept(*slot, &parameters);
    assert_eq!(visited, table.taken().filter(is_requested).collect());
}

#[gpu_test]
fn gpu_schedule_matches_the_reference(gpu: &Gpu) {
    check(gpu, compare);
}

/// Update strides of the reference: each entry is scheduled once in `stride` successive updates, and the updates of a larger stride are among them.
#[test]
fn each_entry_is_scheduled_once_per_stride() {
    let mut random = Random::new(62);
    for _ in 0..1000 {
        let (key, first) = (word(&mut random), word(&mut random) >> 1);
        let scheduled = |stride| {
            (first..first + 64).filter(|update| schedule::is_in_stride(key, *update, stride)).collect::<Vec<_>>()
        };
        assert_eq!([1, 8, 64].map(|stride| scheduled(stride).len()), [64, 8, 1]);
        assert!(scheduled(64).iter().all(|update| scheduled(8).contains(update)));
    }
}
