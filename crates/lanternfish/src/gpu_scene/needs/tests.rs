//! Whoever renders a scene that another renderer uploaded gets the picture of an upload of its own, or is told.

use glam::Vec3;
use lanternfish_gpu::{AdapterChoice, Frame, Gpu, Profiler, testing};
use lanternfish_scene::{Camera, Environment, Image, Light, Material, Projection, Scene, TextureRef};

use crate::{
    GpuScene, RenderError, Renderer, Settings,
    deep_images::DeepImageBuilder,
    rays::{RayTracer, TracedRay},
    settings::{Attenuation, DebugView, Indirect, Materials, Occlusion, Shadows, TextureBinding, Tracer},
    techniques::{DeepImageSettings, DirectionSet, Hbao, Sampled, WITHIN_TEXEL},
    testing::{quad, scene_of},
};

/// A textured floor, a lamp above it, something in between, and an image around it all.
fn scene() -> Scene {
    let textured = Material {
        base_color_texture: Some(TextureRef::new(0)),
        metallic: 0.0,
        perceptual_roughness: 0.4,
        ..Material::default()
    };
    let shining = Material { emissive: Vec3::new(0.4, 0.2, 0.1), double_sided: true, ..Material::default() };
    let floor = quad(0, Vec3::ZERO, 2.0 * Vec3::X, -2.0 * Vec3::Z);
    let shade = quad(1, Vec3::new(0.2, 0.8, 0.1), 0.4 * Vec3::X, -0.4 * Vec3::Z);
    let mut scene = scene_of(vec![floor, shade], vec![textured, shining]);
    let rgba = vec![255, 40, 40, 255, 40, 255, 40, 255, 40, 40, 255, 255, 200, 200, 200, 255];
    scene.images.push(Image { name: String::new(), width: 2, height: 2, rgba });
    scene.samplers.push(Default::default());
    scene.textures.push(lanternfish_scene::Texture { image: 0, sampler: 0 });
    scene.lights.push(Light::point(Vec3::new(0.3, 1.6, 0.2), Vec3::splat(3.0)));
    let pixels = vec![Vec3::new(0.2, 0.3, 0.5), Vec3::new(0.5, 0.3, 0.2)];
    scene.environment = Some(Environment { width: 2, height: 1, pixels, rotation: 0.0 });
    assert_eq!(scene.validate(), Ok(()));
    scene
}

fn camera() -> Camera {
    let projection = Projection::Perspective { fov_y: 0.9, near: 0.01 };
    Camera::look_at(Vec3::new(0.5, 2.0, 3.0), Vec3::new(0.0, 0.3, 0.0), projection)
}

fn coarse() -> DeepImageSettings {
    DeepImageSettings { directions: DirectionSet::Cube { k: 1 }, resolution: 8, ..DeepImageSettings::default() }
}

/// Settings that need something of a scene each.
fn choices(has_ray_query: bool) -> Vec<(&'static str, Settings)> {
    let direct = || Settings { shadows: Shadows::BVH, structure: coarse().into(), ..Settings::direct_light() };
    let indirect = |tracer: Tracer| {
        let sampled = Sampled { diffuse_rays: 2, glossy_rays: 1, tracer: tracer.into(), ..Sampled::default() };
        Settings { indirect: Indirect::from(sampled), ..direct() }
    };
    let mut choices = vec![
        ("no shadows", Settings { shadows: Shadows::None, ..direct() }),
        ("bvh", direct()),
        ("lambert", Settings { materials: Materials::Lambert, ..direct() }),
        ("base colour", Settings { debug_view: Some(DebugView::BaseColor), ..direct() }),
        ("physical", Settings { attenuation: Attenuation::Physical, ..direct() }),
        ("soft", Settings { light_radius: 0.1, ..direct() }),
        ("textures one by one", Settings { textures: TextureBinding::PerMaterial, ..direct() }),
        ("hbao", Settings { occlusion: Occlusion::from(Hbao { radius: 1.0 }), shadows: Shadows::None, ..direct() }),
        ("indirect, bvh", Settings { shadows: Shadows::None, ..indirect(Tracer::BVH) }),
        ("indirect, deep images", indirect(WITHIN_TEXEL)),
    ];
    if has_ray_query {
        choices.push(("indirect, ray query", indirect(Tracer::RAY_QUERY)));
    }
    choices
}

