//! Updates against a fresh upload of the changed scene.

mod anything;
mod masks;

use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Frame, Gpu, Profiler, read_back, testing};
use lanternfish_scene::{
    AlphaMode, Environment, Image, Light, Material, Sampler, Scene, Texture, TextureRef, generate,
};

use obvhs::cwbvh::node::CwBvhNode;

use super::{
    super::{
        moving::tests::read,
        tracing::{self, assert_same_corners, pose, refit::outside},
    },
    Outline,
};
use crate::{
    GpuScene, RenderedImage, Renderer, Settings,
    rays::{RayTracer, TracedRay},
    settings::{Indirect, Shadows, Tracer},
    techniques::Sampled,
    testing::{Random, apart, moved},
};

/// The Cornell box in parts and in light rain, with a masked and a transparent part.
fn scene() -> Scene {
    let mut scene = apart(&generate::demo("cornell").unwrap());
    scene.lights.extend(generate::light_rain(&scene.bounds(), 40, Some(0.8), 1, 0.0));
    for (primitive, alpha_mode) in [(3, AlphaMode::Blend), (4, AlphaMode::Mask { cutoff: 0.5 })] {
        let primitive = &mut scene.meshes[primitive].primitives[0];
        let base_color = Vec3::new(0.3, 0.6, 0.8).extend(0.6);
        primitive.material = scene.materials.len();
        scene.materials.push(Material { base_color, alpha_mode, double_sided: true, ..Material::default() });
    }
    scene.instances.push(scene.instances[0].clone());
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// Few rays, and few samples of each entry of the radiance cache.
fn few_rays() -> Sampled {
    let usual = Sampled { tracer: Tracer::BVH.into(), ..Sampled::default() };
    Sampled { diffuse_rays: 1, first_rays: 1, glossy_rays: 1, cache_samples: 2, ..usual }
}

fn renderer(gpu: &Gpu, shadows: Shadows) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_shadows(shadows)).unwrap()
}

fn shown(renderer: &mut Renderer, uploaded: &GpuScene, scene: &Scene) -> RenderedImage {
    renderer.render(uploaded, &scene.cameras[0], [120, 120]).unwrap()
}

fn differing(a: &RenderedImage, b: &RenderedImage) -> usize {
    a.radiance.iter().zip(&b.radiance).filter(|(a, b)| a != b).count()
}

#[gpu_test]
fn gpu_update_renders_like_a_fresh_upload(gpu: &Gpu) {
    let test = "gpu_update_renders_like_a_fresh_upload";
    let before = scene();
    let mut after = moved(&before, 2, 0.3);
    after.sky = Vec3::new(0.1, 0.2, 0.3);
    after.lights.iter_mut().for_each(|light| light.position.y *= 0.9);
    let more_lights = Scene {
        lights: after.lights.iter().cloned().chain([Light::point(Vec3::Y, Vec3::splat(0.3))]).collect(),
        ..after.clone()
    };
    for shadows in [Shadows::BVH, Shadows::RAY_QUERY, Shadows::None] {
        if shadows == Shadows::RAY_QUERY && !gpu.description.ray_query {
            testing::left_out(test, "this adapter has no ray query");
            continue;
        }
        let mut renderer = renderer(gpu, shadows);
        // The order of triangles differs: at shared edges a ray may hit either.
        let allowed = if shadows == Shadows::RAY_QUERY { 120 * 120 / 500 } else { 0 };
        let mut uploaded = renderer.upload(&before).unwrap();
        let mut last = shown(&mut renderer, &uploaded, &before);
        for now in [&after, &more_lights, &before] {
            renderer.update(&mut uploaded, now).unwrap();
            let updated = shown(&mut renderer, &uploaded, now);
            let fresh_scene = renderer.upload(now).unwrap();
            let fresh = shown(&mut renderer, &fresh_scene, now);
            let (wrong, changed) = (differing(&updated, &fresh), differing(&updated, &last));
            println!("{shadows}: {wrong} pixels differ from a fresh upload, {changed} have changed");
            assert!(wrong <= allowed, "{shadows}: {wrong} pixels");
            assert!(changed > 100, "{shadows}: {changed} pixels");
            // A new tree may have other nodes.
            assert_eq!(updated.report.counters[..4], fresh.report.counters[..4]);
            assert_eq!((uploaded.bounds, uploaded.lights.bounds), (fresh_scene.bounds, fresh_scene.lights.bounds));
            assert_eq!(uploaded.bounds, now.bounds());
            last = updated;
        }
    }
}

