//! Keys, hashes and levels of points, and RGBE radiance.

use super::{accumulate::is_close, *};
use crate::indirect::radiance_cache::reference::{
    accumulate::{pack_reflectance, unpack_reflectance},
    hashing::{entry_at, level, to_middle},
    propagate, rgbe,
};

/// A point, a normal, and the jitter of the point.
type Point = (Vec3, Vec3, [f32; 2]);

fn points(parameters: &RadianceCacheParameters) -> Vec<Point> {
    let mut random = Random::new(31);
    let mut points: Vec<Point> = Vec::new();
    for _ in 0..600 {
        // Up to a few levels away.
        let scale = (random.unit() * 12.0 - 2.0).exp2();
        points.push((scale * random.point(), random.direction(), [random.unit(), random.unit()]));
    }
    // On the borders between facing directions, and of every level.
    for i in 0..200 {
        let p = Vec3::from([i % 5, i / 5 % 5, i / 25].map(|k| k as f32 - 2.0)) * 0.125;
        let n = Vec3::new((i % 3) as f32 - 1.0, (i / 3 % 3) as f32 - 1.0, (i / 9 % 3) as f32 - 1.0);
        let n = if n == Vec3::ZERO { Vec3::Y } else { n / (n.x * n.x + n.y * n.y + n.z * n.z).sqrt() };
        points.push((p, n, [0.5, 0.5]));
        let far = parameters.near * (i as f32 / 8.0 - 3.0).exp2();
        points.push((EYE + far * Vec3::AXES[i as usize % 3], n, [0.5, 0.5]));
    }
    // Rounding differs on a device: points near a border of a voxel or a level are left out.
    let key = |(p, n, u): Point| entry_at(parameters, EYE, p, n, u.into());
    let moved = |p: Vec3, axis: usize, off: f32| p + Vec3::AXES[axis] * off * (1.0 + p.abs().max_element());
    points.retain(|(p, n, u)| {
        let is_inside =
            |axis| [-1e-5, 1e-5].iter().all(|off| key((moved(*p, axis, *off), *n, *u)) == key((*p, *n, *u)));
        (0..3).all(is_inside)
    });
    assert!(points.len() > 700, "{}", points.len());
    points
}

fn compare_keys(bench: &Bench) -> Compared {
    let parameters = parameters(64);
    let points = points(&parameters);
    let queries = points.iter().flat_map(|(p, n, [x, y])| [p.extend(*x), n.extend(*y)]);
    let queries: Vec<_> = queries.map(|query| bits(query.to_array())).collect();
    let mut memory = memory_of(&Table::new(64, 3, 1), &parameters);
    let actual = bench.evaluate(&mut memory, "testing/radiance_cache", "keys", &queries, 2);
    let expected = points.iter().map(|(p, n, u)| {
        let entry = entry_at(&parameters, EYE, *p, *n, (*u).into());
        [entry.key, entry.hash, level(*p, EYE, parameters.near) as u32, 0]
    });
    let expected: Vec<_> = expected.collect();
    let levels: std::collections::BTreeSet<_> = expected.iter().map(|entry| entry[2]).collect();
    assert!(levels.len() > 4, "{levels:?}");
    same("key, hash and level", &actual, &expected)
}

/// Where the sample of an entry lies does not matter for the middle of its voxel.
fn compare_middles(bench: &Bench) -> Compared {
    let parameters = parameters(64);
    let mut points = points(&parameters);
    // Most surfaces of buildings face along an axis. Others may be jittered into a voxel beyond the corners of the jitter.
    points.retain(|(p, _, _)| p.abs().max_element() < 1000.0);
    for (i, point) in points.iter_mut().enumerate().filter(|(i, _)| i % 2 == 0) {
        point.1 = Vec3::AXES[i / 2 % 3] * if i % 4 == 0 { 1.0 } else { -1.0 };
    }
    let queries = points.iter().flat_map(|(p, n, [x, y])| [p.extend(*x), n.extend(*y)]);
    let queries: Vec<_> = queries.map(|query| bits(query.to_array())).collect();
    let mut memory = memory_of(&Table::new(64, 3, 1), &parameters);
    let actual = bench.evaluate(&mut memory, "testing/radiance_cache", "middles", &queries, 2);
    let mut unknown = 0;
    for ((p, n, u), answer) in points.iter().zip(actual) {
        let actual = Vec3::new(f32::from_bits(answer[0]), f32::from_bits(answer[1]), f32::from_bits(answer[2]));
        let expected = to_middle(&parameters, EYE, *p, *n, (*u).into());
        let edge = parameters.edge * (level(*p, EYE, parameters.near) as f32).exp2();
        if actual == Vec3::ZERO && n.abs().max_element() < 1.0 {
            unknown += 1;
        } else if actual.distance(expected) > 1e-3 * edge {
            return Err(format!("middle at {p}, normal {n}: {actual}, not {expected}"));
        }
    }
    if unknown * 20 > points.len() { Err(format!("{unknown} of {} middles unknown", points.len())) } else { Ok(()) }
}

