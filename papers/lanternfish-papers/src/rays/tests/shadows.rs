//! Shadows through deep images, compared with those through the BVH.

use glam::{Vec3, Vec4};
use lanternfish::{
    RenderError, Renderer, Settings,
    settings::{DebugView, Samples, Shadows, Tracer},
    techniques::Sampled,
};
use lanternfish_gpu::{Gpu, faulty_software};
use lanternfish_scene::{Camera, Light, Scene, generate};

use crate::{
    ACROSS_TEXELS, DeepBuilder, DeepImageSettings, DeepStore, DirectionSet, WITHIN_TEXEL,
    testing::{self, light, quad},
};

const SIZE: (u32, u32) = (90, 76);

fn deep(resolution: u32) -> Settings {
    let directions = DirectionSet::ZonalEqualArea { count: 60 };
    let deep_images = DeepImageSettings { directions, resolution, ..DeepImageSettings::default() };
    Settings::direct_light().with_shadows(Shadows::Traced(ACROSS_TEXELS)).with_structure(deep_images)
}

fn bvh() -> Settings {
    Settings::direct_light().with_shadows(Shadows::BVH)
}

fn luminance(gpu: &Gpu, scene: &Scene, settings: Settings) -> Vec<f32> {
    luminance_from(gpu, scene, &scene.cameras[0], settings)
}

fn luminance_from(gpu: &Gpu, scene: &Scene, camera: &Camera, settings: Settings) -> Vec<f32> {
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let rendering = renderer.render(&uploaded, camera, SIZE.into()).unwrap();
    rendering.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate().element_sum()).collect()
}

/// The adapter for tests, unless its driver crashes on these shadows.
fn sound_gpu(test: &str) -> Option<&'static Gpu> {
    let gpu = testing::gpu(test)?;
    let crashes = faulty_software(&gpu.device.adapter_info());
    if crashes {
        testing::left_out(test, "this driver crashes on shadows through deep images");
    }
    (!crashes).then_some(gpu)
}

/// Fraction of the pixels lit in either of two images whose values differ by more than 0.01.
fn differing(a: &[f32], b: &[f32]) -> f64 {
    let lit = a.iter().zip(b).filter(|(a, b)| a.max(**b) > 1e-3);
    let (lit, other) =
        lit.fold((0, 0), |(lit, other), (a, b)| (lit + 1, other + usize::from((a - b).abs() > 0.01 * a.max(*b))));
    f64::from(other as u32) / f64::from(lit)
}

/// Across texels, for lights with and without a size, for one sample and for four.
#[gpu_test(sound_gpu)]
fn gpu_shadows_of_deep_images_are_close_to_exact_ones(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let of = |settings| luminance(gpu, &scene, settings);
    let exact = of(bvh());
    let [coarse, fine] = [64, 256].map(|resolution| differing(&of(deep(resolution)), &exact));
    let none = differing(&of(bvh().with_shadows(Shadows::None)), &exact);
    println!("lit pixels that differ from the BVH's: {coarse} with 64 texels, {fine} with 256, {none} without shadows");
    assert!(fine < 0.008 && coarse < 0.02 && none > 0.05, "{coarse} {fine} {none}");

    for samples in [Samples::One, Samples::Four] {
        let of = |settings: Settings| of(settings.with_light_radius(0.1).with_samples(samples));
        let soft = of(bvh());
        let fraction = |actual: Vec<f32>| {
            let difference: f32 = actual.iter().zip(&soft).map(|(a, b)| (a - b).abs()).sum();
            difference / soft.iter().sum::<f32>()
        };
        let [coarse, fine] = [16, 256].map(|resolution| fraction(of(deep(resolution))));
        println!("{samples} samples, soft: {coarse} of the light differs with 16 texels, {fine} with 256");
        // The deep images are traced, and are as accurate for several samples as for one.
        assert!(coarse > 0.02 && fine < 0.03, "{samples} samples: {coarse} {fine}");
    }
}

/// With slopes a sheet hides a lamp that hangs closely behind it, and the floor closely below it, by texels of 0.3 m as
/// in Sponza; and no floor shadows itself, however near the lamp. Without slopes all of that light leaks.
#[gpu_test(sound_gpu)]
fn gpu_shadows_across_texels_see_sheets_near_lamps_and_floors(gpu: &Gpu) {
    let floor = light::floor(light::matt(0.5));
    let total = |(scene, camera): &(Scene, Camera), shadows, slopes| {
        let images = DeepImageSettings { slopes, resolution: 96, ..DeepImageSettings::NIESSNER };
        let settings = Settings::direct_light().with_shadows(shadows).with_structure(images);
        luminance_from(gpu, scene, camera, settings).iter().map(|value| f64::from(*value)).sum::<f64>()
    };
    // A tilted sheet of 4 m at a height, with a lamp above it: most texels' centres are off its axes.
    let below = |height: f32, lamp: f32| {
        let mut scene = floor.clone();
        let right = Vec3::new(2.0, 0.02, 0.01);
        scene.meshes[0].primitives.push(quad(0, height * Vec3::Y, right, Vec3::new(0.01, 0.03, -2.0)));
        scene.lights = vec![Light::point(Vec3::new(0.07, height + lamp, 0.03), Vec3::splat(5.0))];
        (scene, light::looking([0.0, 0.75 * height, height], [0.0, 0.0, -0.4]))
    };
    let leaks = |scene: &(Scene, Camera), slopes| {
        total(scene, Shadows::Traced(ACROSS_TEXELS), slopes) / total(scene, Shadows::None, slopes)
    };
    for (height, lamp) in [(1.5, 0.05), (1.5, 0.1), (1.5, 0.2), (0.2, 1.0)] {
        let scene = below(height, lamp);
        let [with, without] = [true, false].map(|slopes| leaks(&scene, slopes));
        println!(
            "sheet at {height} m, lamp {lamp} m above it: {with:.4} of the light leaks, {without:.4} without slopes"
        );
        assert!(with < 0.02 && without > 0.5, "{height} {lamp}: {with} {without}");
    }
    for lamp in [0.05, 0.1, 0.2, 1.0] {
        let mut scene = floor.clone();
        scene.lights = vec![Light::point(Vec3::new(0.07, lamp, 0.03), Vec3::ONE)];
        let lit = (scene, light::looking([0.3, 2.0, 2.5], [0.0, 0.0, 0.0]));
        let left = total(&lit, Shadows::Traced(ACROSS_TEXELS), true) / total(&lit, Shadows::BVH, true);
        assert!((0.98..1.001).contains(&left), "{lamp}: {left}");
    }
}

