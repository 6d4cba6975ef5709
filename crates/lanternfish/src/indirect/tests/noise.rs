//! Noise of few rays, and the effect of clamp and filter.

use lanternfish_scene::rig;

use super::*;
use crate::settings::Preset;

/// Errors of pixels at a distance of 32 pixels, the period of the squares that share a net of shifts, are not correlated; nor are those at the periods of
/// smaller squares.
#[gpu_test]
fn gpu_noise_does_not_repeat(gpu: &Gpu) {
    let mut scene = floor(matt(0.5));
    let sky = Environment { width: 16, height: 8, pixels: vec![Vec3::ONE; 128], rotation: 0.0 };
    let card = Material { base_color: Vec4::new(0.0, 0.0, 0.0, 1.0), ..matt(0.0) };
    scene.materials.push(card);
    scene.meshes[0].primitives.push(quad(1, Vec3::new(0.0, 3.0, 0.0), 2.0 * Vec3::X, 2.0 * Vec3::Z));
    scene.environment = Some(sky);
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let of = |diffuse_rays| {
        let sampled = Sampled { diffuse_rays, glossy_rays: 0, ..sampled(Tracer::BVH) };
        image_of(gpu, LARGE, settings(sampled), &scene, &camera)
    };
    let (few, ground_truth) = (of(5), of(256));
    let errors: Vec<f64> =
        few.iter().zip(&ground_truth).map(|(few, ground_truth)| f64::from(few.x / ground_truth.x - 1.0)).collect();
    let (width, height) = (LARGE.x as usize, LARGE.y as usize);
    let power = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
    assert!(power > 1e-4, "{power}: there is no noise");
    for (right, down) in [(4, 0), (8, 0), (32, 0), (0, 4), (0, 8), (0, 32), (32, 32)] {
        let kept = (0..height - down).flat_map(|y| (0..width - right).map(move |x| y * width + x));
        let products: Vec<f64> = kept.map(|i| errors[i] * errors[i + down * width + right]).collect();
        let alike = products.iter().sum::<f64>() / products.len() as f64 / power;
        println!("pixels {right}, {down} apart: {alike:.3}");
        assert!(alike < 0.5, "errors of pixels {right}, {down} apart are alike: {alike}");
    }
}

/// The clamp limits a pixel far above its similar neighbours; no pixel gets brighter, and uniform light does not change.
#[gpu_test]
fn gpu_clamp_removes_only_fireflies(gpu: &Gpu) {
    // A bright unlit card, which rays hit only by chance.
    let mut scene = floor(matt(0.5));
    scene.materials.push(Material { base_color: Vec4::ONE, unlit: true, ..matt(0.0) });
    scene.meshes[0].primitives.push(quad(1, 2.0 * Vec3::Y, 0.1 * Vec3::X, 0.1 * Vec3::Z));
    scene.sky = Vec3::splat(5e-4);
    let camera = looking([0.0, 0.8, 1.6], [0.0, 0.0, 0.0]);
    let of = |clamp, diffuse_rays| {
        let rays = Sampled { clamp, diffuse_rays, glossy_rays: 0, ..sampled(Tracer::BVH) };
        rendering(gpu, settings(rays), &scene, &camera)
    };
    let squares = |pixels: &[Vec3]| pixels.iter().map(|pixel| pixel.x * pixel.x).sum::<f32>();
    let [on, off] = [IndirectClamp::On, IndirectClamp::Off].map(|clamp| of(clamp, 4));
    let kept = mean(&on) / mean(&off);
    let noise = squares(&on) / squares(&off);
    println!("squares {noise:.4}, energy kept {kept:.4}");
    // One ray of 300 hits the card: the clamp removes most of its light.
    assert!(noise < 0.4 && f64::from(noise) < 0.8 * kept && kept > 0.25 && kept < 1.0);
    assert!(on.iter().zip(&off).all(|(on, off)| on.x <= off.x));
    // The mean loses less with more frames (eight are as few as one), also where the pixels around a bright one are black.
    for sky in [5e-4, 0.0] {
        scene.sky = Vec3::splat(sky);
        let kept = [1, 8, 16, 64].map(|frames| {
            let [on, off] = [IndirectClamp::On, IndirectClamp::Off].map(|clamp| {
                let rays = Sampled { clamp, diffuse_rays: 4, glossy_rays: 0, ..sampled(Tracer::BVH) };
                rendering(gpu, over_frames(rays, frames), &scene, &camera)
            });
            mean(&on) / mean(&off)
        });
        println!("sky of {sky}: energy kept of 1, 8, 16 and 64 frames {kept:.4?}");
        assert!(kept[1..].is_sorted() && kept[2] > kept[0] + 0.05 && kept[2] > 0.5 && kept[3] > 0.875, "{kept:?}");
    }
    let sky = Scene { sky: Vec3::ONE, ..floor(matt(0.5)) };
    let even = |clamp| rendering(gpu, settings(Sampled { clamp, ..sampled(Tracer::BVH) }), &sky, &camera);
    assert!(self::off(&even(IndirectClamp::On), &even(IndirectClamp::Off)) < 1e-3);
}

