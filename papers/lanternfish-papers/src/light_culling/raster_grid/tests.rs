use glam::{UVec2, Vec3};
use lanternfish::{
    Renderer, Settings,
    settings::{Culling, Shadows},
    techniques::TileSize,
    view::View,
};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, Profiler, read_back, storage_buffer_of, uniform_buffer_of};
use lanternfish_scene::{Camera, Light, Projection, Scene};

use super::{DECLARED, MOST_LAYERS, RasterCells, RasterGrid, RasterGridCulling};
use crate::{
    shaders::SHADERS,
    testing::{self, Random},
};

#[test]
fn the_shaders_have_a_bit_and_an_invocation_a_layer() {
    assert_eq!(SHADERS.constant("light_culling/raster_grid/sort", "WORKGROUP"), f64::from(MOST_LAYERS));
    assert_eq!(u32::BITS, MOST_LAYERS);
}

#[gpu_test]
fn gpu_layers_end_where_the_scene_does(gpu: &Gpu) {
    let scene = lanternfish_scene::generate::demo("cornell").unwrap();
    let bounds = scene.bounds();
    for projection in [
        Projection::Perspective { fov_y: 1.0, near: 0.01 },
        Projection::Perspective { fov_y: 1.0, near: 2.0 },
        Projection::Orthographic { half_height: 2.0, near: 0.0, far: 1000.0 },
        Projection::Orthographic { half_height: 2.0, near: -5.0, far: 1000.0 },
    ] {
        for (distance, layers) in [(0.1, 32), (3.5, 7), (900.0, 1), (2000.0, 32)] {
            let camera = Camera::look_at(bounds.center() + distance * Vec3::Z, bounds.center(), projection);
            let size = UVec2::new(100, 61);
            let frustum = View::new(&camera, size, Vec3::ZERO, &bounds).frustum(&bounds);
            let settings = RasterGrid { tile_size: TileSize::Px32, layers };
            let grid = RasterGridCulling::new(&gpu.device, settings).unwrap().grid(size, &frustum, false);
            assert_eq!((grid.columns, grid.rows, grid.layers), (4, 2, layers));
            let last = grid.nearest * (grid.log_ratio * layers as f32).exp();
            let error = (last - frustum.far).abs() / last;
            // For a thin scene seen from far away, they end behind it.
            let is_thin = last > 1.99 * grid.nearest && frustum.far < 2.01 * grid.nearest;
            assert!(error < 1e-5 || is_thin, "{projection:?} {distance}: {grid:?}, {frustum:?}");
            assert!(grid.nearest > 0.0 && grid.log_ratio * layers as f32 > 0.69, "{grid:?}");
        }
    }
}

/// A light is tested against exactly the tiles of its outline.
#[gpu_test]
fn gpu_a_light_is_tested_against_the_tiles_of_its_outline(gpu: &Gpu) {
    let scene = lanternfish_scene::generate::demo("cornell").unwrap();
    let culling = Culling::from(RasterGrid::default());
    let settings = Settings::direct_light().with_culling(culling).with_shadows(Shadows::None);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let target = scene.bounds().center();
    let light = |offset: Vec3, range| Light { range: Some(range), ..Light::point(target + offset, Vec3::ONE) };
    let projections = [
        Projection::Perspective { fov_y: 0.8, near: 0.1 },
        Projection::Orthographic { half_height: 1.5, near: 0.1, far: 100.0 },
    ];
    for (i, projection) in projections.into_iter().enumerate() {
        let camera = Camera::look_at(target + 3.0 * Vec3::Z, target, projection);
        // 5 by 5 tiles; the view axis passes through the middle of the central one.
        let mut tests = |light: Light| {
            let uploaded = renderer.upload(&Scene { lights: vec![light], ..scene.clone() }).unwrap();
            let report = renderer.render(&uploaded, &camera, [80, 80]).unwrap().report;
            let counter = |name: &str| report.counters.iter().find(|(label, _)| label == name).unwrap().1;
            (counter("light_culling/light_tests"), counter("light_culling/listed_lights") > 0)
        };
        assert_eq!(tests(Light::directional(Vec3::NEG_Z, Vec3::ONE)), (25, true));
        assert_eq!(tests(light(Vec3::ZERO, 1e12)), (25, true));
        assert_eq!(tests(light(Vec3::ZERO, 0.01)).0, 1, "{projection:?}");
        // Behind the eye; around the eye; beside the view.
        assert_eq!(tests(light(8.0 * Vec3::Z, 0.5)).0, [0, 9][i], "{projection:?}");
        assert_eq!(tests(light(4.0 * Vec3::Z, 1.5)).0, 25, "{projection:?}");
        assert_eq!(tests(light(9.0 * Vec3::X, 1.0)), (0, false), "{projection:?}");
    }
}

/// On a software adapter fragments run in the order of the lights, and lists are already sorted; these are not.
#[gpu_test]
fn gpu_every_list_is_sorted_up_to_the_capacity(gpu: &Gpu) {
    let (columns, rows, layers) = (3, 2, 7);
    let mut random = Random::new(9);
    let mut starts = vec![0];
    for cell in 0..columns * rows * layers {
        let count = [0, 1, 2, 3, 40, 1000][cell as usize % 6];
        starts.push(starts[cell as usize] + count);
    }
    let total = *starts.last().unwrap();
    let lights: Vec<u32> = (0..total).map(|_| random.between(0.0, 1e5) as u32).collect();
    let shader = DECLARED.link("light_culling/raster_grid/sort", &[]).unwrap();
    let sort = ComputeKernel::new(&gpu.device, &shader, "sort", "test/sort");
    let none = wgpu::BufferUsages::empty();
    // Capacity for all, up to the middle of a list, up to the end of one, and 0.
    for capacity in [total, starts[30] - 400, starts[31], 0] {
        let grid = RasterCells { columns, rows, layers, capacity, ..RasterCells::default() };
        let grid = uniform_buffer_of(&gpu.device, "grid", &grid);
        let cells = storage_buffer_of(&gpu.device, "starts", &starts, none).unwrap();
        let listed = storage_buffer_of(&gpu.device, "lights", &lights, none).unwrap();
        let bindings = Bindings::new().buffer("raster_cells", &grid).buffer("cell_starts", &cells);
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        frame.dispatch(&sort, &bindings.buffer("listed_lights", &listed), [columns, rows, 1]);
        frame.submit();
        let mut expected = lights.clone();
        for cell in starts.windows(2) {
            let end = cell[1].min(capacity).max(cell[0]);
            expected[cell[0] as usize..end as usize].sort_unstable();
        }
        let sorted = read_back::<u32>(&gpu.device, &gpu.queue, &listed, total as usize).unwrap();
        assert!(sorted == expected, "capacity {capacity} of {total}");
        assert!(capacity == 0 || sorted != lights);
    }
}
