//! Checks that any light culling technique is conservative: every light in range of a visible point is in the point's
//! list.

mod cases;
mod counted;

use std::cell::RefCell;

use glam::{DVec3, UVec2, Vec3};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Frame, Gpu, Profiler, read_back, storage_buffer, storage_buffer_of, testing,
};
use lanternfish_scene::{Camera, Light, LightKind, Projection, Scene};
use proptest::{
    prelude::*,
    test_runner::{RngAlgorithm, TestRng, TestRunner},
};

use self::cases::{camera, light, scattered, special};
use crate::{
    Renderer, Settings,
    light_culling::{
        LightCulling, LightLists, Reach,
        clustered::{ClusteredCulling, contents::contents_of_grids},
    },
    prepass::Prepass,
    settings::{Culling, Shadows},
    techniques::{ClusterShape, Clustered, Tiled},
    testing::{Random, context, probe},
    view::{View, tightened},
};

/// Not a multiple of any tile size.
pub const SIZE: UVec2 = UVec2::new(100, 60);

/// A technique with its parameters, and its number of cells if the lists do not count them.
pub type Case = (Culling, Option<usize>);

/// The tested techniques, compiled once.
struct Bench<'g> {
    gpu: &'g Gpu,
    renderer: Renderer,
    profiler: Profiler,
    prepass: Prepass,
    techniques: Vec<Compiled>,
}

struct Compiled {
    settings: Culling,
    cells: Option<usize>,
    passes: LightCulling,
    /// The probe that reads the lights of each pixel.
    pixels: ComputeKernel,
}

impl Compiled {
    fn new(gpu: &Gpu, (settings, cells): &Case) -> Self {
        Self {
            settings: settings.clone(),
            cells: *cells,
            passes: LightCulling::new(&gpu.device, settings, 1).unwrap(),
            pixels: probe(gpu, "testing/pixels", &[LightCulling::feature(settings)], "pixels"),
        }
    }
}

/// The lists of one technique for one view.
struct Lists {
    settings: Culling,
    /// Depth of each pixel.
    depths: Vec<f32>,
    /// Listed lights of each pixel, one bit each; at most 64 lights.
    listed: Vec<u64>,
}

impl<'g> Bench<'g> {
    fn new(gpu: &'g Gpu, cases: &[Case]) -> Self {
        let settings = Settings::direct_light().with_shadows(Shadows::None);
        Self {
            gpu,
            renderer: Renderer::with_engine(&testing::engine(gpu), settings).unwrap(),
            profiler: Profiler::new(&gpu.device, &gpu.queue),
            prepass: Prepass::new(true, 1),
            techniques: cases.iter().map(|case| Compiled::new(gpu, case)).collect(),
        }
    }

