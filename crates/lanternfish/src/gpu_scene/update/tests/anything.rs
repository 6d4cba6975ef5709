//! Updates that add, remove and change elements of a scene.

use lanternfish_scene::{Environment, Instance};

use super::{
    masks::{leaf, leaves},
    *,
};

type Change = fn(&mut Scene);

/// Changes in place: nothing is uploaded again.
const IN_PLACE: [(&str, Change); 13] = [
    ("lights that move", |s| s.lights.iter_mut().for_each(|light| light.position.y *= 0.9)),
    ("a light more", |s| s.lights.push(Light::point(Vec3::Y, Vec3::splat(0.3)))),
    ("another environment", |s| {
        let pixels = (0..32).map(|i| Vec3::new(i as f32, 4.0, 32.0 - i as f32) / 16.0).collect();
        s.environment = Some(Environment { width: 8, height: 4, pixels, rotation: 2.0 });
    }),
    ("base colour", |s| materials(s, |m| m.base_color = Vec3::new(0.1, 0.3, 0.9).extend(m.base_color.w))),
    ("emission", |s| materials(s, |m| m.emissive = Vec3::new(0.3, 0.2, 0.1))),
    // Glass that becomes metal or rough is another material.
    ("metallic", |s| materials(s, |m| m.metallic = if m.transmission > 0.0 { 0.5 } else { 1.0 - m.metallic })),
    ("diffuse transmission", |s| materials(s, |m| (m.metallic, m.diffuse_transmission) = (0.2, 0.5))),
    ("roughness", |s| materials(s, |m| m.perceptual_roughness = if m.transmission > 0.0 { 0.0 } else { 0.2 })),
    ("specular", |s| materials(s, |m| (m.specular, m.ior) = (0.2, 1.8))),
    ("specular colour", |s| materials(s, |m| m.specular_color = Vec3::new(0.1, 1.0, 3.0))),
    ("clear coat", |s| materials(s, |m| (m.clearcoat, m.clearcoat_roughness) = (0.8, 0.3))),
    ("normal scale", |s| materials(s, |m| m.normal_scale = 0.3)),
    ("unlit", |s| materials(s, |m| m.unlit = true)),
];

fn materials(scene: &mut Scene, change: fn(&mut Material)) {
    scene.materials.iter_mut().for_each(change);
}

/// Changes that move triangles, or upload the scene again.
const OTHERS: [(&str, Change); 24] = [
    ("instances that move", |s| *s = moved(s, 2, 0.3)),
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
    ("no area", |s| s.meshes[1].primitives[0].positions.fill(Vec3::ZERO)),
    ("other triangles", |s| s.meshes[1].primitives[0].indices.truncate(3)),
    ("other indices", |s| s.meshes[0].primitives[0].indices.swap(0, 1)),
    ("another material", |s| s.meshes[1].primitives[0].material = 2),
    // What was left out of an upload.
    ("an area", |s| {
        let positions = s.meshes[2].primitives[0].positions.iter();
        s.meshes[1].primitives[0].positions = positions.map(|p| 0.8 * *p).collect();
    }),
    ("another mesh", |s| s.instances[1].mesh = 0),
    ("a material more", |s| s.materials.push(Material::default())),
    ("transparent", |s| s.materials[0].alpha_mode = AlphaMode::Blend),
    ("another texture", |s| s.materials[0].base_color_texture = Some(TextureRef::new(1))),
    ("sides", |s| s.materials.iter_mut().for_each(|material| material.double_sided ^= true)),
    ("transmission", |s| s.materials[0].transmission = 0.5),
    ("a volume", |s| (s.materials[0].transmission, s.materials[0].thickness) = (0.5, 0.1)),
    ("alpha of a mask", |s| s.materials.iter_mut().for_each(|material| material.base_color.w *= 0.7)),
    ("cutoff of a mask", |s| masks(s).for_each(|m| m.alpha_mode = AlphaMode::Mask { cutoff: 0.3 })),
    ("another image of a mask", |s| s.images[3] = leaf(12.0)),
    ("another image", |s| s.images[1].rgba.fill(70)),
    ("mirrored", |s| s.instances[1].world_from_object.matrix3.x_axis *= -1.0),
    ("no environment", |s| s.environment = None),
];