/// Within a texel a ray follows its image's axis: shadows deviate by the angle between the axis and the direction to
/// the light. A known fault, kept for comparison.
#[gpu_test(sound_gpu)]
fn gpu_known_fault_shadows_within_a_texel_have_bands(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let [within, across, exact] = [WITHIN_TEXEL, ACROSS_TEXELS, Tracer::BVH]
        .map(|tracer| luminance(gpu, &scene, deep(128).with_shadows(Shadows::Traced(tracer))));
    let [within, across] = [within, across].map(|image| differing(&image, &exact));
    println!("lit pixels that differ from the BVH's: {within} within a texel, {across} across texels");
    // Most pixels are correct nonetheless: walls do not shadow themselves.
    assert!(within < 0.3 && within > 5.0 * across, "{within} {across}");
}

#[gpu_test(sound_gpu)]
fn gpu_chunks_of_deep_images_do_not_change_shadows(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let of = |change: &dyn Fn(&mut Settings)| {
        let mut settings = deep(64).with_light_radius(0.1).with_shadow_rays(3);
        change(&mut settings);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let rendering = renderer.render(&uploaded, &scene.cameras[0], SIZE.into()).unwrap();
        let counter = |name: &str| rendering.report.counters.iter().find(|(n, _)| n == name).map(|(_, count)| *count);
        (counter("shadows/rays").unwrap(), rendering.radiance)
    };
    let one = of(&|_| ());
    assert!(one == of(&|_| ()), "not the same again");
    let with = |change: fn(&mut DeepImageSettings)| {
        of(&|settings| change(settings.structure.get_mut::<DeepImageSettings>().unwrap()))
    };
    // 60 images of 64 x 64 texels of 1000 fragments, 4 bytes each: several bindings' worth.
    assert!(one == with(|images| images.fragments_a_texel = 1000), "chunks change the image");
    assert!(one.1 != with(|images| images.resolution = 63).1, "insensitive to the images");
}

#[gpu_test]
fn gpu_requests_beyond_deep_images_are_refused(gpu: &Gpu) {
    let structure = |images: DeepImageSettings| Settings::direct_light().with_structure(images);
    let [usual, linked] = [DeepStore::LinearArray, DeepStore::LinkedList].map(|store| DeepImageSettings {
        resolution: 16,
        store,
        ..DeepImageSettings::default()
    });
    let through = |images| structure(images).with_shadows(Shadows::Traced(ACROSS_TEXELS));
    let sampled =
        |images| structure(images).with_indirect(Sampled { tracer: WITHIN_TEXEL.into(), ..Sampled::default() });
    let without = DeepImageSettings { payload: false, ..usual };
    for (settings, what) in [
        (through(linked), "linear_array"),
        (through(usual).with_debug_view(Some(DebugView::RayCount)), "`shadows bvh`"),
        (through(DeepImageSettings { slopes: true, builder: DeepBuilder::SinglePass, ..usual }), "per_triangle"),
        (sampled(DeepImageSettings { slopes: true, ..linked }), "`deep-store linear_array`"),
        (sampled(without), "triangles"),
    ] {
        match Renderer::with_engine(&testing::engine(gpu), settings) {
            Err(RenderError::Together { needed, .. }) => assert!(needed.contains(what), "{needed}, not {what}"),
            other => panic!("{what}: {other:?}"),
        }
    }
}

#[test]
fn a_driver_that_crashes_is_refused_by_name_and_with_the_remedy() {
    let check_tracer = |tracer, device_type, driver: &str| {
        let adapter = wgpu::AdapterInfo::new(device_type, wgpu::Backend::Vulkan);
        testing::inside::check_shadow_driver(tracer, &wgpu::AdapterInfo { driver_info: driver.to_owned(), ..adapter })
    };
    let check = |device_type, driver| check_tracer(ACROSS_TEXELS, device_type, driver);
    assert!(check_tracer(Tracer::BVH, wgpu::DeviceType::Cpu, "Mesa 22.3.6").is_ok());
    let error = check(wgpu::DeviceType::Cpu, "Mesa 22.3.6 (LLVM 15.0.6)").unwrap_err().to_string();
    for word in ["`shadows` through deep images", "Mesa 22.3.6", "crashes", "use `shadows bvh`", "newer driver"] {
        assert!(error.contains(word), "{word:?} is not in {error}");
    }
    assert!(check(wgpu::DeviceType::Cpu, "Mesa 25.0.7").is_ok());
    assert!(check(wgpu::DeviceType::IntegratedGpu, "Mesa 22.3.6").is_ok());
}