    /// The lists of every technique for the surfaces or, if `free` is given, for one point per pixel at these depths.
    /// Checks that each list is in ascending order without duplicates.
    fn lists(&mut self, scene: &Scene, camera: &Camera, free: Option<&[f32]>) -> Vec<Lists> {
        let Self { gpu, renderer, profiler, prepass, techniques } = self;
        assert!(scene.lights.len() <= 64, "a bit a light");
        let uploaded = renderer.upload(scene).unwrap();
        let seen = View::new(camera, SIZE, Vec3::ZERO, &scene.bounds());
        let draws = uploaded.visible_draws(&seen);
        let view = seen.upload(&gpu.device);
        let count = (SIZE.x * SIZE.y) as usize;
        let reach = if free.is_some() { Reach::Anywhere } else { Reach::Surface };
        let free = free.map_or_else(|| vec![0.0; count], <[f32]>::to_vec);
        let pixel_lists = storage_buffer(&gpu.device, "lists", 8 * count as u64).unwrap();
        let mut all = Vec::new();
        for Compiled { settings, cells, passes: technique, pixels } in techniques {
            // Clusters are built only for visible surfaces, not for any point of the view.
            if settings.is::<Clustered>() && reach == Reach::Anywhere {
                continue;
            }
            let depths = storage_buffer_of(&gpu.device, "depths", &free, wgpu::BufferUsages::empty()).unwrap();
            let mut frame = Frame::new(&gpu.device, &gpu.queue, profiler);
            let surface = prepass.record(&mut frame, &uploaded, &draws, &view, SIZE, None).unwrap();
            let seen = context(&uploaded, &seen, &view, &surface);
            let lights = technique.record(&mut frame, &[seen], reach, &uploaded.lights).unwrap().remove(0);
            let own = Bindings::new().buffer("pixel_depths", &depths).buffer("pixel_lists", &pixel_lists);
            let bindings = view.bindings().with(&surface.bindings()).with(&lights.bindings()).with(&own);
            frame.dispatch(&*pixels, &bindings, [SIZE.x.div_ceil(8), SIZE.y.div_ceil(8), 1]);
            frame.submit();
            let read = |buffer, count| read_back::<u32>(&gpu.device, &gpu.queue, buffer, count).unwrap();
            let ranges = read(&pixel_lists, 2 * count);
            let depths: Vec<f32> = read(&depths, count).into_iter().map(f32::from_bits).collect();
            let indices = read(&lights.indices, lights.listed as usize);
            let listed = ranges.chunks_exact(2).map(|range| bits(&indices, range)).collect();
            check_cells(&lights, gpu, *cells);
            if let Some(passes) = technique.passes::<ClusteredCulling>() {
                // The measurement equals shading: no surface is transparent, so the depth buffer has every fragment.
                let contents = contents_of_grids(passes, &gpu.device, &gpu.queue).unwrap().remove(0);
                let seen = || ranges.chunks_exact(2).zip(&depths).filter(|(_, depth): &(_, &f32)| **depth > 0.0);
                let operations = seen().map(|(range, _)| u64::from(range[1])).sum::<u64>();
                assert_eq!((contents.fragments(), contents.lighting_operations()), (seen().count() as u64, operations));
            }
            all.push(Lists { settings: settings.clone(), depths, listed });
        }
        all
    }
}

fn bits(indices: &[u32], range: &[u32]) -> u64 {
    let list = &indices[range[0] as usize..(range[0] + range[1]) as usize];
    assert!(list.windows(2).all(|pair| pair[0] < pair[1]), "not ascending, or twice: {list:?}");
    list.iter().fold(0, |bits, index| bits | 1 << index)
}

/// Checks that cells start at zero, do not overlap, and end at the total.
fn check_cells(lights: &LightLists, gpu: &Gpu, cells: Option<usize>) {
    let starts = read_back::<u32>(&gpu.device, &gpu.queue, &lights.cells, cell_count(lights, cells) + 1).unwrap();
    let cells = starts.len() - 1;
    assert!(starts[0] == 0 && u64::from(starts[cells]) == lights.listed && starts.is_sorted(), "{starts:?}");
}

fn cell_count(lights: &LightLists, cells: Option<usize>) -> usize {
    let counted = lights.counters.iter().find(|(name, _)| *name == "light_culling/clusters");
    match (cells, counted) {
        (Some(cells), None) => cells,
        (None, Some((_, clusters))) => *clusters as usize,
        other => panic!("{other:?}"),
    }
}

/// A point of the view in world space, computed from the definition of the projection and not from its matrix.
fn world_from_depth(camera: &Camera, pixel: usize, depth: f64) -> DVec3 {
    let size = SIZE.as_dvec2();
    let x = (f64::from(pixel as u32 % SIZE.x) + 0.5) / size.x * 2.0 - 1.0;
    let y = 1.0 - (f64::from(pixel as u32 / SIZE.x) + 0.5) / size.y * 2.0;
    let aspect = size.x / size.y;
    let p_view = match camera.projection {
        Projection::Perspective { fov_y, near } => {
            let distance = f64::from(near) / depth;
            let half = (0.5 * f64::from(fov_y)).tan() * distance;
            DVec3::new(x * half * aspect, y * half, -distance)
        }
        Projection::Frustum { left, right, bottom, top, near } => {
            let distance = f64::from(near) / depth;
            let between =
                |low: f32, high: f32, t: f64| f64::from(low) + (f64::from(high) - f64::from(low)) * (0.5 + 0.5 * t);
            DVec3::new(between(left, right, x) * distance, between(bottom, top, y) * distance, -distance)
        }
        Projection::Orthographic { half_height, near, far } => {
            let (half, near, far) = (f64::from(half_height), f64::from(near), f64::from(far));
            DVec3::new(x * half * aspect, y * half, -(far - depth * (far - near)))
        }
    };
    camera.world_from_camera.as_daffine3().transform_point3(p_view)
}