/// Materials with an alpha mask.
fn masks(scene: &mut Scene) -> impl Iterator<Item = &mut Material> {
    scene.materials.iter_mut().filter(|material| matches!(material.alpha_mode, AlphaMode::Mask { .. }))
}

/// With three textures, leaves, a pane of glass, and an environment.
fn textured() -> Scene {
    let mut scene = scene();
    let plain = |value| Image { name: String::new(), width: 1, height: 1, rgba: vec![value; 4] };
    let bent = Image { rgba: vec![170, 90, 220, 255], ..plain(0) };
    scene.images = vec![plain(200), plain(250), bent];
    scene.samplers.push(Sampler::default());
    scene.textures = (0..3).map(|image| Texture { image, sampler: 0 }).collect();
    scene.materials.iter_mut().for_each(|material| material.normal_texture = Some(TextureRef::new(2)));
    scene.materials[0].base_color_texture = Some(TextureRef::new(0));
    scene.materials[1].base_color_texture = Some(TextureRef::new(1));
    scene.environment = Some(Environment { width: 2, height: 1, pixels: vec![Vec3::ONE; 2], rotation: 0.0 });
    let glass = Material { transmission: 1.0, metallic: 0.0, perceptual_roughness: 0.0, ..Material::default() };
    let mut pane = scene.meshes[1].clone();
    pane.primitives[0].positions.iter_mut().for_each(|p| *p = 0.4 * *p + Vec3::new(0.2, 0.8, 0.3));
    pane.primitives[0].material = scene.materials.len();
    scene.materials.push(Material { base_color: Vec4::new(0.8, 0.1, 0.1, 1.0), ..glass });
    let instance = Instance { mesh: scene.meshes.len(), ..scene.instances[0].clone() };
    scene.instances.insert(scene.instances.len() - 1, instance);
    scene.meshes.push(pane);
    leaves(scene)
}

/// An update renders bitwise the same as a fresh upload, whatever has changed; unchanged images are not uploaded again.
#[gpu_test]
fn gpu_update_in_place_handles_any_change(gpu: &Gpu) {
    check_changes(gpu, &Settings::direct_light().with_shadows(Shadows::BVH).with_indirect(few_rays()), &IN_PLACE, true);
}

#[gpu_test(full)]
fn gpu_update_by_an_upload_handles_any_change(gpu: &Gpu) {
    check_changes(gpu, &Settings::direct_light().with_shadows(Shadows::BVH).with_indirect(few_rays()), &OTHERS, false);
}

#[gpu_test(full)]
fn gpu_update_without_hits_handles_any_change(gpu: &Gpu) {
    let direct = Settings::direct_light().with_shadows(Shadows::BVH);
    check_changes(gpu, &direct, &IN_PLACE, true);
    check_changes(gpu, &direct, &OTHERS, false);
}

fn check_changes(gpu: &Gpu, settings: &Settings, changes: &[(&str, Change)], is_in_place: bool) {
    let mut now = textured();
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
    let mut uploaded = renderer.upload(&now).unwrap();
    let mut last = shown(&mut renderer, &uploaded, &now);
    for (name, change) in changes {
        let before = now.clone();
        change(&mut now);
        if !is_in_place {
            // In addition to the change in place.
            now.lights.pop();
        }
        assert_eq!(now.validate(), Ok(()), "{name}");
        let (images, generation) = (uploaded.textures.images(|_| true), uploaded.generation());
        let order = uploaded.triangle_order();
        renderer.update(&mut uploaded, &now).unwrap();
        let updated = shown(&mut renderer, &uploaded, &now);
        let fresh = renderer.upload(&now).unwrap();
        let expected = shown(&mut renderer, &fresh, &now);
        let wrong = differing(&updated, &expected);
        println!("{name}: {wrong} pixels differ, {} have changed", differing(&updated, &last));
        assert_eq!(wrong, 0, "{name}");
        // A new tree may have other nodes.
        assert_eq!(updated.report.counters[..4], expected.report.counters[..4], "{name}");
        assert_eq!((uploaded.bounds, uploaded.lights.capacity), (fresh.bounds, fresh.lights.capacity), "{name}");
        assert_eq!((uploaded.bounds, uploaded.lights.bounds), (now.bounds(), fresh.lights.bounds), "{name}");
        assert_eq!(uploaded.generation() == generation, is_in_place, "{name}");
        assert!(!is_in_place || uploaded.triangle_order() == order, "{name}: the scene was uploaded again");
        assert!(differing(&updated, &last) > 10, "{name}");
        for (key, (view, _)) in uploaded.textures.images(|_| true) {
            let is_as_it_was = now.images[key.0].rgba == before.images[key.0].rgba;
            let stays = images.get(&key).is_some_and(|(last_view, _)| *last_view == view);
            assert_eq!(stays, is_as_it_was && images.contains_key(&key), "{name}: {key:?}");
        }
        last = updated;
    }
    let nowhere = Scene { instances: vec![Instance { mesh: 99, ..now.instances[0].clone() }], ..now.clone() };
    renderer.update(&mut uploaded, &nowhere).unwrap_err();
    let generation = uploaded.generation();
    renderer.update(&mut uploaded, &now).unwrap();
    assert_eq!(uploaded.generation(), generation, "nothing has changed");
    assert_eq!(differing(&shown(&mut renderer, &uploaded, &now), &last), 0, "an error changes nothing");
}

