//! Ray tracing through a tree that was built in the background, against a fresh upload.

use std::time::Duration;

use glam::{Affine3A, Mat3A, Vec3};
use lanternfish_gpu::{Gpu, read_back, testing};
use lanternfish_scene::Scene;
use obvhs::cwbvh::node::CwBvhNode;

use super::{
    super::super::{
        tracing::{assert_same_corners, differing, pose},
        update::tests::{few_rays, scene},
    },
    read,
};
use crate::{
    GpuScene, Renderer, Settings,
    gpu_scene::tracing::refit::{box_of, cost, outside},
    settings::{DebugView, Shadows},
    testing::moved,
};

fn is_emissive(scene: &Scene, instance: usize) -> bool {
    let mut primitives = scene.meshes[scene.instances[instance].mesh].primitives.iter();
    primitives.any(|primitive| scene.materials[primitive.material].emissive != Vec3::ZERO)
}

/// The scene with every instance that is not emissive moved.
fn elsewhere(before: &Scene, seed: u64) -> Scene {
    let mut after = moved(before, seed, 0.3);
    for i in (0..after.instances.len()).filter(|i| is_emissive(before, *i)) {
        after.instances[i] = before.instances[i].clone();
    }
    after
}

/// Transforms of all instances that are not emissive.
fn transforms(scene: &Scene) -> Vec<(usize, Affine3A)> {
    let transforms = scene.instances.iter().map(|instance| instance.world_from_object).enumerate();
    transforms.filter(|(i, _)| !is_emissive(scene, *i)).collect()
}

/// Calls until another tree has replaced the first one; returns the number of calls.
fn wait(renderer: &Renderer, uploaded: &mut GpuScene, transforms: &[(usize, Affine3A)]) -> Option<usize> {
    (0..20_000).find(|_| {
        std::thread::sleep(Duration::from_millis(2));
        renderer.move_instances(uploaded, transforms).unwrap().has_rebuilt
    })
}

/// Pixels that are not those of a fresh upload.
fn wrong(gpu: &Gpu, renderer: &mut Renderer, uploaded: &GpuScene, now: &Scene) -> usize {
    let fresh = renderer.upload(now).unwrap();
    let mut shown = |uploaded| renderer.render(uploaded, &now.cameras[0], [48, 48]).unwrap().radiance;
    let (seen, expected) = (shown(uploaded), shown(&fresh));
    assert!(expected.iter().filter(|pixel| pixel[..3] != [0.0; 3]).count() > 250, "the image is not black");
    // A card may decide ties between triangles by the order of its tree: rays draw other noise then, as with corners a rounding apart.
    let is_exact = gpu.description.kind == wgpu::DeviceType::Cpu;
    let placed = pose(now, uploaded.placed.parts(), uploaded.placed.sources());
    let placed = if is_exact { placed } else { Vec::new() };
    differing([&seen, &expected], [&read(gpu, uploaded).corners, &placed])
}

/// The triangles are at the host's positions, and inside the tree's boxes.
fn check(gpu: &Gpu, uploaded: &GpuScene, now: &Scene) {
    let (actual, placed) = (read(gpu, uploaded), &uploaded.placed);
    let parts: Vec<_> = now.instances.iter().flat_map(|i| &now.meshes[i.mesh].primitives).collect();
    assert_eq!(parts.len(), now.instances.len(), "a part is an instance");
    let expected = pose(now, placed.parts(), placed.sources());
    assert_same_corners(&actual.corners, &expected);
    let nodes: &[CwBvhNode] = bytemuck::cast_slice(&actual.nodes);
    assert_eq!(outside(nodes, &actual.corners), (0, expected.len()));
    // The test can fail: the boxes do not contain triangles that have moved.
    assert!(outside(nodes, &pose(&moved(now, 1, 0.3), placed.parts(), placed.sources())).0 > 0);
}

