//! Accumulation of samples in their entries.

use super::*;
use crate::indirect::radiance_cache::{planes::TrianglePlane, reference::accumulate};

const SLOTS: u32 = 256;

/// Parameters of caches with one bounce, with a limited number of bounces, and with all.
fn caches() -> [RadianceCacheParameters; 3] {
    let all = parameters(SLOTS);
    [
        RadianceCacheParameters { bounce_levels: 0, earlier_steps: 0, ..all },
        RadianceCacheParameters { bounce_levels: 3, first_level: 1, earlier_steps: 3, ..all },
        all,
    ]
}

/// Hits are appended and samples accumulated in successive updates.
pub(super) fn compare(bench: &Bench) -> Compared {
    for (cache, parameters) in caches().iter().enumerate() {
        let mut random = Random::new(71 + cache as u64);
        let mut table = random_table(&mut random, SLOTS, 150, parameters);
        for update in 0..4 {
            let list = random_list(&mut random, &table, 0.5);
            let mut samples = random_samples(&mut random, &table, &list);
            // NaN, and numbers that are too large.
            samples.iter_mut().step_by(3).for_each(|sample| sample.sent = Vec3::NAN);
            samples.iter_mut().step_by(7).for_each(|sample| sample.sent = Vec3::splat(f32::INFINITY));
            let mut memory = memory_of(&table, parameters);
            memory.bind(&["scheduled"], &scheduled_words(&list, SLOTS));
            memory.bind(&["sampled_entries"], &samples);
            memory.bind(&["triangle_planes"], &[TrianglePlane::default(); 16]);
            memory.bind(&["list_to_empty"], &[7u32; LIST_HEADER + 1]);
            memory.set("entry_counters", &[77u32, 1000, 3, 4]);
            memory.set("cache_update", &[CacheUpdate { counts: u32::from(update % 2 == 0), ..UPDATE }]);
            if parameters.bounce_levels > 0 {
                bench.run(&mut memory, "intersect", "store_hits", workgroups(list.len() as u32));
                accumulate::append_hits(&mut table, &samples, parameters);
            }
            bench.run(&mut memory, "accumulate", "accumulate", workgroups(list.len() as u32));
            accumulate::accumulate(&mut table, &samples, parameters);
            let mut emptied = [0; LIST_HEADER + 1];
            emptied[LIST_HEADER] = 7;
            same("word of the other list", &memory.get::<u32>("list_to_empty"), &emptied)?;
            let taken = if update % 2 == 0 { TAKEN } else { 77 };
            same("counter", &memory.get("entry_counters"), &[taken, 1000 + list.len() as u32, 3, 4])?;
            let mut actual = table_of(&memory, &table);
            // The rounding of roots, and of means before packing, depends on the device.
            take_close_ones(&mut actual, &table);
            same_tables(&actual, &table)?;
        }
    }
    Ok(())
}

/// Replaces packed numbers that differ by one step with those of the other table.
fn take_close_ones(actual: &mut Table, expected: &Table) {
    for slot in expected.taken() {
        let (rgbe, expected_rgbe) = (&mut actual.rgbe[slot], expected.rgbe[slot]);
        if is_close(*rgbe, expected_rgbe, [0, 8, 16], 0xff) && *rgbe >> 24 == expected_rgbe >> 24 {
            *rgbe = expected_rgbe;
        }
        for (hit, expected) in actual.hits[slot].iter_mut().zip(&expected.hits[slot]) {
            if is_close(hit.reflectance, expected.reflectance, [0, 10, 20], 1023) {
                hit.reflectance = expected.reflectance;
            }
        }
    }
}

/// True if the parts of two words at these bits differ by one step at most.
pub(super) fn is_close(a: u32, b: u32, bits: [u32; 3], mask: u32) -> bool {
    bits.iter().all(|bit| (a >> bit & mask).abs_diff(b >> bit & mask) <= 1)
}

#[gpu_test]
fn gpu_accumulation_matches_the_reference(gpu: &Gpu) {
    check(gpu, compare);
}
