//! Number of rays that are traced.

use super::*;

/// Every pixel traces its rays; rays that leave the scene are no hits, and hits without light have no shadow rays.
#[gpu_test]
fn gpu_rays_are_counted(gpu: &Gpu) {
    let rays = Sampled { diffuse_rays: 3, glossy_rays: 0, ..sampled(Tracer::BVH) };
    let counted = |scene: &Scene, camera: &Camera| {
        let image = rendered(gpu, SIZE, settings(rays), scene, camera);
        ["indirect/rays", "indirect/hits", "indirect/shadow_rays", "indirect/emitter_rays"].map(|n| counted(&image, n))
    };
    let pixels = u64::from(SIZE.x * SIZE.y);
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let mut box_scene = closed_box(matt(0.5));
    assert_eq!(counted(&box_scene, &camera), [3 * pixels, 3 * pixels, 0, 0]);
    box_scene.lights.push(Light::point(Vec3::ZERO, Vec3::ONE));
    let [rays, hits, shadow_rays, emitter_rays] = counted(&box_scene, &camera);
    // Russian roulette skips some of the shadow rays with a small contribution.
    assert_eq!([rays, hits, emitter_rays], [3 * pixels, 3 * pixels, 0]);
    assert!(shadow_rays > 3 * pixels / 2 && shadow_rays < 3 * pixels, "{shadow_rays} of {hits}");
    // A thin dielectric in front of the eye adds as many rays, and one glossy ray per pixel.
    let mut with_dielectric = box_scene.clone();
    let thin_dielectric =
        Material { alpha_mode: AlphaMode::Blend, base_color: Vec4::new(0.5, 0.5, 0.5, 0.5), ..matt(0.5) };
    with_dielectric.materials.push(thin_dielectric);
    with_dielectric.meshes[0].primitives.push(quad(1, Vec3::new(0.0, 0.0, 0.5), Vec3::X, Vec3::Y));
    let [rays, hits, shadow_rays, emitter_rays] = counted(&with_dielectric, &camera);
    // Glossy rays may point into the thin dielectric.
    assert!((6 * pixels..=7 * pixels).contains(&rays), "{rays} of {pixels} pixels");
    assert_eq!([hits, emitter_rays], [rays, 0]);
    assert!(shadow_rays > rays / 2 && shadow_rays < rays, "{shadow_rays} of {rays}");
    // One side is emissive, but dim beside the light: two emitter rays per pixel for three diffuse rays, of which at least one in 16 is traced.
    let shining = Material { emissive: Vec3::ONE, ..matt(0.5) };
    box_scene.materials.push(shining);
    box_scene.meshes[0].primitives[2].material = 1;
    let behind = looking([0.0, 0.5, 0.0], [0.0, -1.0, 0.1]);
    let emitter_rays = counted(&box_scene, &behind)[3];
    assert!(emitter_rays > pixels / 20 && emitter_rays <= 2 * pixels, "{emitter_rays} of {pixels} pixels");
    let down = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let [rays, hits, shadow_rays, _] = counted(&floor(matt(0.5)), &down);
    // Over a floor all rays leave the scene and count, except a few at the very edge of the hemisphere.
    assert!(
        rays > 29 * pixels / 10 && rays <= 3 * pixels && (hits, shadow_rays) == (0, 0),
        "{rays} {hits} {shadow_rays}"
    );
}

/// Some of the segments with a small contribution are traced, with a higher weight; occluded ones have weight 0.
#[gpu_test]
fn gpu_roulette_is_unbiased(gpu: &Gpu) {
    let renderer = walks::renderer(gpu, settings(sampled(Tracer::BVH)));
    let uploaded = renderer.upload(&floor(matt(0.5))).unwrap();
    let mut random = Random::new(8);
    let mut queries = Vec::new();
    for i in 0..64 * 400 {
        // Every fourth segment passes through the floor; few segments have most of the contribution.
        let start = Vec3::new(0.1, if i % 4 == 0 { -1.0 } else { 0.5 }, 0.2);
        queries.push(start.extend(random.unit().powi(6)));
        queries.push(Vec3::Y.extend(random.unit()));
    }
    let answers = evaluate_module(gpu, "testing/roulette", "fractions", &uploaded.bindings(), &queries, 2);
    let (mut estimate, mut total, mut traced, mut visible) = (0.0, 0.0, 0, 0);
    for (group, answers) in queries.chunks(2 * 64).zip(answers.chunks(64)) {
        let mean = group.iter().step_by(2).map(|query| query.w).sum::<f32>() / 64.0;
        for (segment, answer) in group.chunks(2).zip(answers) {
            let (weight, is_visible) = (segment[0].w, segment[0].y > 0.0);
            assert!(is_visible || answer.x == 0.0, "an occluded segment counts");
            assert!(!is_visible || weight < 1.001 * mean || answer.x == 1.0, "{weight} beside {mean}: {}", answer.x);
            estimate += f64::from(weight * answer.x);
            total += if is_visible { f64::from(weight) } else { 0.0 };
            traced += usize::from(answer.x > 0.0);
            visible += usize::from(is_visible);
        }
    }
    println!("{traced} of {visible} traced, with {:.4} of the total", estimate / total);
    assert!(
        traced < visible / 2 && (estimate / total - 1.0).abs() < 0.01,
        "{traced} of {visible}: {estimate} of {total}"
    );
}

