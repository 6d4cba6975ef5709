//! Deformation on the device against deformation on the host.

mod rebuilt;

use glam::{Affine3A, Quat, Vec3, Vec4};
use lanternfish_gpu::{Gpu, read_back, testing};
use lanternfish_scene::{
    Bounds, Camera, Instance, Light, Material, Mesh, Primitive, Scene,
    motion::{
        Animation, Bound, BoundLight, Channel, Deformation, DeformedMesh, Influences, Interpolation, MorphTarget,
        Motion, Node, Property, Sampler, Skin, Transform,
    },
};
use obvhs::cwbvh::node::CwBvhNode;

use super::{
    super::tracing::{TracedTriangle, refit::outside},
    Sent,
};
use crate::{
    GpuScene, RenderError, Renderer, Settings,
    settings::{DebugView, Shadows, Tracer},
    techniques::Sampled,
    testing::{ANIMATED, quad, scene_of},
};

/// Fractions of an animation's duration.
const TIMES: [f32; 5] = [0.0, 0.21, 0.45, 0.7, 0.93];
const JOINTS: usize = 6;

/// A sheet of 16 × 16 vertices with its deformation: six joints, two sets with the five joints of a vertex, and two targets. `is_flat`:
/// triangles share no vertex, and the normals are the triangles'.
fn sheet(material: usize, center: Vec3, is_skinned: bool, is_flat: bool) -> Primitive {
    const EDGE: u32 = 16;
    let position = |i: u32| Vec3::new((i % EDGE) as f32 / 15.0 - 0.5, 0.0, (i / EDGE) as f32 / 15.0 - 0.5);
    let squares = (0..EDGE * (EDGE - 1)).filter(|i| i % EDGE != EDGE - 1);
    let corners: Vec<u32> = squares.flat_map(|i| [i, i + EDGE, i + 1, i + 1, i + EDGE, i + EDGE + 1]).collect();
    let vertices: Vec<u32> = if is_flat { corners.clone() } else { (0..EDGE * EDGE).collect() };
    let count = vertices.len();
    let positions: Vec<Vec3> = vertices.iter().map(|i| position(*i)).collect();
    let tilted = |p: &Vec3| Vec3::new(0.2 * p.x, 1.0, 0.1).normalize();
    let tangent = |p: &Vec3| Vec3::new(1.0, -0.2 * p.x, 0.0).normalize().extend(-1.0);
    let joint = |p: &Vec3, k: usize| ((2.9 * (p.x + 0.5)) as usize + k) as u16 % JOINTS as u16;
    let set = |first: usize, weights: Vec4| Influences {
        joints: positions.iter().map(|p| std::array::from_fn(|k| joint(p, first + k))).collect(),
        weights: vec![weights; count],
    };
    let lift = |size: f32| MorphTarget {
        positions: positions.iter().map(|p| size * Vec3::Y * (9.0 * p.x).sin()).collect(),
        normals: positions.iter().map(|p| -9.0 * size * Vec3::X * (9.0 * p.x).cos()).collect(),
        tangents: positions.iter().map(|p| 9.0 * size * Vec3::Y * (9.0 * p.x).cos()).collect(),
    };
    let only_positions = MorphTarget { positions: vec![0.1 * Vec3::Z; count], ..MorphTarget::default() };
    let sets = vec![set(0, Vec4::new(0.5, 0.2, 0.0, 0.1)), set(4, Vec4::new(0.2, 0.0, 0.0, 0.0))];
    let primitive = Primitive {
        material,
        positions: positions.iter().map(|p| center + *p).collect(),
        normals: if is_flat { vec![Vec3::Y; count] } else { positions.iter().map(tilted).collect() },
        tangents: if is_flat { Vec::new() } else { positions.iter().map(tangent).collect() },
        indices: if is_flat { (0..count as u32).collect() } else { corners },
        ..Primitive::default()
    };
    let deformation = Deformation {
        positions: primitive.positions.clone(),
        normals: primitive.normals.clone(),
        tangents: primitive.tangents.clone(),
        influences: if is_skinned { sets } else { Vec::new() },
        targets: vec![if is_flat { only_positions } else { lift(0.1) }, lift(0.03)],
        has_flat_normals: is_flat,
    };
    Primitive { deformation: Some(Box::new(deformation)), ..primitive }
}

