//! Indirect light from screen probes.

mod energy;
mod functions;
mod leaks;
mod means;
mod overflow;
mod sizes;

use super::*;
use crate::{settings::History, techniques::Probes};

/// The default probes, through the BVH.
fn probes() -> Probes {
    let mut probes = Probes::default();
    probes.per_pixel.tracer = Tracer::BVH.into();
    probes
}

/// The same with tiles of this edge, pixels, and as many rays per probe.
fn probes_of(probe_size: u32, probe_rays: u32) -> Probes {
    let mut probes = probes();
    (probes.probe_size, probes.probe_rays) = (probe_size, probe_rays);
    probes
}

/// Rays from every pixel, as probes have them in later frames of a mean.
fn per_pixel() -> Indirect {
    Indirect::from(probes().per_pixel)
}

/// Settings with this indirect light and inverse-square falloff.
fn with(indirect: impl Into<Indirect>, history: History) -> Settings {
    settings(Sampled::default()).with_indirect(indirect).with_history(history)
}

/// Small cards at many depths, which need many further probes, in a box with a lamp.
fn clutter(cards: usize, half: f32) -> Scene {
    let mut scene = closed_box(matt(0.6));
    let mut random = Random::new(3);
    for _ in 0..cards {
        let (right, up) = random.direction().any_orthonormal_pair();
        scene.meshes[0].primitives.push(quad(0, 0.7 * random.point(), half * right, half * up));
    }
    scene.lights.push(Light::point(Vec3::new(0.3, 0.8, 0.9), Vec3::ONE));
    scene
}

/// Mean image of these frames of a renderer at rest, with a history.
fn rested(
    gpu: &Gpu,
    indirect: impl Into<Indirect>,
    scene: &Scene,
    camera: &Camera,
    size: UVec2,
    frames: std::ops::Range<usize>,
) -> Vec<Vec3> {
    let mut renderer = walks::renderer(gpu, with(indirect, History::On));
    let uploaded = renderer.upload(scene).unwrap();
    let mut sum = vec![Vec3::ZERO; (size.x * size.y) as usize];
    for frame in 0..frames.end {
        let rendering = renderer.render(&uploaded, camera, size.into()).unwrap();
        if frames.contains(&frame) {
            let share = 1.0 / frames.len() as f32;
            sum.iter_mut().zip(pixels(&rendering)).for_each(|(sum, pixel)| *sum += share * pixel);
        }
    }
    sum
}
