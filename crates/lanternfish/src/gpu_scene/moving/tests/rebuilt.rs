//! What is traced through a tree that was built in the background, against a fresh upload.

use std::time::Duration;

use glam::{Affine3A, Vec3};
use lanternfish_gpu::{Gpu, read_back, testing};
use lanternfish_scene::{AlphaMode, Material, Scene, generate};
use obvhs::cwbvh::node::CwBvhNode;

use super::{
    super::super::tracing::{assert_same_corners, differing, pose},
    read,
};
use crate::{
    GpuScene, Renderer, Settings,
    gpu_scene::refit::{box_of, cost, outside},
    settings::{DebugView, Indirect, Shadows, Tracer},
    techniques::Sampled,
    testing::{apart, moved},
};

/// The Cornell box in light rain and in parts, of which one has holes, and one shines.
fn scene() -> Scene {
    let mut scene = apart(&generate::demo("cornell").unwrap());
    scene.lights.extend(generate::light_rain(&scene.bounds(), 40, Some(0.8), 1, 0.0));
    scene.meshes[4].primitives[0].material = scene.materials.len();
    let base_color = Vec3::new(0.3, 0.6, 0.8).extend(0.6);
    let alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    scene.materials.push(Material { base_color, alpha_mode, double_sided: true, ..Material::default() });
    scene
}

fn shines(scene: &Scene, instance: usize) -> bool {
    let mut primitives = scene.meshes[scene.instances[instance].mesh].primitives.iter();
    primitives.any(|primitive| scene.materials[primitive.material].emissive != Vec3::ZERO)
}

/// Where all that does not shine has moved to.
fn elsewhere(before: &Scene, seed: u64) -> Scene {
    let mut after = moved(before, seed, 0.3);
    for i in (0..after.instances.len()).filter(|i| shines(before, *i)) {
        after.instances[i] = before.instances[i].clone();
    }
    after
}

/// Of all that does not shine.
fn places(scene: &Scene) -> Vec<(usize, Affine3A)> {
    let places = scene.instances.iter().map(|instance| instance.world_from_object).enumerate();
    places.filter(|(i, _)| !shines(scene, *i)).collect()
}

/// Calls until another tree is there; how many calls that took.
fn wait(renderer: &Renderer, uploaded: &mut GpuScene, places: &[(usize, Affine3A)]) -> Option<usize> {
    (0..2000).find(|_| {
        std::thread::sleep(Duration::from_millis(2));
        renderer.move_instances(uploaded, places).unwrap().has_rebuilt
    })
}

/// Pixels that are not those of a fresh upload.
fn wrong(gpu: &Gpu, renderer: &mut Renderer, uploaded: &GpuScene, now: &Scene) -> usize {
    let fresh = renderer.upload(now).unwrap();
    let mut shown = |uploaded| renderer.render(uploaded, &now.cameras[0], 64, 64).unwrap().radiance;
    let (seen, expected) = (shown(uploaded), shown(&fresh));
    assert!(expected.iter().filter(|pixel| pixel[..3] != [0.0; 3]).count() > 500, "there is something to see");
    // A card may decide ties between triangles by the order of its tree: rays draw other noise then, as with corners a rounding apart.
    let is_exact = gpu.description.kind == wgpu::DeviceType::Cpu;
    let placed = pose(now, uploaded.placed.parts(), uploaded.placed.sources());
    let placed = if is_exact { placed } else { Vec::new() };
    differing([&seen, &expected], [&read(gpu, uploaded).corners, &placed])
}

/// The triangles are where the host puts those of their sources, and inside the tree's boxes.
fn check(gpu: &Gpu, uploaded: &GpuScene, now: &Scene) {
    let (found, placed) = (read(gpu, uploaded), &uploaded.placed);
    let parts: Vec<_> = now.instances.iter().flat_map(|i| &now.meshes[i.mesh].primitives).collect();
    assert_eq!(parts.len(), now.instances.len(), "a part is an instance");
    let expected = pose(now, placed.parts(), placed.sources());
    assert_same_corners(&found.corners, &expected);
    let nodes: &[CwBvhNode] = bytemuck::cast_slice(&found.nodes);
    assert_eq!(outside(nodes, &found.corners), (0, expected.len()));
}