/// A floor; above it a skinned sheet, a skinned sheet with flat normals, a sheet with targets only and two instances of which one moves,
/// and a tile that moves; a lamp that moves, and one that shrinks to zero.
fn scene() -> Scene {
    let material =
        |base_color: Vec3| Material { base_color: base_color.extend(1.0), double_sided: true, ..Material::default() };
    let materials = vec![material(Vec3::splat(0.7)), material(Vec3::new(0.8, 0.3, 0.1))];
    let mut scene = scene_of(vec![quad(0, Vec3::ZERO, 2.0 * Vec3::X, -2.0 * Vec3::Z)], materials);
    let at = |x: f32| Vec3::new(x, 0.6, 0.0);
    for (primitives, x) in [
        (vec![sheet(1, at(-1.0), true, false), quad(1, at(-1.0), 0.1 * Vec3::X, 0.1 * Vec3::Y)], 0.0),
        (vec![sheet(1, at(0.3), true, true)], 0.0),
        (vec![sheet(0, Vec3::ZERO, false, false)], 1.4),
        (vec![quad(1, Vec3::ZERO, 0.2 * Vec3::X, 0.2 * Vec3::Z)], 0.5),
    ] {
        let world_from_object = Affine3A::from_translation(Vec3::new(x, 0.0, 0.0));
        scene.instances.push(Instance { name: String::new(), mesh: scene.meshes.len(), world_from_object });
        scene.meshes.push(Mesh { name: String::new(), primitives });
    }
    scene.instances.push(Instance {
        mesh: 3,
        world_from_object: Affine3A::from_translation(at(1.0)),
        ..scene.instances[0].clone()
    });
    let mut nodes = vec![Node { weights: vec![0.0, 0.5], ..Node::default() }];
    let mut channels = Vec::new();
    let mut animate = |node: usize, property: Property, values: &[f32]| {
        let sampler = Sampler { interpolation: Interpolation::Linear, times: vec![0.0, 2.0], values: values.to_vec() };
        channels.push(Channel { node, property, sampler: sampler.into() });
    };
    for i in 1..=JOINTS {
        nodes.push(Node { parent: Some(i - 1), rest: Transform::IDENTITY, ..Node::default() });
        let rotation = Quat::from_scaled_axis(0.2 * Vec3::new(0.3, 0.1 * i as f32, -0.5));
        animate(i, Property::Rotation, &[Quat::IDENTITY.to_array(), rotation.to_array()].concat());
        animate(i, Property::Scale, &[1.0, 1.0, 1.0, 1.1, 0.9, 1.05]);
    }
    animate(0, Property::Weights, &[0.0, 0.5, 1.0, -0.5]);
    nodes.push(Node { parent: None, ..Node::default() });
    animate(JOINTS + 1, Property::Translation, &[0.0, 0.3, 0.0, 0.3, 1.0, 0.5]);
    nodes.push(Node { parent: None, ..Node::default() });
    animate(JOINTS + 2, Property::Scale, &[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let bound = |index| Bound { index, node: JOINTS + 1, node_from_object: Affine3A::from_translation(0.1 * Vec3::X) };
    let lamps = [
        Light::point(Vec3::new(0.4, 1.4, 0.3), Vec3::splat(2.0)),
        Light::disk(Vec3::new(-0.5, 2.0, 0.3), Vec3::NEG_Y, 0.2, Vec3::splat(9.0)),
    ];
    let lights = lamps.iter().enumerate();
    scene.motion = Motion {
        nodes,
        skins: vec![Skin { joints: (1..=JOINTS).collect(), joint_from_object: vec![Affine3A::IDENTITY; JOINTS] }],
        animations: vec![Animation { name: "all".to_owned(), channels }],
        instances: vec![bound(3), bound(4)],
        lights: lights.map(|(i, light)| BoundLight { index: i, node: JOINTS + 1 + i, light: light.clone() }).collect(),
        meshes: [(1, Some(0)), (2, Some(0)), (3, None)].map(|(mesh, skin)| DeformedMesh { mesh, node: 0, skin }).into(),
        ..Motion::default()
    };
    scene.lights = lamps.into();
    scene.lights.push(Light::point(Vec3::new(0.0, 1.0, 1.0), Vec3::ONE));
    scene.pose_at_rest();
    assert_eq!(scene.validate(), Ok(()));
    scene
}

/// Contents of the device's buffers.
pub(in crate::gpu_scene) struct Read {
    positions: Vec<f32>,
    attributes: Vec<[u32; 10]>,
    /// Traced triangles, in leaf order.
    pub(in crate::gpu_scene) corners: Vec<TracedTriangle>,
    pub(in crate::gpu_scene) nodes: Vec<u32>,
}

pub(in crate::gpu_scene) fn read(gpu: &Gpu, scene: &GpuScene) -> Read {
    let words =
        |buffer: &wgpu::Buffer| read_back::<u32>(&gpu.device, &gpu.queue, buffer, buffer.size() as usize / 4).unwrap();
    let bvh = scene.bvh.as_ref().unwrap();
    let triangles = words(&bvh.triangles);
    let floats: &[f32] = bytemuck::cast_slice(&triangles);
    let corners = floats.as_chunks::<12>().0.iter().zip(scene.placed.sources());
    let corners = corners
        .map(|(t, source)| TracedTriangle { corners: [0, 4, 8].map(|i| Vec3::from_slice(&t[i..])), source: *source });
    Read {
        positions: bytemuck::cast_vec(words(&scene.geometry.positions)),
        attributes: words(&scene.geometry.attributes).as_chunks::<10>().0.to_vec(),
        corners: corners.collect(),
        nodes: words(&bvh.nodes),
    }
}

/// Greatest difference between two contents: positions and corners, m; normals and tangents, 1/32767.
fn apart(a: &Read, b: &Read) -> (f32, i32) {
    let farthest = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // The order of the triangles depends on the tree.
    let flat = |read: &Read| {
        let mut triangles = read.corners.clone();
        triangles.sort_by_key(|triangle| (triangle.source.part, triangle.source.triangle));
        triangles.iter().flat_map(|t| t.corners.map(|c| c.to_array())).flatten().collect::<Vec<f32>>()
    };
    let mut steps = 0;
    for (a, b) in a.attributes.iter().zip(&b.attributes) {
        for (a, b) in a[..4].iter().zip(&b[..4]) {
            for shift in [0, 16] {
                steps = steps.max((i32::from((a >> shift) as i16) - i32::from((b >> shift) as i16)).abs());
            }
        }
        assert_eq!(a[4..], b[4..], "texture coordinates and colours");
    }
    (farthest(&a.positions, &b.positions).max(farthest(&flat(a), &flat(b))), steps)
}

fn holds(outer: &Bounds, inner: &Bounds) -> bool {
    outer.min.cmple(inner.min).all() && outer.max.cmpge(inner.max).all()
}

/// Animates a scene on the device and by updates, and compares the results at all times.
fn compare(gpu: &Gpu, renderer: &Renderer, name: &str, rest: &Scene) {
    let (mut by_device, mut by_host) = (renderer.upload(rest).unwrap(), renderer.upload(rest).unwrap());
    let (first, mut posed) = (read(gpu, &by_device), rest.clone());
    let (mut farthest, mut most_steps, mut largest, mut moved) = (0.0f32, 0, 0.0f32, 0.0f32);
    let mut later = Sent::default();
    for fraction in TIMES {
        let time = fraction * rest.motion.animations[0].duration();
        let generation = by_device.generation();
        later = renderer.animate(&mut by_device, rest, Some((0, time))).unwrap();
        posed.pose(0, time);
        renderer.update(&mut by_host, &posed).unwrap();
        // A second call uploads nothing.
        let numbers = (by_device.generation(), by_device.revision());
        assert!(numbers.0 != generation || later == Sent::default(), "{name} at {fraction}");
        let again = renderer.animate(&mut by_device, rest, Some((0, time))).unwrap();
        assert!(again == Sent::default() || again.has_rebuilt, "{again:?}");
        assert!((by_device.generation(), by_device.revision()) == numbers || again.has_rebuilt);

        let (device, host) = (read(gpu, &by_device), read(gpu, &by_host));
        let size = by_host.bounds.size().length();
        let (distance, steps) = apart(&device, &host);
        (farthest, most_steps) = (farthest.max(distance / size), most_steps.max(steps));
        moved = moved.max(apart(&device, &first).0 / size);
        assert_eq!(
            outside(bytemuck::cast_slice::<_, CwBvhNode>(&device.nodes), &device.corners),
            (0, device.corners.len())
        );
        assert!(holds(&by_device.bounds, &by_host.bounds), "{name} at {fraction}");
        largest = largest.max(by_device.bounds.size().length() / size);
        assert_eq!(by_device.geometry.draws.len(), by_host.geometry.draws.len());
        for (reach, exact) in by_device.geometry.draws.iter().zip(&by_host.geometry.draws) {
            assert!(
                holds(&reach.bounds, &exact.bounds),
                "{name} at {fraction}: {:?}, {:?}",
                reach.bounds,
                exact.bounds
            );
            largest = largest.max(reach.bounds.size().length() / exact.bounds.size().length());
        }
        assert!(by_device.placed.stands().eq(by_host.placed.stands()), "{name} at {fraction}");
        // Lights without emission agree in that alone.
        for (device, host) in by_device.lights.on_host.iter().zip(&*by_host.lights.on_host) {
            assert!(
                device == host || (device.intensity, host.intensity) == (Vec3::ZERO, Vec3::ZERO),
                "{name} at {fraction}"
            );
        }
    }
    println!(
        "{name}: {farthest:.1e} of the scene's size apart, {most_steps} steps of normals; boxes up to {largest:.2} times as large; \
         it moves by {moved:.1e} of its size; {} bytes and {} dispatches a moment",
        later.bytes, later.dispatches
    );
    assert!(farthest <= 1e-5, "{name}: {farthest}");
    // Bound 2e-4: a step is 3e-5, and a device may round each of the 30 operations before it, 6e-8 of values that may be several times the
    // normal.
    assert!(most_steps <= 6, "{name}: {most_steps}");
    assert!(largest < 3.0, "{name}: {largest}");
    // The test can fail: another time gives other positions.
    assert!(moved > 1e-3, "{name}: {moved}");
    // An update restores vertices that the device has deformed.
    renderer.update(&mut by_device, rest).unwrap();
    assert_eq!(apart(&read(gpu, &by_device), &first), (0.0, 0), "{name}");
    assert_eq!(by_device.bounds, rest.bounds());
    renderer.animate(&mut by_device, rest, Some((0, TIMES[4] * rest.motion.animations[0].duration()))).unwrap();
    assert!(
        apart(&read(gpu, &by_device), &read(gpu, &by_host)).0 / by_host.bounds.size().length() <= 1e-5,
        "{name}: again"
    );
}

fn tracing(gpu: &Gpu) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_shadows(Shadows::BVH)).unwrap()
}

