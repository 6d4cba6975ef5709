//! The table of the radiance cache, levels of its entries, who has asked for them, and what they send in four bytes.

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

/// Slots of entries of these numbers that are put into an empty table, slots of the same entries when they are looked up, and of as many others. -1: none.
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

/// Three quarters of the slots can be taken without losing an entry; what is put in is found there, and nothing else is found.
#[test]
fn gpu_cells_are_found_where_they_were_put() {
    let Some(gpu) = testing::gpu("gpu_cells_are_found_where_they_were_put") else { return };
    let [put, found, others] = slots_of(gpu, SLOTS / 4 * 3);
    assert!(put.iter().all(|slot| (0..SLOTS as i32).contains(slot)));
    assert_eq!(put.iter().collect::<HashSet<_>>().len(), put.len());
    assert_eq!(put, found);
    assert!(others.iter().all(|slot| *slot == -1));
    // It can fail: of more entries than there are slots some have none, and those are not found.
    let [put, found, _] = slots_of(gpu, SLOTS + 64);
    assert!(put.iter().filter(|slot| **slot == -1).count() >= 64);
    assert_eq!(put, found);
}

/// Edges double with the distance from the eye: at `near`, and at each doubling of that.
#[test]
fn gpu_levels_are_those_of_the_distance() {
    let Some(gpu) = testing::gpu("gpu_levels_are_those_of_the_distance") else { return };
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
        // Within rounding of a border either side's will do.
        assert!([0.9999, 1.0001].map(|off| expected(off * far)).contains(&level.x), "{far}: {}", level.x);
        seen.insert(level.x as i32);
    }
    assert_eq!(seen, (0..=15).collect());
}

/// Who has asked for an entry is known by the lot that has won, and lots are spread evenly.
#[test]
fn gpu_lots_say_whose_they_are() {
    let Some(gpu) = testing::gpu("gpu_lots_say_whose_they_are") else { return };
    let update = CacheUpdate { update: 12_345, ..Default::default() };
    let uniform = uniform_buffer_of(&gpu.device, "cache_update", &update);
    let about = Bindings::new().buffer("cache_update", &uniform);
    let mut random = Random::new(8);
    let halves: Vec<_> = (0..4000)
        .map(|_| [(); 2].map(|()| (65_536.0 * random.unit()).floor()))
        .map(|[x, y]| Vec4::new(x, y, 0.0, 0.0))
        .collect();
    let answers = evaluate_module(gpu, "testing/cell_table", "priorities", &about, &halves, 1);
    assert!(halves.iter().zip(&answers).all(|(candidate, found)| candidate.xy() == found.xy()));
    // Those that follow each other have lots in any order.
    let row: Vec<_> = (0..1024).map(|x| Vec4::new(x as f32, 0.0, 0.0, 0.0)).collect();
    let priorities = evaluate_module(gpu, "testing/cell_table", "priorities", &about, &row, 1);
    let rising = priorities.iter().zip(&priorities[1..]).filter(|(a, b)| a.z < b.z).count();
    assert!((450..=575).contains(&rising), "{rising}");
}

/// Four bytes keep the largest of three numbers within 0.4 % and the others within as much of that, from the least to the largest; black is known.
#[test]
fn gpu_packed_radiance_is_close() {
    let Some(gpu) = testing::gpu("gpu_packed_radiance_is_close") else { return };
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
    for (radiance, found) in radiances.iter().zip(&answers) {
        assert_eq!(found.w, 1.0, "{radiance}: nothing is known");
        let most = radiance.truncate().max_element();
        let off = (found.truncate() - radiance.truncate()).abs().max_element();
        assert!(off <= 0.004 * most || most < 1e-35, "{radiance}: {found}");
        sum += if most > 1e-35 { (found.truncate() - radiance.truncate()).element_sum() / most } else { 0.0 };
    }
    // Not to one side.
    assert!((sum / answers.len() as f32).abs() < 2e-4, "{}", sum / answers.len() as f32);
}
