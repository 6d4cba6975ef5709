//! Hundreds of frames with random changes: the result equals that of a fresh upload.

use glam::{Affine3A, Quat, Vec3};
use lanternfish::{
    Change, GpuScene, Renderer, Settings,
    settings::{Culling, DebugView, Indirect, Samples, Shadows, ToneMap, Tracer},
    techniques::{Sampled, SampledLights},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_papers::{Hbao, indirect::virtual_lights::VirtualLights};
use lanternfish_scene::{Instance, Light, Mesh, Scene, generate};

use crate::support::differing;

/// Warm-up frames: all settings have been used by then, which is asserted, and no more memory may be retained after.
const WARM: usize = 200;
/// Bytes that a run may retain in addition after the warm-up: allocator slack for varying sizes.
const KEPT: u64 = 24 << 20;

/// Pseudo-random numbers, equal in every run [Steele2014].
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) - 0.5
    }
}

/// The Cornell box with each of its parts an instance, in light rain.
fn scene() -> Scene {
    let cornell = generate::demo("cornell").unwrap();
    let mut scene = Scene { meshes: Vec::new(), instances: Vec::new(), ..cornell.clone() };
    for instance in &cornell.instances {
        for primitive in &cornell.meshes[instance.mesh].primitives {
            scene.instances.push(Instance { mesh: scene.meshes.len(), ..instance.clone() });
            scene.meshes.push(Mesh { name: String::new(), primitives: vec![primitive.clone()] });
        }
    }
    // A moving emitter would need an update.
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    scene.lights.extend(generate::light_rain(&scene.bounds(), 12, Some(0.8), 1, 0.0));
    scene
}

/// Adds or removes an instance, sometimes with a mesh and a material of its own.
fn come_or_go(scene: &mut Scene, random: &mut Random) {
    let (few, many) = (scene.instances.len() < 6, scene.instances.len() > 20);
    if few || (!many && random.below(2) == 0) {
        let like = scene.instances[random.below(scene.instances.len())].clone();
        let mut mesh = like.mesh;
        if random.below(2) == 0 {
            let mut another = scene.meshes[mesh].clone();
            another.primitives[0].positions.iter_mut().for_each(|position| *position *= 0.9);
            another.primitives[0].material = scene.materials.len();
            scene.materials.push(scene.materials[0].clone());
            mesh = scene.meshes.len();
            scene.meshes.push(another);
        }
        let step = Affine3A::from_translation(0.3 * random.vector());
        scene.instances.push(Instance { mesh, world_from_object: step * like.world_from_object, ..like });
        return;
    }
    scene.instances.remove(random.below(scene.instances.len()));
    // The last mesh is removed with its last instance, and so is its material, the last one too.
    let last = scene.meshes.len() - 1;
    let is_placed = scene.instances.iter().any(|instance| instance.mesh == last);
    if last >= 8 && !is_placed && scene.meshes[last].primitives[0].material == scene.materials.len() - 1 {
        scene.meshes.pop();
        scene.materials.pop();
    }
}

/// Settings that do not require another upload of a scene with hit shading and a BVH.
fn settings() -> Vec<Settings> {
    let few = Sampled { diffuse_rays: 1, first_rays: 1, glossy_rays: 1, cache_samples: 2, ..Sampled::default() };
    let sampled = Sampled { tracer: Tracer::BVH.into(), ..few };
    let usual = Settings::direct_light().with_shadows(Shadows::BVH).with_indirect(sampled);
    let direct = || usual.clone().with_indirect(Indirect::NONE);
    vec![
        usual.clone(),
        direct(),
        direct().with_culling(Culling::NONE),
        direct().with_direct(SampledLights::default()),
        direct().with_samples(Samples::Four),
        usual.clone().with_tone_map(ToneMap::None),
        usual.clone().with_indirect(VirtualLights { count: 256, ..VirtualLights::default() }),
        direct().with_occlusion(Hbao { radius: 0.5, ..Hbao::default() }),
        direct().with_debug_view(Some(DebugView::LightCount)),
    ]
}

/// Resident memory of this process, bytes; none if the system does not report it.
fn resident() -> Option<u64> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    pages.split(' ').nth(1)?.parse::<u64>().ok().map(|pages| 4096 * pages)
}

/// Every fifth of a few frames is compared.
#[gpu_test(crate::gpu)]
fn gpu_random_changes_end_as_a_fresh_upload(gpu: &Gpu) {
    check_changes(gpu, 60, 5);
}