#[gpu_test]
fn gpu_deformations_on_device_and_host_agree(gpu: &Gpu) {
    compare(gpu, &tracing(gpu), "generated", &scene());
}

#[gpu_test(full)]
fn gpu_deformations_of_files_on_device_and_host_agree(gpu: &Gpu) {
    let renderer = tracing(gpu);
    for sample in ANIMATED {
        let path = format!("assets/conformance/{sample}");
        let Some(path) = testing::shared("deformations of files", &path) else { return };
        compare(gpu, &renderer, sample, &lanternfish_scene::load(path.to_str().unwrap()).unwrap());
    }
}

#[gpu_test]
fn gpu_unsupported_animations_are_refused_by_name(gpu: &Gpu) {
    let direct = Settings::direct_light().with_shadows(Shadows::BVH);
    let sampled = Sampled { diffuse_rays: 1, glossy_rays: 1, tracer: Tracer::BVH.into(), ..Sampled::default() };
    let lit = direct.clone().with_indirect(sampled);
    let mut dark = scene();
    dark.motion.lights.clear();
    let mut shining = dark.clone();
    shining.materials[1].emissive = Vec3::ONE;
    for (name, scene, settings, refused) in [
        ("lights without trees", scene(), &direct, None),
        ("lights in trees", scene(), &lit, None),
        ("nothing in light trees moves", dark, &lit, None),
        ("an emissive instance moves", shining, &lit, Some("instance 1 is emissive")),
    ] {
        let renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let result = renderer.animate(&mut uploaded, &scene, Some((0, 1.0)));
        match (&result, refused) {
            (Ok(sent), None) => assert!(sent.bytes > 0 && sent.dispatches > 2, "{name}: {sent:?}"),
            (Err(error @ RenderError::NeedsUpdate { .. }), Some(what)) => {
                assert!(error.to_string().contains(what), "{name}: {error}");
            }
            _ => panic!("{name}: {result:?}"),
        }
        let mut posed = scene.clone();
        posed.pose(0, 1.0);
        renderer.update(&mut uploaded, &posed).unwrap();
        let mut error = |scene: &Scene, moment| renderer.animate(&mut uploaded, scene, Some(moment)).unwrap_err();
        assert!(matches!(error(&scene, (1, 0.0)), RenderError::NoAnimation { number: 1, count: 1 }));
        let mut other = scene.clone();
        other.meshes[1].primitives[0].positions.pop();
        assert!(matches!(error(&other, (0, 0.0)), RenderError::NeedsUpdate { .. }));
        let mut other = scene.clone();
        other.motion.meshes.pop();
        if refused.is_none() {
            assert!(error(&other, (0, 0.0)).to_string().contains("other meshes bend"));
        }
        let mut other = scene.clone();
        other.motion.instances[0].node = 99;
        assert!(matches!(error(&other, (0, 0.0)), RenderError::InvalidScene { .. }));
    }
}

