use glam::Vec3;
use lanternfish::{
    Renderer,
    settings::{Attenuation, Indirect, Shadows, Tracer},
    techniques::IndirectResolution,
};
use lanternfish_scene::{Camera, Light, LightKind, Scene};

use super::{MapSize, MapSource, Ranges, Residual, VirtualLights};
use crate::{
    indirect::tests::{SIZE, TINY, cornell, counter, energy, looking, rays, render, settings, virtual_lights},
    testing::{self, light::matt, quad, scene_of},
};

/// Two rooms of 2 m beside each other, x from −2 to 0 and from 0 to 2, closed on all sides, with a lamp in the first.
fn two_rooms() -> Scene {
    let quads = [
        quad(0, Vec3::new(0.0, -1.0, 0.0), 2.0 * Vec3::X, -Vec3::Z),
        quad(0, Vec3::new(0.0, 1.0, 0.0), 2.0 * Vec3::X, Vec3::Z),
        quad(0, Vec3::new(0.0, 0.0, -1.0), 2.0 * Vec3::X, Vec3::Y),
        quad(0, Vec3::new(0.0, 0.0, 1.0), -2.0 * Vec3::X, Vec3::Y),
        quad(0, Vec3::new(-2.0, 0.0, 0.0), -Vec3::Z, Vec3::Y),
        quad(0, Vec3::new(2.0, 0.0, 0.0), Vec3::Z, Vec3::Y),
        quad(0, Vec3::ZERO, Vec3::Z, Vec3::Y),
    ];
    let mut scene = scene_of(quads.to_vec(), vec![matt(0.5)]);
    scene.lights.push(Light::point(Vec3::new(-1.0, 0.3, 0.2), Vec3::splat(2.0)));
    scene
}

/// The first of these rooms, from within.
fn lit_view() -> Camera {
    looking([-0.2, -0.3, 0.6], [-1.6, 0.0, -0.6])
}

/// The flux of the virtual lights is the flux on a closed room less the absorption of its walls: by rays and by rasterization, for any
/// number of lights in the map, and any number taken from it.
#[gpu_test]
fn gpu_the_flux_of_virtual_lights_is_that_of_the_lights(gpu: &Gpu) {
    let point = |x: f32| Light::point(Vec3::new(x, 0.3, 0.2), Vec3::splat(2.0));
    let spot = |angle: f32| Light {
        kind: LightKind::Spot { inner_angle: 0.3, outer_angle: angle },
        direction: Vec3::new(0.6, -0.8, 0.0),
        ..point(-1.0)
    };
    let many = (0..700).map(|i| point(-1.9 + 0.0025 * i as f32)).collect();
    for (what, lights) in
        [("point", vec![point(-1.0)]), ("spot", vec![spot(0.8)]), ("wide spot", vec![spot(1.5)]), ("many", many)]
    {
        let scene = Scene { lights, ..two_rooms() };
        for (source, count) in [(MapSource::Rays, 0), (MapSource::Raster, 0), (MapSource::Rays, 200)] {
            let technique = VirtualLights { map: MapSize::Texels64, source, count, ..virtual_lights() };
            let rendering = render(gpu, TINY, settings(technique), &scene, &lit_view());
            // In units of 1/256 of the lights' flux over 64² texels. A spot's flux uses the mean of its ramp. Of many lights each has one
            // ray per face and frame, whose weight deviates by a half: for 4,096 lights, 0.8 %.
            let sent = counter(&rendering, "flux_sent") / (256.0 * 64.0 * 64.0);
            let most = if what.contains("spot") {
                0.06
            } else if what == "many" {
                0.03
            } else {
                0.01
            };
            assert!((sent / 0.5 - 1.0).abs() < most, "{what}, {source}, {count}: {sent} of 0.5");
            if count > 0 {
                assert_eq!(counter(&rendering, "taken"), f64::from(count), "{what}");
            }
        }
    }
}

