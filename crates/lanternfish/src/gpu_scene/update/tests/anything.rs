//! Updates that add, remove and change elements of a scene.

use lanternfish_scene::{Environment, Instance};

use super::*;

type Change = fn(&mut Scene);

const CHANGES: [(&str, Change); 19] = [
    ("an instance more", |s| {
        let world_from_object = Affine3A::from_translation(0.2 * Vec3::ONE) * s.instances[4].world_from_object;
        s.instances.push(Instance { world_from_object, ..s.instances[4].clone() });
    }),
    ("one of two mirrored", |s| {
        let last = s.instances.last_mut().unwrap();
        last.world_from_object.matrix3.x_axis *= -1.0;
    }),
    ("an instance less", |s| drop(s.instances.remove(2))),
    ("a mesh more", |s| {
        s.meshes.push(s.meshes[3].clone());
        let mesh = s.meshes.len() - 1;
        s.meshes[mesh].primitives[0].positions.iter_mut().for_each(|position| *position *= 0.8);
        s.instances.push(Instance { mesh, ..s.instances[3].clone() });
    }),
    ("a mesh less", |s| {
        s.meshes.truncate(s.meshes.len() - 1);
        s.instances.retain(|instance| instance.mesh < s.meshes.len());
    }),
    ("other triangles", |s| s.meshes[1].primitives[0].indices.truncate(3)),
    ("other indices", |s| s.meshes[0].primitives[0].indices.swap(0, 1)),
    ("another material", |s| s.meshes[1].primitives[0].material = 2),
    ("another mesh", |s| s.instances[1].mesh = 0),
    ("a material more", |s| s.materials.push(Material::default())),
    ("transparent", |s| s.materials[0].alpha_mode = AlphaMode::Blend),
    ("another texture", |s| s.materials[0].base_color_texture = Some(TextureRef::new(1))),
    ("sides", |s| s.materials.iter_mut().for_each(|material| material.double_sided ^= true)),
    ("transmission", |s| s.materials[0].transmission = 0.5),
    ("a volume", |s| (s.materials[0].transmission, s.materials[0].thickness) = (0.5, 0.1)),
    ("alpha of a mask", |s| s.materials.iter_mut().for_each(|material| material.base_color.w *= 0.7)),
    ("another image", |s| s.images[1].rgba.fill(70)),
    ("mirrored", |s| s.instances[1].world_from_object.matrix3.x_axis *= -1.0),
    ("no environment", |s| s.environment = None),
];

/// With two textures and an environment.
fn textured() -> Scene {
    let mut scene = scene();
    let plain = |value| Image { name: String::new(), width: 1, height: 1, rgba: vec![value; 4] };
    scene.images = vec![plain(200), plain(250)];
    scene.samplers.push(Sampler::default());
    scene.textures = vec![Texture { image: 0, sampler: 0 }, Texture { image: 1, sampler: 0 }];
    scene.materials[0].base_color_texture = Some(TextureRef::new(0));
    scene.materials[1].base_color_texture = Some(TextureRef::new(1));
    scene.environment = Some(Environment { width: 2, height: 1, pixels: vec![Vec3::ONE; 2], rotation: 0.0 });
    scene
}

fn small(renderer: &mut Renderer, uploaded: &GpuScene, scene: &Scene) -> RenderedImage {
    renderer.render(uploaded, &scene.cameras[0], [60, 60]).unwrap()
}