/// Motion of vertices deformed on the device is bitwise that of vertices deformed on the host, and is not zero.
#[gpu_test]
fn gpu_motion_includes_deformation_on_the_device(gpu: &Gpu) {
    let scene = scene();
    let settings = Settings::direct_light().with_debug_view(Some(DebugView::Motion));
    let shown = |by_device: bool| {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let camera = Camera::look_at(Vec3::new(0.3, 1.2, 3.0), 0.5 * Vec3::Y, scene.default_camera(1.5).projection);
        let mut renderings = Vec::new();
        for time in [0.3, 0.5, 0.5, 1.1] {
            if by_device {
                renderer.animate(&mut uploaded, &scene, Some((0, time))).unwrap();
            } else {
                let mut posed = scene.clone();
                posed.pose(0, time);
                renderer.update(&mut uploaded, &posed).unwrap();
            }
            renderings.push(renderer.render(&uploaded, &camera, [60, 40]).unwrap().display);
        }
        renderings
    };
    let (device, host) = (shown(true), shown(false));
    assert!(device == host, "motion differs");
    let moving = |i: usize| device[i].iter().filter(|pixel| pixel[..3] != [0; 3]).count();
    assert!(moving(1) > 200 && moving(2) == 0 && moving(3) > 200, "{} {} {}", moving(1), moving(2), moving(3));
}

/// Mirroring an instance reorders the draws: the frame has no motion, instead of the motion of other instances.
#[gpu_test]
fn gpu_mirroring_an_instance_resets_motion(gpu: &Gpu) {
    let scene = scene();
    let settings = Settings::direct_light().with_debug_view(Some(DebugView::Motion));
    let camera = Camera::look_at(Vec3::new(0.3, 1.2, 3.0), 0.5 * Vec3::Y, scene.default_camera(1.5).projection);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    let mut moving = |transform: Affine3A| {
        renderer.render(&uploaded, &camera, [60, 40]).unwrap();
        renderer.move_instances(&mut uploaded, &[(3, transform)]).unwrap();
        let rendering = renderer.render(&uploaded, &camera, [60, 40]).unwrap();
        rendering.display.iter().filter(|pixel| pixel[..3] != [0; 3]).count()
    };
    let transform = scene.instances[3].world_from_object;
    assert!(moving(Affine3A::from_translation(0.1 * Vec3::Y) * transform) > 50, "it moves");
    assert_eq!(moving(transform * Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0))), 0);
}
