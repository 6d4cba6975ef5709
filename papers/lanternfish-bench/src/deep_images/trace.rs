//! Traces rays through images and through exact structures, times them, and compares distances.

use lanternfish::{rays::TracedRay, settings::Tracer};
use lanternfish_cli::error::CliError;
use lanternfish_gpu::{Frame, read_back};
use lanternfish_papers::{DeepImageSettings, deep_images::DeepImages};

use super::{
    Bench,
    cases::{Group, in_words},
    crossings::Counts,
    rays::ReferenceRay,
};
use crate::{
    run::{least, ms_of},
    table::Row,
};

/// The ray query of a software adapter is slow, and traces one ray in this many.
const SOFTWARE_RAYS: usize = 8;

impl Bench {
    /// Traces `rays` with every tracer of deep images, and with the exact tracers if the group requires them.
    pub fn trace(
        &mut self,
        group: &Group,
        settings: DeepImageSettings,
        images: &DeepImages,
        rays: Vec<ReferenceRay>,
    ) -> Result<Vec<Row>, CliError> {
        let known = Tracer::all().into_iter().filter(|known| known.is_supported(&self.run.gpu.device));
        let (coarse, exact): (Vec<_>, Vec<_>) = known.partition(|known| !known.is_exact());
        let requested = coarse.into_iter().chain(exact.into_iter().filter(|_| group.beside_exact));
        let is_software = self.run.gpu.description.device_type == "Cpu";
        let figures = |through: Tracer| {
            let is_slow = is_software && through == Tracer::RAY_QUERY;
            let mut chosen = rays[..rays.len() / if is_slow { SOFTWARE_RAYS } else { 1 }].to_vec();
            let count = chosen.len();
            let rate = |ms: f64| count as f64 / ms / 1e3;
            let (random_ms, _) = self.time(through, images, &chosen)?;
            chosen.sort_by_key(|known| known.ray.image_and_side);
            let (by_direction_ms, distances) = self.time(through, images, &chosen)?;
            let errors = Errors::of(&distances, &chosen);
            let traced: Vec<TracedRay> = chosen.iter().map(|known| known.ray).collect();
            let counts = self.counts(through, images, &traced)?;
            Ok(Row::default()
                .data("group", group.title)
                .text("images", "images", in_words(&settings))
                .number("directions", "directions", settings.directions.count())
                .number("resolution", "texels", settings.resolution)
                .said_as(format_args!("{}²", settings.resolution))
                .text("structure", "structure", through.name())
                .count("rays", "rays", count as u64)
                // Best ray rate of all runs, millions per second, in random order and sorted by image.
                .fixed("rate_random", "random, M/s", 2, rate(random_ms))
                .fixed("rate_by_direction", "by direction, M/s", 2, rate(by_direction_ms))
                .and(Counts::row(counts))
                .percent("error_median", "error, median", 2, errors.median)
                .percent("error_p95", "95 %", 1, errors.p95)
                .percent("missed", "missed", 2, errors.missed)
                .percent("false_hits", "false", 2, errors.false_hits))
        };
        requested.map(figures).collect()
    }

    /// Milliseconds, the least of all runs but the first, and distances.
    fn time(
        &mut self,
        through: Tracer,
        images: &DeepImages,
        rays: &[ReferenceRay],
    ) -> Result<(f64, Vec<f32>), CliError> {
        let rays: Vec<TracedRay> = rays.iter().map(|known| known.ray).collect();
        let uploaded = self.tracer.upload(&self.run.gpu.device, &rays)?;
        let scene = match (through, &self.with_ray_query) {
            (tracer, Some(scene)) if tracer == Tracer::RAY_QUERY => scene,
            _ => &self.uploaded,
        };
        let gpu = &self.run.gpu;
        let frame = || {
            let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut self.profiler);
            let buffer = self.tracer.record(&mut frame, scene, through, Some(images), &uploaded, rays.len() as u32)?;
            frame.submit();
            let distances = read_back::<f32>(&gpu.device, &gpu.queue, &buffer, rays.len())?;
            Ok::<_, CliError>((ms_of(&self.profiler.finished(), ""), distances))
        };
        Ok(least(self.run.runs, frame, |(ms, _)| *ms)?.1)
    }
}

/// Errors of traced distances against exact rays. All are zero if there are no rays.
#[derive(Debug, PartialEq)]
struct Errors {
    /// Median of the relative errors of rays where both hit.
    median: f64,
    /// 95th percentile of the same errors.
    p95: f64,
    /// Fraction of rays that miss where the exact ray hits.
    missed: f64,
    /// Fraction of rays that hit where the exact ray misses.
    false_hits: f64,
}

impl Errors {
    fn of(actual: &[f32], reference: &[ReferenceRay]) -> Self {
        let (mut errors, mut missed, mut false_hits) = (Vec::new(), 0, 0);
        for (actual, reference) in actual.iter().zip(reference) {
            match reference.distance {
                Some(distance) if *actual >= 0.0 => errors.push(f64::from((actual - distance).abs() / distance)),
                Some(_) => missed += 1,
                None => false_hits += usize::from(*actual >= 0.0),
            }
        }
        errors.sort_by(f64::total_cmp);
        let at = |fraction: f64| errors.get((fraction * errors.len() as f64) as usize).copied().unwrap_or_default();
        let fraction = |count: usize| count as f64 / reference.len().max(1) as f64;
        Self { median: at(0.5), p95: at(0.95), missed: fraction(missed), false_hits: fraction(false_hits) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_distances() {
        let reference = [Some(1.0), Some(2.0), Some(4.0), Some(1.0), None, None]
            .map(|distance| ReferenceRay { ray: TracedRay::default(), distance });
        let errors = Errors::of(&[1.0, 3.0, 8.0, -1.0, 5.0, -1.0], &reference);
        assert_eq!(errors, Errors { median: 0.5, p95: 1.0, missed: 1.0 / 6.0, false_hits: 1.0 / 6.0 });
        assert_eq!(Errors::of(&[], &[]), Errors { median: 0.0, p95: 0.0, missed: 0.0, false_hits: 0.0 });
    }
}