/// With a filter, the clamped excess is redistributed over the pixels around: the energy is preserved, with less noise than without the clamp. The same
/// holds for reflections in a rough metal.
#[gpu_test]
fn gpu_clamped_excess_is_redistributed(gpu: &Gpu) {
    // All of each image is floor. One image alone is off by up to 5 %.
    let cameras = [0.0, 0.02, 0.04, 0.06].map(|x| looking([x, 1.5, 0.4], [0.0, 0.0, 0.0]));
    let metal = Material { metallic: 1.0, ..matt(0.9) };
    for (name, material, glossy_rays) in [("matt", matt(0.5), 0), ("metal", metal, 4)] {
        let mut scene = floor(material);
        scene.materials.push(Material { base_color: Vec4::ONE, unlit: true, ..matt(0.0) });
        scene.meshes[0].primitives.push(quad(1, 2.0 * Vec3::Y, 0.1 * Vec3::X, 0.1 * Vec3::Z));
        scene.sky = Vec3::splat(5e-4);
        let of = |clamp, filter_radius| {
            let rays = Sampled { clamp, filter_radius, diffuse_rays: 4, glossy_rays, ..sampled(Tracer::BVH) };
            let images = cameras.iter().map(|camera| image_of(gpu, LARGE, settings(rays), &scene, camera));
            images.collect::<Vec<_>>().concat()
        };
        let all = mean(&of(IndirectClamp::Off, 0));
        let [lost, kept] = [0, 8].map(|radius| mean(&of(IndirectClamp::On, radius)) / all);
        let uneven = |pixels: Vec<Vec3>| {
            let mean = mean(&pixels);
            pixels.iter().map(|pixel| (f64::from(pixel.x) / mean - 1.0).abs()).sum::<f64>() / pixels.len() as f64
        };
        let fraction = uneven(of(IndirectClamp::On, 8)) / uneven(of(IndirectClamp::Off, 8));
        println!(
            "{name}: energy kept {kept:.4}, {lost:.4} without redistribution; {fraction:.3} of the noise without the clamp"
        );
        assert!(lost < 0.9, "{name}: nothing is clamped: {lost}");
        assert!((kept - 1.0).abs() < 0.03, "{name}: {kept}");
        assert!(fraction < 0.8, "{name}: {fraction}");
    }
}

/// Light of diffuse and glossy rays counts once in the glossy lobe: the mean of few rays of both kinds is that of many glossy ones, for every roughness,
/// resolution and source of the light at hits. Some rays leave the scene.
#[gpu_test]
fn gpu_both_kinds_of_rays_count_light_once(gpu: &Gpu) {
    let camera = looking([0.0, 1.0, 2.6], [0.0, 1.0, 0.0]);
    let [full, half] = [IndirectResolution::Full, IndirectResolution::Half];
    let [shaded, cached] = [HitLight::Shaded, HitLight::Cached];
    let cases = [(0.2, full, shaded), (0.5, full, cached), (0.5, full, shaded), (1.0, half, shaded)];
    for (perceptual_roughness, resolution, hit_light) in cases.into_iter().take(if testing::is_full() { 4 } else { 2 })
    {
        let mut scene = cornell();
        scene.sky = Vec3::splat(0.2);
        for material in &mut scene.materials {
            *material = Material { metallic: 1.0, perceptual_roughness, ..matt(0.8) };
        }
        let of = |diffuse_rays, glossy_rays, accumulate| {
            let rays = Sampled { diffuse_rays, glossy_rays, resolution, hit_light, ..sampled(Tracer::BVH) };
            mean(&rendering(gpu, over_frames(rays, accumulate), &scene, &camera))
        };
        let actual = of(3, 1, 64) / of(1, 16, 64);
        let name = format!("roughness {perceptual_roughness}, {resolution}, {hit_light}");
        println!("{name}: {actual:.4} of the light");
        // Graphics cards have faster, less precise square roots and quotients: 0.005 on one.
        assert!((actual - 1.0).abs() < if hit_light == cached { 0.01 } else { 0.006 }, "{name}: {actual}");
    }
}