/// With the radiance cache, an image's first frame has `first_rays` times as many diffuse rays: it is the image of that number of rays. Later frames, and
/// frames with shaded hits, have the usual number.
#[gpu_test]
fn gpu_first_frames_have_more_rays(gpu: &Gpu) {
    // The lamp is made of emissive triangles.
    let scene = demo("cornell").unwrap();
    let rendered = |frames, hit_light, diffuse_rays, first_rays| {
        let rays = Sampled { diffuse_rays, first_rays, glossy_rays: 2, hit_light, ..sampled(Tracer::BVH) };
        let image = rendered(gpu, SIZE, over_frames(rays, frames), &scene, &scene.cameras[0]);
        (["indirect/rays", "indirect/emitter_rays"].map(|name| counted(&image, name)), image.radiance)
    };
    let (rays, twice) = rendered(1, HitLight::Cached, 4, 2);
    let (as_many, same) = rendered(1, HitLight::Cached, 8, 1);
    assert!(rays == as_many && rays.iter().all(|rays| *rays > 0), "{rays:?}, {as_many:?}");
    assert!(twice == same, "another image");
    let (usual, rendering) = rendered(1, HitLight::Cached, 4, 1);
    assert!(rendering != twice && usual[0] < rays[0] && usual[1] < rays[1], "{usual:?}, {rays:?}");
    // Counters are those of the last frame.
    for (frames, hit_light) in [(2, HitLight::Cached), (1, HitLight::Shaded)] {
        assert_eq!(rendered(frames, hit_light, 4, 2).0[0], rendered(frames, hit_light, 4, 1).0[0], "{hit_light}");
    }
}

/// Samples per entry of the radiance cache.
fn samples_per_entry(image: &RenderedImage) -> f64 {
    counted(image, "radiance_cache/samples") as f64 / counted(image, "radiance_cache/entries") as f64
}

/// In a mean, every entry that pixels' rays request gets a sample in each frame; of those with a long history, half or a quarter. Entries that
/// rays hit again and again get four, up to 128 in all: a few are left after 64 frames. In a first frame, entries that many rays hit get more samples
/// than others, up to the requested number.
#[gpu_test(full)]
fn gpu_samples_of_entries_follow_hits_and_history(gpu: &Gpu) {
    let scene = Scene { lights: vec![Light::point(Vec3::ZERO, Vec3::ONE)], ..closed_box(matt(0.5)) };
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    let cached = Sampled { glossy_rays: 0, hit_light: HitLight::Cached, ..sampled(Tracer::BVH) };
    let mut renderer = walks::renderer(gpu, settings(Sampled { diffuse_rays: 32, bounces: Bounces::All, ..cached }));
    let uploaded = renderer.upload(&scene).unwrap();
    // After the first frame's 2 to 16 samples, all have 24 after 22 to 8 frames, and 32 after 16 more.
    let expected = [(4, 1.0), (30, 0.5), (64, 0.3)];
    for frame in 1..=64 {
        let image = renderer.refine(&uploaded, &[(&camera, SIZE.into())]).unwrap().remove(0);
        let Some((_, fraction)) = expected.iter().find(|(at, _)| *at == frame) else { continue };
        let samples = samples_per_entry(&image);
        println!("frame {frame}: {samples} samples per entry");
        assert!((samples / fraction - 1.0).abs() < 0.3, "frame {frame}: {samples} samples per entry");
    }
    let first = Sampled { diffuse_rays: 16, first_rays: 1, bounces: Bounces::UpTo(1), ..cached };
    let of = |edge| samples_per_entry(&rendered(gpu, UVec2::splat(edge), settings(first), &scene, &camera));
    let [few, many] = [16, 256].map(of);
    println!("{few} samples of an entry that few rays hit, {many} where many do");
    // Hardly any entry is hit twice.
    assert!((2.0..4.0).contains(&few), "{few}");
    assert!((12.0..=16.0).contains(&many), "{many}");
}
