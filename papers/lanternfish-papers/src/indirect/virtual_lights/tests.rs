use glam::{UVec2, Vec3, Vec4};
use lanternfish::{
    RenderedImage, Renderer, Settings,
    settings::{Attenuation, Culling, Indirect, Materials, Samples, Shadows, Tracer},
    techniques::{IndirectClamp, IndirectResolution, Sampled},
};
use lanternfish_gpu::Gpu;
use lanternfish_scene::{Camera, Light, Material, Projection, Scene, generate::demo};

use super::{MapSize, MapSource, Ranges, Residual, VirtualLights};
use crate::testing::{self, quad, scene_of};

/// The size is not a multiple of the workgroup size.
const SIZE: UVec2 = UVec2::new(53, 39);

/// Virtual lights with as little noise as a small image allows, so that the filter has nothing to spread.
fn technique() -> VirtualLights {
    VirtualLights { stride: 1, filter_radius: 0, clamp: IndirectClamp::Off, ..VirtualLights::default() }
}

fn settings(indirect: Indirect) -> Settings {
    Settings::direct_light()
        .with_indirect(indirect)
        .with_materials(Materials::Lambert)
        .with_attenuation(Attenuation::Physical)
        .with_range_threshold(1e-6)
}

fn render(gpu: &Gpu, settings: Settings, scene: &Scene, camera: &Camera) -> RenderedImage {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    renderer.render(&uploaded, camera, SIZE.into()).unwrap()
}

fn render_technique(gpu: &Gpu, technique: VirtualLights, scene: &Scene, camera: &Camera) -> RenderedImage {
    render(gpu, settings(Indirect::from(technique)), scene, camera)
}

fn energy(rendering: &RenderedImage) -> f64 {
    rendering.radiance.iter().map(|pixel| f64::from(Vec4::from(*pixel).truncate().element_sum())).sum()
}

fn counter(rendering: &RenderedImage, name: &str) -> f64 {
    let actual =
        rendering.report.counters.iter().find(|(label, _)| label.strip_prefix("virtual_lights/") == Some(name));
    actual.unwrap_or_else(|| panic!("no {name} in {:?}", rendering.report.counters)).1 as f64
}

fn looking(eye: [f32; 3], target: [f32; 3]) -> Camera {
    Camera::look_at(eye.into(), target.into(), Projection::Perspective { fov_y: 0.9, near: 0.02 })
}

fn matt(albedo: f32) -> Material {
    Material { base_color: Vec3::splat(albedo).extend(1.0), double_sided: true, ..Material::default() }
}

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

/// The Cornell box without its lamp's own light: the path tracer and the renderer then have the same light.
fn cornell() -> (Scene, Camera) {
    let mut scene = demo("cornell").unwrap();
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene.lights = vec![Light::point(Vec3::new(0.0, 1.2, 0.5), Vec3::new(3.0, 2.5, 2.0))];
    (scene, looking([0.0, 1.0, 4.2], [0.0, 1.0, 0.0]))
}

/// Every light culling technique lists the lights that reach a pixel in the same order: the image is the same to the bit, also in another
/// renderer.
#[gpu_test]
fn gpu_virtual_lights_are_the_same_with_every_culling_technique(gpu: &Gpu) {
    let (scene, camera) = cornell();
    // Short ranges, so that lists differ from pixel to pixel; far lights, which are in none.
    let technique =
        VirtualLights { ranges: Ranges::Random, most_range: 0.3, count: 300, far_lights: 16, ..technique() };
    let of = |culling| settings(Indirect::from(technique)).with_culling(culling);
    let all = render(gpu, of(Culling::NONE), &scene, &camera);
    assert!(counter(&all, "listed") > 200.0);
    for culling in Culling::all() {
        for run in 0..2 {
            let actual = render(gpu, of(culling.clone()), &scene, &camera);
            assert!(actual.radiance == all.radiance, "{}, run {run}", culling.name());
        }
    }
    let other = render(gpu, of(Culling::NONE), &scene, &looking([0.0, 1.0, 4.1], [0.0, 1.0, 0.0]));
    assert!(other.radiance != all.radiance, "insensitive to another view");
}

