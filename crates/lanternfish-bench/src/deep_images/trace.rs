//! Traces rays through images and through exact structures, times them, and compares distances.

use lanternfish::{
    deep_images::DeepImages,
    rays::{RayTracer, TracedRay},
    settings::{DeepImageSettings, Tracer},
};
use lanternfish_gpu::{Frame, read_back};
use serde::Serialize;

use super::{
    Bench,
    configurations::{Group, in_words},
    rays::KnownRay,
};
use lanternfish_cli::error::CliError;

/// One ray in this many goes through a software adapter's ray query, which is slow.
const SOFTWARE_RAYS: usize = 8;

/// Figures of tracing rays through one structure.
#[derive(Debug, Serialize)]
pub struct Traced {
    pub group: &'static str,
    pub images: String,
    pub directions: u64,
    pub resolution: u32,
    pub structure: &'static str,
    pub rays: usize,
    /// Million rays a second, best of all runs, in random order and image by image.
    pub rate_random: f64,
    pub rate_by_direction: f64,
    /// Error of the distance to the first hit, relative to the exact ray's distance, where both hit: median and 95th percentile.
    pub error_median: f64,
    pub error_p95: f64,
    /// Shares of rays that miss what the exact ray meets, and meet something where it meets nothing.
    pub missed: f64,
    pub false_hits: f64,
}

impl Bench {
    /// Traces `rays` through every tracer of deep images, and through the exact ones where the group wants them.
    pub fn trace(
        &mut self,
        group: &Group,
        settings: DeepImageSettings,
        images: &DeepImages,
        rays: Vec<KnownRay>,
    ) -> Result<Vec<Traced>, CliError> {
        let tracer = RayTracer::new(&self.gpu.device)?;
        let known = Tracer::ALL.iter().filter(|known| known.is_supported(&self.gpu.device));
        let (coarse, exact): (Vec<_>, Vec<_>) = known.copied().partition(|known| known.uses_deep_images());
        let asked = coarse.into_iter().chain(exact.into_iter().filter(|_| group.beside_exact));
        let is_software = self.gpu.description.device_type == "Cpu";
        let figures = |through: Tracer| {
            let is_slow = is_software && through == Tracer::RayQuery;
            let mut chosen = rays[..rays.len() / if is_slow { SOFTWARE_RAYS } else { 1 }].to_vec();
            let count = chosen.len();
            let rate = |ms: f64| count as f64 / ms / 1e3;
            let (random_ms, _) = self.time(&tracer, through, images, &chosen)?;
            chosen.sort_by_key(|known| known.ray.image_and_side);
            let (by_direction_ms, distances) = self.time(&tracer, through, images, &chosen)?;
            let errors = Errors::of(&distances, &chosen);
            Ok(Traced {
                group: group.title,
                images: in_words(&settings),
                directions: settings.directions.count(),
                resolution: settings.resolution,
                structure: through.name(),
                rays: count,
                rate_random: rate(random_ms),
                rate_by_direction: rate(by_direction_ms),
                error_median: errors.median,
                error_p95: errors.p95,
                missed: errors.missed,
                false_hits: errors.false_hits,
            })
        };
        asked.map(figures).collect()
    }

    /// Milliseconds, the least of all runs but the first, and distances.
    fn time(
        &mut self,
        tracer: &RayTracer,
        through: Tracer,
        images: &DeepImages,
        rays: &[KnownRay],
    ) -> Result<(f64, Vec<f32>), CliError> {
        let rays: Vec<TracedRay> = rays.iter().map(|known| known.ray).collect();
        let uploaded = tracer.upload(&self.gpu.device, &rays)?;
        let scene = match (through, &self.with_ray_query) {
            (Tracer::RayQuery, Some(scene)) => scene,
            _ => &self.uploaded,
        };
        let mut least = f64::INFINITY;
        let mut distances = Vec::new();
        for run in 0..=self.runs {
            let mut frame = Frame::new(&self.gpu.device, &self.gpu.queue, &mut self.profiler);
            let buffer = tracer.record(&mut frame, scene, through, Some(images), &uploaded, rays.len() as u32)?;
            frame.submit();
            distances = read_back::<f32>(&self.gpu.device, &self.gpu.queue, &buffer, rays.len())?;
            let ms: f64 = self.profiler.finished().iter().map(|pass| pass.ms).sum();
            if run > 0 {
                least = least.min(ms);
            }
        }
        Ok((least, distances))
    }
}

/// How far distances are from the truth; see [`Traced`]. Zero where there is nothing to judge.
#[derive(Debug, PartialEq)]
struct Errors {
    median: f64,
    p95: f64,
    missed: f64,
    false_hits: f64,
}

impl Errors {
    fn of(found: &[f32], known: &[KnownRay]) -> Self {
        let (mut errors, mut missed, mut false_hits) = (Vec::new(), 0, 0);
        for (found, known) in found.iter().zip(known) {
            match known.distance {
                Some(distance) if *found >= 0.0 => errors.push(f64::from((found - distance).abs() / distance)),
                Some(_) => missed += 1,
                None => false_hits += usize::from(*found >= 0.0),
            }
        }
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| errors.get((share * errors.len() as f64) as usize).copied().unwrap_or_default();
        let share = |count: usize| count as f64 / known.len().max(1) as f64;
        Self { median: at(0.5), p95: at(0.95), missed: share(missed), false_hits: share(false_hits) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_distances() {
        let known = [Some(1.0), Some(2.0), Some(4.0), Some(1.0), None, None]
            .map(|distance| KnownRay { ray: TracedRay::default(), distance });
        let errors = Errors::of(&[1.0, 3.0, 8.0, -1.0, 5.0, -1.0], &known);
        assert_eq!(errors, Errors { median: 0.5, p95: 1.0, missed: 1.0 / 6.0, false_hits: 1.0 / 6.0 });
        assert_eq!(Errors::of(&[], &[]), Errors { median: 0.0, p95: 0.0, missed: 0.0, false_hits: 0.0 });
    }
}
