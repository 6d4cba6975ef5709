//! A renderer of a scene that another renderer uploaded renders the same image as with its own upload, or returns an error.

use glam::Vec3;
use lanternfish_gpu::{AdapterChoice, Frame, Gpu, Profiler, testing};

use crate::{
    RenderError, Settings,
    rays::{RayTracer, TracedRay},
    settings::{Attenuation, DebugView, Materials, Shadows, TextureBinding, Tracer},
    techniques::Sampled,
    testing::shared::{camera, renderer, scene, shared_and_refused},
};

/// Settings with different requirements of a scene.
fn choices(has_ray_query: bool) -> Vec<(&'static str, Settings)> {
    let direct = || Settings::direct_light().with_shadows(Shadows::BVH);
    let indirect = |tracer: Tracer| {
        let sampled = Sampled { diffuse_rays: 2, glossy_rays: 1, tracer: tracer.into(), ..Sampled::default() };
        direct().with_indirect(sampled)
    };
    let mut choices = vec![
        ("no shadows", direct().with_shadows(Shadows::None)),
        ("bvh", direct()),
        ("lambert", direct().with_materials(Materials::Lambert)),
        ("base colour", direct().with_debug_view(Some(DebugView::BaseColor))),
        ("physical", direct().with_attenuation(Attenuation::Physical)),
        ("soft", direct().with_light_radius(0.1)),
        ("wide suns", direct().with_sun_diameter(0.53)),
        ("textures per material", direct().with_textures(TextureBinding::PerMaterial)),
        ("indirect, bvh", indirect(Tracer::BVH).with_shadows(Shadows::None)),
    ];
    if has_ray_query {
        choices.push(("indirect, ray query", indirect(Tracer::RAY_QUERY)));
    }
    choices
}

#[gpu_test]
fn gpu_a_shared_scene_is_the_same_image_or_is_refused(gpu: &Gpu) {
    let choices = choices(gpu.description.ray_query);
    let count = choices.len();
    let (same, refused) = shared_and_refused(gpu, choices);
    // Some choices have the same materials, lights and textures: a choice that requires less may use the scene of one that requires more.
    // Ray queries add a choice that agrees with others.
    let agreeing = if gpu.description.ray_query { 4 } else { 3 };
    assert!(same >= count + agreeing && refused > 30, "{same} shared, {refused} refused");
}

fn is_other_settings<T: std::fmt::Debug>(result: Result<T, RenderError>) {
    assert!(matches!(result, Err(RenderError::OtherSettings { .. })), "{result:?}");
}

fn is_other_device<T: std::fmt::Debug>(result: Result<T, RenderError>) {
    assert!(matches!(result, Err(RenderError::OtherDevice)), "{result:?}");
}

#[gpu_test]
fn gpu_tracing_requires_the_uploaded_structure(gpu: &Gpu) {
    let without = renderer(gpu, Settings::direct_light().with_shadows(Shadows::None));
    let mut uploaded = without.upload(&scene()).unwrap();
    let mut tracing = renderer(gpu, Settings::direct_light().with_shadows(Shadows::BVH));
    is_other_settings(tracing.update(&mut uploaded, &scene()));
    is_other_settings(tracing.refine(&uploaded, &[(&camera(), [16, 12])]));

    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let rays = RayTracer::new(&gpu.device).unwrap();
    let buffer = rays.upload(&gpu.device, &[TracedRay { direction: Vec3::X, ..TracedRay::default() }]).unwrap();
    is_other_settings(rays.record(&mut frame, &uploaded, Tracer::BVH, None, &buffer, 1));
    if gpu.description.ray_query {
        is_other_settings(rays.record(&mut frame, &uploaded, Tracer::RAY_QUERY, None, &buffer, 1));
    }
}

#[gpu_test]
fn gpu_a_scene_of_another_device_is_refused(gpu: &Gpu) {
    let other = Gpu::open(&AdapterChoice::Auto).unwrap();
    let direct = || Settings::direct_light().with_shadows(Shadows::BVH);
    let mut uploaded = renderer(&other, direct()).upload(&scene()).unwrap();
    let mut renderer = renderer(gpu, direct());
    is_other_device(renderer.render(&uploaded, &camera(), [16, 12]));
    is_other_device(renderer.refine(&uploaded, &[(&camera(), [16, 12])]));
    is_other_device(renderer.update(&mut uploaded, &scene()));
}
