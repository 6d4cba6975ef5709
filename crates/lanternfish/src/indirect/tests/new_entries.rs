//! Entries of the radiance cache in frames that follow each other: those that come into view while the camera moves, and all of them while the scene changes.

use lanternfish_scene::Instance;

use crate::{
    GpuScene, Target, ViewRequest,
    settings::History,
    techniques::{Bounces, HitLight},
};

use super::*;

/// Two closed boxes, 4 m apart, a lamp in the middle of each: neither has ever been seen from within the other. Three walls that meet in a corner
/// reflect the first share, those that face them the second one.
fn two_boxes(fractions: [f32; 2]) -> Scene {
    let mut scene = closed_box(matt(fractions[0]));
    scene.materials.push(matt(fractions[1]));
    let walls = scene.meshes[0].primitives.iter_mut().enumerate();
    walls.for_each(|(i, wall)| wall.material = i % 2);
    let other = Affine3A::from_translation(4.0 * Vec3::X);
    scene.instances.push(Instance { world_from_object: other, ..scene.instances[0].clone() });
    scene.lights = [0.0, 4.0].map(|x| Light::point(Vec3::new(x, 0.0, 0.0), Vec3::ONE)).to_vec();
    scene
}

/// From within a box: two walls of the first share, and a part of those that face them.
fn within(x: f32) -> Camera {
    looking([x, 0.0, 0.9], [x + 0.3, 0.2, -1.0])
}

/// Frames of two boxes that do not wait and follow each other.
struct Frames<'g> {
    gpu: &'g Gpu,
    renderer: Renderer,
    uploaded: GpuScene,
    scene: Scene,
    /// A light that nobody sees moves in each frame.
    changes: bool,
}

impl<'g> Frames<'g> {
    fn of(gpu: &'g Gpu, rays: Sampled, fractions: [f32; 2], changes: bool) -> Self {
        let settings = Settings { history: History::On, ..settings(rays) };
        let renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let mut scene = two_boxes(fractions);
        scene.lights.push(Light::point(100.0 * Vec3::Y, Vec3::ONE));
        let uploaded = renderer.upload(&scene).unwrap();
        Self { gpu, renderer, uploaded, scene, changes }
    }

    /// Mean radiance of the next frame.
    fn next(&mut self, camera: &Camera) -> f64 {
        let Self { gpu, renderer, uploaded, scene, changes } = self;
        if *changes {
            scene.lights[2].position.y += 1.0;
            renderer.update(uploaded, scene).unwrap();
        }
        let views = [ViewRequest::of_camera(0, camera, LARGE.into(), Target::Own)];
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let frame = renderer.record(&mut commands, uploaded, &views).unwrap();
        gpu.queue.submit([commands.finish()]);
        renderer.submitted(frame);
        let rendering = renderer.read(frame).unwrap().remove(0);
        mean(&rendering.radiance.iter().map(|pixel| Vec4::from(*pixel).truncate()).collect::<Vec<_>>())
    }
}

fn cached(bounces: Bounces) -> Sampled {
    let hit_light = HitLight::Cached;
    Sampled { diffuse_rays: 16, glossy_rays: 0, hit_light, bounces, ..sampled(Tracer::BVH) }
}

/// Mean radiance of 16 images from within the second box.
fn settled(gpu: &Gpu, indirect: Indirect, fractions: [f32; 2]) -> f64 {
    let settings = Settings { accumulate: 16, indirect, ..settings(cached(Bounces::ONE)) };
    mean(&image_of(gpu, LARGE, settings, &two_boxes(fractions), &within(4.0)))
}

/// Mean radiance of frames in the second box after twelve in the first one, over that of images.
fn seen(gpu: &Gpu, bounces: Bounces, fractions: [f32; 2], frames: usize, changes: bool) -> Vec<f64> {
    let rays = cached(bounces);
    let settled = settled(gpu, Indirect::from(rays), fractions);
    let mut walk = Frames::of(gpu, rays, fractions, changes);
    (0..12).for_each(|_| {
        walk.next(&within(0.0));
    });
    (0..frames).map(|_| walk.next(&within(4.0)) / settled).collect()
}

