//! Invalid scenes and cameras, and unusual valid ones.

use glam::{Affine3A, UVec2, Vec3, Vec4};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{
    Camera, Image, Light, Material, Mesh, Primitive, Projection, Sampler, Scene, Texture, TextureRef,
};

use super::upload::lights::packed_lights;
use crate::{
    GpuScene, RenderError, Renderer, Settings,
    lights::Light as PackedLight,
    settings::{Shadows, TextureBinding, Tracer},
    testing::{quad, scene_of},
    view::View,
};

const PERSPECTIVE: Projection = Projection::Perspective { fov_y: 0.9, near: 0.01 };

/// Two meshes under a lamp.
fn scene() -> Scene {
    let textured = Material { base_color_texture: Some(TextureRef::new(0)), metallic: 0.0, ..Material::default() };
    let mut scene = scene_of(vec![quad(0, Vec3::ZERO, Vec3::X, -Vec3::Z)], vec![textured, Material::default()]);
    let above = quad(1, Vec3::new(0.2, 0.5, 0.1), 0.3 * Vec3::X, -0.3 * Vec3::Z);
    scene.meshes.push(Mesh { name: "shade".to_owned(), primitives: vec![above] });
    scene.instances.push(lanternfish_scene::Instance { mesh: 1, ..scene.instances[0].clone() });
    scene.images.push(Image { name: String::new(), width: 2, height: 1, rgba: vec![200; 8] });
    scene.samplers.push(Sampler::default());
    scene.textures.push(Texture { image: 0, sampler: 0 });
    scene.lights.push(Light::point(Vec3::new(0.0, 1.0, 0.0), Vec3::ONE));
    scene.cameras.push(Camera::look_at(Vec3::new(0.5, 1.5, 2.0), Vec3::ZERO, PERSPECTIVE));
    scene.sky = Vec3::splat(0.1);
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// A renderer with the default settings.
fn everything(gpu: &Gpu) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), Settings::default()).unwrap()
}

type Change = fn(&mut Scene);

#[gpu_test]
fn gpu_a_scene_that_is_not_valid_is_refused_by_the_name_of_its_fault(gpu: &Gpu) {
    // One of each part of a scene; the others are tests of `Scene::validate`.
    let damages: [(&str, Change); 8] = [
        ("index 7 of 4 vertices", |s| s.meshes[0].primitives[0].indices[2] = 7),
        ("mesh 2 of 2", |s| s.instances[1].mesh = 2),
        ("material 1 ()", |s| s.materials[1].emissive_texture = Some(TextureRef::new(1))),
        ("texture 0", |s| s.textures[0].image = 1),
        ("7 bytes for 2", |s| s.images[0].rgba.truncate(7)),
        ("light 0 (): its position", |s| s.lights[0].position.x = f32::NAN),
        ("camera 0 (): fov_y is 45", |s| s.cameras[0].projection = Projection::Perspective { fov_y: 45.0, near: 0.1 }),
        ("sky", |s| s.sky.z = f32::NAN),
    ];
    let mut renderer = everything(gpu);
    let sound = scene();
    let mut uploaded = renderer.upload(&sound).unwrap();
    let revision = uploaded.revision();
    let shown = |renderer: &mut Renderer, uploaded: &GpuScene| {
        renderer.render(uploaded, &sound.cameras[0], [16, 12]).unwrap().radiance
    };
    let before = shown(&mut renderer, &uploaded);
    for (named, damage) in damages {
        let mut damaged = scene();
        damage(&mut damaged);
        for error in [renderer.upload(&damaged).unwrap_err(), renderer.update(&mut uploaded, &damaged).unwrap_err()] {
            let text = error.to_string();
            assert!(matches!(error, RenderError::InvalidScene { .. }) && text.contains(named), "{named}: {text}");
        }
    }
    assert_eq!(uploaded.revision(), revision);
    assert!(shown(&mut renderer, &uploaded) == before, "a refused update left something behind");
}