/// The filter and half resolution do not change constant light, and both reduce the error of few rays.
#[gpu_test]
fn gpu_filter_and_half_resolution_keep_constant_light(gpu: &Gpu) {
    let camera = looking([0.0, 2.0, 2.0], [0.0, 0.0, 0.0]);
    let scene = Scene { sky: Vec3::ONE, ..floor(matt(0.5)) };
    for resolution in IndirectResolution::ALL.iter().copied() {
        let filtered = Sampled { resolution, filter_radius: 6, ..sampled(Tracer::BVH) };
        let actual = rendering(gpu, settings(filtered), &scene, &camera);
        assert!(actual.iter().all(|pixel| (*pixel / 0.5 - 1.0).abs().max_element() < 2e-3), "{resolution}");
    }
    let cornell = cornell();
    let camera = &cornell.cameras[0];
    let few = Sampled { diffuse_rays: 4, glossy_rays: 4, filter_radius: 0, ..sampled(Tracer::BVH) };
    let ground_truth =
        rendering(gpu, settings(Sampled { diffuse_rays: 256, ..sampled(Tracer::BVH) }), &cornell, camera);
    let noisy = off(&rendering(gpu, settings(few), &cornell, camera), &ground_truth);
    for resolution in IndirectResolution::ALL.iter().copied() {
        let filtered = Sampled { resolution, filter_radius: 5, ..few };
        let smooth = off(&rendering(gpu, settings(filtered), &cornell, camera), &ground_truth);
        println!("{resolution}: {noisy:.4} unfiltered, {smooth:.4} filtered");
        assert!(smooth < 0.75 * noisy, "{resolution}: {smooth} of {noisy}");
    }
}

/// A mirror shows surfaces lit by many lights, of which few rays sample few: the filter removes most of that noise and preserves edges.
#[gpu_test]
fn gpu_a_mirror_of_many_lights_is_not_speckled(gpu: &Gpu) {
    let mut scene = closed_box(matt(0.6));
    scene.materials.push(Material { metallic: 1.0, perceptual_roughness: 0.0, ..matt(0.9) });
    scene.materials.push(matt(0.05));
    // The floor is a mirror; two walls are dark.
    scene.meshes[0].primitives[2].material = 1;
    scene.meshes[0].primitives[4].material = 2;
    scene.meshes[0].primitives[0].material = 2;
    // All of the image is mirror.
    let camera = looking([0.0, -0.2, 0.1], [0.0, -1.0, 0.0]);
    let few = Sampled { diffuse_rays: 1, glossy_rays: 4, ..sampled(Tracer::BVH) };
    let many = Sampled { glossy_rays: 256, ..few };
    let mut off_by = |lights: usize| {
        let mut random = Random::new(4);
        scene.lights = (0..lights).map(|_| Light::point(0.8 * random.point(), 0.01 * (random.point() + 1.5))).collect();
        let of = |sampled| rendering(gpu, settings(sampled), &scene, &camera);
        let ground_truth = of(many);
        [0, 8].map(|filter_radius| off(&of(Sampled { filter_radius, ..few }), &ground_truth))
    };
    let [noisy, smooth] = off_by(300);
    let [without, edges] = off_by(1);
    println!("300 lights: off by {noisy:.4}, filtered {smooth:.4}; one light: {without:.4}, {edges:.4}");
    assert!(smooth < 0.6 * noisy, "{smooth} of {noisy}");
    assert!(edges < 0.05, "{edges}");
}

/// Four glossy rays of a rough metal hit the studio's lamps in one pixel and miss them in the next: they read the environment prefiltered by the rest of the
/// lobe. The prefilter is no wider than the lobe, and narrower with more rays.
#[gpu_test]
fn gpu_rough_metal_in_the_studio_is_not_speckled(gpu: &Gpu) {
    // All of the image is floor.
    let camera = looking([0.0, 1.5, 0.4], [0.0, 0.0, 0.0]);
    let few = Sampled { diffuse_rays: 1, glossy_rays: 4, ..sampled(Tracer::BVH) };
    let unclamped = IndirectClamp::Off;
    // The limits are between the measured errors and those with lookups in the rays' own directions: 0.138, 0.197, 0.217.
    for (perceptual_roughness, most) in [(0.3, 0.09), (0.5, 0.155), (0.7, 0.18)] {
        let mut scene = floor(Material { metallic: 1.0, perceptual_roughness, ..matt(0.9) });
        // Rotated away from the camera for which it was made, so that the floor reflects a lamp's edge.
        scene.environment = Some(rig::studio(&looking([0.0, 0.0, 1.0], [0.3, 0.0, 0.0])));
        let of = |sampled| rendering(gpu, settings(sampled), &scene, &camera);
        let ground_truth = of(Sampled { glossy_rays: 512, clamp: unclamped, ..few });
        let [noisy, smooth] = [0, 8].map(|filter_radius| off(&of(Sampled { filter_radius, ..few }), &ground_truth));
        let many = off(&of(Sampled { glossy_rays: 64, clamp: unclamped, filter_radius: 0, ..few }), &ground_truth);
        println!(
            "roughness {perceptual_roughness}: four rays off by {noisy:.4}, filtered {smooth:.4}, 64 rays by {many:.4}"
        );
        assert!(noisy < most && smooth < 0.085, "roughness {perceptual_roughness}: {noisy}, filtered {smooth}");
        assert!(many < 0.05, "roughness {perceptual_roughness}: {many}");
    }
}

