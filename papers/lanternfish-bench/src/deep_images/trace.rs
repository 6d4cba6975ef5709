//! Traces rays through images and through exact structures, times them, and compares distances.

use std::rc::Rc;

use bytemuck::Pod;
use lanternfish::{
    GpuScene,
    rays::{RayTracer, TracedRay},
    settings::Tracer,
};
use lanternfish_cli::{error::CliError, timed::Timed, times::ms_of};
use lanternfish_gpu::{Frame, read_back};
use lanternfish_papers::{DeepImageSettings, deep_images::DeepImages};

use super::{
    DeepBench,
    cases::{Group, in_words},
    crossings::Counts,
    rays::ReferenceRay,
};
use crate::table::Row;

/// The ray query of a software adapter is slow, and traces one ray in this many.
const SOFTWARE_RAYS: usize = 8;

impl DeepBench {
    /// Traces `rays` with every tracer of deep images, and with the exact tracers if the group requires them.
    pub fn trace(
        &mut self,
        group: &Group,
        settings: DeepImageSettings,
        images: &DeepImages,
        rays: Vec<ReferenceRay>,
    ) -> Result<Vec<Row>, CliError> {
        let (bench, device) = (Rc::clone(&self.bench), self.bench.gpu.device.clone());
        let known = Tracer::in_one_level().into_iter().filter(|known| known.is_supported(&device));
        let (coarse, exact): (Vec<_>, Vec<_>) = known.partition(|known| !known.is_exact());
        let requested = coarse.into_iter().chain(exact.into_iter().filter(|_| group.beside_exact));
        let figures = |through: Tracer| {
            let is_slow = bench.is_software() && through == Tracer::RAY_QUERY;
            let mut chosen = rays[..rays.len() / if is_slow { SOFTWARE_RAYS } else { 1 }].to_vec();
            let count = chosen.len();
            let rate = |ms: f64| count as f64 / ms / 1e3;
            let traced = |chosen: &[ReferenceRay]| chosen.iter().map(|known| known.ray).collect::<Vec<_>>();
            let (random_ms, _) = self.time(through, images, &traced(&chosen))?;
            chosen.sort_by_key(|known| known.ray.image_and_side);
            let (by_direction_ms, distances) = self.time(through, images, &traced(&chosen))?;
            let errors = DistanceErrors::of(&distances, &chosen);
            let counts = self.counts(through, images, &traced(&chosen))?;
            Ok(Row::default()
                .data("group", group.title)
                .text("images", "images", in_words(&settings))
                .number("directions", "directions", settings.directions.count())
                .texels("resolution", settings.resolution)
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
    fn time(&mut self, through: Tracer, images: &DeepImages, rays: &[TracedRay]) -> Result<(f64, Vec<f32>), CliError> {
        let is_query = through == Tracer::RAY_QUERY;
        let scene = self.with_ray_query.as_ref().filter(|_| is_query).unwrap_or(&self.uploaded);
        let scene = Rc::clone(scene);
        self.distances(through, &scene, images, rays)?;
        let (times, distances) = Timed::fastest(self.bench.runs, || self.distances(through, &scene, images, rays))?;
        Ok((times.least(), distances))
    }

    /// Milliseconds, and how far rays go, m; negative where they hit nothing.
    pub fn distances(
        &mut self,
        through: Tracer,
        scene: &GpuScene,
        images: &DeepImages,
        rays: &[TracedRay],
    ) -> Result<(f64, Vec<f32>), CliError> {
        let uploaded = self.tracer.upload(&self.bench.gpu.device, rays)?;
        let count = rays.len() as u32;
        let record = |frame: &mut Frame<'_>, tracer: &RayTracer| {
            tracer.record(frame, scene, through, Some(images), &uploaded, count)
        };
        self.read(rays.len(), record)
    }

    /// Submits what is recorded, and reads `count` values back. Returns them with the milliseconds of the passes.
    pub fn read<T: Pod, E>(
        &mut self,
        count: usize,
        record: impl FnOnce(&mut Frame<'_>, &RayTracer) -> Result<wgpu::Buffer, E>,
    ) -> Result<(f64, Vec<T>), CliError>
    where
        CliError: From<E>,
    {
        let gpu = &self.bench.gpu;
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut self.profiler);
        let buffer = record(&mut frame, &self.tracer)?;
        frame.submit();
        let values = read_back::<T>(&gpu.device, &gpu.queue, &buffer, count)?;
        Ok((ms_of(&self.profiler.finished(), ""), values))
    }
}

/// Errors of traced distances against exact rays. All are zero if there are no rays.
#[derive(Debug, PartialEq)]
struct DistanceErrors {
    /// Median of the relative errors of rays where both hit.
    median: f64,
    /// 95th percentile of the same errors.
    p95: f64,
    /// Fraction of rays that miss where the exact ray hits.
    missed: f64,
    /// Fraction of rays that hit where the exact ray misses.
    false_hits: f64,
}

impl DistanceErrors {
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
        let errors = DistanceErrors::of(&[1.0, 3.0, 8.0, -1.0, 5.0, -1.0], &reference);
        assert_eq!(errors, DistanceErrors { median: 0.5, p95: 1.0, missed: 1.0 / 6.0, false_hits: 1.0 / 6.0 });
        assert_eq!(
            DistanceErrors::of(&[], &[]),
            DistanceErrors { median: 0.0, p95: 0.0, missed: 0.0, false_hits: 0.0 }
        );
    }
}
