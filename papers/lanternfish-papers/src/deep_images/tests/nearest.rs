//! The nearest direction, on the device.

use glam::Vec4;
use lanternfish_gpu::{Bindings, Frame, Profiler, read_back, storage_buffer, storage_buffer_of, uniform_buffer_of};

use crate::{
    deep_images::{
        DeepFrame, DeepGrid,
        directions::{DirectionSet, Directions},
    },
    testing::{self, Random, probe},
};

#[gpu_test]
fn gpu_the_nearest_direction_is_the_hosts(gpu: &Gpu) {
    let kernel = probe(gpu, "testing/directions", &[], "nearest");
    let mut random = Random::new(2);
    let queries: Vec<Vec4> = (0..20_000).map(|_| random.direction().extend(0.0)).collect();
    for set in [
        DirectionSet::StacksSlices { stacks: 13, slices: 13 },
        DirectionSet::Cube { k: 5 },
        DirectionSet::ZonalEqualArea { count: 169 },
        DirectionSet::ZonalEqualArea { count: 1 },
    ] {
        let directions = Directions::new(set).unwrap();
        let none = wgpu::BufferUsages::empty();
        let frames: Vec<DeepFrame> = (0..directions.len() as u32)
            .map(|image| {
                let axes = directions.frame(image);
                DeepFrame { x: axes.x_axis, y: axes.y_axis, z: axes.z_axis, ..DeepFrame::default() }
            })
            .collect();
        let frames = storage_buffer_of(&gpu.device, "frames", &frames, none).unwrap();
        let grid = DeepGrid { set_from_world: Vec4::W, ..DeepGrid::default() };
        let grid = uniform_buffer_of(&gpu.device, "grid", &grid);
        let cells = storage_buffer_of(&gpu.device, "cells", directions.cells(), none).unwrap();
        let requested = storage_buffer_of(&gpu.device, "queries", &queries, none).unwrap();
        let answers = storage_buffer(&gpu.device, "answers", 16 * queries.len() as u64).unwrap();
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let bindings = Bindings::new()
            .buffer("queries", &requested)
            .buffer("answers", &answers)
            .buffer("deep_frames", &frames)
            .buffer("deep_grid", &grid)
            .buffer("direction_cells", &cells);
        frame.dispatch(&kernel, &bindings, [queries.len().div_ceil(64) as u32, 1, 1]);
        frame.submit();
        let actual = read_back::<Vec4>(&gpu.device, &gpu.queue, &answers, queries.len()).unwrap();
        for (query, actual) in queries.iter().zip(actual) {
            let direction = query.truncate();
            let (image, reversed) = directions.nearest(direction);
            let cosine = |image: usize| directions.axes()[image].dot(direction);
            // Between two axes that are equally near up to the last bits, either is correct.
            let tied = (cosine(actual.x as usize).abs() - cosine(image as usize).abs()).abs() < 1e-6;
            assert!(
                tied && (actual.y == 1.0) == (cosine(actual.x as usize) < 0.0),
                "{set:?} {direction}: {actual}, not {image}"
            );
            assert!(actual.x as u32 != image || (actual.y == 1.0) == reversed);
        }
    }
}