#[gpu_test]
fn gpu_odd_scenes_that_are_valid_render(gpu: &Gpu) {
    let oddities: [(&str, Change); 14] = [
        ("nothing", |s| *s = Scene::default()),
        ("no instances", |s| s.instances.clear()),
        ("no lights", |s| s.lights.clear()),
        ("a mesh without primitives", |s| s.meshes[0].primitives.clear()),
        ("a primitive without vertices", |s| s.meshes[0].primitives[0] = Primitive::default()),
        ("no triangles at all", |s| s.meshes.iter_mut().for_each(|m| m.primitives[0].indices.clear())),
        ("vertices that no triangle uses", |s| s.meshes[0].primitives[0].indices.truncate(3)),
        ("triangles that are points", |s| s.meshes[0].primitives[0].indices.fill(0)),
        ("an instance without extent", |s| s.instances[0].world_from_object.matrix3 *= 0.0),
        ("nothing but points", |s| s.instances.iter_mut().for_each(|i| i.world_from_object.matrix3 *= 0.0)),
        ("a tiny instance", |s| s.instances[0].world_from_object.matrix3 *= 1e-18),
        ("a mirrored one", |s| s.instances[0].world_from_object = Affine3A::from_scale(-Vec3::ONE)),
        ("a lamp very far away", |s| s.lights[0].position = Vec3::splat(1e11)),
        ("the same triangle a thousand times", |s| {
            let again = s.meshes[1].primitives[0].indices.repeat(500);
            s.meshes[1].primitives[0].indices = again;
        }),
    ];
    let in_levels = Settings::direct_light().with_shadows(Shadows::Traced(Tracer::TWO_LEVEL));
    let in_levels = Renderer::with_engine(&testing::engine(gpu), in_levels).unwrap();
    let camera = scene().cameras.remove(0);
    for (mut renderer, copies) in [(everything(gpu), 1), (in_levels, 3)] {
        for (name, change) in &oddities {
            let mut odd = scene();
            change(&mut odd);
            odd.instances = vec![odd.instances; copies].concat();
            assert_eq!(odd.validate(), Ok(()), "{name}");
            let uploaded = renderer.upload(&odd).unwrap_or_else(|error| panic!("{name}: {error}"));
            let image = renderer.render(&uploaded, &camera, [16, 12]).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(image.radiance.as_flattened().iter().all(|value| value.is_finite()), "{name}");
        }
    }
}

/// Materials without textures differ in numbers alone. A software adapter ended the process at 65,530 materials.
#[gpu_test]
fn gpu_materials_with_equal_textures_share_a_bind_group(gpu: &Gpu) {
    let settings = Settings::direct_light().with_shadows(Shadows::None).with_textures(TextureBinding::PerMaterial);
    let engine = testing::engine(gpu);
    // The last of coincident surfaces is visible.
    let image = |materials: Vec<Material>| {
        let quads = (0..materials.len()).map(|material| quad(material, Vec3::ZERO, Vec3::X, -Vec3::Z)).collect();
        let mut scene = scene_of(quads, materials);
        scene.sky = Vec3::ONE;
        let camera = Camera::look_at(Vec3::new(0.5, 1.5, 2.0), Vec3::ZERO, PERSPECTIVE);
        let mut renderer = Renderer::with_engine(&engine, settings.clone()).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let before = lanternfish_gpu::made();
        let rendering = renderer.render(&uploaded, &camera, [16, 12]).unwrap();
        ((lanternfish_gpu::made() - before).bind_groups, rendering.radiance)
    };
    let red = |red: f32| Material { base_color: Vec4::new(red, 0.5, 0.25, 1.0), unlit: true, ..Material::default() };
    let one = image(vec![red(1.0)]);
    for many in [100, 70_000] {
        let all = image((0..many).map(|index| red((index + 1) as f32 / many as f32)).collect());
        assert!(all == one, "{many}: {} bind groups, not {}, or another image", all.0, one.0);
    }
}

