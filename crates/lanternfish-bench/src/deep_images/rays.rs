//! Rays to trace, with the distances that they truly go.

use glam::Vec3;
use lanternfish::rays::TracedRay;
use lanternfish_papers::deep_images::DeepImages;
use lanternfish_reference::{Random, Tracer};
use lanternfish_scene::Scene;
use rayon::prelude::*;

/// A ray and where it ends, if anywhere.
#[derive(Clone, Copy, Debug)]
pub struct KnownRay {
    pub ray: TracedRay,
    /// m.
    pub distance: Option<f32>,
}

/// `count` rays from points of surfaces, uniform in direction: half of them start behind their surface. Fewer where a hundred
/// tries each do not find so many.
pub fn from_surfaces(scene: &Scene, exact: &Tracer<'_>, images: &DeepImages, count: u32) -> Vec<KnownRay> {
    let bounds = scene.bounds();
    // Three quarters of a texel: the surface itself is not met again.
    let offset = 0.75 * bounds.size().length() / images.chunks[0].grid.resolution as f32;
    let ray = |tried: u64| {
        let mut random = Random::new(1, tried, 0);
        let mut unit = || random.unit() as f32;
        let inside = bounds.min + bounds.size() * Vec3::new(unit(), unit(), unit());
        let mut direction = || {
            let (z, turn) = (2.0 * unit() - 1.0, std::f32::consts::TAU * unit());
            let ring = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(ring * turn.cos(), ring * turn.sin(), z).normalize()
        };
        let (towards, away) = (direction(), direction());
        let origin = inside + 0.999 * exact.nearest(inside.into(), towards.into())? * towards;
        let start = origin + offset * away;
        let distance = exact.nearest(start.into(), away.into()).map(|distance| distance + offset);
        Some(KnownRay { ray: images.ray(origin, away, offset), distance })
    };
    let batch = u64::from(count);
    let mut rays: Vec<KnownRay> = Vec::with_capacity(count as usize);
    for first in (0..100 * batch).step_by(batch as usize) {
        rays.par_extend((first..first + batch).into_par_iter().filter_map(ray));
        if rays.len() >= count as usize {
            break;
        }
    }
    rays.truncate(count as usize);
    rays
}