/// Another environment replaces the last one, and the scene keeps its BVH.
#[gpu_test]
fn gpu_an_environment_is_replaced_in_place(gpu: &Gpu) {
    let mut scene = scene();
    let pixels = (0..32).map(|i| Vec3::new(i as f32, 4.0, 32.0 - i as f32) / 16.0).collect();
    scene.environment = Some(Environment { width: 8, height: 4, pixels, rotation: 0.0 });
    let direct = Settings::direct_light().with_shadows(Shadows::BVH);
    for settings in [direct.clone().with_indirect(few_rays()), direct] {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let before = uploaded.triangle_order();
        let last = shown(&mut renderer, &uploaded, &scene);
        let mut now = scene.clone();
        let environment = now.environment.as_mut().unwrap();
        environment.rotation = 2.0;
        (environment.width, environment.height) = (4, 8);
        renderer.update(&mut uploaded, &now).unwrap();
        assert_eq!(uploaded.triangle_order(), before, "the scene was uploaded again");
        let fresh = renderer.upload(&now).unwrap();
        let (updated, fresh) = (shown(&mut renderer, &uploaded, &now), shown(&mut renderer, &fresh, &now));
        assert_eq!(differing(&updated, &fresh), 0);
        assert!(differing(&updated, &last) > 100, "{}", differing(&updated, &last));
    }
}

/// Instances that have moved, in the form that `move_instances` takes.
fn moves(before: &Scene, after: &Scene) -> Vec<(usize, Affine3A)> {
    let pairs = before.instances.iter().zip(&after.instances).enumerate();
    let moved = pairs.filter(|(_, (was, is))| was.world_from_object != is.world_from_object);
    moved.map(|(i, (_, is))| (i, is.world_from_object)).collect()
}

