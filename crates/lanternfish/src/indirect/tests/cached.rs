//! Indirect light from the radiance cache.

use super::*;
use crate::{indirect::radiance_cache::FIRST_ENTRIES_IN_TESTS, settings::History};

fn cached(tracer: Tracer, bounces: Bounces) -> Sampled {
    Sampled { diffuse_rays: 16, glossy_rays: 0, hit_light: HitLight::Cached, bounces, ..sampled(tracer) }
}

/// A closed, uniformly emissive box has the same radiance everywhere: emission, and a geometric series of bounces.
#[gpu_test]
fn gpu_emissive_box_has_the_stated_bounces(gpu: &Gpu) {
    let scene = closed_box(Material { emissive: Vec3::ONE, ..matt(0.5) });
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let shaded = tracers(gpu).map(|tracer| (sampled(tracer), 1, 1.75));
    let counted = [(Bounces::ONE, 1.75), (Bounces::UpTo(2), 1.875), (Bounces::UpTo(3), 1.9375), (Bounces::All, 2.0)];
    let cached =
        counted.map(|(bounces, expected)| (Sampled { cache_samples: 32, ..cached(Tracer::BVH, bounces) }, 8, expected));
    for (rays, frames, expected) in shaded.chain(cached) {
        let actual = mean(&rendering(gpu, over_frames(rays, frames), &scene, &camera));
        println!("{}, {}: {actual:.4} of {expected}", rays.hit_light, rays.bounces);
        assert!((actual / expected - 1.0).abs() < 0.01, "{rays:?}: {actual} of {expected}");
    }
}

/// With many samples per entry in the first frame, and few rays that request them: the mean of hits that have left an entry's list contains the light
/// of all bounces.
#[gpu_test(full)]
fn gpu_many_first_samples_keep_every_bounce(gpu: &Gpu) {
    let scene = Scene { lights: vec![Light::point(Vec3::ZERO, Vec3::ONE)], ..closed_box(matt(0.8)) };
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let of = |diffuse_rays, cache_samples| {
        let rays = Sampled { diffuse_rays, cache_samples, ..cached(Tracer::BVH, Bounces::All) };
        mean(&rendering(gpu, over_frames(rays, 1), &scene, &camera))
    };
    // With no more rays than a hit list holds.
    let ground_truth = of(16, 16);
    for diffuse_rays in [1, 8] {
        let actual = of(diffuse_rays, 64) / ground_truth;
        println!("{diffuse_rays} rays: {actual:.4} of the light");
        assert!((actual - 1.0).abs() < 0.015, "{diffuse_rays} rays: {actual}");
    }
}

/// Compares light of so many bounces with paths of so many segments, and with those of another number: the test can fail.
fn check_bounces(gpu: &Gpu, scene: &Scene, camera: &Camera, counts: &[(Bounces, u32, [u32; 2])]) {
    let direct = over_frames(sampled(Tracer::BVH), 8).with_indirect(Indirect::NONE);
    let direct = mean(&rendering(gpu, direct, scene, camera));
    let traced = |depth| mean(&traced(scene, camera, depth, 128));
    let traced_direct = traced(2);
    for (bounces, depth, others) in counts {
        let entries = Sampled { glossy_rays: 8, ..cached(Tracer::BVH, *bounces) };
        let actual = mean(&rendering(gpu, over_frames(entries, 8), scene, camera)) - direct;
        let fraction = |depth| actual / (traced(depth) - traced_direct);
        let (right, others) = (fraction(*depth), others.map(fraction));
        println!("{bounces}: {right:.4} of the light; of other numbers of bounces {others:.4?}");
        assert!((right - 1.0).abs() < if *bounces == Bounces::All { 0.04 } else { 0.03 }, "{bounces}: {right}");
        assert!(others.iter().all(|other| !(0.96..1.05).contains(other)), "{bounces}: {others:?}");
    }
}

const EVERY_BOUNCE: (Bounces, u32, [u32; 2]) = (Bounces::All, u32::MAX, [3, 3]);

#[gpu_test]
fn gpu_bounces_match_path_tracer(gpu: &Gpu) {
    let counts = [(Bounces::UpTo(3), 5, [4, 6]), EVERY_BOUNCE];
    check_bounces(gpu, &cornell(), &looking(CAMERA.0, CAMERA.1), &counts);
}

/// In the hall, rotated about all axes, the two sides of a wall seen from within it are close to each other, and face the same directions as its other
/// sides.
#[gpu_test(full)]
fn gpu_every_bounce_matches_path_tracer_in_the_hall(gpu: &Gpu) {
    let hall = demo("hall").unwrap();
    check_bounces(gpu, &hall, &hall.cameras[0], &[EVERY_BOUNCE]);
    check_bounces(gpu, &cornell(), &looking(CAMERA.0, CAMERA.1), &[(Bounces::UpTo(2), 4, [3, 5])]);
}