/// Fraction of pixels that are a quarter brighter, relative to the true image, than the median of the 5 x 5 pixels around.
fn specks(image: &[Vec3], truth: &[Vec3], size: UVec2) -> f64 {
    let ratios: Vec<f32> = image.iter().zip(truth).map(|(a, b)| a.element_sum() / b.element_sum().max(0.01)).collect();
    let (width, height) = (size.x as i32, size.y as i32);
    let is_speck = |i: &usize| {
        let (x, y) = (*i as i32 % width, *i as i32 / width);
        let clamped =
            |k: i32| ((y + k / 5 - 2).clamp(0, height - 1) * width + (x + k % 5 - 2).clamp(0, width - 1)) as usize;
        let mut around = [0; 25].map(|_: i32| 0.0);
        (0..25).for_each(|k| around[k as usize] = ratios[clamped(k)]);
        around.sort_by(f32::total_cmp);
        ratios[*i] > 1.25 * around[12]
    };
    (0..ratios.len()).filter(is_speck).count() as f64 / ratios.len() as f64
}

/// A mean of frames with few rays has fewer bright dots than one frame, although each frame adds some.
#[gpu_test(full)]
fn gpu_means_of_drafts_have_no_specks(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    let size = UVec2::splat(64);
    let of = |preset, accumulate| {
        image_of(gpu, size, Settings::of_preset(preset).with_accumulate(accumulate), &scene, &camera)
    };
    let truth = of(Preset::Good, 16);
    let [one, many] = [1, 8].map(|frames| specks(&of(Preset::Draft, frames), &truth, size));
    println!("specks: {one:.4} of the pixels after one frame, {many:.4} after 8");
    assert!(many < one, "{many} after 8 frames, {one} after one");
    let dotted: Vec<Vec3> = truth.iter().enumerate().map(|(i, v)| if i % 97 == 0 { 2.0 * *v } else { *v }).collect();
    assert!(specks(&dotted, &truth, size) > 0.005, "dots are not seen");
}

/// Small bright cards, which glossy rays hit only by chance, leave no bright dots on a wet floor: its lobes are wider than the dots.
#[gpu_test]
fn gpu_a_wet_floor_under_small_lights_has_no_dots(gpu: &Gpu) {
    let mut scene = floor(Material { specular: 1.0, perceptual_roughness: 0.35, ..matt(0.05) });
    scene.materials.push(Material { base_color: Vec4::ONE, unlit: true, ..matt(0.0) });
    let mut random = Random::new(6);
    for _ in 0..12 {
        let at = Vec3::new(random.between(-0.4, 0.4), 1.5, random.between(-1.6, -0.4));
        scene.meshes[0].primitives.push(quad(1, at, 0.02 * Vec3::X, 0.02 * Vec3::Z));
    }
    scene.sky = Vec3::splat(5e-3);
    let camera = looking([0.0, 0.8, 1.2], [0.0, 0.0, 0.0]);
    // Narrow and high, so that pixels are as small as in the images of users.
    let size = UVec2::new(40, 360);
    let few = Sampled { diffuse_rays: 1, glossy_rays: 4, ..sampled(Tracer::BVH) };
    let of = |sampled| image_of(gpu, size, settings(sampled), &scene, &camera);
    let truth = of(Sampled { glossy_rays: 256, clamp: IndirectClamp::Off, ..few });
    let [noisy, smooth] = [0, 8].map(|filter_radius| specks(&of(Sampled { filter_radius, ..few }), &truth, size));
    println!("specks: {noisy:.4} of the pixels without filter, {smooth:.4} with it");
    assert!(noisy > 0.01 && smooth < 0.001, "{noisy} without filter, {smooth} with it");
}