/// Ranges lose light, and far lights restore it; shadows prevent leaks. Without ranges and with all rays the energy equals that of rays
/// from every pixel.
#[gpu_test]
fn gpu_the_energy_of_virtual_lights_is_that_of_one_bounce(gpu: &Gpu) {
    let (scene, camera) = cornell();
    let of = |indirect: Indirect| energy(&render(gpu, SIZE, settings(indirect), &scene, &camera));
    let direct = of(Indirect::NONE);
    let ground_truth = of(rays(256)) - direct;
    let of = |technique: VirtualLights| (of(technique.into()) - direct) / ground_truth;
    let exact = VirtualLights { count: 2048, shadow_rays: 64, ..virtual_lights() };
    let unlimited = of(VirtualLights { ranges: Ranges::Unlimited, residual: Residual::Lost, ..exact });
    // Lights count as disks near surfaces, so corners are slightly darker; other seeds differ by 1.5 %.
    assert!((unlimited - 1.0).abs() < 0.04, "without ranges {unlimited}");
    let far = of(VirtualLights { far_lights: 1024, ..exact });
    // A thousand lights carry half of the energy: an error of 1 %.
    assert!((far - unlimited).abs() < 0.03, "with far lights {far}, without ranges {unlimited}");
    let lost = of(VirtualLights { residual: Residual::Lost, ..exact });
    assert!(lost < 0.7, "ranges cut nothing off: {lost}");
    let scaled = of(VirtualLights { residual: Residual::Scaled, ..exact });
    // In total, over the complete box; the view shows more of some walls.
    assert!((scaled - 1.0).abs() < 0.25, "scaled {scaled}");
    // A subset of the lights per pixel, and few rays: unbiased in the mean over 2,000 pixels.
    let few = of(VirtualLights { far_lights: 1024, stride: 8, shadow_rays: 2, ..exact });
    assert!((few / far - 1.0).abs() < 0.03, "few rays {few}, many {far}");
    let half = of(VirtualLights { far_lights: 1024, resolution: IndirectResolution::Half, ..exact });
    assert!((half / far - 1.0).abs() < 0.05, "at half resolution {half}, at full {far}");
    let unshadowed = of(VirtualLights { shadows: Shadows::None, ..exact });
    assert!(unshadowed > far + 0.05, "blocks cast no shadow in the ground truth: {unshadowed}");
}

/// A closed room beside a lit one stays dark with every exact tracer; without shadows it does not.
#[gpu_test]
fn gpu_no_light_leaks_into_a_closed_room(gpu: &Gpu) {
    let scene = two_rooms();
    let dark_view = looking([1.7, -0.3, 0.6], [0.2, 0.0, -0.6]);
    let technique = VirtualLights { count: 1024, ..VirtualLights::default() };
    let of = |technique, view: &Camera| energy(&render(gpu, SIZE, settings(technique), &scene, view));
    let lit = of(technique, &lit_view());
    let leak = of(VirtualLights { shadows: Shadows::None, ..technique }, &dark_view) / lit;
    assert!(leak > 0.03, "negative control failed: {leak} without shadows");
    let tracers = [Tracer::BVH, Tracer::RAY_QUERY].into_iter().filter(|tracer| tracer.is_supported(&gpu.device));
    for tracer in tracers {
        let leak = of(VirtualLights { shadows: Shadows::Traced(tracer), ..technique }, &dark_view) / lit;
        // Rays start off their surface, possibly beyond a wall's edge.
        assert!(leak < 0.01, "{tracer}: {leak}");
    }
}