/// Entries that have migrated to another table keep their radiance for each number of bounces.
#[gpu_test(full)]
fn gpu_counted_bounces_survive_migration(gpu: &Gpu) {
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let entries = Sampled { diffuse_rays: 1, glossy_rays: 1, ..cached(Tracer::BVH, Bounces::UpTo(3)) };
    let settings = settings(entries).with_history(History::On);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let mut moved = 0;
    let mut light = |frames: usize| {
        let renderings = (0..frames).map(|_| renderer.render(&uploaded, &camera, SIZE.into()).unwrap());
        let light = renderings.map(|rendering| {
            moved += rendering.report.commands.iter().filter(|pass| pass.name == "radiance_cache/migrate").count();
            mean(&pixels(&rendering))
        });
        light.sum::<f64>() / frames as f64
    };
    // Entries migrate after 128 frames.
    light(100);
    let [before, _, after] = [24, 8, 24].map(&mut light);
    println!("{:.4} of the light in the other table", after / before);
    assert!(moved > 0 && (after / before - 1.0).abs() < 0.004, "{before} {after}, moved {moved} times");
}

/// An image does not depend on what was rendered before, and is the same in every run, although the slots of entries depend on the order of invocations.
#[gpu_test]
fn gpu_cached_light_is_reproducible(gpu: &Gpu) {
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let settings = over_frames(cached(Tracer::BVH, Bounces::All), 3);
    let first = rendering(gpu, settings.clone(), &scene, &camera);
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let elsewhere = looking([0.5, 1.5, 2.0], [0.0, 0.5, 0.0]);
    renderer.render(&uploaded, &elsewhere, [40, 30]).unwrap();
    assert_eq!(first, pixels(&renderer.render(&uploaded, &camera, SIZE.into()).unwrap()));
}

/// Light of the cache is that of shaded hits, but for the blur over an entry. Hits for whose entries the cache is full are shaded: with one bounce no
/// light is lost; with all bounces the radiance of missing entries is approximate. Both are counted.
#[gpu_test]
fn gpu_a_full_cache_loses_no_light_of_one_bounce(gpu: &Gpu) {
    let (scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    let none = over_frames(sampled(Tracer::BVH), 8).with_indirect(Indirect::NONE);
    let direct = mean(&image_of(gpu, LARGE, none, &scene, &camera));
    let rendered_over = |frames, rays| {
        let image = rendered(gpu, LARGE, over_frames(rays, frames), &scene, &camera);
        let names = ["indirect/rays", "indirect/hits", "indirect/lost_entries", "radiance_cache/lost"];
        (mean(&pixels(&image)) - direct, names.map(|name| counted(&image, name)))
    };
    let rendered = |rays| rendered_over(8, rays);
    let one = cached(Tracer::BVH, Bounces::ONE);
    let (expected, [rays, hits, ..]) = rendered(Sampled { hit_light: HitLight::Shaded, ..one });
    let (actual, counts) = rendered(one);
    assert_eq!(counts, [rays, hits, 0, 0]);
    assert!((actual / expected - 1.0).abs() < 0.03, "{actual} of {expected}");
    let (actual, counts) = rendered(Sampled { cache_entries: 64, ..one });
    println!("{} rays found the cache full; {:.4} of the light", counts[2], actual / expected);
    assert!(counts[..2] == [rays, hits] && counts[2] > rays / 4 && counts[3] == 0, "{counts:?}");
    assert!((actual / expected - 1.0).abs() < 0.03, "{actual} of {expected}");
    // A first frame that starts over, with a table that is full again: some entries that had a slot before have none then.
    let first = Sampled { first_rays: 1, ..one };
    let (_, [rays, hits, ..]) = rendered_over(1, Sampled { hit_light: HitLight::Shaded, ..first });
    FIRST_ENTRIES_IN_TESTS.set(256);
    let (actual, counts) = rendered_over(1, Sampled { cache_entries: 512, ..first });
    println!("{} rays found the cache full after starting over; {:.4} of the light", counts[2], actual / expected);
    assert!(counts[..2] == [rays, hits] && counts[2] > rays / 4, "{counts:?}, {rays} rays, {hits} hits");
    assert!((actual / expected - 1.0).abs() < 0.03, "{actual} of {expected}");
    FIRST_ENTRIES_IN_TESTS.set(1 << 17);
    let all = cached(Tracer::BVH, Bounces::All);
    let (complete, counts) = rendered(all);
    assert_eq!(counts[2..], [0, 0]);
    let (actual, counts) = rendered(Sampled { cache_entries: 64, ..all });
    assert!(counts[3] > 0 && actual > expected && actual < complete, "{counts:?}, {actual} of {complete}");
}

/// An unlit surface emits its colour and reflects no light.
#[gpu_test]
fn gpu_unlit_surfaces_emit_only_their_colour(gpu: &Gpu) {
    let scene = closed_box(Material { unlit: true, ..matt(0.5) });
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let of = |bounces| {
        let mut scene = scene.clone();
        // The visible side is lit by the unlit sides.
        scene.materials.push(matt(0.5));
        scene.meshes[0].primitives[5].material = 1;
        mean(&rendering(gpu, over_frames(cached(Tracer::BVH, bounces), 8), &scene, &camera))
    };
    let [one, all] = [Bounces::ONE, Bounces::All].map(of);
    println!("{one:.4} with one bounce, {all:.4} with every bounce");
    // The one reflecting side receives light of unlit sides only.
    assert!((all / one - 1.0).abs() < 0.01, "{all} {one}");
}

/// Light does not leak from a wall's lit side to the other one through shared entries.
#[gpu_test]
fn gpu_entries_do_not_leak_through_walls(gpu: &Gpu) {
    // A wall without thickness in the middle of a box; a lamp on the far side.
    let mut scene = closed_box(matt(0.8));
    scene.meshes[0].primitives.push(quad(0, Vec3::ZERO, Vec3::X, Vec3::Y));
    scene.lights.push(Light::point(Vec3::new(0.0, 0.0, -0.5), Vec3::ONE));
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, 0.0]);
    let behind = looking([0.0, 0.0, -0.9], [0.3, 0.2, 0.0]);
    let settings = over_frames(cached(Tracer::BVH, Bounces::All), 4);
    let [dark, lit] = [camera, behind].map(|camera| mean(&rendering(gpu, settings.clone(), &scene, &camera)));
    println!("{dark:.2e} on the dark side, {lit:.2} on the lit one");
    assert!(dark < 0.005 * lit, "{dark} of {lit}");
}