/// The flux of the virtual lights is the flux on a closed room less the absorption of its walls: by rays and by rasterization, for any
/// number of lights in the map, and any number taken from it.
#[gpu_test]
fn gpu_the_flux_of_virtual_lights_is_that_of_the_lights(gpu: &Gpu) {
    let point = |x: f32| Light::point(Vec3::new(x, 0.3, 0.2), Vec3::splat(2.0));
    let spot = |angle: f32| Light {
        kind: lanternfish_scene::LightKind::Spot { inner_angle: 0.3, outer_angle: angle },
        direction: Vec3::new(0.6, -0.8, 0.0),
        ..point(-1.0)
    };
    let many = (0..700).map(|i| point(-1.9 + 0.0025 * i as f32)).collect();
    for (what, lights) in
        [("point", vec![point(-1.0)]), ("spot", vec![spot(0.8)]), ("wide spot", vec![spot(1.5)]), ("many", many)]
    {
        let scene = Scene { lights, ..two_rooms() };
        for (source, count) in [(MapSource::Rays, 0), (MapSource::Raster, 0), (MapSource::Rays, 200)] {
            let technique = VirtualLights { map: MapSize::Texels64, source, count, ..technique() };
            let rendering = render_technique(gpu, technique, &scene, &lit_view());
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

/// Disks, rectangles and emissive triangles are lights of the map: their flux reaches a closed room.
#[gpu_test]
fn gpu_virtual_lights_have_the_flux_of_area_lights_and_emitters(gpu: &Gpu) {
    let point = two_rooms().lights.remove(0);
    let lamp = |kind| Light { kind, direction: Vec3::NEG_Y, ..point.clone() };
    let disk = lamp(lanternfish_scene::LightKind::Disk { radius: 0.2 });
    let rectangle = lamp(lanternfish_scene::LightKind::Rectangle { half_width: 0.3, half_height: 0.1, right: Vec3::X });
    let mut shining = two_rooms();
    shining.lights.clear();
    shining.meshes[0].primitives.push(quad(1, Vec3::new(-1.0, 0.3, 0.2), 0.1 * Vec3::X, 0.1 * Vec3::Z));
    shining.materials.push(Material { emissive: Vec3::splat(10.0), double_sided: false, ..matt(0.0) });
    let lit = |light: Light| Scene { lights: vec![light], ..two_rooms() };
    for (what, scene) in [("disk", lit(disk)), ("rectangle", lit(rectangle)), ("triangles", shining)] {
        for source in [MapSource::Rays, MapSource::Raster] {
            let technique = VirtualLights { map: MapSize::Texels64, source, count: 0, ..technique() };
            let sent =
                counter(&render_technique(gpu, technique, &scene, &lit_view()), "flux_sent") / (256.0 * 64.0 * 64.0);
            // Emissive triangles also contribute their direct light.
            let expected = if what == "triangles" { 1.5 } else { 0.5 };
            assert!((sent / expected - 1.0).abs() < 0.02, "{what}, {source}: {sent} of {expected}");
        }
        let technique = VirtualLights { map: MapSize::Texels64, count: 2048, far_lights: 512, ..technique() };
        let of = |indirect| energy(&render(gpu, settings(indirect), &scene, &lit_view()));
        let sampled = Sampled {
            diffuse_rays: 256,
            filter_radius: 0,
            clamp: IndirectClamp::Off,
            ..Sampled::default().one_bounce()
        };
        let direct = of(Indirect::NONE);
        let (actual, rays) = (of(Indirect::from(technique)) - direct, of(Indirect::from(sampled)) - direct);
        assert!((actual / rays - 1.0).abs() < 0.08, "{what}: {actual} of {rays}");
    }
}

/// Ranges lose light, and far lights restore it; shadows prevent leaks. Without ranges and with all rays the energy equals that of rays
/// from every pixel.
#[gpu_test]
fn gpu_the_energy_of_virtual_lights_is_that_of_one_bounce(gpu: &Gpu) {
    let (scene, camera) = cornell();
    let direct = energy(&render(gpu, settings(Indirect::NONE), &scene, &camera));
    let sampled =
        Sampled { diffuse_rays: 256, filter_radius: 0, clamp: IndirectClamp::Off, ..Sampled::default().one_bounce() };
    let ground_truth = energy(&render(gpu, settings(Indirect::from(sampled)), &scene, &camera)) - direct;
    let of = |technique| (energy(&render_technique(gpu, technique, &scene, &camera)) - direct) / ground_truth;
    let exact = VirtualLights { count: 2048, shadow_rays: 64, ..technique() };
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
    let lit = energy(&render_technique(gpu, technique, &scene, &lit_view()));
    let unshadowed = VirtualLights { shadows: Shadows::None, ..technique };
    let leak = energy(&render_technique(gpu, unshadowed, &scene, &dark_view)) / lit;
    assert!(leak > 0.03, "negative control failed: {leak} without shadows");
    let tracers = [Tracer::BVH, Tracer::RAY_QUERY].into_iter().filter(|tracer| tracer.is_supported(&gpu.device));
    for tracer in tracers {
        let shadowed = VirtualLights { shadows: Shadows::Traced(tracer), ..technique };
        let leak = energy(&render_technique(gpu, shadowed, &scene, &dark_view)) / lit;
        // Rays start off their surface, possibly beyond a wall's edge.
        assert!(leak < 0.01, "{tracer}: {leak}");
    }
}

/// Rays through the BVH give about the same ranges as rays through deep images; the maximum is at least the average.
#[gpu_test]
fn gpu_ranges_reach_the_hits_of_rays(gpu: &Gpu) {
    let (scene, camera) = (two_rooms(), lit_view());
    let fraction = |technique| {
        let rendering = render_technique(gpu, technique, &scene, &camera);
        counter(&rendering, "flux_in_range") / counter(&rendering, "flux_arriving")
    };
    let technique = VirtualLights { count: 512, falloff: Attenuation::Physical, ..technique() };
    let deep = fraction(technique);
    let bvh = fraction(VirtualLights { range_tracer: Tracer::BVH, ..technique });
    // Some of six rays are longer than their average.
    assert!((0.4..0.8).contains(&bvh) && (deep - bvh).abs() < 0.1, "deep images {deep}, BVH {bvh}");
    let most = fraction(VirtualLights { ranges: Ranges::Maximum, range_tracer: Tracer::BVH, ..technique });
    assert!(most > 0.8, "{most}: all but the longest ray end within the maximum");
    let unlimited = fraction(VirtualLights { ranges: Ranges::Unlimited, ..technique });
    assert_eq!(unlimited, 1.0);
    // Lights that are dropped are counted.
    let rendering =
        render_technique(gpu, VirtualLights { most_range: 0.2, large_kept: 0, ..technique }, &scene, &camera);
    assert!(counter(&rendering, "too_large") > 100.0);
    assert_eq!(counter(&rendering, "too_large") + counter(&rendering, "listed"), counter(&rendering, "taken"));
    let rendering = render_technique(gpu, VirtualLights { least_range: 0.7, ..technique }, &scene, &camera);
    assert!(counter(&rendering, "too_small") > 10.0);
}

/// A scene without lights, and one whose lights reach nothing, are dark and give no error.
#[gpu_test]
fn gpu_no_lights_are_no_virtual_lights(gpu: &Gpu) {
    let none = Scene { lights: Vec::new(), ..two_rooms() };
    let mut lost = two_rooms();
    lost.lights[0].position = Vec3::new(50.0, 50.0, 50.0);
    lost.lights[0].range = Some(1.0);
    for scene in [none, lost] {
        for (samples, residual) in
            [Samples::One, Samples::Four].iter().flat_map(|samples| Residual::ALL.iter().map(move |r| (*samples, *r)))
        {
            let technique = VirtualLights { count: 64, residual, ..VirtualLights::default() };
            let settings = settings(Indirect::from(technique)).with_samples(samples);
            let rendering = render(gpu, settings, &scene, &lit_view());
            assert_eq!((energy(&rendering), counter(&rendering, "listed")), (0.0, 0.0));
        }
    }
}

/// With more lights than texels, each frame of a mean samples other lights: over the frames all of their light is there, with its
/// distribution.
#[gpu_test]
fn gpu_a_mean_of_frames_has_the_light_of_every_light(gpu: &Gpu) {
    let light = |i: i32| Light::point(Vec3::new(-1.9 + 0.0009 * i as f32, 0.8, 0.3), Vec3::splat(0.003));
    let scene = Scene { lights: (0..2000).map(light).collect(), ..two_rooms() };
    let direct = energy(&render(gpu, settings(Indirect::NONE), &scene, &lit_view()));
    let sampled =
        Sampled { diffuse_rays: 64, filter_radius: 0, clamp: IndirectClamp::Off, ..Sampled::default().one_bounce() };
    let ground_truth = energy(&render(gpu, settings(Indirect::from(sampled)), &scene, &lit_view())) - direct;
    let technique = VirtualLights { map: MapSize::Texels64, count: 512, ..technique() };
    let settings = settings(Indirect::from(technique)).with_accumulate(8);
    let actual = (energy(&render(gpu, settings, &scene, &lit_view())) - direct) / ground_truth;
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
    let settings = settings(Indirect::from(technique));
    let alone = [&camera, &other].map(|camera| render(gpu, settings.clone(), &scene, camera).radiance);
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
    assert!(moved != alone[0] && moved == render(gpu, settings, &scene, &camera).radiance);
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
