//! The table of the radiance cache, the levels of its entries, the priorities of votes, and packed radiance.

use std::collections::HashSet;

use glam::Vec4Swizzles;
use lanternfish_gpu::{Bindings, storage_buffer, uniform_buffer_of};

use super::*;
use crate::{
    indirect::radiance_cache::{CacheUpdate, RadianceCacheParameters},
    testing::{Random, evaluate_module},
    view::View,
};

const SLOTS: u32 = 4096;

/// Slots of so many entries that are inserted into an empty table, slots from a lookup of the same entries, and from a lookup of as many others. -1: none.
fn slots_of(gpu: &Gpu, entries: u32) -> [Vec<i32>; 3] {
    let buffer = |name| storage_buffer(&gpu.device, name, 8 * u64::from(SLOTS)).unwrap();
    let [words, hashes] = ["words", "hashes"].map(buffer);
    let parameters = RadianceCacheParameters { slot_mask: SLOTS - 1, ..Default::default() };
    let uniform = uniform_buffer_of(&gpu.device, "radiance_cache", &parameters);
    let about = Bindings::new()
        .buffer("radiance_cache", &uniform)
        .buffer("entry_words", &words)
        .buffer("found_words", &words)
        .buffer("entry_hashes", &hashes);
    let evaluate = |entry, first: u32| {
        let numbers: Vec<_> = (first..first + entries).map(|entry| Vec4::splat(entry as f32)).collect();
        let answers = evaluate_module(gpu, "testing/cell_table", entry, &about, &numbers, 1);
        answers.iter().map(|answer| answer.x as i32).collect()
    };
    [evaluate("put", 0), evaluate("look_up", 0), evaluate("look_up", entries)]
}

/// Three quarters of the slots can be filled without losing an entry; a lookup finds the inserted entries in their slots, and no others.
#[gpu_test]
fn gpu_inserted_entries_are_found(gpu: &Gpu) {
    let [put, actual, others] = slots_of(gpu, SLOTS / 4 * 3);
    assert!(put.iter().all(|slot| (0..SLOTS as i32).contains(slot)));
    assert_eq!(put.iter().collect::<HashSet<_>>().len(), put.len());
    assert_eq!(put, actual);
    assert!(others.iter().all(|slot| *slot == -1));
    // The test can fail: with more entries than slots, some have no slot, and a lookup does not find them.
    let [put, actual, _] = slots_of(gpu, SLOTS + 64);
    assert!(put.iter().filter(|slot| **slot == -1).count() >= 64);
    assert_eq!(put, actual);
}

/// Voxel edges double with the distance from the eye: at `near`, and at each doubling of that.
#[gpu_test]
fn gpu_voxel_levels_follow_the_distance(gpu: &Gpu) {
    let (near, eye) = (3.0, Vec3::new(1.0, -20.0, 5.0));
    let uniform =
        uniform_buffer_of(&gpu.device, "radiance_cache", &RadianceCacheParameters { near, ..Default::default() });
    let view = uniform_buffer_of(&gpu.device, "view", &View { eye, ..View::default() });
    let about = Bindings::new().buffer("radiance_cache", &uniform).buffer("view", &view);
    let mut random = Random::new(5);
    let distances: Vec<f32> = (0..4000).map(|_| near * (random.unit() * 20.0 - 3.0).exp2()).collect();
    let points: Vec<_> = distances.iter().map(|far| (eye + *far * random.direction()).extend(0.0)).collect();
    let levels = evaluate_module(gpu, "testing/cell_table", "level", &about, &points, 1);
    let mut seen = HashSet::new();
    for (point, level) in points.iter().zip(&levels) {
        let far = (point.truncate() - eye).length() / near;
        let expected = |far: f32| (far.log2().floor() + 1.0).clamp(0.0, 15.0);
        // Within rounding of a border, the level of either side is correct.
        assert!([0.9999, 1.0001].map(|off| expected(off * far)).contains(&level.x), "{far}: {}", level.x);
        seen.insert(level.x as i32);
    }
    assert_eq!(seen, (0..=15).collect());
}

/// The winning priority identifies the candidate, and priorities are evenly distributed.
#[gpu_test]
fn gpu_priorities_identify_candidates(gpu: &Gpu) {
    let update = CacheUpdate { update: 12_345, ..Default::default() };
    let uniform = uniform_buffer_of(&gpu.device, "cache_update", &update);
    let about = Bindings::new().buffer("cache_update", &uniform);
    let mut random = Random::new(8);
    let halves: Vec<_> = (0..4000)
        .map(|_| [(); 2].map(|()| (65_536.0 * random.unit()).floor()))
        .map(|[x, y]| Vec4::new(x, y, 0.0, 0.0))
        .collect();
    let answers = evaluate_module(gpu, "testing/cell_table", "priorities", &about, &halves, 1);
    assert!(halves.iter().zip(&answers).all(|(candidate, actual)| candidate.xy() == actual.xy()));
    // Priorities of successive candidates are in random order.
    let row: Vec<_> = (0..1024).map(|x| Vec4::new(x as f32, 0.0, 0.0, 0.0)).collect();
    let priorities = evaluate_module(gpu, "testing/cell_table", "priorities", &about, &row, 1);
    let rising = priorities.iter().zip(&priorities[1..]).filter(|(a, b)| a.z < b.z).count();
    assert!((450..=575).contains(&rising), "{rising}");
}

/// RGBE in four bytes: the error of each channel is within 0.4 % of the largest one, over the complete range; black is distinct from no history.
#[gpu_test]
fn gpu_packed_radiance_is_close(gpu: &Gpu) {
    let mut random = Random::new(9);
    let mut radiances: Vec<Vec4> = (0..4000)
        .map(|_| {
            let scale = (random.unit() * 200.0 - 100.0).exp2();
            scale * Vec4::new(random.unit(), random.unit(), random.unit(), 0.0)
        })
        .collect();
    radiances.extend([Vec4::ZERO, Vec4::splat(1e-44), Vec4::X, Vec4::splat(3e38)]);
    let answers = evaluate_module(gpu, "testing/cell_table", "packed", &Bindings::new(), &radiances, 1);
    let mut sum = 0.0;
    for (radiance, actual) in radiances.iter().zip(&answers) {
        assert_eq!(actual.w, 1.0, "{radiance}: no history");
        let most = radiance.truncate().max_element();
        let off = (actual.truncate() - radiance.truncate()).abs().max_element();
        assert!(off <= 0.004 * most || most < 1e-35, "{radiance}: {actual}");
        sum += if most > 1e-35 { (actual.truncate() - radiance.truncate()).element_sum() / most } else { 0.0 };
    }
    // The rounding is unbiased.
    assert!((sum / answers.len() as f32).abs() < 2e-4, "{}", sum / answers.len() as f32);
}
