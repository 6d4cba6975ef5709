//! Screen probes stand for the pixels around them.

use glam::{Vec3, Vec4};
use lanternfish_gpu::{Profiler, read_back, storage_buffer, storage_buffer_of, testing};
use lanternfish_scene::{Camera, Scene};

use super::*;
use crate::{
    Renderer, Settings,
    prepass::Prepass,
    testing::{
        light::{looking, matt},
        probe, quad, scene_of,
    },
    view::View,
};

#[test]
fn most_further_probes_are_the_shaders() {
    assert_eq!(crate::shaders::constant("indirect/sampled/probes/list", "MOST_FURTHER"), f64::from(MOST_FURTHER));
}

/// Not a multiple of a tile.
const SIZE: UVec2 = UVec2::new(61, 45);
const TILE: u32 = 8;

/// A pixel of `testing/probe_coverage`.
#[derive(Clone, Copy, Debug)]
struct Covered {
    tile: UVec2,
    has_surface: bool,
    /// Best fit of the first probes around, and of these and the tile's further probes.
    first: f32,
    every: f32,
    probes: f32,
}

/// How well the pixels of a view are covered, with this first capacity of the list of further probes.
fn covered(gpu: &lanternfish_gpu::Gpu, scene: &Scene, camera: &Camera, random_index: u32, first: u64) -> Vec<Covered> {
    FIRST_FURTHER_IN_TESTS.set(Some(first));
    let renderer = Renderer::with_engine(&testing::engine(gpu), Settings::direct_light()).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let view = View { random_index, ..View::new(camera, SIZE, Vec3::ZERO, &scene.bounds()) };
    let (draws, buffer) = (uploaded.visible_draws(&view), view.upload(&gpu.device));
    let pixels: Vec<UVec2> = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| UVec2::new(x, y))).collect();
    let queries: Vec<Vec4> = pixels.iter().map(|pixel| pixel.as_vec2().extend(0.0).extend(0.0)).collect();
    let queries = storage_buffer_of(&gpu.device, "queries", &queries, wgpu::BufferUsages::empty()).unwrap();
    let answers = storage_buffer(&gpu.device, "answers", 16 * pixels.len() as u64).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let surface = Prepass::new(true, 1).record(&mut frame, &uploaded, &draws, &buffer, SIZE, None).unwrap();
    let tiles = SIZE.map(|side| side.div_ceil(TILE));
    let parameters = ProbeParameters { tile: TILE, tiles, ..Default::default() };
    let uniform = frame.uniform(&parameters);
    let surfaces = buffer.bindings().with(&surface.bindings());
    let placed = Placement::new(&gpu.device).unwrap().record(&mut frame, &surfaces, &parameters, &uniform).unwrap();
    let kernel = probe(gpu, "testing/probe_coverage", &[], "covered");
    let bindings = surfaces.with(&placed.bindings()).part("probes", &uniform);
    let bindings = bindings.buffer("queries", &queries).buffer("answers", &answers);
    frame.dispatch(&kernel, &bindings, [pixels.len().div_ceil(64) as u32, 1, 1]);
    frame.submit();
    FIRST_FURTHER_IN_TESTS.set(None);
    let answers: Vec<Vec4> = read_back(&gpu.device, &gpu.queue, &answers, pixels.len()).unwrap();
    let of = |(pixel, answer): (&UVec2, &Vec4)| {
        let [has_surface, first, every, probes] = answer.to_array();
        Covered { tile: *pixel / TILE, has_surface: has_surface > 0.5, first, every, probes }
    };
    pixels.iter().zip(&answers).map(of).collect()
}

/// Small cards in front of a wall. And many small cards at many depths.
fn edges() -> [(&'static str, Scene); 2] {
    let wall = quad(0, -Vec3::Z, 8.0 * Vec3::X, 8.0 * Vec3::Y);
    // About four pixels wide: most first probes miss them.
    let cards = (0..16).map(|i| {
        let at = Vec3::new(0.4 * (i % 4) as f32 - 0.6, 0.4 * (i / 4) as f32 - 0.6, 0.0);
        quad(0, at, Vec3::new(0.11, 0.03, 0.0), Vec3::new(-0.03, 0.11, 0.0))
    });
    let cards = cards.collect();
    let of = |cards: Vec<_>| scene_of([vec![wall.clone()], cards].concat(), vec![matt(0.5)]);
    let mut random = crate::testing::Random::new(3);
    let small = (0..120).map(|_| {
        let (right, up) = random.direction().any_orthonormal_pair();
        quad(0, random.point(), 0.1 * right, 0.1 * up)
    });
    let small = small.collect();
    [("cards", of(cards)), ("clutter", of(small))]
}

/// The library's constants: `refine.wesl`.
fn constant(name: &str) -> f32 {
    crate::shaders::constant("indirect/sampled/probes/refine", name) as f32
}

/// Each tile with a surface has a probe of its own. Of a tile with fewer than the most further probes, less than a sixteenth of the pixels are unlike all
/// probes around; without further probes they are many. A list that overflows at first gives the same probes.
#[gpu_test]
fn gpu_further_probes_cover_edges(gpu: &Gpu) {
    let camera = looking([0.0, 0.0, 3.0], [0.0, 0.0, 0.0]);
    let (least, worth) = (constant("COVERED"), constant("WORTH"));
    for (name, scene) in edges() {
        let (mut further, mut missed, mut at_first) = (0.0, 0, 0);
        for random_index in 0..4 {
            let pixels = covered(gpu, &scene, &camera, random_index, 1000);
            let tiles = SIZE.map(|side| side.div_ceil(TILE));
            for tile in (0..tiles.y).flat_map(|y| (0..tiles.x).map(move |x| UVec2::new(x, y))) {
                let own: Vec<_> = pixels.iter().filter(|pixel| pixel.tile == tile && pixel.has_surface).collect();
                assert!(own.iter().all(|pixel| pixel.probes >= 1.0), "{name}: a probe of {tile} is misplaced");
                let uncovered = own.iter().filter(|pixel| pixel.every < least).count();
                let Some(pixel) = own.first() else { continue };
                if pixel.probes <= MOST_FURTHER as f32 {
                    assert!((uncovered as f32) * worth < (TILE * TILE) as f32, "{name}, {tile}: {uncovered} pixels");
                }
                further += pixel.probes - 1.0;
                missed += uncovered;
                at_first += own.iter().filter(|pixel| pixel.first < least).count();
            }
            if random_index == 0 {
                let grown = covered(gpu, &scene, &camera, random_index, 0);
                let same = |(a, b): (&Covered, &Covered)| (a.every, a.probes) == (b.every, b.probes);
                assert!(pixels.iter().zip(&grown).all(same), "{name}: other probes after an overflow");
            }
        }
        println!("{name}: {further} further probes; {at_first} pixels uncovered without, {missed} with them");
        assert!(further > 3.0 && at_first > 40 && missed * 2 < at_first, "{name}: {missed} of {at_first}");
    }
    // A wall alone needs no further probe.
    let (_, mut plain) = edges().into_iter().next().unwrap();
    plain.meshes[0].primitives.truncate(1);
    let pixels = covered(gpu, &plain, &camera, 0, 0);
    assert!(pixels.iter().all(|pixel| pixel.has_surface && pixel.probes == 1.0 && pixel.first >= least));
}
