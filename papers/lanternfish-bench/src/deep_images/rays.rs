//! Rays to trace, with their exact hit distances.

use glam::Vec3;
use lanternfish::rays::TracedRay;
use lanternfish_papers::deep_images::DeepImages;
use lanternfish_reference::{Random, Tracer};
use lanternfish_scene::Scene;
use rayon::prelude::*;

/// A ray and its exact hit distance.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceRay {
    pub ray: TracedRay,
    /// Distance to the first hit, m; `None` if the ray hits nothing.
    pub distance: Option<f32>,
}

/// Returns `count` rays from surface points with uniform directions; half of them start behind their surface. Returns fewer rays if
/// 100 tries per ray do not find enough surface points.
pub fn from_surfaces(scene: &Scene, exact: &Tracer<'_>, images: &DeepImages, count: u32) -> Vec<ReferenceRay> {
    let bounds = scene.bounds();
    // Three quarters of a texel, so that the ray does not hit its own surface.
    let offset = 0.75 * bounds.size().length() / images.chunks[0].grid.resolution as f32;
    let ray = |tried: u64| {
        let mut random = Random::new(1, tried, 0);
        let mut unit = || random.unit() as f32;
        let inside = bounds.min + bounds.size() * Vec3::new(unit(), unit(), unit());
        let mut direction = || {
            let (z, angle) = (2.0 * unit() - 1.0, std::f32::consts::TAU * unit());
            let ring = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(ring * angle.cos(), ring * angle.sin(), z).normalize()
        };
        let (towards, away) = (direction(), direction());
        let origin = inside + 0.999 * exact.nearest(inside.into(), towards.into())? * towards;
        let start = origin + offset * away;
        let distance = exact.nearest(start.into(), away.into()).map(|distance| distance + offset);
        Some(ReferenceRay { ray: images.ray(origin, away, offset), distance })
    };
    let batch = u64::from(count);
    let mut rays: Vec<ReferenceRay> = Vec::with_capacity(count as usize);
    for first in (0..100 * batch).step_by(batch as usize) {
        rays.par_extend((first..first + batch).into_par_iter().filter_map(ray));
        if rays.len() >= count as usize {
            break;
        }
    }
    rays.truncate(count as usize);
    rays
}