/// A table that is too small at first grows, by starting over in a first frame and by migration between frames. The image is that of a table that was
/// large enough.
#[gpu_test]
fn gpu_table_growth_does_not_change_the_image(gpu: &Gpu) {
    let (mut scene, camera) = (cornell(), looking(CAMERA.0, CAMERA.1));
    // Unlit surfaces emit, and shading runs for the sky: this detects hits that are shaded in addition to their entry, after the table was full
    // before the frame started over.
    scene.materials[0].unlit = true;
    scene.sky = Vec3::splat(0.2);
    let rays = Sampled { diffuse_rays: 4, glossy_rays: 2, ..cached(Tracer::BVH, Bounces::All) };
    let rendered = |first_entries, rays| {
        FIRST_ENTRIES_IN_TESTS.set(first_entries);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), over_frames(rays, 3)).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let [rendering, again] = [(), ()].map(|()| renderer.render(&uploaded, &camera, SIZE.into()).unwrap());
        let counts = ["radiance_cache/entries", "radiance_cache/lost", "indirect/lost_entries"];
        let counts = counts.map(|name| counted(&rendering, name));
        let moved = rendering.report.commands.iter().filter(|pass| pass.name == "radiance_cache/migrate").count();
        println!("{first_entries} entries at first: {counts:?}, moved {moved} times");
        assert!(
            counts[1] > 0 || rendering.radiance == again.radiance,
            "{first_entries}: another image the second time"
        );
        (rendering.radiance, counts, moved)
    };
    let mut moved_between_frames = 0;
    // The last case has more sample indices in the first frame than samples per entry.
    for (tracer, bounces, first_rays) in [(Tracer::BVH, Bounces::All, 1), (Tracer::BVH, Bounces::UpTo(3), 4)] {
        let rays = Sampled { tracer: tracer.into(), bounces, first_rays, ..rays };
        let (expected, [entries, ..], _) = rendered(1 << 17, rays);
        // With 4096 entries, the frame starts over after a later sample index.
        for first_entries in [64, 1 << 12, 1 << 14] {
            let (actual, counts, moved) = rendered(first_entries, rays);
            moved_between_frames += moved;
            assert_eq!(counts, [entries, 0, 0], "{tracer}, {first_entries}");
            assert!(actual == expected, "{tracer}, {first_entries}: another image");
        }
        // If the table cannot grow, entries are lost.
        let (actual, [.., lost, lost_of_pixels], _) = rendered(64, Sampled { cache_entries: 64, ..rays });
        assert!(lost > 0 && lost_of_pixels > 0 && actual != expected, "{tracer}");
    }
    assert!(moved_between_frames > 0);
}
