//! Bands of visibility, and constants that shaders and host share.

mod history;
mod panes;
mod soft;
mod vertex_grid;
mod visibility;

use glam::Vec3;
use lanternfish_gpu::testing;
use lanternfish_scene::{Light, Scene, generate};

use super::{BLOCK_EDGE, FIRST_START, bands, check_row, even_row_starts, row_starts, split};
use crate::{
    Renderer, Settings,
    rays::Tracer,
    settings::{History, RayCulling, Samples, Shadows},
    shaders::constant,
    testing::walks,
};

/// With one band, shading uses the bits that were traced for the visibility ratios; with several bands they are traced again.
#[gpu_test]
fn gpu_one_band_or_many_give_the_same_image(gpu: &Gpu) {
    let mut rain = generate::demo("cornell").unwrap();
    rain.lights.extend(generate::light_rain(&rain.bounds(), 30, Some(1.0), 1, 0.0));
    let mut with_rectangle = rain.clone();
    let down = Light::rectangle(Vec3::new(-0.4, 1.8, 0.2), -Vec3::Y, Vec3::X, [0.6, 0.3], Vec3::splat(6.0));
    with_rectangle.lights.push(down);
    let images = |settings: &Settings, scene: &Scene, limits: [u64; 2]| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        let shadows = renderer.passes.shadows.as_mut().expect("shadows are on");
        [shadows.word_limit, shadows.dispatch_limit] = limits;
        let uploaded = renderer.upload(scene).unwrap();
        let [first, image] = [0, 1].map(|i| renderer.render(&uploaded, &walks::steps(2)[i], [56, 40]).unwrap());
        let counter = |name: &str| image.report.counters.iter().find(|(n, _)| n == name).map(|(_, count)| *count);
        let trace = image.report.commands.iter().find(|pass| pass.name == "shadows/trace").unwrap();
        let counts = [counter("shadows/bands").unwrap(), u64::from(trace.dispatches)];
        (counts, counter("shadows/rays").unwrap(), [first.radiance, image.radiance])
    };
    let hard = Settings::direct_light().with_shadows(Shadows::BVH).with_shadow_rays(5);
    let four = hard.clone().with_samples(Samples::Four);
    let soft = hard.clone().with_light_radius(0.2);
    let accumulated = soft.clone().with_history(History::On);
    let unlimited = u64::MAX;
    // Words of a pixel, at most.
    let mut rays = Vec::new();
    for (name, settings, scene, words) in [
        ("hard", hard, &rain, 2),
        ("four samples", four, &rain, 4),
        ("soft", soft, &rain, 9),
        ("accumulated", accumulated, &with_rectangle, 32),
    ] {
        let one = images(&settings, scene, [unlimited; 2]);
        assert!(one == images(&settings, scene, [unlimited; 2]), "{name}: not reproducible");
        rays.push(one.1);
        // Seven blocks of 64 pixels: one band, or one dispatch, holds one row of blocks.
        let row = 7 * 64 * words;
        for (limits, is_expected) in [
            ([row, unlimited], (|[bands, _]| bands > 1) as fn([u64; 2]) -> bool),
            ([unlimited, row], |[bands, dispatches]| bands == 1 && dispatches > 1),
            ([2 * row, 0], |[_, dispatches]| dispatches >= 5),
        ] {
            let many = images(&settings, scene, limits);
            println!("{name}: {:?} bands and dispatches, {} rays", many.0, many.1);
            assert!(is_expected(many.0), "{name}, {limits:?}: {:?}", many.0);
            assert!(one.1 == many.1 && one.2 == many.2, "{name}: {limits:?} changes the image");
        }
        let mut less = scene.clone();
        less.lights.pop();
        assert!(images(&settings, &less, [unlimited; 2]).2 != one.2, "{name}: removing a light changes nothing");
    }
    assert_eq!(rays[2], 5 * rays[0], "five rays where there was one");
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