fn renderer(gpu: &Gpu, settings: Settings) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), settings).unwrap()
}

#[test]
fn gpu_a_shared_scene_is_the_same_picture_or_is_refused() {
    let Some(gpu) = testing::gpu("gpu_a_shared_scene_is_the_same_picture_or_is_refused") else { return };
    let (scene, camera) = (scene(), camera());
    let mut renderers: Vec<_> =
        choices(gpu.description.ray_query).into_iter().map(|(name, s)| (name, renderer(gpu, s))).collect();
    let uploads: Vec<(&str, GpuScene)> = renderers.iter().map(|(name, r)| (*name, r.upload(&scene).unwrap())).collect();
    let (mut same, mut refused) = (0, 0);
    for (i, (name, renderer)) in renderers.iter_mut().enumerate() {
        let own = renderer.render(&uploads[i].1, &camera, 16, 12).unwrap_or_else(|error| panic!("{name}: {error}"));
        for (uploader, uploaded) in &uploads {
            match renderer.render(uploaded, &camera, 16, 12) {
                Ok(picture) => {
                    assert_eq!(picture.radiance, own.radiance, "uploaded for {uploader}, rendered with {name}");
                    same += 1;
                }
                Err(error @ RenderError::OtherSettings { .. }) => {
                    assert!(error.to_string().contains("upload it with"), "{error}");
                    refused += 1;
                }
                Err(error) => panic!("uploaded for {uploader}, rendered with {name}: {error}"),
            }
        }
    }
    println!("{same} shared, {refused} refused");
    // Seven choices agree in materials, lights and textures: those that need less may take the scenes of those that need more.
    assert!(same >= renderers.len() + 6 && refused > 40, "{same} shared, {refused} refused");
}

fn is_other_settings<T: std::fmt::Debug>(result: Result<T, RenderError>) {
    assert!(matches!(result, Err(RenderError::OtherSettings { .. })), "{result:?}");
}

fn is_other_device<T: std::fmt::Debug>(result: Result<T, RenderError>) {
    assert!(matches!(result, Err(RenderError::OtherDevice)), "{result:?}");
}

#[test]
fn gpu_what_is_traced_through_a_scene_must_be_there() {
    let Some(gpu) = testing::gpu("gpu_what_is_traced_through_a_scene_must_be_there") else { return };
    let without = renderer(gpu, Settings { shadows: Shadows::None, ..Settings::direct_light() });
    let mut uploaded = without.upload(&scene()).unwrap();
    let mut tracing = renderer(gpu, Settings { shadows: Shadows::BVH, ..Settings::direct_light() });
    is_other_settings(tracing.update(&mut uploaded, &scene()));
    is_other_settings(tracing.refine(&uploaded, &[(&camera(), 16, 12)]));

    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    is_other_settings(DeepImageBuilder::new(&gpu.device, coarse()).unwrap().record(&mut frame, &uploaded));
    let rays = RayTracer::new(&gpu.device).unwrap();
    let buffer = rays.upload(&gpu.device, &[TracedRay { direction: Vec3::X, ..TracedRay::default() }]).unwrap();
    is_other_settings(rays.record(&mut frame, &uploaded, Tracer::BVH, None, &buffer, 1));
    if gpu.description.ray_query {
        is_other_settings(rays.record(&mut frame, &uploaded, Tracer::RAY_QUERY, None, &buffer, 1));
    }
}

#[test]
fn gpu_a_scene_of_another_device_is_refused() {
    let Some(gpu) = testing::gpu("gpu_a_scene_of_another_device_is_refused") else { return };
    let other = Gpu::open(&AdapterChoice::Auto).unwrap();
    let direct = || Settings { shadows: Shadows::BVH, ..Settings::direct_light() };
    let mut uploaded = renderer(&other, direct()).upload(&scene()).unwrap();
    let mut renderer = renderer(gpu, direct());
    is_other_device(renderer.render(&uploaded, &camera(), 16, 12));
    is_other_device(renderer.refine(&uploaded, &[(&camera(), 16, 12)]));
    is_other_device(renderer.update(&mut uploaded, &scene()));
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    is_other_device(DeepImageBuilder::new(&gpu.device, coarse()).unwrap().record(&mut frame, &uploaded));
}
