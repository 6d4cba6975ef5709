//! Votes for the sample positions of entries.

use glam::IVec2;

use super::*;
use crate::indirect::{
    radiance_cache::{
        planes::TrianglePlane,
        reference::{accumulate, schedule, vote},
    },
    sampled::SampleSlots,
};

const SLOTS: u32 = 256;

/// Priorities, and the winner of each slot.
fn compare_priorities(bench: &Bench) -> Compared {
    let mut random = Random::new(51);
    let mut candidates: Vec<u32> = (0..500).map(|_| word(&mut random)).collect();
    candidates.extend(0..100);
    let mut queries: Vec<[u32; 4]> =
        candidates.iter().map(|candidate| [below(&mut random, 40), *candidate, 0, 0]).collect();
    // The candidate with priority 0, alone in a slot.
    candidates.push(vote::candidate(0, UPDATE.update));
    queries.push([40, candidates[600], 0, 0]);
    let mut memory = memory_of(&Table::new(SLOTS, 1, 0), &parameters(SLOTS));
    let voted = bench.evaluate(&mut memory, "testing/radiance_cache", "cast_vote", &queries, 1);
    let priorities: Vec<u32> = candidates.iter().map(|candidate| vote::priority(*candidate, UPDATE.update)).collect();
    let expected: Vec<[u32; 4]> =
        priorities.iter().zip(&candidates).map(|(priority, of)| [*priority, *of, 0, 0]).collect();
    same("priority and candidate", &voted, &expected)?;
    let mut most = [0; SLOTS as usize];
    for (query, priority) in queries.iter().zip(&priorities) {
        most[query[0] as usize] = most[query[0] as usize].max(*priority);
    }
    same("vote for slot", &memory.get::<u32>("entry_winners"), &most)?;
    // Only voters win.
    let others: Vec<u32> = (0..200).map(|_| word(&mut random)).collect();
    queries.extend(others.iter().map(|candidate| [below(&mut random, 60), *candidate, 0, 0]));
    let priorities = priorities.into_iter().chain(others.iter().map(|of| vote::priority(*of, UPDATE.update)));
    let priorities: Vec<u32> = priorities.collect();
    let is_winner = bench.evaluate(&mut memory, "testing/radiance_cache", "count_votes", &queries, 1);
    let is_winner: Vec<bool> = is_winner.iter().map(|answer| answer[0] == 1).collect();
    let is_selected = |(query, priority): (&[u32; 4], &u32)| *priority != 0 && most[query[0] as usize] == *priority;
    let expected: Vec<bool> = queries.iter().zip(&priorities).map(is_selected).collect();
    same("whether candidate wins", &is_winner, &expected)?;
    // One winner per slot.
    let winners = queries.iter().zip(&is_winner).filter(|(_, is_winner)| **is_winner).map(|(query, _)| query[0]);
    match (winners.clone().collect::<std::collections::BTreeSet<_>>().len(), winners.count()) {
        (slots, winners) if slots == winners => Ok(()),
        differ => Err(format!("slots and winners: {differ:?}")),
    }
}

/// Pixels' rays: their priorities, and the entries for which they may vote.
fn compare_rays(bench: &Bench) -> Compared {
    let mut random = Random::new(52);
    let empty = Table::new(SLOTS, 1, 0);
    for first in [0, 24, 5] {
        let queries: Vec<[u32; 4]> =
            (0..300).map(|_| [below(&mut random, 1 << 26), first + below(&mut random, 32), 0, 0]).collect();
        let mut memory = memory_of(&empty, &parameters(SLOTS));
        memory.bind(&["sample_slots"], &[SampleSlots { round: first, ..Default::default() }]);
        let actual = bench.evaluate(&mut memory, "testing/radiance_cache_rays", "rays", &queries, 1);
        let expected = queries.iter().map(|[scatter, sample, ..]| {
            let priority = vote::ray_priority(*scatter, *sample, first, UPDATE.update);
            let ray = vote::ray_with(priority, first, UPDATE.update);
            assert_eq!(ray.to_array(), [*scatter, *sample]);
            [priority, ray.x, ray.y, 0]
        });
        same("priority and ray", &actual, &expected.collect::<Vec<_>>())?;
    }
    let mask_and_step = [[7, 0], [7, 1], [3, 1], [0, 0]];
    let queries = (0..1200)
        .map(|i| [word(&mut random), below(&mut random, 40), mask_and_step[i % 4][0], mask_and_step[i % 4][1]]);
    let queries: Vec<[u32; 4]> = queries.collect();
    let may_vote =
        bench.evaluate(&mut memory_of(&empty, &parameters(SLOTS)), "testing/radiance_cache", "may_vote", &queries, 1);
    let expected = queries.iter().map(|[key, sample, mask, step]| {
        [schedule::is_voted_for(*key, UPDATE.update, *sample, mask + 1, *step).into(), 0, 0, 0]
    });
    same("whether rays vote", &may_vote, &expected.collect::<Vec<_>>())
}

