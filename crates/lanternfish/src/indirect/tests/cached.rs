//! Light that the ends of rays send by way of the radiance cache.

use crate::settings::{Bounces, HitLight};

use super::*;

fn cached(tracer: Tracer, bounces: Bounces) -> Sampled {
    Sampled { diffuse_rays: 16, glossy_rays: 0, hit_light: HitLight::Cached, bounces, ..sampled(tracer) }
}

fn over_frames(rays: Sampled, accumulate: u32) -> Settings {
    Settings { accumulate, ..settings(rays) }
}

const CAMERA: ([f32; 3], [f32; 3]) = ([0.0, 1.0, 2.6], [0.0, 1.0, 0.0]);

/// The light that comes from other surfaces is that of hits which are shaded each, but for what is blurred over a cell.
#[test]
fn gpu_cells_send_what_the_surfaces_in_them_send() {
    let Some(gpu) = testing::gpu("gpu_cells_send_what_the_surfaces_in_them_send") else { return };
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let direct =
        picture(gpu, Settings { indirect: Indirect::None, ..over_frames(sampled(Tracer::Bvh), 8) }, &scene, &camera);
    let indirect = |rays| mean(&picture(gpu, over_frames(rays, 8), &scene, &camera)) - mean(&direct);
    let shaded = Sampled { hit_light: HitLight::Shaded, ..cached(Tracer::Bvh, Bounces::One) };
    let expected = indirect(shaded);
    for tracer in tracers(gpu) {
        let found = indirect(cached(*tracer, Bounces::One)) / expected;
        println!("{tracer}: {found:.4} of the light");
        // Deep images have lost some of it before the cache is asked: see their page.
        let most = if is_exact(*tracer) { 0.03 } else { 0.08 };
        assert!((found - 1.0).abs() < most, "{tracer}: {found}");
    }
}

/// A closed box that shines evenly: what it sends is a geometric series of bounces.
#[test]
fn gpu_a_closed_box_that_shines_sends_every_bounce() {
    let Some(gpu) = testing::gpu("gpu_a_closed_box_that_shines_sends_every_bounce") else { return };
    let scene = closed_box(Material { emissive: Vec3::ONE, ..matt(0.5) });
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    for (bounces, expected) in [(Bounces::One, 1.75), (Bounces::All, 2.0)] {
        let found = mean(&picture(gpu, over_frames(cached(Tracer::Bvh, bounces), 16), &scene, &camera));
        println!("{bounces}: {found:.4} of {expected}");
        assert!((found / expected - 1.0).abs() < 0.02, "{bounces}: {found} of {expected}");
    }
}

/// All that is not direct light, against paths of any length.
#[test]
fn gpu_every_bounce_is_the_path_tracers() {
    let Some(gpu) = testing::gpu("gpu_every_bounce_is_the_path_tracers") else { return };
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let direct = Settings { indirect: Indirect::None, ..over_frames(sampled(Tracer::Bvh), 16) };
    let indirect = mean(&picture(gpu, over_frames(cached(Tracer::Bvh, Bounces::All), 16), &scene, &camera))
        - mean(&picture(gpu, direct, &scene, &camera));
    let [truth, direct] = [u32::MAX, 2].map(|depth| mean(&traced(&scene, &camera, depth, 256)));
    let found = indirect / (truth - direct);
    println!("{found:.4} of the light");
    assert!((found - 1.0).abs() < 0.04, "{found}");
    // One bounce alone is not enough: the test can fail.
    let [one, _] = [3, 2].map(|depth| mean(&traced(&scene, &camera, depth, 256)));
    assert!((one - direct) / (truth - direct) < 0.8);
}

/// A picture is the same whatever was rendered before it, and from run to run, though cells come to their slots in any order.
#[test]
fn gpu_cached_light_is_the_same_again() {
    let Some(gpu) = testing::gpu("gpu_cached_light_is_the_same_again") else { return };
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let settings = over_frames(cached(Tracer::Bvh, Bounces::All), 3);
    let first = picture(gpu, settings.clone(), &scene, &camera);
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let elsewhere = looking([0.5, 1.5, 2.0], [0.0, 0.5, 0.0]);
    renderer.render(&uploaded, &elsewhere, 40, 30).unwrap();
    let again = renderer.render(&uploaded, &camera, SIZE.x, SIZE.y).unwrap();
    let again: Vec<Vec3> = again.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate()).collect();
    assert_eq!(first, again);
}

/// Ends of rays for whose cells there is no room are shaded: nothing is lost, and they are counted.
#[test]
fn gpu_a_full_cache_loses_no_light() {
    let Some(gpu) = testing::gpu("gpu_a_full_cache_loses_no_light") else { return };
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let rendered = |rays| {
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, over_frames(rays, 8)).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let picture = renderer.render(&uploaded, &camera, SIZE.x, SIZE.y).unwrap();
        let lost = picture.report.counters.iter().find(|(name, _)| name == "indirect/lost_cells").unwrap().1;
        let pixels: Vec<Vec3> = picture.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate()).collect();
        (mean(&pixels), lost)
    };
    let usual = cached(Tracer::Bvh, Bounces::One);
    let (expected, lost) = rendered(Sampled { hit_light: HitLight::Shaded, ..usual });
    assert_eq!(lost, 0);
    let (found, lost) = rendered(usual);
    assert_eq!(lost, 0);
    assert!((found / expected - 1.0).abs() < 0.01, "{found} of {expected}");
    let (found, lost) = rendered(Sampled { cache_cells: 64, ..usual });
    println!("{lost} rays' cells had no room; {:.4} of the light", found / expected);
    assert!(lost > 10_000, "{lost}");
    assert!((found / expected - 1.0).abs() < 0.01, "{found} of {expected}");
}

/// No light of the outside comes into a closed box by way of cells that both sides of its walls would share.
#[test]
fn gpu_cells_do_not_leak_through_walls() {
    let Some(gpu) = testing::gpu("gpu_cells_do_not_leak_through_walls") else { return };
    let mut scene = closed_box(matt(0.8));
    scene.lights.push(Light::point(Vec3::new(0.0, 3.0, 0.0), Vec3::splat(100.0)));
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let inside = mean(&picture(gpu, over_frames(cached(Tracer::Bvh, Bounces::All), 4), &scene, &camera));
    // What the top of the box sends of the light 2 m above it.
    let outside = 0.8 / std::f64::consts::PI * 100.0 / 4.0;
    println!("{inside:.2e} inside of {outside:.2} outside");
    assert!(inside < 0.005 * outside, "{inside} of {outside}");
}