/// Rays through the BVH give about the same ranges as rays through deep images; the maximum is at least the average.
#[gpu_test]
fn gpu_ranges_reach_the_hits_of_rays(gpu: &Gpu) {
    let (scene, camera) = (two_rooms(), lit_view());
    let of = |technique| render(gpu, TINY, settings(technique), &scene, &camera);
    let fraction = |technique| {
        let rendering = of(technique);
        counter(&rendering, "flux_in_range") / counter(&rendering, "flux_arriving")
    };
    let technique = VirtualLights { count: 512, falloff: Attenuation::Physical, ..virtual_lights() };
    let deep = fraction(technique);
    let bvh = fraction(VirtualLights { range_tracer: Tracer::BVH, ..technique });
    // Some of six rays are longer than their average.
    assert!((0.4..0.8).contains(&bvh) && (deep - bvh).abs() < 0.1, "deep images {deep}, BVH {bvh}");
    let most = fraction(VirtualLights { ranges: Ranges::Maximum, range_tracer: Tracer::BVH, ..technique });
    assert!(most > 0.8, "{most}: all but the longest ray end within the maximum");
    let unlimited = fraction(VirtualLights { ranges: Ranges::Unlimited, ..technique });
    assert_eq!(unlimited, 1.0);
    // Lights that are dropped are counted.
    let rendering = of(VirtualLights { most_range: 0.2, large_kept: 0, ..technique });
    assert!(counter(&rendering, "too_large") > 100.0);
    assert_eq!(counter(&rendering, "too_large") + counter(&rendering, "listed"), counter(&rendering, "taken"));
    let rendering = of(VirtualLights { least_range: 0.7, ..technique });
    assert!(counter(&rendering, "too_small") > 10.0);
}

/// With more lights than texels, each frame of a mean samples other lights: over the frames all of their light is there, with its
/// distribution.
#[gpu_test]
fn gpu_a_mean_of_frames_has_the_light_of_every_light(gpu: &Gpu) {
    let light = |i: i32| Light::point(Vec3::new(-1.9 + 0.0009 * i as f32, 0.8, 0.3), Vec3::splat(0.003));
    let scene = Scene { lights: (0..2000).map(light).collect(), ..two_rooms() };
    let of = |indirect, frames| {
        energy(&render(gpu, SIZE, settings::<Indirect>(indirect).with_accumulate(frames), &scene, &lit_view()))
    };
    let direct = of(Indirect::NONE, 1);
    let technique = VirtualLights { map: MapSize::Texels64, count: 512, ..virtual_lights() };
    let actual = (of(technique.into(), 8) - direct) / (of(rays(64), 1) - direct);
    // 4,096 lights in total, near the surfaces that they light: an error of 3 %.
    assert!((actual - 1.0).abs() < 0.08, "{actual}");
}

/// Two views of one frame share their virtual lights: each image is the same to the bit as that of a single view. Moved objects move the
/// lights.
#[gpu_test]
fn gpu_views_share_virtual_lights_and_an_update_moves_them(gpu: &Gpu) {
    let (mut scene, camera) = cornell();
    let other = looking([0.3, 1.0, 4.0], [0.0, 1.0, 0.0]);
    let technique = VirtualLights { count: 200, ..VirtualLights::default() };
    let settings = settings(technique);
    let alone = [&camera, &other].map(|camera| render(gpu, SIZE, settings.clone(), &scene, camera).radiance);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    let views = [(&camera, SIZE.into()), (&other, SIZE.into())];
    let together = renderer.render_views(&uploaded, &views).unwrap();
    for (alone, together) in alone.iter().zip(&together) {
        assert!(*alone == together.radiance);
    }
    scene.lights[0].position.x += 0.3;
    renderer.update(&mut uploaded, &scene).unwrap();
    let moved = renderer.render(&uploaded, &camera, SIZE.into()).unwrap().radiance;
    assert!(moved != alone[0] && moved == render(gpu, SIZE, settings, &scene, &camera).radiance);
}

#[test]
fn numbers_out_of_range_are_refused() {
    let usual = VirtualLights::default();
    assert!(super::check(&usual).is_ok());
    let wrong = [
        VirtualLights { shadow_rays: 0, ..usual },
        VirtualLights { stride: 65, ..usual },
        VirtualLights { far_lights: 5000, ..usual },
        VirtualLights { large_kept: 101, ..usual },
        VirtualLights { spacing: 0.0, ..usual },
        VirtualLights { most_range: f32::NAN, ..usual },
        VirtualLights { least_distance: Some(-1.0), ..usual },
        VirtualLights { filter_radius: 65, ..usual },
    ];
    for technique in wrong {
        assert!(super::check(&technique).is_err(), "{technique:?}");
    }
}