/// True if a light reaches a point: by its range, and its cone or side.
fn reaches(light: &Light, settings: &Settings, p_world: DVec3) -> bool {
    if light.kind == LightKind::Directional {
        return true;
    }
    let from_light = p_world - light.position.as_dvec3();
    let distance = from_light.length();
    if distance >= f64::from(light.effective_range(settings.lights.attenuation, settings.lights.range_threshold)) {
        return false;
    }
    match light.kind {
        LightKind::Spot { outer_angle, .. } => {
            let cosine = from_light.dot(light.direction.as_dvec3()) / distance.max(1e-30);
            cosine > f64::from(outer_angle).cos()
        }
        // Everything in front of their planes.
        LightKind::Disk { .. } | LightKind::Rectangle { .. } => from_light.dot(light.direction.as_dvec3()) > 0.0,
        _ => true,
    }
}

/// Number of pairs of a visible pixel and a light that reaches it, and of those that the lists miss.
fn lost(lights: &[Light], points: &[Option<DVec3>], lists: &Lists) -> (usize, usize) {
    let settings = Settings::direct_light();
    let (mut pairs, mut lost) = (0, 0);
    for (point, listed) in points.iter().zip(&lists.listed) {
        let Some(point) = point else { continue };
        for (i, light) in lights.iter().enumerate() {
            if reaches(light, &settings, *point) {
                pairs += 1;
                lost += usize::from(listed >> i & 1 == 0);
            }
        }
    }
    (pairs, lost)
}

/// The points of the lists; none in the sky.
fn points(camera: &Camera, lists: &Lists) -> Vec<Option<DVec3>> {
    let point =
        |(pixel, depth): (usize, &f32)| (*depth > 0.0).then(|| world_from_depth(camera, pixel, (*depth).into()));
    lists.depths.iter().enumerate().map(point).collect()
}

/// Depths of points anywhere from the near plane to far beyond the scene, one per pixel.
fn free_depths(camera: &Camera, random: &mut Random) -> Vec<f32> {
    let depth = |_| match camera.projection {
        Projection::Perspective { .. } | Projection::Frustum { .. } => random.between(0.0, 13.0).exp2().recip(),
        Projection::Orthographic { .. } => random.between(1e-3, 1.0),
    };
    (0..SIZE.x * SIZE.y).map(depth).collect()
}

/// Panics if a technique misses a light or lists one beyond the device's count, or if the checks do not detect shorter
/// ranges.
pub fn check_culling(gpu: &Gpu, cases: &[Case]) {
    let mut bench = Bench::new(gpu, cases);
    bench.sees_a_tenth_of_range_missing();
    let mut bench = bench.loses_no_light();
    bench.techniques.push(Compiled::new(gpu, &(Culling::NONE, Some(1))));
    bench.lists_no_light_beyond_the_count();
}