/// An update renders bitwise the same as a fresh upload, whatever has changed; unchanged images are not uploaded again.
#[gpu_test]
fn gpu_update_handles_any_change(gpu: &Gpu) {
    let direct = Settings::direct_light().with_shadows(Shadows::BVH);
    let indirect = direct.clone().with_indirect(few_rays());
    for settings in [direct, indirect] {
        let mut now = textured();
        let mut renderer = Renderer::with_engine(&lanternfish_gpu::testing::engine(gpu), settings).unwrap();
        let mut uploaded = renderer.upload(&now).unwrap();
        let mut last = small(&mut renderer, &uploaded, &now);
        for (name, change) in CHANGES {
            let before = now.clone();
            change(&mut now);
            // In addition to the change in place.
            now.lights.pop();
            assert_eq!(now.validate(), Ok(()), "{name}");
            let (images, generation) = (uploaded.textures.images(|_| true), uploaded.generation());
            renderer.update(&mut uploaded, &now).unwrap();
            let updated = small(&mut renderer, &uploaded, &now);
            let fresh = renderer.upload(&now).unwrap();
            let expected = small(&mut renderer, &fresh, &now);
            let wrong = differing(&updated, &expected);
            println!("{name}: {wrong} pixels differ, {} have changed", differing(&updated, &last));
            assert_eq!(wrong, 0, "{name}");
            assert_eq!(updated.report.counters[..5], expected.report.counters[..5], "{name}");
            assert_eq!((uploaded.bounds, uploaded.lights.capacity), (fresh.bounds, fresh.lights.capacity), "{name}");
            assert_ne!(uploaded.generation(), generation, "{name}");
            assert!(differing(&updated, &last) > 20, "{name}");
            for (key, (view, _)) in uploaded.textures.images(|_| true) {
                let is_as_it_was = now.images[key.0].rgba == before.images[key.0].rgba;
                let stays = images.get(&key).is_some_and(|(last_view, _)| *last_view == view);
                assert_eq!(stays, is_as_it_was && images.contains_key(&key), "{name}: {key:?}");
            }
            last = updated;
        }
        let nowhere = Scene { instances: vec![Instance { mesh: 99, ..now.instances[0].clone() }], ..now.clone() };
        renderer.update(&mut uploaded, &nowhere).unwrap_err();
        assert_eq!(differing(&small(&mut renderer, &uploaded, &now), &last), 0, "an error changes nothing");
    }
}

/// An instance scaled to zero is invisible from the upload on; a move makes it visible, and another mirrors it.
#[gpu_test]
fn gpu_instances_scaled_to_zero_appear_by_a_move(gpu: &Gpu) {
    let test = "gpu_instances_scaled_to_zero_appear_by_a_move";
    let complete = scene();
    let mut without = complete.clone();
    without.instances.truncate(4);
    let mut hidden = complete.clone();
    hidden.instances[4..].iter_mut().for_each(|instance| instance.world_from_object.matrix3 *= 0.0);
    let mut mirrored = complete.clone();
    mirrored.instances[4].world_from_object.matrix3.x_axis *= -1.0;
    for shadows in [Shadows::BVH, Shadows::RAY_QUERY] {
        if shadows == Shadows::RAY_QUERY && !gpu.description.ray_query {
            testing::left_out(test, "this adapter has no ray query");
            continue;
        }
        let mut renderer = renderer(gpu, shadows);
        let mut uploaded = renderer.upload(&hidden).unwrap();
        let mut last = &hidden;
        for (now, like) in [(&hidden, &without), (&complete, &complete), (&mirrored, &mirrored), (&hidden, &without)] {
            renderer.move_instances(&mut uploaded, &moves(last, now)).unwrap();
            let fresh = renderer.upload(like).unwrap();
            let (actual, expected) = (shown(&mut renderer, &uploaded, now), shown(&mut renderer, &fresh, like));
            // The order of triangles differs: at shared edges the adapter's own structure may return either.
            let allowed = if shadows == Shadows::RAY_QUERY { 120 * 120 / 500 } else { 0 };
            assert!(differing(&actual, &expected) <= allowed, "{shadows}: {}", differing(&actual, &expected));
            last = now;
        }
        let (there, gone) = (renderer.upload(&complete).unwrap(), renderer.upload(&without).unwrap());
        let renderings = (shown(&mut renderer, &there, &complete), shown(&mut renderer, &gone, &without));
        assert!(differing(&renderings.0, &renderings.1) > 500, "{shadows}: hiding an instance must change the image");
    }
}

