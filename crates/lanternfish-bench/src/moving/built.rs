//! What is built again where something has moved or come: deep images, and the scene itself.

use std::fmt::Write;

use glam::Mat3A;
use lanternfish::{
    Renderer,
    deep_images::directions::Directions,
    settings::{Indirect, Quality, Settings, Shadows, Tracer},
};
use lanternfish_gpu::Gpu;
use lanternfish_scene::Scene;
use serde::Serialize;

use super::{moved, renderer, timed};
use lanternfish_cli::error::CliError;

/// Size of the picture of the frame that builds deep images, pixels: all but a few of its milliseconds are theirs.
const SIZE: [u32; 2] = [64, 36];

/// Device ms, or for the last two of all that it takes; least of all runs.
#[derive(Debug, Serialize)]
pub struct Built {
    /// Directions of the deep images, and texels along an edge.
    directions: usize,
    resolution: u32,
    /// Passes that build deep images, in the frame after one part has moved.
    images_ms: f64,
    /// How many they are; and in the next frame, in which nothing has moved.
    image_passes: usize,
    kept_passes: usize,
    /// One instance more, by an update.
    inserted_ms: f64,
    /// The same where it was there, scaled to nothing, and is moved in.
    moved_in_ms: f64,
}

pub fn built(gpu: &Gpu, scene: &Scene, runs: u32) -> Result<Built, CliError> {
    let mut built = Built {
        directions: 0,
        resolution: 0,
        images_ms: f64::INFINITY,
        image_passes: 0,
        kept_passes: 0,
        inserted_ms: f64::INFINITY,
        moved_in_ms: f64::INFINITY,
    };
    images(gpu, scene, runs, &mut built)?;
    instances(gpu, scene, runs, &mut built)?;
    Ok(built)
}

fn images(gpu: &Gpu, scene: &Scene, runs: u32, built: &mut Built) -> Result<(), CliError> {
    let mut sampled = Quality::Good.sampled().one_bounce();
    sampled.tracer = Tracer::WithinTexel.into();
    let settings = Settings { indirect: Indirect::Sampled(sampled), shadows: Shadows::BVH, ..Settings::default() };
    built.directions = Directions::new(settings.deep_images.directions).map_or(0, |all| all.len());
    built.resolution = settings.deep_images.resolution;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, settings)?;
    let mut uploaded = renderer.upload(scene)?;
    let camera = scene.default_camera(SIZE[0] as f32 / SIZE[1] as f32);
    // What shines goes by an update.
    let Some(part) = dark_part(scene) else { return Ok(()) };
    let places = [moved(scene, 0.01), scene.clone()].map(|scene| scene.instances[part].world_from_object);
    for run in 0..=runs as usize {
        renderer.move_instances(&mut uploaded, &[(part, places[run % 2])])?;
        let mut of_images = || {
            let picture = renderer.render(&uploaded, &camera, SIZE[0], SIZE[1])?;
            let passes = picture.report.passes.into_iter();
            Ok::<_, CliError>(passes.filter(|pass| pass.name.starts_with("deep_images/")).collect::<Vec<_>>())
        };
        let (moved, kept) = (of_images()?, of_images()?);
        (built.image_passes, built.kept_passes) = (moved.len(), kept.len());
        if run > 0 && !moved.is_empty() {
            built.images_ms = built.images_ms.min(moved.iter().map(|pass| pass.ms).sum());
        }
    }
    Ok(())
}

/// The middle one of the parts that do not shine.
fn dark_part(scene: &Scene) -> Option<usize> {
    let shines = |part: &usize| {
        let primitives = &scene.meshes[scene.instances[*part].mesh].primitives;
        primitives.iter().any(|primitive| scene.materials[primitive.material].emissive.max_element() > 0.0)
    };
    let dark: Vec<usize> = (0..scene.instances.len()).filter(|part| !shines(part)).collect();
    dark.get(dark.len() / 2).copied()
}

fn instances(gpu: &Gpu, scene: &Scene, runs: u32, built: &mut Built) -> Result<(), CliError> {
    let renderer = renderer(gpu, Shadows::BVH)?;
    let part = scene.instances.len() / 2;
    let mut more = scene.clone();
    more.instances.push(moved(scene, 0.01).instances[part].clone());
    let last = more.instances.len() - 1;
    let there = more.instances[last].world_from_object;
    let mut spare = more.clone();
    spare.instances[last].world_from_object.matrix3 = Mat3A::ZERO;
    for run in 0..=runs {
        let mut uploaded = renderer.upload(scene)?;
        let inserted = timed(gpu, || Ok(renderer.update(&mut uploaded, &more)?))?;
        let mut uploaded = renderer.upload(&spare)?;
        // The first move of an upload makes what moves it.
        renderer.move_instances(&mut uploaded, &[(0, moved(scene, 0.001).instances[0].world_from_object)])?;
        let moved_in = timed(gpu, || Ok(renderer.move_instances(&mut uploaded, &[(last, there)]).map(|_| ())?))?;
        if run > 0 {
            built.inserted_ms = built.inserted_ms.min(inserted);
            built.moved_in_ms = built.moved_in_ms.min(moved_in);
        }
    }
    Ok(())
}

pub fn markdown(built: &Built) -> String {
    let Built { directions, resolution, images_ms, image_passes, kept_passes, inserted_ms, moved_in_ms } = built;
    // Passes are not timed everywhere.
    let ms = if images_ms.is_finite() { format!("{images_ms:.1} ms") } else { "–".to_owned() };
    let mut text = String::new();
    let _ = writeln!(
        text,
        "\nDeep images, {directions} of {resolution}² texels: {ms} of the device in the frame after one part has moved, in {image_passes} \
         passes; in the next frame {kept_passes}.\n\nOne instance more: {inserted_ms:.1} ms by an update, {moved_in_ms:.1} ms where it was there, \
         scaled to nothing, and is moved in."
    );
    text
}