impl<'g> Bench<'g> {
    /// Panics if a technique misses a light, with random lights and cameras.
    fn loses_no_light(self) -> Self {
        let bench = RefCell::new(self);
        let scenes = [lanternfish_scene::generate::demo("cornell").unwrap(), scattered()];
        let pairs = RefCell::new(0);
        let config = ProptestConfig { cases: 8, failure_persistence: None, max_shrink_iters: 64, ..Default::default() };
        let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
        let strategy = (prop::collection::vec(light(), 1..48), camera(), 0usize..2);
        let outcome = runner.run(&strategy, |(mut lights, camera, which)| {
            lights.extend(special(&camera));
            let scene = Scene { lights, ..scenes[which].clone() };
            // The planes of the view's fitted projection, to reconstruct positions.
            let projection = tightened(&camera, &scene.bounds());
            let camera = Camera { projection, ..camera };
            for reach in [Reach::Surface, Reach::Anywhere] {
                let free = (reach == Reach::Anywhere).then(|| free_depths(&camera, &mut Random::new(which as u64)));
                let lists = bench.borrow_mut().lists(&scene, &camera, free.as_deref());
                let points = points(&camera, &lists[0]);
                for list in &lists {
                    let (total, lost) = lost(&scene.lights, &points, list);
                    prop_assert_eq!(lost, 0, "of {} pairs, {:?}, {:?}", total, list.settings, reach);
                    *pairs.borrow_mut() += total;
                }
                // The box test only removes lights.
                let tiled: Vec<&Lists> = lists.iter().filter(|l| l.settings.is::<Tiled>()).collect();
                for pair in tiled.chunks_exact(2) {
                    let [without, with] = pair else { unreachable!("two a tile size") };
                    let added = with.listed.iter().zip(&without.listed).any(|(with, without)| with & !without != 0);
                    prop_assert!(!added, "{:?}", with.settings);
                }
                // The tree lists no light that the plane tests do not list; for boxes the lists are equal.
                let clustered: Vec<&Lists> = lists.iter().filter(|l| l.settings.is::<Clustered>()).collect();
                for pair in clustered.chunks_exact(2) {
                    let [brute, tree] = pair else { unreachable!("two a shape") };
                    let added = tree.listed.iter().zip(&brute.listed).any(|(tree, brute)| tree & !brute != 0);
                    prop_assert!(!added, "{:?}", tree.settings);
                    let shape = tree.settings.get::<Clustered>().map(|clustered| clustered.shape);
                    if matches!(shape, Some(ClusterShape::Orthographic { .. })) {
                        prop_assert_eq!(&tree.listed, &brute.listed);
                    }
                }
            }
            Ok(())
        });
        outcome.unwrap_or_else(|error| panic!("{error}"));
        println!("{} pairs of a point and a light in reach", pairs.borrow());
        assert!(*pairs.borrow() > 300_000, "the cases cover too little: {} pairs", pairs.borrow());
        bench.into_inner()
    }

    /// Panics if the checks do not detect ranges that are 10 % too short.
    fn sees_a_tenth_of_range_missing(&mut self) {
        let mut scene = lanternfish_scene::generate::demo("cornell").unwrap();
        let camera = scene.cameras[0].clone();
        let mut random = Random::new(3);
        scene.lights = (0..40)
            .map(|_| {
                let position = Vec3::Y + random.point();
                Light { range: Some(random.between(0.2, 1.0)), ..Light::point(position, Vec3::ONE) }
            })
            .collect();
        let shorter = scene.lights.iter().map(|light| Light { range: light.range.map(|r| 0.9 * r), ..light.clone() });
        let shorter = Scene { lights: shorter.collect(), ..scene.clone() };

        let complete = self.lists(&scene, &camera, None);
        let points = points(&camera, &complete[0]);
        for list in &complete {
            assert_eq!(lost(&scene.lights, &points, list).1, 0, "{:?}", list.settings);
        }
        for list in self.lists(&shorter, &camera, None) {
            let (pairs, lost) = lost(&scene.lights, &points, &list);
            println!("{:?}: {lost} of {pairs} pairs lost", list.settings);
            assert!(lost > 0, "{:?}: does not detect a 10 % error in range", list.settings);
        }
    }
}

/// Number of lights each technique lists for all pixels of a scene together, and how many of these reach their pixels.
pub fn listed(gpu: &Gpu, cases: &[Case]) -> (Vec<u32>, usize) {
    let mut bench = Bench::new(gpu, cases);
    let mut random = Random::new(5);
    let mut scene = scattered();
    scene.lights = (0..64)
        .map(|_| {
            let position = random.point() * Vec3::new(3.0, 2.0, 6.0);
            Light { range: Some(1.0), ..Light::point(position, Vec3::ONE) }
        })
        .collect();
    let camera =
        Camera::look_at(Vec3::new(0.0, 0.0, 9.0), Vec3::ZERO, Projection::Perspective { fov_y: 0.6, near: 0.1 });
    let lists = bench.lists(&scene, &camera, None);
    let points = points(&camera, &lists[0]);
    let needed = lost(&scene.lights, &points, &lists[0]).0;
    let total = |list: &Lists| -> u32 {
        let seen = list.listed.iter().zip(&points).filter(|(_, point)| point.is_some());
        seen.map(|(bits, _)| bits.count_ones()).sum()
    };
    (lists.iter().map(total).collect(), needed)
}