/// Instances moved on the device match the host: images, triangles, and bounding boxes; for every structure, and for hit shading.
#[gpu_test]
fn gpu_moves_on_device_and_host_agree(gpu: &Gpu) {
    let test = "gpu_moves_on_device_and_host_agree";
    let mut before = scene();
    before.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    let before = before;
    let direct = |shadows| Settings::direct_light().with_shadows(shadows);
    let requested = [
        ("bvh", direct(Shadows::BVH)),
        ("ray query", direct(Shadows::RAY_QUERY)),
        ("sampled", direct(Shadows::BVH).with_indirect(few_rays())),
        ("sampled, and ray query", direct(Shadows::RAY_QUERY).with_indirect(few_rays())),
        ("nothing traced", direct(Shadows::None)),
    ];
    for (name, settings) in requested {
        if settings.shadows.technique == Shadows::RAY_QUERY && !gpu.description.ray_query {
            testing::left_out(test, "this adapter has no ray query");
            continue;
        }
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let (mut by_device, mut by_host) = (renderer.upload(&before).unwrap(), renderer.upload(&before).unwrap());
        let mut last = before.clone();
        for seed in [2, 5, 9] {
            let mut now = moved(&before, seed, 0.3);
            // One instance does not move.
            now.instances[1].world_from_object = last.instances[1].world_from_object;
            let generation = by_device.generation();
            let sent = renderer.move_instances(&mut by_device, &moves(&last, &now)).unwrap();
            assert!(sent.bytes > 0 && sent.bytes < 4096, "{name}: {sent:?}");
            assert_ne!(by_device.generation(), generation);
            renderer.update(&mut by_host, &now).unwrap();
            let (device, host) = (shown(&mut renderer, &by_device, &now), shown(&mut renderer, &by_host, &now));
            assert_eq!(by_device.bounds, by_host.bounds);
            if by_device.bvh.is_none() {
                assert_eq!(differing(&device, &host), 0, "{name}: {seed}");
            } else {
                let (actual, expected) = (read(gpu, &by_device), read(gpu, &by_host));
                assert_same_corners(&actual.corners, &expected.corners);
                let images = [&device.radiance[..], &host.radiance];
                assert_eq!(tracing::differing(images, [&actual.corners, &expected.corners]), 0, "{name}: {seed}");
                let nodes: &[CwBvhNode] = bytemuck::cast_slice(&actual.nodes);
                assert_eq!(outside(nodes, &actual.corners), (0, expected.corners.len()), "{name}: {seed}");
                // The test can fail: the boxes do not contain triangles that have moved.
                let elsewhere = pose(&moved(&before, seed + 1, 0.3), &by_host.placed.parts, &by_host.placed.sources);
                assert!(outside(nodes, &elsewhere).0 > 0, "{name}: {seed}");
            }
            last = now;
        }
        // Moves back, one by one, and one move without a change.
        for (instance, back) in moves(&last, &before) {
            renderer.move_instances(&mut by_device, &[(instance, Affine3A::IDENTITY), (instance, back)]).unwrap();
        }
        let generation = by_device.generation();
        renderer.move_instances(&mut by_device, &[(0, before.instances[0].world_from_object)]).unwrap();
        assert_eq!(by_device.generation(), generation, "nothing has moved");
        let fresh = renderer.upload(&before).unwrap();
        let (back, fresh) = (shown(&mut renderer, &by_device, &before), shown(&mut renderer, &fresh, &before));
        assert_eq!(differing(&back, &fresh), 0, "{name}: back");
        let nowhere = Affine3A::from_translation(Vec3::splat(f32::NAN));
        for (wrong, what) in [((99, Affine3A::IDENTITY), "none is 99"), ((1, nowhere), "not finite")] {
            let error = renderer.move_instances(&mut by_device, &[wrong]).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
        // Emissive triangles are in a tree that only `update` builds again.
        let lit = renderer.upload(&scene());
        let lamp = before.instances.iter().position(|instance| {
            scene().materials[before.meshes[instance.mesh].primitives[0].material].emissive != Vec3::ZERO
        });
        let error = renderer.move_instances(&mut lit.unwrap(), &[(lamp.unwrap(), Affine3A::from_translation(Vec3::Y))]);
        assert_eq!(error.is_err(), name.contains("sampled"), "{name}: {error:?}");
    }
}

/// Replaces one light of many: 64 bytes are uploaded, and the image is that of a fresh upload.
#[gpu_test]
fn gpu_set_light_renders_like_a_fresh_upload(gpu: &Gpu) {
    let before = scene();
    let mut renderer = renderer(gpu, Shadows::BVH);
    let mut uploaded = renderer.upload(&before).unwrap();
    let last = shown(&mut renderer, &uploaded, &before);
    let mut now = before.clone();
    let outside = 3.0 * Vec3::ONE;
    for light in [
        Light::point(Vec3::new(0.2, 0.4, 0.1), Vec3::splat(0.5)),
        Light::directional(Vec3::new(-0.1, -1.0, -0.5), Vec3::ONE),
        Light::rectangle(Vec3::new(0.0, 0.8, 0.0), Vec3::NEG_Y, Vec3::X, [0.3, 0.2], Vec3::splat(3.0)),
        Light::point(outside, Vec3::splat(2.0)),
    ] {
        now.lights[7] = light.clone();
        let sent = renderer.set_light(&mut uploaded, 7, &light).unwrap();
        assert_eq!((sent.bytes, sent.dispatches), (64, 0));
        let actual = shown(&mut renderer, &uploaded, &now);
        let fresh = renderer.upload(&now).unwrap();
        assert_eq!(uploaded.lights.bounds, fresh.lights.bounds);
        assert_eq!(differing(&actual, &shown(&mut renderer, &fresh, &now)), 0, "{light:?}");
        assert!(differing(&actual, &last) > 100, "{light:?}: nothing has changed");
    }
    let dark = Light { range: Some(-1.0), ..now.lights[7].clone() };
    assert!(renderer.set_light(&mut uploaded, 7, &dark).unwrap_err().to_string().contains("range"));
    assert!(renderer.set_light(&mut uploaded, 99, &now.lights[7]).unwrap_err().to_string().contains("none is 99"));
}

/// Other passes draw glass that becomes rough, so its material is not updated in place.
#[test]
fn glass_that_becomes_rough_is_another_material() {
    let smooth = Material { metallic: 0.0, perceptual_roughness: 0.0, transmission: 1.0, ..Material::default() };
    let outline = Outline::of(&Scene { materials: vec![smooth.clone()], ..Scene::default() });
    let is_updated = |material: Material| outline.has_kind_of(0, &material);
    assert_eq!(is_updated(Material { perceptual_roughness: 0.2, ..smooth.clone() }), Some(false));
    assert_eq!(is_updated(Material { perceptual_roughness: 0.01, ior: 1.8, ..smooth }), Some(true));
}

#[gpu_test]
fn gpu_update_writes_material_factors(gpu: &Gpu) {
    let mut before = scene();
    before.images.push(Image { name: String::new(), width: 1, height: 1, rgba: vec![170, 90, 220, 255] });
    before.samplers.push(Sampler::default());
    before.textures.push(Texture { image: 0, sampler: 0 });
    before.materials.iter_mut().for_each(|material| material.normal_texture = Some(TextureRef::new(0)));
    type Change = fn(&mut Material);
    let changes: [(&str, Change); 10] = [
        ("base colour", |m| m.base_color = Vec3::new(0.1, 0.3, 0.9).extend(m.base_color.w)),
        ("emission", |m| m.emissive = Vec3::new(0.3, 0.2, 0.1)),
        ("metallic", |m| m.metallic = 1.0 - m.metallic),
        ("diffuse transmission", |m| (m.metallic, m.diffuse_transmission) = (0.2, 0.5)),
        ("roughness", |m| m.perceptual_roughness = 0.2),
        ("specular", |m| (m.specular, m.ior) = (0.2, 1.8)),
        ("specular colour", |m| m.specular_color = Vec3::new(0.1, 1.0, 3.0)),
        ("clear coat", |m| (m.clearcoat, m.clearcoat_roughness) = (0.8, 0.3)),
        ("normal scale", |m| m.normal_scale = 0.3),
        ("unlit", |m| m.unlit = true),
    ];
    let direct = Settings::direct_light().with_shadows(Shadows::BVH);
    // The same with hit shading.
    let indirect = direct.clone().with_indirect(few_rays());
    for (settings, size, least) in [(direct, [40, 40], 100), (indirect, [20, 20], 25)] {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut uploaded = renderer.upload(&before).unwrap();
        let (generation, mut scene) = (uploaded.generation(), before.clone());
        let small =
            |renderer: &mut Renderer, uploaded: &GpuScene| renderer.render(uploaded, &before.cameras[0], size).unwrap();
        let mut last = small(&mut renderer, &uploaded);
        for (name, change) in changes {
            scene.materials.iter_mut().for_each(change);
            renderer.update(&mut uploaded, &scene).unwrap();
            let updated = small(&mut renderer, &uploaded);
            let fresh_scene = renderer.upload(&scene).unwrap();
            let (wrong, changed) =
                (differing(&updated, &small(&mut renderer, &fresh_scene)), differing(&updated, &last));
            assert!(
                wrong == 0 && changed > least,
                "{name}: {wrong} pixels differ from a fresh upload, {changed} have changed"
            );
            last = updated;
        }
        assert_eq!(uploaded.generation(), generation, "no triangle has moved");
    }
}

/// Distances of rays through the BVH, m.
fn distances(gpu: &Gpu, uploaded: &GpuScene, rays: &[TracedRay]) -> Vec<f32> {
    let tracer = RayTracer::new(&gpu.device).unwrap();
    let buffer = tracer.upload(&gpu.device, rays).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let actual = tracer.record(&mut frame, uploaded, Tracer::BVH, None, &buffer, rays.len() as u32).unwrap();
    frame.submit();
    read_back(&gpu.device, &gpu.queue, &actual, rays.len()).unwrap()
}

#[gpu_test]
fn gpu_rays_hit_the_same_in_a_refit_and_a_new_bvh(gpu: &Gpu) {
    let renderer = renderer(gpu, Shadows::BVH);
    for name in ["cornell", "atrium"] {
        let mut scene = apart(&generate::demo(name).unwrap());
        let mut uploaded = renderer.upload(&scene).unwrap();
        let size = scene.bounds().size();
        let mut random = Random::new(4);
        let mut last = Vec::new();
        let original = scene.clone();
        for step in 0..5 {
            scene = moved(&original, step, 0.2 * size.x);
            // In one step some parts are points, which a fresh upload leaves out; then they have their size again.
            if step == 3 {
                let flat = scene.instances.iter_mut().step_by(3);
                flat.for_each(|i| i.world_from_object.matrix3 *= 0.0);
            }
            renderer.update(&mut uploaded, &scene).unwrap();
            let bounds = scene.bounds();
            let ray = |_| {
                let origin = bounds.center() + 0.5 * random.point() * bounds.size();
                TracedRay { origin, direction: random.direction(), ..TracedRay::default() }
            };
            let rays: Vec<TracedRay> = (0..20_000).map(ray).collect();
            let actual = distances(gpu, &uploaded, &rays);
            assert_eq!(actual, distances(gpu, &renderer.upload(&scene).unwrap(), &rays), "{name}, step {step}");
            let hits = actual.iter().filter(|distance| **distance >= 0.0).count();
            assert!(hits > 4000, "{name}, step {step}: {hits}");
            assert_ne!(actual, last);
            last = actual;
        }
    }
}

#[test]
fn every_texel_of_a_small_image_is_hashed() {
    let mut scene = Scene {
        images: vec![Image { name: String::new(), width: 32, height: 32, rgba: vec![7; 4096] }],
        ..Scene::default()
    };
    let outline = Outline::of(&scene);
    assert!(outline == Outline::of(&scene));
    for i in 0..4096 {
        scene.images[0].rgba[i] = 8;
        assert!(outline != Outline::of(&scene), "texel {}", i / 4);
        scene.images[0].rgba[i] = 7;
    }
}

#[gpu_test]
fn gpu_generation_changes_when_triangles_move(gpu: &Gpu) {
    let renderer = renderer(gpu, Shadows::BVH);
    let mut scene = scene();
    let mut uploaded = renderer.upload(&scene).unwrap();
    let first = uploaded.generation();
    assert_ne!(renderer.upload(&scene).unwrap().generation(), first);
    // Lights alone move no triangle.
    scene.lights.truncate(3);
    renderer.update(&mut uploaded, &scene).unwrap();
    assert_eq!((uploaded.generation(), uploaded.lights.capacity), (first, 3));
    let after = moved(&scene, 1, 0.1);
    renderer.update(&mut uploaded, &after).unwrap();
    let second = uploaded.generation();
    renderer.update(&mut uploaded, &after).unwrap();
    assert!(second > first && uploaded.generation() == second);
    // A move back is a motion, too.
    renderer.update(&mut uploaded, &scene).unwrap();
    assert!(uploaded.generation() > second);
}
