//! Bands of visibility, and constants that shaders and host share.

mod history;
mod panes;
mod soft;
mod vertex_grid;
mod visibility;

use lanternfish_gpu::testing;

use super::{BLOCK_EDGE, FIRST_START, bands, check_row, even_row_starts, row_starts, split};
use crate::{
    Renderer, Settings,
    rays::Tracer,
    settings::{RayCulling, Samples, Shadows},
    shaders::constant,
};

#[gpu_test]
fn gpu_one_band_or_many_give_the_same_image(gpu: &Gpu) {
    let mut scene = lanternfish_scene::generate::demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    scene.lights.extend(lanternfish_scene::generate::light_rain(&scene.bounds(), 70, Some(1.0), 1, 0.0));
    let rendering = |samples, limits: [u64; 2], seed: u32| {
        let mut scene = scene.clone();
        scene.lights.truncate(scene.lights.len() - seed as usize);
        let settings = Settings::direct_light().with_shadows(Shadows::BVH).with_samples(samples);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let shadows = renderer.passes.shadows.as_mut().expect("shadows are on");
        [shadows.word_limit, shadows.dispatch_limit] = limits;
        let uploaded = renderer.upload(&scene).unwrap();
        let rendering = renderer.render(&uploaded, &camera, [72, 60]).unwrap();
        let counter = |name: &str| rendering.report.counters.iter().find(|(n, _)| n == name).map(|(_, count)| *count);
        let trace = rendering.report.commands.iter().find(|pass| pass.name == "shadows/trace").unwrap();
        let counts = [counter("shadows/bands").unwrap(), u64::from(trace.dispatches)];
        (counts, counter("shadows/rays").unwrap(), rendering.radiance)
    };
    for samples in [Samples::One, Samples::Four] {
        let unlimited = u64::MAX;
        let one = rendering(samples, [unlimited; 2], 0);
        assert_eq!(one.0, [1, 1]);
        // Nine blocks of 64 pixels with up to three words each, and some edges: one band, or one dispatch, holds one row of blocks.
        let row = 9 * 64 * 4;
        for (limits, is_expected) in [
            ([row, unlimited], (|[bands, dispatches]| bands >= 4 && dispatches == bands) as fn([u64; 2]) -> bool),
            ([unlimited, row], |[bands, dispatches]| bands == 1 && dispatches >= 4),
            ([4 * row, 0], |[bands, dispatches]| bands <= 2 && dispatches == 8),
        ] {
            let many = rendering(samples, limits, 0);
            println!("{samples} samples: {:?} bands and dispatches, {} rays", many.0, many.1);
            assert!(is_expected(many.0), "{limits:?}: {:?}", many.0);
            assert!(one.1 == many.1 && one.2 == many.2, "{limits:?} changes the image");
        }
        assert!(rendering(samples, [unlimited; 2], 1).2 != one.2, "removing a light changes nothing");
    }
}

#[test]
fn depth_alone_reads_no_surface_target() {
    let reads = |ray_culling| {
        let settings = Settings::direct_light().with_ray_culling(ray_culling);
        let trace = super::features(&settings, Tracer::BVH, true, false).unwrap().trace;
        let shader = super::DECLARED.link("shadows/trace", &trace).unwrap();
        let is_texture =
            |name: &Option<String>| name.as_deref().is_some_and(|name| name.starts_with("surface_texture"));
        let is_read = shader.module.global_variables.iter().any(|(_, variable)| is_texture(&variable.name));
        assert_eq!(is_read, super::reads_surface(&settings), "{ray_culling}");
        is_read
    };
    let without: Vec<_> = RayCulling::ALL.iter().copied().filter(|culling| !reads(*culling)).collect();
    assert_eq!(without, [RayCulling::Depth]);
}

#[test]
fn sums_that_started_over_are_unrolled() {
    let most = u32::MAX - 63;
    assert_eq!(row_starts(&[0, 64, 128, 192, 128, 64, 5], 2), [0, 128, 128, (1 << 32) + 5]);
    assert_eq!(row_starts(&[0, most, most.wrapping_add(most)], 1), [0, u64::from(most), 2 * u64::from(most)]);
    assert!(check_row(2048, 1_000_000 / 32).is_ok() && check_row(2048, 2_100_000 / 32).is_err());
}

#[test]
fn bands_cover_every_row_once_and_fit() {
    let starts = [0, 4, 9, 9, 15, 16, 26];
    assert_eq!(bands(&starts, 10).unwrap(), [0..3, 3..5, 5..6]);
    assert_eq!(bands(&starts, 26).unwrap(), std::slice::from_ref(&(0..6)));
    assert_eq!(bands(&[0, 0, 0], 0).unwrap(), std::slice::from_ref(&(0..2)));
    assert!(bands(&starts, 9).is_err());
}

#[test]
fn dispatches_cover_every_row_of_their_band_once() {
    let starts = [0, 4, 9, 9, 15, 16, 26];
    assert_eq!(split(&starts, 1..5, 10), [1..3, 3..5]);
    // A row with more than the limit stands alone.
    assert_eq!(split(&starts, 0..6, 6), [0..1, 1..3, 3..4, 4..5, 5..6]);
    assert_eq!(split(&even_row_starts(6, 60), 0..6, 20), [0..2, 2..4, 4..6]);
    assert_eq!(even_row_starts(3, 10), [0, 3, 6, 10]);
}

#[test]
fn constants_are_the_shaders() {
    let file = "shadows/visibility_bits";
    assert_eq!(constant(file, "BLOCK_PIXELS"), f64::from(BLOCK_EDGE * BLOCK_EDGE));
    assert_eq!(constant(file, "FIRST_START"), FIRST_START as f64);
}
