//! Updates against a fresh upload of the changed scene.

mod anything;
mod masks;

use glam::{Affine3A, Vec3, Vec4};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{AlphaMode, Image, Instance, Light, Material, Sampler, Scene, Texture, TextureRef, generate};

use super::{
    super::tracing::{self, pose},
    UploadSignature,
};
use crate::{
    GpuScene, RenderedImage, Renderer, Settings,
    rays::{TracedRay, tests::distances},
    settings::{Indirect, Shadows, Tracer},
    techniques::Sampled,
    testing::{Random, apart, moved},
};

/// The Cornell box in parts and in light rain, with a masked and a transparent part.
pub(in crate::gpu_scene) fn scene() -> Scene {
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
pub(in crate::gpu_scene) fn few_rays() -> Sampled {
    let usual = Sampled { tracer: Tracer::BVH.into(), ..Sampled::default() };
    Sampled { diffuse_rays: 1, first_rays: 1, glossy_rays: 1, cache_samples: 2, ..usual }
}

fn renderer(gpu: &Gpu, shadows: Shadows) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_shadows(shadows)).unwrap()
}

fn shown(renderer: &mut Renderer, uploaded: &GpuScene, scene: &Scene) -> RenderedImage {
    renderer.render(uploaded, &scene.cameras[0], [40, 40]).unwrap()
}

fn differing(a: &RenderedImage, b: &RenderedImage) -> usize {
    a.radiance.iter().zip(&b.radiance).filter(|(a, b)| a != b).count()
}

/// Instances that have moved, in the form that `move_instances` takes.
fn moves(before: &Scene, after: &Scene) -> Vec<(usize, Affine3A)> {
    let pairs = before.instances.iter().zip(&after.instances).enumerate();
    let moved = pairs.filter(|(_, (was, is))| was.world_from_object != is.world_from_object);
    moved.map(|(i, (_, is))| (i, is.world_from_object)).collect()
}

/// What moves on the device, and what is refused.
#[gpu_test]
fn gpu_moves_are_small_and_wrong_ones_are_refused(gpu: &Gpu) {
    let mut before = scene();
    let is_emissive = |instance: &Instance| {
        let material = before.meshes[instance.mesh].primitives[0].material;
        before.materials[material].emissive != Vec3::ZERO
    };
    let lamp = before.instances.iter().position(is_emissive).unwrap();
    let lit = before.clone();
    before.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    let direct = |shadows| Settings::direct_light().with_shadows(shadows);
    for settings in [direct(Shadows::BVH).with_indirect(few_rays()), direct(Shadows::None)] {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut uploaded = renderer.upload(&before).unwrap();
        let (now, generation) = (moved(&before, 2, 0.3), uploaded.generation());
        let sent = renderer.move_instances(&mut uploaded, &moves(&before, &now)).unwrap();
        assert!(sent.bytes > 0 && sent.bytes < 4096, "{sent:?}");
        assert_ne!(uploaded.generation(), generation);
        let fresh = renderer.upload(&now).unwrap();
        assert_eq!(uploaded.bounds, fresh.bounds);
        let (updated, fresh) = (shown(&mut renderer, &uploaded, &now), shown(&mut renderer, &fresh, &now));
        assert_eq!(differing(&updated, &fresh), 0);
        // Moves back, one by one, and one move without a change.
        for (instance, back) in moves(&now, &before) {
            renderer.move_instances(&mut uploaded, &[(instance, Affine3A::IDENTITY), (instance, back)]).unwrap();
        }
        let generation = uploaded.generation();
        let sent = renderer.move_instances(&mut uploaded, &[(0, before.instances[0].world_from_object)]).unwrap();
        // A tree from the background may arrive with any call.
        assert!(sent.has_rebuilt || uploaded.generation() == generation, "nothing has moved");
        let fresh = renderer.upload(&before).unwrap();
        let (back, fresh) = (shown(&mut renderer, &uploaded, &before), shown(&mut renderer, &fresh, &before));
        assert_eq!(differing(&back, &fresh), 0, "back");
        let nowhere = Affine3A::from_translation(Vec3::splat(f32::NAN));
        for (wrong, what) in [((99, Affine3A::IDENTITY), "none is 99"), ((1, nowhere), "not finite")] {
            let error = renderer.move_instances(&mut uploaded, &[wrong]).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
        // Emissive triangles are in a tree that only `update` builds again.
        let mut lit = renderer.upload(&lit).unwrap();
        let moved = renderer.move_instances(&mut lit, &[(lamp, Affine3A::from_translation(Vec3::Y))]);
        assert_eq!(moved.is_err(), renderer.settings().indirect != Indirect::NONE, "{moved:?}");
    }
}

/// Replaces one light of many: 64 bytes are uploaded, and the image is that of a fresh upload.
#[gpu_test]
fn gpu_set_light_renders_like_a_fresh_upload(gpu: &Gpu) {
    let before = scene();
    let mut renderer = renderer(gpu, Shadows::BVH);
    let mut uploaded = renderer.upload(&before).unwrap();
    let mut last = shown(&mut renderer, &uploaded, &before);
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
        assert!(differing(&actual, &last) > 12, "{light:?}: nothing has changed");
    }
    // The sky is updated in place, too.
    (now.sky, last) = (Vec3::new(0.1, 0.2, 0.3), shown(&mut renderer, &uploaded, &now));
    let generation = uploaded.generation();
    renderer.update(&mut uploaded, &now).unwrap();
    let (actual, fresh) = (shown(&mut renderer, &uploaded, &now), renderer.upload(&now).unwrap());
    assert!(uploaded.generation() == generation && differing(&actual, &last) > 12);
    assert_eq!(differing(&actual, &shown(&mut renderer, &fresh, &now)), 0);
    let dark = Light { range: Some(-1.0), ..now.lights[7].clone() };
    assert!(renderer.set_light(&mut uploaded, 7, &dark).unwrap_err().to_string().contains("range"));
    assert!(renderer.set_light(&mut uploaded, 99, &now.lights[7]).unwrap_err().to_string().contains("none is 99"));
}