/// Planes across the axes, and samples whose rays hit them, all with numbers that are exact in a float: results are the same on every device.
fn hits(random: &mut Random, table: &Table) -> (Vec<TrianglePlane>, Vec<SampledEntry>) {
    let ends = [[32_767, 0], [-32_767, 0], [0, 32_767], [0, -32_767], [0, 0]];
    let normal = |i: usize| vote::snorm_bits(IVec2::from(ends[i % ends.len()]));
    let planes: Vec<_> = (0..16).map(|i| TrianglePlane { normal: normal(i), offset: i as f32 * 0.25 - 2.0 }).collect();
    let list = random_list(random, table, 0.9);
    let mut samples = random_samples(random, table, &list);
    for (i, sample) in samples.iter_mut().enumerate() {
        let dyadic = |random: &mut Random| below(random, 256) as f32 / 64.0 - 2.0;
        sample.p_world = Vec3::new(dyadic(random), dyadic(random), dyadic(random));
        sample.distance = below(random, 64) as f32 / 16.0;
        sample.hit_direction = normal(i / 3);
        sample.rank = below(random, 8);
        (sample.slot_hit, sample.vote) = (u32::MAX, 0);
        // Few positions, so that some entries have many voters.
        if i % 2 == 0 {
            (sample.p_world, sample.distance) = (Vec3::new(0.125, 0.125, 0.25 * (i % 6) as f32), 1.0);
        }
    }
    (planes, samples)
}

/// Hits of samples' rays are inserted and voted for, and winners set the sample positions.
fn compare_hits(bench: &Bench) -> Compared {
    // With enough capacity for all, and with too little for some.
    for (slots, entries, are_lost) in [(512, 120, false), (128, 100, true)] {
        let mut random = Random::new(53);
        let parameters = parameters(slots);
        let mut table = random_table(&mut random, slots, entries, &parameters);
        // Pixels' rays have not voted in this update.
        table.votes.fill(0);
        let (planes, mut samples) = hits(&mut random, &table);
        let list: Vec<_> = samples.iter().map(|sample| ScheduledEntry { slot: sample.slot, sample: 0 }).collect();
        let mut memory = memory_of(&table, &parameters);
        memory.bind(&["scheduled"], &scheduled_words(&list, slots));
        memory.bind(&["sampled_entries"], &samples);
        memory.bind(&["triangle_planes"], &planes);
        bench.run(&mut memory, "intersect", "intersect", workgroups(list.len() as u32));
        let lost = vote::intersect(&mut table, &mut samples, &planes, (EYE, &parameters), UPDATE.update);
        assert_eq!(lost > 0, are_lost, "{lost} of {}", samples.len());
        let read: Vec<SampledEntry> = memory.get("sampled_entries");
        let is_lost = |sample: &&SampledEntry| sample.slot_hit == u32::MAX && sample.triangle != u32::MAX;
        let lost = read.iter().filter(is_lost).count() as u32;
        same("counter", &memory.get::<u32>("entry_counters"), &[0, 0, lost, 0])?;
        if (lost > 0) != are_lost {
            return Err(format!("{lost} of {} are lost", read.len()));
        }
        if are_lost {
            // The set of lost entries depends on the order.
            continue;
        }
        bench.run(&mut memory, "intersect", "store_hits", workgroups(list.len() as u32));
        accumulate::append_hits(&mut table, &samples, &parameters);
        vote::select(&mut table, &mut samples, &planes);
        let actual = table_of(&memory, &table);
        same_tables(&actual, &table)?;
        let hit = |table: &Table, sample: &SampledEntry| {
            (table.keys.get(sample.slot_hit as usize).copied(), sample.vote, sample.rank, sample.triangle)
        };
        let read: Vec<SampledEntry> = memory.get("sampled_entries");
        let read: Vec<_> = read.iter().map(|sample| hit(&actual, sample)).collect();
        same("hit", &read, &samples.iter().map(|sample| hit(&table, sample)).collect::<Vec<_>>())?;
        assert!(samples.iter().filter(|sample| sample.vote != 0).count() > 10);
    }
    Ok(())
}

pub(super) fn compare(bench: &Bench) -> Compared {
    compare_priorities(bench)?;
    compare_rays(bench)?;
    compare_hits(bench)
}

#[gpu_test]
fn gpu_votes_match_the_reference(gpu: &Gpu) {
    check(gpu, compare);
}

/// Priorities are invertible: no two candidates have the same.
#[test]
fn priorities_are_a_permutation() {
    let mut random = Random::new(54);
    for _ in 0..10_000 {
        let (candidate, update) = (word(&mut random), word(&mut random));
        assert_eq!(vote::candidate(vote::priority(candidate, update), update), candidate);
    }
}
