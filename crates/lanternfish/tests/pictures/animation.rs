//! Scenes that move: the pictures of posed scenes against the path tracer's, and what is brought to the device against what is uploaded.

use glam::Vec3;
use lanternfish::{
    Renderer, Settings,
    settings::{Attenuation, Shadows},
};
use lanternfish_gpu::testing;
use lanternfish_metrics::{RelativeError, RgbImage, write_exr};
use lanternfish_reference as reference;
use lanternfish_scene::{Bounds, Camera, Light, Scene};

use crate::support::{differing, linear};

const SIZE: (u32, u32) = (96, 72);
/// Every animated sample.
const SAMPLES: [&str; 12] = [
    "AnimatedCube/AnimatedCube.gltf",
    "AnimatedTriangle/AnimatedTriangle.gltf",
    "AnimatedMorphCube.glb",
    "BoxAnimated.glb",
    "CesiumMan.glb",
    "CesiumMilkTruck.glb",
    "Fox.glb",
    "InterpolationTest.glb",
    "RiggedFigure.glb",
    "RiggedSimple.glb",
    "SimpleMorph/SimpleMorph.gltf",
    "SimpleSkin/SimpleSkin.gltf",
];
/// Shares of the animation's duration.
const TIMES: [f32; 5] = [0.0, 0.21, 0.45, 0.7, 0.93];

/// A camera that sees the scene at all times, and lights around it. Surfaces have no textures, which do not move and are filtered by
/// each renderer in its own way.
fn staged(mut scene: Scene) -> (Scene, Camera) {
    for material in &mut scene.materials {
        material.base_color_texture = None;
        material.metallic_roughness_texture = None;
        material.normal_texture = None;
        material.occlusion_texture = None;
        material.emissive_texture = None;
        material.emissive = Vec3::ZERO;
    }
    let mut bounds = Bounds::EMPTY;
    let duration = scene.motion.animations[0].duration();
    for time in TIMES {
        scene.pose(0, time * duration);
        bounds.add_bounds(&scene.bounds());
    }
    let (center, size) = (bounds.center(), bounds.size().length());
    let sun = Light::directional(Vec3::new(-0.5, -1.0, -0.7), Vec3::splat(2.0));
    let lamp = Light::point(center + size * Vec3::new(0.6, 0.7, 0.9), Vec3::new(1.0, 0.8, 0.6) * size * size);
    scene.lights = vec![sun, lamp];
    (scene, Camera::framing(&bounds, 0.8, SIZE.0 as f32 / SIZE.1 as f32))
}

/// Direct light alone.
fn truth(scene: &Scene, camera: &Camera) -> RgbImage {
    let settings = reference::Settings { max_depth: 2, ..reference::Settings::default() };
    let tracer = reference::Tracer::new(scene, settings).unwrap();
    let mut film = reference::Film::new(SIZE.0 as usize, SIZE.1 as usize).unwrap();
    tracer.render(camera, &mut film, 1024);
    RgbImage::new(SIZE.0 as usize, SIZE.1 as usize, film.mean()).unwrap()
}

fn settings() -> Settings {
    Settings { accumulate: 16, shadows: Shadows::BVH, attenuation: Attenuation::Physical, ..Settings::direct_light() }
}

/// Each animated sample at five times: brought to the device that has the scene at rest, uploaded anew, and traced.
#[test]
fn gpu_posed_scenes_are_the_path_tracers() {
    let name = "gpu_posed_scenes_are_the_path_tracers";
    let Some(gpu) = testing::gpu(name) else { return };
    let mut all = Vec::new();
    for sample in SAMPLES {
        let Some(path) = testing::shared(name, &format!("assets/conformance/{sample}")) else { return };
        let (mut scene, camera) = staged(lanternfish_scene::load(path.to_str().unwrap()).unwrap());
        let duration = scene.motion.animations[0].duration();
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings()).unwrap();
        scene.pose_at_rest();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let mut pictures = Vec::new();
        for time in TIMES {
            scene.pose(0, time * duration);
            assert_eq!(scene.validate(), Ok(()), "{sample} at {time}");
            renderer.update(&mut uploaded, &scene).unwrap();
            let found = renderer.render(&uploaded, &camera, SIZE.0, SIZE.1).unwrap();
            let fresh = renderer.upload(&scene).unwrap();
            let fresh = renderer.render(&fresh, &camera, SIZE.0, SIZE.1).unwrap();
            assert_eq!(differing(&found, &fresh), 0, "{sample} at {time}: what was brought is not what is uploaded");
            let (found, expected) = (linear(&found), truth(&scene, &camera));
            if let Ok(folder) = std::env::var("LANTERNFISH_TEST_PICTURES") {
                for (kind, image) in [("found", &found), ("truth", &expected)] {
                    let file = format!("{}-{time}-{kind}.exr", sample.replace('/', "-"));
                    write_exr(&std::path::Path::new(&folder).join(file), image).expect("the folder can be written");
                }
            }
            let error = RelativeError::measure(&found, &expected, 1e-3).unwrap();
            println!(
                "{sample} at {time}: {} lit, median {:.3} %, {:.2} % within 5 %, energy {:+.3} %",
                error.lit_count(),
                100.0 * error.median(),
                100.0 * error.share_within(0.05),
                100.0 * (error.energy_ratio() - 1.0)
            );
            pictures.push((found, expected, error));
        }
        all.push((sample, pictures));
    }
    for (sample, pictures) in &all {
        for (time, (_, _, error)) in TIMES.iter().zip(pictures) {
            // A third of the pixels of so small a thing are edges, of which 16 frames see 16 places.
            assert!(error.lit_count() > 100, "{sample} at {time}: little is seen");
            assert!(error.median() < 0.03, "{sample} at {time}: median {}", error.median());
            assert!(error.share_within(0.1) > 0.75, "{sample} at {time}: {} within 10 %", error.share_within(0.1));
            assert!((error.energy_ratio() - 1.0).abs() < 0.01, "{sample} at {time}: energy {}", error.energy_ratio());
        }
        // It can fail: another moment is another picture. The truck's wheels turn alone, and are round.
        let other = RelativeError::measure(&pictures[2].0, &pictures[1].1, 1e-3).unwrap().share_within(0.1);
        let own = pictures[2].2.share_within(0.1);
        assert!(other < own - 0.02 || sample.contains("Truck"), "{sample}: blind to what moves: {other} and {own}");
    }
}