/// Replaces one material: its bytes are uploaded, and the image is that of a fresh upload; changes that need an update are refused.
#[gpu_test]
fn gpu_set_material_renders_like_a_fresh_upload(gpu: &Gpu) {
    let direct = Settings::direct_light().with_shadows(Shadows::BVH);
    let indirect = direct.clone().with_indirect(few_rays());
    for (settings, bytes) in [(direct, 544), (indirect, 608)] {
        let is_indirect = settings.indirect != Indirect::NONE;
        let mut renderer = Renderer::with_engine(&lanternfish_gpu::testing::engine(gpu), settings).unwrap();
        let mut now = textured();
        let mut uploaded = renderer.upload(&now).unwrap();
        let last = small(&mut renderer, &uploaded, &now);
        let painted =
            Material { base_color: Vec3::new(0.1, 0.2, 0.9).extend(1.0), metallic: 0.4, ..now.materials[1].clone() };
        now.materials[1] = painted.clone();
        let sent = renderer.set_material(&mut uploaded, 1, &painted).unwrap();
        assert_eq!((sent.bytes, sent.dispatches), (bytes, 0));
        let fresh = renderer.upload(&now).unwrap();
        let actual = small(&mut renderer, &uploaded, &now);
        assert_eq!(differing(&actual, &small(&mut renderer, &fresh, &now)), 0);
        assert!(differing(&actual, &last) > 20);
        let shining = Material { emissive: Vec3::splat(0.4), ..painted.clone() };
        assert_eq!(renderer.set_material(&mut uploaded, 1, &shining).is_err(), is_indirect);
        renderer.set_material(&mut uploaded, 1, &painted).unwrap();
        for (index, wrong, what) in [
            (99, painted.clone(), "so many were not uploaded"),
            (1, Material { alpha_mode: AlphaMode::Blend, ..painted.clone() }, "another alpha mode"),
            (1, Material { base_color_texture: None, ..painted.clone() }, "other textures"),
            (1, Material { ior: 0.5, ..painted }, "refraction"),
        ] {
            let error = renderer.set_material(&mut uploaded, index, &wrong).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
        assert_eq!(differing(&small(&mut renderer, &uploaded, &now), &actual), 0);
    }
}

/// Geometry without area at the upload occludes light after an update gives it an area.
#[gpu_test]
fn gpu_flat_geometry_occludes_after_an_update(gpu: &Gpu) {
    let complete = scene();
    let mut flat = complete.clone();
    flat.meshes[1].primitives[0].positions.fill(Vec3::ZERO);
    let mut renderer = renderer(gpu, Shadows::BVH);
    let mut uploaded = renderer.upload(&flat).unwrap();
    let before = shown(&mut renderer, &uploaded, &flat);
    renderer.update(&mut uploaded, &complete).unwrap();
    let fresh = renderer.upload(&complete).unwrap();
    let (actual, expected) = (shown(&mut renderer, &uploaded, &complete), shown(&mut renderer, &fresh, &complete));
    assert_eq!(differing(&actual, &expected), 0);
    assert!(differing(&actual, &before) > 500);
}

/// After an error of the device the next update uploads the complete scene.
#[gpu_test]
fn gpu_scene_is_uploaded_again_after_a_device_error(gpu: &Gpu) {
    let scene = textured();
    let mut renderer = renderer(gpu, Shadows::BVH);
    let mut uploaded = renderer.upload(&scene).unwrap();
    let (rendering, images) = (small(&mut renderer, &uploaded, &scene), uploaded.textures.images(|_| true));
    let is_another = |uploaded: &GpuScene| {
        let now = uploaded.textures.images(|_| true);
        now.iter().all(|(key, (view, _))| images[key].0 != *view)
    };
    renderer.update(&mut uploaded, &scene).unwrap();
    assert!(!is_another(&uploaded));
    uploaded.distrust();
    renderer.update(&mut uploaded, &scene).unwrap();
    assert!(is_another(&uploaded));
    assert_eq!(differing(&small(&mut renderer, &uploaded, &scene), &rendering), 0);
    // A refused request is not an error of the device.
    renderer.move_instances(&mut uploaded, &[(99, Affine3A::IDENTITY)]).unwrap_err();
    let (generation, images) = (uploaded.generation(), uploaded.textures.images(|_| true));
    renderer.update(&mut uploaded, &scene).unwrap();
    assert_eq!(uploaded.generation(), generation);
    assert!(uploaded.textures.images(|_| true).iter().all(|(key, (view, _))| images[key].0 == *view));
}
