//! Primitives that break builders: coincident, flat, nested, not finite, far away.

use glam::Vec3;
use lanternfish_gpu::{Engine, GpuError, testing};

use super::{Device, Kind, inputs};
use crate::{BvhBuilder, DeviceBvh, SHADERS, clustering::iterations_for, parameters::MAX_ITERATIONS};

fn around(center: Vec3, half: f32) -> [[f32; 4]; 2] {
    [center - half, center + half].map(|corner| corner.extend(0.0).into())
}

fn ever_larger(i: usize) -> [[f32; 4]; 2] {
    let size = 1.003f32.powi(i as i32 % 8192);
    around(Vec3::X * size, 0.4 * size)
}

#[gpu_test]
fn gpu_trees_of_hostile_boxes_are_right(gpu: &Gpu) {
    const COUNT: usize = 20_000;
    let size = |i: usize| i as f32 / COUNT as f32;
    let nan = [f32::NAN; 4];
    let some_bad = |i: usize| match i % 5 {
        0 => [nan, nan],
        1 => [[f32::NEG_INFINITY; 4], [f32::INFINITY; 4]],
        2 => [[1.0; 4], [-1.0; 4]],
        _ => around(9.0 * inputs::point(i), 0.1),
    };
    let all = |of: &dyn Fn(usize) -> [[f32; 4]; 2]| -> Vec<[f32; 4]> { (0..COUNT).flat_map(of).collect() };
    let mut mesh = all(&|i| around(50.0 * inputs::point(i), 0.3));
    mesh.extend(all(&|_| around(Vec3::ONE, 1.0)));
    let hostile: [(&str, Vec<[f32; 4]>); 13] = [
        ("equal", all(&|_| around(Vec3::ONE, 1.0))),
        ("equal points", all(&|_| around(Vec3::ONE, 0.0))),
        ("on a line", all(&|i| around(Vec3::Y * inputs::unit(i), 0.0))),
        ("on a plane", all(&|i| around(Vec3::new(inputs::unit(2 * i), 3.0, inputs::unit(2 * i + 1)), 0.0))),
        ("one in another", all(&|i| around(Vec3::ZERO, 1.0 + size(i)))),
        ("on a line, ever farther", all(&|i| around(Vec3::X * 9e3 * size(i).powi(2), 1e-6))),
        ("ever larger", all(&ever_larger)),
        ("within a mesh", mesh),
        ("not finite", all(&|_| [nan, nan])),
        ("some not finite", all(&some_bad)),
        ("far", all(&|i| around(1e14 * inputs::point(i), 1e12 * inputs::unit(i)))),
        ("small and far", all(&|i| around(1e6 + inputs::point(i), 1e-3))),
        ("tiny", all(&|i| around(1e-22 * inputs::point(i), 1e-24))),
    ];
    let mut device = Device::new(gpu);
    for (what, boxes) in hostile {
        let (_, levels) = device.checked(what, Kind::Boxes, &boxes);
        println!("{what}: {} nodes in {} levels", levels.iter().sum::<usize>(), levels.len());
    }
}

/// The list must end with one cluster, and equal boxes must not merge one by one.
#[gpu_test]
fn gpu_clustering_ends_for_a_million_equal_boxes(gpu: &Gpu) {
    const COUNT: usize = 1_000_000;
    let mut device = Device::new(gpu);
    let boxes = vec![[1.0; 4]; 2 * COUNT];
    let bvh = device.build(Kind::Boxes, &boxes);
    let counts: Vec<[u32; 4]> = device.read(&bvh.iterations, MAX_ITERATIONS as usize + 1);
    assert_eq!(counts.iter().position(|row| row[3] & 0x7fff_ffff == 1), Some(20), "{counts:?}");
    let (_, levels) = device.checked_tree("equal", Kind::Boxes, &boxes, &bvh);
    assert!(levels.len() <= 16, "{levels:?}");
}

/// Trees that would be deeper are opened by height. A shader with fewer levels shows it; 3 × 22 holds the height of this binary tree.
#[gpu_test]
fn gpu_the_number_of_levels_is_bounded(gpu: &Gpu) {
    let boxes: Vec<_> = (0..4096).flat_map(ever_larger).collect();
    let mut device = Device::new(gpu);
    let deep = device.checked("deep", Kind::Boxes, &boxes).1.len();
    assert!(deep > 22 && iterations_for(4096) <= 3 * 22, "{deep} levels");
    let engine = Engine::new(&gpu.device, &gpu.queue);
    let (_, host) = SHADERS.sources().iter().find(|(path, _)| *path == "host").unwrap();
    let edited = host.replace("MAX_LEVELS: u32 = 32;", "MAX_LEVELS: u32 = 22;");
    assert_ne!(*host, edited);
    engine.edit(&SHADERS, [("host".to_owned(), edited)].into());
    device.builder = engine.within(|| BvhBuilder::new(&gpu.device)).unwrap();
    let shallow = device.checked("shallow", Kind::Boxes, &boxes).1.len();
    assert!(shallow <= 22, "{shallow} levels");
}

#[gpu_test]
fn gpu_a_count_above_the_limit_is_an_error(gpu: &Gpu) {
    let error = DeviceBvh::new(&gpu.device, 16_776_961).unwrap_err();
    assert!(matches!(error, GpuError::TooLarge { .. }) && error.to_string().contains("16776961"), "{error}");
}