/// Entries that are new read those that are, too: nearly all light is there at once, and stays. While each entry took one bounce in a frame, every bounce
/// had 0.53 of it in the first frame and 0.95 in the 41st where all walls reflect four fifths, 0.89 and 0.99 where three reflect a fifth. Found:
/// off by 0.014 at most in the first case, since not every bounce is there, and by 0.003 in the second. Entries that take themselves for what they read
/// are off by 0.21 in the second case, and by 0.039 of three bounces.
#[test]
fn gpu_cells_that_come_into_view_have_every_bounce() {
    let Some(gpu) = testing::gpu("gpu_cells_that_come_into_view_have_every_bounce") else { return };
    let (even, uneven) = (([0.8, 0.8], 0.02), ([0.9, 0.2], 0.01));
    for (bounces, (fractions, most)) in [(Bounces::UpTo(3), uneven), (Bounces::All, even), (Bounces::All, uneven)] {
        let seen = seen(gpu, bounces, fractions, 25, false);
        println!("{bounces}, {fractions:?}: {:.4?}", [0, 1, 2, 4, 8, 16, 24].map(|i: usize| seen[i]));
        assert!(seen.iter().all(|fraction| (fraction - 1.0).abs() < most), "{bounces}, {fractions:?}: {seen:?}");
    }
}

/// While the scene changes in every frame all entries together take few bounces in each, and have the others of the frames before; those that are new take
/// more. With 3 turns for all and none more for new ones, the first frame had 0.74 of the light; found, with 2 for all: 0.992.
#[test]
fn gpu_cells_have_every_bounce_while_the_scene_changes() {
    let Some(gpu) = testing::gpu("gpu_cells_have_every_bounce_while_the_scene_changes") else { return };
    let seen = seen(gpu, Bounces::All, [0.8, 0.8], 16, true);
    println!("{seen:.4?}");
    assert!(seen.iter().all(|fraction| (fraction - 1.0).abs() < 0.02), "{seen:?}");
}

/// A lamp is dimmed to a tenth while the scene changes in every frame. What entries know of it counts for three samples beside a new one, so that three
/// quarters of one bounce are left in each frame; every bounce follows it, no more than two frames later. Found: 0.764, 0.323, 0.103 and 0.011 of the
/// light that goes are left of one bounce after 1, 4, 8 and 16 frames, and 0.896, 0.481, 0.167 and 0.018 of every one. With one turn in a frame for two
/// it was 0.944, 0.637, 0.300 and 0.050, with twelve as of one bounce.
#[test]
fn gpu_every_bounce_follows_a_lamp_while_the_scene_changes() {
    let Some(gpu) = testing::gpu("gpu_every_bounce_follows_a_lamp_while_the_scene_changes") else { return };
    let fractions = [0.8, 0.8];
    let direct = settled(gpu, Indirect::NONE, fractions);
    for (bounces, most_late) in [(Bounces::ONE, 0), (Bounces::All, 2)] {
        let rays = cached(bounces);
        let indirect = settled(gpu, Indirect::from(rays), fractions) - direct;
        let mut frames = Frames::of(gpu, rays, fractions, true);
        (0..16).for_each(|_| {
            frames.next(&within(4.0));
        });
        frames.scene.lights[1].intensity *= 0.1;
        let mut left = || ((frames.next(&within(4.0)) - 0.1 * direct) / indirect - 0.1) / 0.9;
        let left: Vec<f64> = (0..16).map(|_| left()).collect();
        println!("{bounces}: {left:.3?}");
        for (left_now, frame) in left.iter().zip(1..) {
            let [in_time, late] = [frame, frame - most_late].map(|frames| 0.75_f64.powi(frames));
            assert!((in_time - 0.03..late + 0.03).contains(left_now), "{bounces}, frame {frame}: {left:?}");
        }
    }
}