#[test]
fn gpu_a_tree_that_was_built_in_the_background_shows_what_a_fresh_upload_shows() {
    let test = "gpu_a_tree_that_was_built_in_the_background_shows_what_a_fresh_upload_shows";
    let Some(gpu) = testing::gpu(test) else { return };
    let before = scene();
    let direct = |shadows| Settings { shadows, ..Settings::direct_light() };
    let usual = Sampled { tracer: Tracer::BVH.into(), ..Sampled::default() };
    let sampled = Sampled { diffuse_rays: 1, first_rays: 1, glossy_rays: 1, cache_samples: 2, ..usual };
    let requested = [
        ("bvh", direct(Shadows::BVH)),
        ("sampled", Settings { indirect: Indirect::from(sampled), ..direct(Shadows::BVH) }),
        ("sampled, and ray query", Settings { indirect: Indirect::from(sampled), ..direct(Shadows::RAY_QUERY) }),
    ];
    for (name, settings) in requested {
        if settings.shadows == Shadows::RAY_QUERY && !gpu.description.ray_query {
            testing::left_out(test, "this adapter has no ray query");
            continue;
        }
        // The adapter's own structure has triangles in another order: at edges either of two may be met.
        let allowed = if settings.shadows == Shadows::RAY_QUERY { 64 * 64 / 500 } else { 0 };
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut uploaded = renderer.upload(&before).unwrap();
        let now = elsewhere(&before, 2);
        let sources = uploaded.placed.sources().to_vec();
        renderer.move_instances(&mut uploaded, &places(&now)).unwrap();
        let calls = wait(&renderer, &mut uploaded, &places(&now));
        println!("{name}: another tree after {calls:?} calls");
        assert!(calls.is_some(), "{name}");
        assert_ne!(uploaded.placed.sources(), sources, "{name}: the triangles have another order");
        check(gpu, &uploaded, &now);
        assert!(wrong(gpu, &mut renderer, &uploaded, &now) <= allowed, "{name}");
        // It goes on from there: by the device, by the host, and by the device again.
        for (seed, by_device) in [(5, true), (6, false), (7, true)] {
            let now = elsewhere(&before, seed);
            match by_device {
                true => drop(renderer.move_instances(&mut uploaded, &places(&now)).unwrap()),
                false => renderer.update(&mut uploaded, &now).unwrap(),
            }
            check(gpu, &uploaded, &now);
            assert!(wrong(gpu, &mut renderer, &uploaded, &now) <= allowed, "{name}: {seed}");
        }
    }
}

#[test]
fn gpu_a_tree_that_is_not_costly_stays_and_its_cost_is_the_hosts() {
    let Some(gpu) = testing::gpu("gpu_a_tree_that_is_not_costly_stays_and_its_cost_is_the_hosts") else { return };
    let before = scene();
    let renderer =
        Renderer::with_engine(&testing::engine(gpu), Settings { shadows: Shadows::BVH, ..Settings::direct_light() });
    let renderer = renderer.unwrap();
    let mut uploaded = renderer.upload(&before).unwrap();
    let on_device = |uploaded: &GpuScene| -> f64 {
        let tree = uploaded.moving.as_ref().and_then(|moving| moving.tree.as_ref()).unwrap();
        let nodes = uploaded.bvh.as_ref().unwrap().tree().len();
        let boxes = read_back::<[f32; 8]>(&gpu.device, &gpu.queue, &tree.boxes, nodes).unwrap();
        boxes.iter().map(|node| f64::from(node[3])).sum()
    };
    let on_host = |uploaded: &GpuScene| {
        let found = read(gpu, uploaded);
        let nodes: &[CwBvhNode] = bytemuck::cast_slice(&found.nodes);
        cost(&nodes[..uploaded.bvh.as_ref().unwrap().tree().len()], |place| box_of(&found.corners[place].corners))
    };
    let when_built = uploaded.bvh.as_ref().unwrap().cost_when_built();
    // To and fro.
    for i in 0..30 {
        let shift = Affine3A::from_translation(1e-3 * Vec3::X * (i % 2) as f32);
        let mut all = places(&before);
        all.retain(|(instance, _)| *instance > 1);
        all.iter_mut().for_each(|(_, place)| *place = shift * *place);
        let sent = renderer.move_instances(&mut uploaded, &all).unwrap();
        assert!(!sent.has_rebuilt && sent.bytes < 4096, "{i}: {sent:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
    let [device, host] = [on_device(&uploaded), on_host(&uploaded)];
    assert!((device - host).abs() < 1e-4 * host && (host - when_built).abs() < 0.01 * when_built, "{device}, {host}");
    // What is far apart is costly.
    renderer.move_instances(&mut uploaded, &places(&elsewhere(&before, 2))).unwrap();
    let [device, host] = [on_device(&uploaded), on_host(&uploaded)];
    assert!((device - host).abs() < 1e-4 * host && host > 1.5 * when_built, "{device}, {host}, built for {when_built}");
    // What moved while the cost of something else was found is not forgotten, though nothing moves any more.
    assert!(wait(&renderer, &mut uploaded, &[]).is_some());
}

/// The frame after another tree was taken has the motion of what has moved in it.
#[test]
fn gpu_motion_goes_on_where_another_tree_is_taken() {
    let Some(gpu) = testing::gpu("gpu_motion_goes_on_where_another_tree_is_taken") else { return };
    let before = scene();
    let settings = Settings { debug_view: Some(DebugView::Motion), shadows: Shadows::BVH, ..Settings::direct_light() };
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let mut uploaded = renderer.upload(&before).unwrap();
    let now = elsewhere(&before, 2);
    renderer.move_instances(&mut uploaded, &places(&now)).unwrap();
    let mut taken = false;
    for i in 0..2000 {
        renderer.render(&uploaded, &now.cameras[0], 48, 48).unwrap();
        let mut all = places(&now);
        all.iter_mut()
            .for_each(|(_, place)| *place = Affine3A::from_translation(0.05 * Vec3::X * (i % 2) as f32) * *place);
        taken = renderer.move_instances(&mut uploaded, &all).unwrap().has_rebuilt;
        let rendering = renderer.render(&uploaded, &now.cameras[0], 48, 48).unwrap();
        let moving = rendering.display.iter().filter(|pixel| pixel[..3] != [0; 3]).count();
        assert!(i == 0 || moving > 200, "{moving} pixels move in frame {i}, another tree taken: {taken}");
        if taken {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(taken);
}