/// Replaces one material: its bytes are uploaded, and the image is that of a fresh upload; changes that need an update are refused.
#[gpu_test]
fn gpu_set_material_renders_like_a_fresh_upload(gpu: &Gpu) {
    let direct = Settings::direct_light().with_shadows(Shadows::BVH);
    let indirect = direct.clone().with_indirect(few_rays());
    for (settings, bytes) in [(direct, 544), (indirect, 608)] {
        let is_indirect = settings.indirect != Indirect::NONE;
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut now = textured();
        let mut uploaded = renderer.upload(&now).unwrap();
        let last = shown(&mut renderer, &uploaded, &now);
        let painted =
            Material { base_color: Vec3::new(0.1, 0.2, 0.9).extend(1.0), metallic: 0.4, ..now.materials[1].clone() };
        now.materials[1] = painted.clone();
        let sent = renderer.set_material(&mut uploaded, 1, &painted).unwrap();
        assert_eq!((sent.bytes, sent.dispatches), (bytes, 0));
        // The shadow of the pane follows, too.
        let pane = now.materials.iter().position(|material| material.transmission > 0.0).unwrap();
        now.materials[pane].base_color = Vec4::new(0.1, 0.8, 0.2, 1.0);
        renderer.set_material(&mut uploaded, pane, &now.materials[pane]).unwrap();
        let fresh = renderer.upload(&now).unwrap();
        let actual = shown(&mut renderer, &uploaded, &now);
        assert_eq!(differing(&actual, &shown(&mut renderer, &fresh, &now)), 0);
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
        assert_eq!(differing(&shown(&mut renderer, &uploaded, &now), &actual), 0);
    }
}

/// After an error of the device the next update uploads the complete scene.
#[gpu_test]
fn gpu_scene_is_uploaded_again_after_a_device_error(gpu: &Gpu) {
    let scene = textured();
    let mut renderer = renderer(gpu, Shadows::BVH);
    let mut uploaded = renderer.upload(&scene).unwrap();
    let (rendering, images) = (shown(&mut renderer, &uploaded, &scene), uploaded.textures.images(|_| true));
    let is_another = |uploaded: &GpuScene| {
        let now = uploaded.textures.images(|_| true);
        now.iter().all(|(key, (view, _))| images[key].0 != *view)
    };
    renderer.update(&mut uploaded, &scene).unwrap();
    assert!(!is_another(&uploaded));
    uploaded.distrust();
    renderer.update(&mut uploaded, &scene).unwrap();
    assert!(is_another(&uploaded));
    assert_eq!(differing(&shown(&mut renderer, &uploaded, &scene), &rendering), 0);
    // A refused request is not an error of the device.
    renderer.move_instances(&mut uploaded, &[(99, Affine3A::IDENTITY)]).unwrap_err();
    let (generation, images) = (uploaded.generation(), uploaded.textures.images(|_| true));
    renderer.update(&mut uploaded, &scene).unwrap();
    assert_eq!(uploaded.generation(), generation);
    assert!(uploaded.textures.images(|_| true).iter().all(|(key, (view, _))| images[key].0 == *view));
}