/// All settings and kinds of change, and the memory that they leave.
#[gpu_test(full, crate::gpu)]
fn gpu_frames_of_random_changes_end_as_a_fresh_upload(gpu: &Gpu) {
    check_changes(gpu, 400, 40);
}

fn check_changes(gpu: &Gpu, frames: usize, every: usize) {
    let (all, mut random, mut scene) = (settings(), Random(7), scene());
    let camera = scene.cameras[0].clone();
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), all[0].clone()).unwrap();
    let mut uploaded = renderer.upload(&scene).unwrap();
    let mut size = (24, 16);
    let (mut compared, mut changed) = (0, 0);
    let mut used: Vec<bool> = (0..all.len()).map(|which| which == 0).collect();
    let mut last = None;
    let mut warm = None;
    for frame in 0..frames {
        match random.below(15) {
            0..=5 => {
                let instance = random.below(scene.instances.len());
                let rotation = Quat::from_scaled_axis(0.3 * random.vector());
                let step = Affine3A::from_rotation_translation(rotation, 0.05 * random.vector());
                let transform = &mut scene.instances[instance].world_from_object;
                *transform = step * *transform;
                renderer.move_instances(&mut uploaded, &[(instance, *transform)]).unwrap();
            }
            6 => {
                let index = random.below(scene.lights.len());
                scene.lights[index] = Light::point(0.4 * random.vector() + 0.5 * Vec3::Y, Vec3::splat(0.2));
                // With hit shading and sampled lights, lights are in a tree, which is rebuilt.
                renderer.set_light(&mut uploaded, index, &scene.lights[index]).unwrap();
            }
            7 => {
                scene.lights.push(Light::point(0.4 * random.vector() + 0.5 * Vec3::Y, Vec3::splat(0.1)));
                renderer.update(&mut uploaded, &scene).unwrap();
            }
            8 => {
                let index = random.below(scene.lights.len());
                scene.lights.remove(index);
                scene.lights.push(Light::point(0.2 * random.vector(), Vec3::splat(0.1)));
                let primitive = &mut scene.meshes[random.below(2)].primitives[0];
                primitive.positions.iter_mut().for_each(|p| *p *= 1.01);
                renderer.update(&mut uploaded, &scene).unwrap();
            }
            9 => size = (8 + random.below(40) as u32, 8 + random.below(30) as u32),
            10 => {
                let which = used.iter().position(|used| !used).unwrap_or_else(|| random.below(all.len()));
                used[which] = true;
                let cost = renderer.set(all[which].clone()).unwrap();
                if cost == Change::Upload {
                    uploaded = renderer.upload(&scene).unwrap();
                }
            }
            11 => {
                come_or_go(&mut scene, &mut random);
                renderer.update(&mut uploaded, &scene).unwrap();
            }
            12 => {
                let index = random.below(scene.materials.len());
                scene.materials[index].base_color = (random.vector() + 0.5).extend(1.0);
                renderer.set_material(&mut uploaded, index, &scene.materials[index]).unwrap();
            }
            _ => {}
        }
        let shown =
            |renderer: &mut Renderer, uploaded: &GpuScene| renderer.render(uploaded, &camera, size.into()).unwrap();
        let actual = shown(&mut renderer, &uploaded);
        if frame == WARM {
            assert!(used.iter().all(|used| *used), "{used:?}");
            warm = resident();
        }
        if frame % every == every - 1 {
            let fresh = renderer.upload(&scene).unwrap();
            let mut another = Renderer::with_engine(&testing::engine(gpu), renderer.settings().clone()).unwrap();
            assert_eq!(differing(&actual, &shown(&mut renderer, &fresh)), 0, "frame {frame}");
            let fresh = another.upload(&scene).unwrap();
            assert_eq!(differing(&actual, &shown(&mut another, &fresh)), 0, "frame {frame}, another renderer");
            compared += 1;
        }
        changed += usize::from(last.replace(actual.radiance.clone()) != Some(actual.radiance));
    }
    if let (Some(warm), Some(end)) = (warm, resident()) {
        println!("{} MiB after {WARM} frames, {} at the end", warm >> 20, end >> 20);
        assert!(end < warm + KEPT, "{warm} bytes after {WARM} frames, {end} at the end");
    }
    println!("{compared} compared, {changed} of {frames} changed");
    assert!(changed > frames / 3, "{changed} frames changed");
}
