//! Shadows through deep images, compared with those through the BVH.

use glam::{Affine3A, Vec3, Vec4};
use lanternfish::{
    RenderError, Renderer, Settings,
    settings::{DebugView, Samples, Shadows, Tracer},
};
use lanternfish_gpu::{Gpu, faulty_software};
use lanternfish_scene::{Scene, generate};

use crate::{
    ACROSS_TEXELS, DeepDepth, DeepImageSettings, DeepStore, DirectionSet, WITHIN_TEXEL,
    testing::{self, apart},
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
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let rendering = renderer.render(&uploaded, &scene.cameras[0], SIZE.into()).unwrap();
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

#[gpu_test(sound_gpu)]
fn gpu_shadows_of_deep_images_are_close_to_exact_ones(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let exact = luminance(gpu, &scene, bvh());
    let of = |settings| differing(&luminance(gpu, &scene, settings), &exact);
    let [coarse, fine] = [64, 256].map(|resolution| of(deep(resolution)));
    let none = of(bvh().with_shadows(Shadows::None));
    println!("lit pixels that differ from the BVH's: {coarse} with 64 texels, {fine} with 256, {none} without shadows");
    assert!(fine < 0.008 && coarse < 0.02 && none > 0.05, "{coarse} {fine} {none}");

    // Soft shadows as well.
    let radius = |settings: Settings| settings.with_light_radius(0.1);
    let soft = luminance(gpu, &scene, radius(bvh()));
    let actual = luminance(gpu, &scene, radius(deep(256)));
    let difference: f32 = actual.iter().zip(&soft).map(|(a, b)| (a - b).abs()).sum();
    let fraction = difference / soft.iter().sum::<f32>();
    println!("soft: {fraction} of the light");
    assert!(fraction < 0.03, "{fraction}");
}

/// Within a texel a ray follows its image's axis: shadows deviate by the angle between the axis and the direction to the light. A known
/// fault, kept for comparison.
#[gpu_test(sound_gpu)]
fn gpu_known_fault_shadows_within_a_texel_have_bands(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let exact = luminance(gpu, &scene, bvh());
    let of = |tracer| {
        let settings = deep(128).with_shadows(Shadows::Traced(tracer));
        differing(&luminance(gpu, &scene, settings), &exact)
    };
    let [within, across] = [WITHIN_TEXEL, ACROSS_TEXELS].map(of);
    println!("lit pixels that differ from the BVH's: {within} within a texel, {across} across texels");
    // Most pixels are correct nonetheless: walls do not shadow themselves.
    assert!(within < 0.3 && within > 5.0 * across, "{within} {across}");
}

#[gpu_test(sound_gpu)]
fn gpu_chunks_and_depths_of_deep_images_do_not_change_shadows(gpu: &Gpu) {
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
    // 60 images of 64 x 64 texels of 1000 fragments, 4 bytes each: several bindings' worth.
    assert!(
        one == of(&|settings| settings.structure.get_mut::<DeepImageSettings>().unwrap().fragments_a_texel = 1000),
        "chunks change the image"
    );
    assert!(
        one.1 != of(&|settings| settings.structure.get_mut::<DeepImageSettings>().unwrap().resolution = 63).1,
        "insensitive to the images"
    );
    let sums =
        [one.1, of(&|settings| settings.structure.get_mut::<DeepImageSettings>().unwrap().depth = DeepDepth::Bits16).1]
            .map(|radiance| radiance.iter().flatten().sum::<f32>());
    assert!((sums[0] / sums[1] - 1.0).abs() < 2e-3, "{sums:?}");
}

#[gpu_test(sound_gpu)]
fn gpu_a_shadow_moves_with_its_caster(gpu: &Gpu) {
    let before = apart(&generate::demo("cornell").unwrap());
    let mut after = before.clone();
    let shift = Affine3A::from_translation(Vec3::new(0.2, 0.0, 0.15));
    let last = after.instances.last_mut().expect("several");
    last.world_from_object = shift * last.world_from_object;
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), deep(64)).unwrap();
    let mut uploaded = renderer.upload(&before).unwrap();
    let mut frame = |uploaded: &_| renderer.render(uploaded, &before.cameras[0], SIZE.into()).unwrap().radiance;
    let still = frame(&uploaded);
    assert!(still == frame(&uploaded));
    Renderer::with_engine(&testing::engine(gpu), deep(64)).unwrap().update(&mut uploaded, &after).unwrap();
    let moved = frame(&uploaded);
    let fresh = Renderer::with_engine(&testing::engine(gpu), deep(64)).unwrap();
    let fresh = fresh.upload(&after).unwrap();
    assert!(moved != still, "nothing moved");
    assert!(moved == frame(&fresh), "differs from a fresh upload");
}

#[gpu_test(sound_gpu)]
fn gpu_samples_of_a_pixel_share_its_shadows(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let of = |settings: Settings| luminance(gpu, &scene, settings.with_samples(Samples::Four).with_light_radius(0.1));
    let exact = of(bvh());
    let difference = |actual: Vec<f32>| {
        let difference: f32 = actual.iter().zip(&exact).map(|(a, b)| (a - b).abs()).sum();
        difference / exact.iter().sum::<f32>()
    };
    let (coarse, fine) = (difference(of(deep(16))), difference(of(deep(256))));
    println!("fractions of the light that differ from the BVH's: {coarse} with 16 texels, {fine} with 256");
    // The deep images are traced, and are as accurate as for one sample.
    assert!(coarse > 0.02 && fine < 0.03, "{coarse} {fine}");
}

#[gpu_test(sound_gpu)]
fn gpu_scenes_without_lights_are_dark(gpu: &Gpu) {
    let mut scene = generate::demo("cornell").unwrap();
    scene.lights.clear();
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    for settings in [bvh(), deep(16)] {
        for light_radius in [0.0, 0.1] {
            let actual = luminance(gpu, &scene, settings.clone().with_light_radius(light_radius));
            assert!(actual.iter().all(|value| *value == 0.0));
        }
    }
}

#[gpu_test]
fn gpu_requests_beyond_deep_images_are_refused(gpu: &Gpu) {
    let refused = |settings| match Renderer::with_engine(&testing::engine(gpu), settings) {
        Err(RenderError::Together { needed, .. }) => needed,
        other => panic!("{other:?}"),
    };
    let mut linked = deep(16);
    linked.structure.get_mut::<DeepImageSettings>().unwrap().store = DeepStore::LinkedList;
    assert!(refused(linked).contains("linear_array"));
    let counts = deep(16).with_debug_view(Some(DebugView::RayCount));
    assert_eq!(refused(counts), "`shadows bvh`");
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
