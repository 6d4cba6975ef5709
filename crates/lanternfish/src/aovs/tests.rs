//! Output variables against planes, against the first hits of the path tracer, and against the frames that they do not depend on.

use glam::{Affine3A, DVec3, Vec2, Vec3};
use lanternfish_gpu::{Engine, Gpu, testing};
use lanternfish_reference::Tracer;
use lanternfish_scene::{
    AlphaMode, Camera, Filter, Image, Material, Primitive, Projection, Sampler, Scene, Texture, TextureRef, Wrap,
};

use super::Aovs;
use crate::{
    Renderer, Settings,
    settings::{Samples, Shadows},
    testing::{apart, edited_engine, looking, quad, scene_of},
};

const SIZE: [u32; 2] = [120, 80];

fn renderer(engine: &Engine, settings: Settings) -> Renderer {
    Renderer::with_engine(engine, settings.with_shadows(Shadows::None)).unwrap()
}

fn aovs_of(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Aovs {
    aovs_with(&testing::engine(gpu), scene, camera)
}

fn aovs_with(engine: &Engine, scene: &Scene, camera: &Camera) -> Aovs {
    let mut renderer = renderer(engine, Settings::direct_light());
    let uploaded = renderer.upload(scene).unwrap();
    renderer.aovs(&uploaded, camera, SIZE, None).unwrap()
}

/// Each rectangle as an instance of its own.
fn placed(rectangles: Vec<Primitive>, materials: Vec<Material>) -> Scene {
    apart(&scene_of(rectangles, materials))
}

/// A floor, and a tilted plate above it.
fn floor_and_plate() -> Scene {
    let red = Material { base_color: [0.8, 0.2, 0.1, 1.0].into(), ..Material::default() };
    let plate = quad(1, Vec3::new(0.3, 0.7, 0.2), Vec3::new(0.9, 0.1, -0.2), Vec3::new(0.0, 0.4, 0.2));
    placed(vec![quad(0, Vec3::ZERO, 3.0 * Vec3::X, -3.0 * Vec3::Z), plate], vec![Material::default(), red])
}

/// The first of the scene's planes on a pixel's ray within its rectangle: index, point and normal.
fn expected(scene: &Scene, camera: &Camera, pixel: Vec2) -> Option<(usize, DVec3, DVec3)> {
    let [left, right, bottom, top] = camera.projection.slopes(SIZE[0] as f32 / SIZE[1] as f32).unwrap();
    let at = pixel / Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    let slope = Vec3::new(left + (right - left) * at.x, top + (bottom - top) * at.y, -1.0);
    let (eye, ray) = (camera.eye().as_dvec3(), camera.world_from_camera.transform_vector3(slope).as_dvec3());
    let hits = scene.meshes.iter().enumerate().filter_map(|(index, mesh)| {
        let corners: Vec<_> = mesh.primitives[0].positions.iter().map(|p| p.as_dvec3()).collect();
        let (right, up) = (corners[1] - corners[0], corners[3] - corners[0]);
        let normal = right.cross(up).normalize();
        let p = eye + (corners[0] - eye).dot(normal) / ray.dot(normal) * ray;
        let within = |side: DVec3| (0.0..=1.0).contains(&((p - corners[0]).dot(side) / side.length_squared()));
        ((p - eye).dot(ray) > 0.0 && within(right) && within(up)).then_some((index, p, normal))
    });
    hits.min_by(|a, b| a.1.distance(eye).total_cmp(&b.1.distance(eye)))
}

#[gpu_test]
fn gpu_planes_are_where_they_are_said_to_be(gpu: &Gpu) {
    let scene = floor_and_plate();
    let off_axis = Projection::Frustum { left: -0.2, right: 0.9, bottom: -0.6, top: 0.25, near: 0.05 };
    let camera = looking([0.5, 1.6, 2.5], [0.2, 0.5, 0.0]);
    for camera in [Camera { projection: off_axis, ..camera.clone() }, camera] {
        let aovs = aovs_of(gpu, &scene, &camera);
        let mut counts = [0; 3];
        for i in 0..aovs.depth.len() {
            let pixel = Vec2::new((i as u32 % SIZE[0]) as f32, (i as u32 / SIZE[0]) as f32) + 0.5;
            let found = aovs.instance[i].checked_sub(1);
            counts[found.map_or(2, |instance| instance as usize)] += 1;
            // At silhouettes, to within 1/100 of a pixel, either side counts.
            let around = [Vec2::ZERO, Vec2::X, Vec2::NEG_X, Vec2::Y, Vec2::NEG_Y];
            let near = around.map(|aside| expected(&scene, &camera, pixel + 0.01 * aside));
            if near.iter().any(|other| other.map(|hit| hit.0) != near[0].map(|hit| hit.0)) {
                continue;
            }
            let Some((instance, p, normal)) = near[0] else {
                let nothing = (aovs.depth[i], aovs.position[i], aovs.normal[i], aovs.material[i]);
                assert_eq!((found, nothing), (None, (0.0, [0.0; 3], [0.0; 3], 0)), "{pixel}");
                continue;
            };
            assert_eq!((found, aovs.material[i]), (Some(instance as u32), instance as u32 + 1), "{pixel}");
            let distance = p.distance(camera.eye().as_dvec3());
            let depth = -camera.world_from_camera.inverse().transform_point3(p.as_vec3()).z;
            let of = |v: [f32; 3]| Vec3::from(v).as_dvec3();
            assert!((aovs.depth[i] / depth - 1.0).abs() < 1e-4, "{pixel}: {} is not {depth}", aovs.depth[i]);
            assert!((f64::from(aovs.distance[i]) / distance - 1.0).abs() < 1e-4, "{pixel}: {}", aovs.distance[i]);
            assert!(of(aovs.position[i]).distance(p) < 1e-4 * distance, "{pixel}: {:?} is not {p}", aovs.position[i]);
            assert!(of(aovs.normal[i]).distance(normal) < 1e-4, "{pixel}: {:?} is not {normal}", aovs.normal[i]);
            let albedo = scene.materials[instance].base_color.truncate();
            assert!(Vec3::from(aovs.albedo[i]).distance(albedo) < 1e-4, "{pixel}: {:?}", aovs.albedo[i]);
        }
        assert!(counts.iter().all(|count| *count > 300), "{counts:?} pixels of floor, plate and nothing");
    }
}

#[gpu_test]
fn gpu_identities_are_those_of_first_hits(gpu: &Gpu) {
    let mut scene = lanternfish_scene::generate::demo("atrium").unwrap();
    // The path tracer does not filter the textures of masks.
    scene.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Opaque);
    let camera = scene.default_camera(1.5);
    let aovs = aovs_of(gpu, &scene, &camera);
    let tracer = Tracer::new(&scene, lanternfish_reference::Settings::default()).unwrap();
    // Vertices are snapped to 1/256 of a pixel.
    let near = [[0.0; 2], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
    let hits = near.map(|aside| {
        tracer.first_hits(&camera, SIZE[0] as usize, SIZE[1] as usize, aside.map(|aside| 0.5 + aside / 128.0))
    });
    let is_hit = |i: usize| {
        hits.iter().any(|hits| match hits[i] {
            Some((instance, material, distance)) => {
                let is_there = (aovs.distance[i] / distance - 1.0).abs() < 1e-3;
                (aovs.instance[i], aovs.material[i]) == (instance + 1, material + 1) && is_there
            }
            None => aovs.instance[i] == 0,
        })
    };
    let others: Vec<_> = (0..hits[0].len()).filter(|i| !is_hit(*i)).collect();
    let show = |i: &usize| (*i, aovs.instance[*i], aovs.material[*i], aovs.distance[*i], hits[0][*i]);
    // Coincident surfaces, of which either may be hit.
    assert!(others.len() <= 5, "{:?}", others.iter().map(show).collect::<Vec<_>>());
    let mut instances = aovs.instance.clone();
    instances.sort_unstable();
    instances.dedup();
    assert!(instances.len() > 20, "{} instances", instances.len());
}

#[gpu_test]
fn gpu_surfaces_count_from_half_opacity_on(gpu: &Gpu) {
    let leaf = |alpha| Material {
        base_color: [1.0, 1.0, 1.0, alpha].into(),
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    };
    let glass = Material { transmission: 1.0, ..Material::default() };
    let camera = looking([0.0, 0.0, 3.0], [0.0; 3]);
    for (front, instance) in [(leaf(0.4), 1), (leaf(0.6), 2), (glass, 2), (Material::default(), 2)] {
        let wall = quad(0, Vec3::NEG_Z, 4.0 * Vec3::X, 4.0 * Vec3::Y);
        let scene = placed(
            vec![wall, quad(1, Vec3::ZERO, 4.0 * Vec3::X, 4.0 * Vec3::Y)],
            vec![Material::default(), front.clone()],
        );
        let aovs = aovs_of(gpu, &scene, &camera);
        assert!(aovs.instance.iter().all(|other| *other == instance), "{front:?}: {:?}", aovs.instance[0]);
        let depth = if instance == 1 { 4.0 } else { 3.0 };
        assert!(aovs.depth.iter().all(|other| (other - depth).abs() < 1e-4), "{front:?}: {}", aovs.depth[0]);
    }
}

#[gpu_test]
fn gpu_motion_is_the_shift_to_the_next_frame(gpu: &Gpu) {
    let scene = floor_and_plate();
    let camera = looking([0.0, 0.8, 3.0], [0.0, 0.8, 0.0]);
    let mut renderer = renderer(&testing::engine(gpu), Settings::direct_light());
    let mut uploaded = renderer.upload(&scene).unwrap();
    let still = renderer.aovs(&uploaded, &camera, SIZE, None).unwrap();
    assert!(still.motion.iter().all(|motion| *motion == [0.0; 2]));
    let shift = Vec3::new(0.25, -0.1, 0.0);
    renderer.move_instances(&mut uploaded, &[(1, Affine3A::from_translation(shift))]).unwrap();
    let next = renderer.moment(&uploaded, &camera);
    renderer.move_instances(&mut uploaded, &[(1, Affine3A::IDENTITY)]).unwrap();
    let moved = renderer.aovs(&uploaded, &camera, SIZE, Some(&next)).unwrap();
    assert_eq!((&moved.depth, &moved.instance), (&still.depth, &still.instance), "the frame itself is as it was");
    // Pixels per metre at a depth of 1 m.
    let scale = 0.5 * SIZE[1] as f32 / (0.5f32 * 0.8).tan();
    for (i, motion) in moved.motion.iter().enumerate() {
        let is_plate = moved.instance[i] == 2;
        let expected = if is_plate { Vec2::new(shift.x, -shift.y) * scale / moved.depth[i] } else { Vec2::ZERO };
        assert!(Vec2::from(*motion).distance(expected) < 1e-3, "{i}: {motion:?} is not {expected}");
    }
    assert!(moved.instance.contains(&2));
    // Of a camera that moves, everything moves.
    let aside = renderer.moment(&uploaded, &looking([0.2, 0.8, 3.0], [0.2, 0.8, 0.0]));
    let moved = renderer.aovs(&uploaded, &camera, SIZE, Some(&aside)).unwrap();
    for i in (0..moved.depth.len()).filter(|i| moved.instance[*i] > 0) {
        let expected = Vec2::new(-0.2 * scale / moved.depth[i], 0.0);
        assert!(Vec2::from(moved.motion[i]).distance(expected) < 2e-3, "{i}: {:?} is not {expected}", moved.motion[i]);
    }
}

#[gpu_test]
fn gpu_they_do_not_depend_on_frames_and_samples(gpu: &Gpu) {
    let (scene, camera) = (floor_and_plate(), looking([0.5, 1.6, 2.5], [0.2, 0.5, 0.0]));
    let alone = aovs_of(gpu, &scene, &camera);
    let mut renderer =
        renderer(&testing::engine(gpu), Settings::direct_light().with_accumulate(4).with_samples(Samples::Four));
    let uploaded = renderer.upload(&scene).unwrap();
    let image = renderer.render(&uploaded, &camera, SIZE).unwrap();
    assert!(renderer.aovs(&uploaded, &camera, SIZE, None).unwrap() == alone);
    assert!(renderer.render(&uploaded, &camera, SIZE).unwrap().radiance == image.radiance, "nor does an image on them");
}

/// A card of 4 m whose base colour is a texture of a black and a white texel, left to right.
fn textured(wrap: Wrap, uv: [Vec2; 4]) -> Scene {
    let card = Primitive { uv0: uv.to_vec(), ..quad(0, Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y) };
    let material = Material { base_color_texture: Some(TextureRef::new(0)), ..Material::default() };
    let mut scene = placed(vec![card], vec![material]);
    scene.images =
        vec![Image { name: String::new(), width: 2, height: 1, rgba: vec![0, 0, 0, 255, 255, 255, 255, 255] }];
    let nearest = Sampler { mag: Filter::Nearest, min: Filter::Nearest, ..Sampler::default() };
    scene.samplers = vec![Sampler { wrap_u: wrap, wrap_v: wrap, ..nearest }];
    scene.textures = vec![Texture { image: 0, sampler: 0 }];
    scene
}

/// Left to right a texture of two texels is seen twice, the second time as its sampler says.
#[gpu_test]
fn gpu_textures_continue_beyond_their_edges_as_their_samplers_say(gpu: &Gpu) {
    let uv = [[0.0, 1.0], [2.0, 1.0], [2.0, 0.0], [0.0, 0.0]].map(Vec2::from);
    let wraps = [(Wrap::Repeat, [0, 1, 0, 1]), (Wrap::MirroredRepeat, [0, 1, 1, 0]), (Wrap::ClampToEdge, [0, 1, 1, 1])];
    for (wrap, expected) in wraps {
        let albedo = aovs_of(gpu, &textured(wrap, uv), &looking([0.0, 0.0, 4.0], [0.0; 3])).albedo;
        let row = SIZE[1] as usize / 2 * SIZE[0] as usize;
        // Quarters of the middle 90 pixels, in which the card is seen.
        let seen = [1, 3, 5, 7].map(|eighth| albedo[row + 15 + eighth * 90 / 8][0].round() as u32);
        assert_eq!(seen, expected, "{wrap:?}");
    }
}

/// A texture coordinate that is the same all over a surface, up to the rounding of interpolation, has a colour too: also
/// with a filter that reads the black texel where rounding, a millionth, may leave a footprint of size zero.
#[gpu_test]
fn gpu_one_texel_for_a_whole_surface_is_a_colour(gpu: &Gpu) {
    let strict = "let moved = at + vec2f(step, 0.0); let is_wide = any(fwidth(moved) > vec2f(2e-6));
        return select(vec2f(0.25, 0.5), moved, is_wide);";
    let engine = edited_engine(gpu, &[("gpu_scene/material_textures", "return at + vec2f(step, 0.0);", strict)]);
    for at in [[0.75, 0.5], [0.7, 0.3], [5.61, 0.9]] {
        let scene = textured(Wrap::Repeat, [Vec2::from(at); 4]);
        let albedo = aovs_with(&engine, &scene, &looking([0.3, 0.1, 0.9], [0.4, 0.2, 0.0])).albedo;
        let wrong = albedo.iter().filter(|albedo| **albedo != [1.0; 3]).count();
        assert_eq!(wrong, 0, "{at:?}: of {} pixels", albedo.len());
    }
}