/// Moves by the device, and moves by either after a tree from the background has replaced the first one. An instance scaled to zero is
/// invisible from the upload on; a move makes it visible, and another mirrors it.
#[gpu_test(full)]
fn gpu_moves_and_a_rebuild_render_like_a_fresh_upload(gpu: &Gpu) {
    let before = scene();
    let [mut hidden, mut mirrored] = [(); 2].map(|()| elsewhere(&before, 5));
    for i in (3..before.instances.len()).filter(|i| !is_emissive(&before, *i)) {
        hidden.instances[i].world_from_object.matrix3 *= 0.0;
    }
    mirrored.instances[4].world_from_object.matrix3.x_axis *= -1.0;
    let mut without = hidden.clone();
    without.instances.retain(|instance| instance.world_from_object.matrix3 != Mat3A::ZERO);
    let at = |seed: u64| elsewhere(&before, seed);
    for shadows in [Shadows::BVH, Shadows::RAY_QUERY] {
        if shadows == Shadows::RAY_QUERY && !gpu.description.ray_query {
            testing::left_out("moves and a rebuild", "this adapter has no ray query");
            continue;
        }
        // The adapter's own structure has triangles in another order: at shared edges a ray may hit either.
        let allowed = if shadows == Shadows::RAY_QUERY { 48 * 48 / 500 } else { 0 };
        let direct = Settings::direct_light().with_shadows(shadows);
        let [mut plain, mut renderer] = [direct.clone(), direct.with_indirect(few_rays())]
            .map(|settings| Renderer::with_engine(&testing::engine(gpu), settings).unwrap());
        let [seen, expected] = [&hidden, &without].map(|scene| {
            let uploaded = plain.upload(scene).unwrap();
            plain.render(&uploaded, &before.cameras[0], [48, 48]).unwrap().radiance
        });
        assert!(seen.iter().zip(&expected).filter(|(seen, expected)| seen != expected).count() <= allowed, "{shadows}");
        let step = |renderer: &mut Renderer, uploaded: &mut GpuScene, now: &Scene, by_device: bool| {
            match by_device {
                true => drop(renderer.move_instances(uploaded, &transforms(now)).unwrap()),
                false => renderer.update(uploaded, now).unwrap(),
            }
            check(gpu, uploaded, now);
            let wrong = wrong(gpu, renderer, uploaded, now);
            assert!(wrong <= allowed, "{shadows}: {wrong} pixels");
        };
        let mut uploaded = renderer.upload(&hidden).unwrap();
        for now in [&at(5), &mirrored, &hidden] {
            step(&mut renderer, &mut uploaded, now, true);
        }
        let mut uploaded = renderer.upload(&before).unwrap();
        let (now, sources) = (at(2), uploaded.placed.sources().to_vec());
        renderer.move_instances(&mut uploaded, &transforms(&now)).unwrap();
        let calls = wait(&renderer, &mut uploaded, &transforms(&now));
        println!("{shadows}: the tree was rebuilt after {calls:?} calls");
        assert!(calls.is_some(), "{shadows}");
        assert_ne!(uploaded.placed.sources(), sources, "{shadows}: the triangles have another order");
        // It goes on from there.
        for (now, by_device) in [(now, true), (at(6), false), (at(5), true)] {
            step(&mut renderer, &mut uploaded, &now, by_device);
        }
    }
}

#[gpu_test]
fn gpu_bvh_of_low_cost_is_kept_and_device_and_host_costs_agree(gpu: &Gpu) {
    let before = scene();
    let renderer = Renderer::with_engine(&testing::engine(gpu), Settings::direct_light().with_shadows(Shadows::BVH));
    let renderer = renderer.unwrap();
    let mut uploaded = renderer.upload(&before).unwrap();
    let on_device = |uploaded: &GpuScene| -> f64 {
        let tree = uploaded.moving.as_ref().and_then(|moving| moving.tree.as_ref()).unwrap();
        let nodes = uploaded.bvh.as_ref().unwrap().tree().len();
        let boxes = read_back::<[f32; 8]>(&gpu.device, &gpu.queue, &tree.boxes, nodes).unwrap();
        boxes.iter().map(|node| f64::from(node[3])).sum()
    };
    let on_host = |uploaded: &GpuScene| {
        let actual = read(gpu, uploaded);
        let nodes: &[CwBvhNode] = bytemuck::cast_slice(&actual.nodes);
        cost(&nodes[..uploaded.bvh.as_ref().unwrap().tree().len()], |index| box_of(&actual.corners[index].corners))
    };
    let when_built = uploaded.bvh.as_ref().unwrap().cost_when_built();
    // Back and forth.
    for i in 0..30 {
        let shift = Affine3A::from_translation(1e-3 * Vec3::X * (i % 2) as f32);
        let mut all = transforms(&before);
        all.retain(|(instance, _)| *instance > 1);
        all.iter_mut().for_each(|(_, transform)| *transform = shift * *transform);
        let sent = renderer.move_instances(&mut uploaded, &all).unwrap();
        assert!(!sent.has_rebuilt && sent.bytes < 4096, "{i}: {sent:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
    let [device, host] = [on_device(&uploaded), on_host(&uploaded)];
    assert!((device - host).abs() < 1e-4 * host && (host - when_built).abs() < 0.01 * when_built, "{device}, {host}");
    // Triangles far apart in one leaf are costly.
    renderer.move_instances(&mut uploaded, &transforms(&elsewhere(&before, 2))).unwrap();
    let [device, host] = [on_device(&uploaded), on_host(&uploaded)];
    assert!((device - host).abs() < 1e-4 * host && host > 1.5 * when_built, "{device}, {host}, built for {when_built}");
    // Moves during a cost measurement start another one, although nothing moves any more.
    assert!(wait(&renderer, &mut uploaded, &[]).is_some());
}

/// The first frame after a rebuild has the motion of the instances that have moved.
#[gpu_test]
fn gpu_motion_continues_after_a_rebuild(gpu: &Gpu) {
    let before = scene();
    let settings = Settings::direct_light().with_debug_view(Some(DebugView::Motion)).with_shadows(Shadows::BVH);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let mut uploaded = renderer.upload(&before).unwrap();
    let now = elsewhere(&before, 2);
    renderer.move_instances(&mut uploaded, &transforms(&now)).unwrap();
    let mut taken = false;
    for i in 0..2000 {
        renderer.render(&uploaded, &now.cameras[0], [48, 48]).unwrap();
        let mut all = transforms(&now);
        all.iter_mut().for_each(|(_, transform)| {
            *transform = Affine3A::from_translation(0.05 * Vec3::X * (i % 2) as f32) * *transform
        });
        taken = renderer.move_instances(&mut uploaded, &all).unwrap().has_rebuilt;
        let rendering = renderer.render(&uploaded, &now.cameras[0], [48, 48]).unwrap();
        let moving = rendering.display.iter().filter(|pixel| pixel[..3] != [0; 3]).count();
        assert!(i == 0 || moving > 200, "{moving} pixels move in frame {i}, rebuilt: {taken}");
        if taken {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(taken);
}