/// Many instances are drawn in parts, of which a view needs some, and the image is that of so many meshes.
#[gpu_test]
fn gpu_a_view_leaves_out_parts_of_many_instances(gpu: &Gpu) {
    let mut scene = scene_of(vec![quad(0, Vec3::ZERO, 0.4 * Vec3::X, 0.4 * Vec3::Y)], vec![Material::default()]);
    let one = scene.instances[0].clone();
    let at = |i: usize| Affine3A::from_translation(Vec3::new(i as f32, 0.0, 0.0));
    scene.instances =
        (0..1500).map(|i| lanternfish_scene::Instance { world_from_object: at(i), ..one.clone() }).collect();
    scene.sky = Vec3::ONE;
    let camera = Camera::look_at(Vec3::new(20.0, 0.0, 4.0), Vec3::new(20.0, 0.0, 0.0), PERSPECTIVE);
    let mut renderer =
        Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_shadows(Shadows::None)).unwrap();
    let mut shown = |scene: &Scene| {
        let uploaded = renderer.upload(scene).unwrap();
        let view = View::new(&camera, UVec2::new(64, 16), Vec3::ZERO, uploaded.bounds());
        let drawn = uploaded.visible_draws(&view).solid.iter().map(|draw| draw.instances.len()).sum::<usize>();
        let all = uploaded.geometry.draws.iter().map(|draw| draw.instances.clone());
        assert!(all.flatten().eq(0..1500), "each once");
        (drawn, renderer.render(&uploaded, &camera, [64, 16]).unwrap().display)
    };
    let (drawn, image) = shown(&scene);
    assert_eq!(drawn, 64);
    scene.meshes = (0..1500).map(|_| scene.meshes[0].clone()).collect();
    (0..).zip(&mut scene.instances).for_each(|(mesh, instance)| instance.mesh = mesh);
    let (drawn, apart) = shown(&scene);
    assert!(drawn < 20 && apart == image, "{drawn}");
}

#[gpu_test]
fn gpu_cameras_without_a_view_are_refused(gpu: &Gpu) {
    let mut renderer = everything(gpu);
    let uploaded = renderer.upload(&scene()).unwrap();
    let sound = &scene().cameras[0];
    let through = |projection| Camera { projection, ..sound.clone() };
    let perspective = |fov_y, near| through(Projection::Perspective { fov_y, near });
    for (named, camera) in [
        ("fov_y is 45: radians between 0 and π are meant; 45 degrees are 45f32.to_radians()", perspective(45.0, 0.1)),
        ("half_height is 0", through(Projection::Orthographic { half_height: 0.0, near: 0.0, far: 1.0 })),
        ("stands at", Camera::look_at(Vec3::NAN, Vec3::ONE, PERSPECTIVE)),
    ] {
        let views = [(sound, [16, 12]), (&camera, [16, 12])];
        for error in [
            renderer.render(&uploaded, &camera, [16, 12]).unwrap_err(),
            renderer.render_views(&uploaded, &views).unwrap_err(),
            renderer.refine(&uploaded, &views).unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(matches!(error, RenderError::Camera { .. }) && text.contains(named), "{named}: {text}");
        }
    }
    for (width, height) in [(0, 12), (16, 0), (u32::MAX, 1)] {
        let error = renderer.render(&uploaded, sound, [width, height]).unwrap_err();
        assert!(matches!(error, RenderError::Size { .. }), "{error}");
    }
    // Unusual but valid cameras give an image.
    let close_up = Camera::look_at(Vec3::Y, Vec3::ZERO, PERSPECTIVE);
    let far_off = Camera::look_at(Vec3::splat(1e9), Vec3::ZERO, PERSPECTIVE);
    for camera in [perspective(3.1, 0.01), perspective(1e-4, 0.01), perspective(0.9, 1e-20), close_up, far_off] {
        renderer.render(&uploaded, &camera, [16, 12]).unwrap_or_else(|error| panic!("{camera:?}: {error}"));
    }
}

#[test]
fn lights_that_do_not_fit_are_refused_by_name() {
    let limits =
        wgpu::Limits { max_storage_buffer_binding_size: 2 * size_of::<PackedLight>() as u64, ..Default::default() };
    let packed = |count| {
        let lights = vec![Light::point(Vec3::ZERO, Vec3::ONE); count];
        packed_lights(&Scene { lights, ..Scene::default() }, &Settings::default().light_storage(), 1.0, &limits)
    };
    assert_eq!(packed(2).unwrap().len(), 2);
    let error = packed(3).unwrap_err().to_string();
    assert!(error.contains("lights: 3 entries needed, at most 2") && error.contains("`lights`"), "{error}");
}