/// Other passes draw glass that becomes rough, so its material is not updated in place.
#[test]
fn glass_that_becomes_rough_is_another_material() {
    let smooth = Material { metallic: 0.0, perceptual_roughness: 0.0, transmission: 1.0, ..Material::default() };
    let signature = UploadSignature::of(&Scene { materials: vec![smooth.clone()], ..Scene::default() });
    let is_updated = |material: Material| signature.has_shape_of(0, &material);
    assert_eq!(is_updated(Material { perceptual_roughness: 0.2, ..smooth.clone() }), Some(false));
    assert_eq!(is_updated(Material { perceptual_roughness: 0.01, ior: 1.8, ..smooth }), Some(true));
}

#[gpu_test]
fn gpu_rays_hit_the_same_in_a_refit_and_a_new_bvh(gpu: &Gpu) {
    let renderer = renderer(gpu, Shadows::BVH);
    let mut scene = apart(&generate::demo("atrium").unwrap());
    let mut uploaded = renderer.upload(&scene).unwrap();
    let size = scene.bounds().size();
    let mut random = Random::new(4);
    let mut last = Vec::new();
    let original = scene.clone();
    for step in 1..5 {
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
        let rays: Vec<TracedRay> = (0..5000).map(ray).collect();
        let actual = distances(gpu, &uploaded, Tracer::BVH, &rays);
        assert_eq!(actual, distances(gpu, &renderer.upload(&scene).unwrap(), Tracer::BVH, &rays), "step {step}");
        let hits = actual.iter().filter(|distance| **distance >= 0.0).count();
        assert!(hits > 1000, "step {step}: {hits}");
        assert_ne!(actual, last);
        last = actual;
    }
}

#[test]
fn every_texel_of_a_small_image_is_hashed() {
    let mut scene = Scene {
        images: vec![Image { name: String::new(), width: 32, height: 32, rgba: vec![7; 4096] }],
        ..Scene::default()
    };
    let signature = UploadSignature::of(&scene);
    assert!(signature == UploadSignature::of(&scene));
    for i in 0..4096 {
        scene.images[0].rgba[i] = 8;
        assert!(signature != UploadSignature::of(&scene), "texel {}", i / 4);
        scene.images[0].rgba[i] = 7;
    }
}