fn compare_packing(bench: &Bench) -> Compared {
    let mut random = Random::new(32);
    let mut colors: Vec<Vec3> =
        (0..600).map(|_| (random.unit() * 200.0 - 100.0).exp2() * 0.5 * (Vec3::ONE + random.point())).collect();
    colors.extend([Vec3::ZERO, Vec3::splat(1e-44), Vec3::X, Vec3::splat(3e38), Vec3::splat(f32::MIN_POSITIVE)]);
    // Halves, and numbers between two quantization steps.
    colors.extend((0..600).map(|i| Vec3::new(i as f32 / 256.0, i as f32 / 512.0, 1.0)));
    let evaluate = |entry: &str| {
        let queries: Vec<_> = colors.iter().map(|color| bits(color.extend(0.0).to_array())).collect();
        bench.evaluate(
            &mut memory_of(&Table::new(64, 3, 1), &parameters(64)),
            "testing/radiance_cache",
            entry,
            &queries,
            1,
        )
    };
    let answer = |packed: u32, color: Vec3| {
        let [r, g, b] = bits(color.to_array());
        [packed, r, g, b]
    };
    let radiance = colors.iter().map(|color| answer(rgbe::pack(*color), rgbe::unpack(rgbe::pack(*color))));
    // A device may flush numbers below 2^-126 to 0.
    let is_normal = |(_, color): &(_, &Vec3)| color.to_array().iter().all(|x| *x == 0.0 || x.is_normal());
    let of_normal = |all: Vec<[u32; 4]>| -> Vec<[u32; 4]> {
        all.into_iter().zip(&colors).filter(is_normal).map(|(answer, _)| answer).collect()
    };
    same("radiance", &of_normal(evaluate("radiance")), &of_normal(radiance.collect()))?;
    for (color, [packed, unpacked @ ..]) in colors.iter().zip(evaluate("reflectance")) {
        // The rounding of roots and divisions depends on the device.
        let expected = unpack_reflectance(packed);
        let is_exact = (0..3).all(|i| (f32::from_bits(unpacked[i]) - expected[i]).abs() <= TOLERANCE * expected[i]);
        if !is_exact || !is_close(packed, pack_reflectance(*color), [0, 10, 20], 1023) {
            return Err(format!("reflectance of {color}: {packed:x} as {unpacked:x?}, not {expected}"));
        }
    }
    Ok(())
}

/// The packing passes, over all slots and over those of a list.
fn compare_packed_slots(bench: &Bench) -> Compared {
    let mut random = Random::new(33);
    let parameters = parameters(256);
    let mut table = random_table(&mut random, 256, 150, &parameters);
    let mut memory = memory_of(&table, &parameters);
    bench.run(&mut memory, "propagate", "pack", workgroups(256));
    let taken: Vec<usize> = table.taken().collect();
    propagate::pack(&mut table, taken, &CacheSweep::default());
    same_tables(&table_of(&memory, &table), &table)?;
    let list = random_list(&mut random, &table, 0.3);
    table.light[0].iter_mut().for_each(|light| *light *= Vec4::new(3.0, 5.0, 0.5, 1.0));
    memory.set("entry_light", &table.light.concat());
    memory.bind(&["scheduled"], &scheduled_words(&list, 256));
    bench.run(&mut memory, "propagate", "pack_scheduled", workgroups(list.len() as u32));
    propagate::pack(&mut table, list.iter().map(|entry| entry.of_slot() as usize), &CacheSweep::default());
    same_tables(&table_of(&memory, &table), &table)
}

pub(super) fn compare(bench: &Bench) -> Compared {
    compare_keys(bench)?;
    compare_middles(bench)?;
    compare_packing(bench)?;
    compare_packed_slots(bench)
}

#[gpu_test]
fn gpu_keys_and_packing_match_the_reference(gpu: &Gpu) {
    check(gpu, compare);
}
