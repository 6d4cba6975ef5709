//! `lanternfish bench deep-images`: building and tracing deep images, beside the BVH, with the error of every figure
//! [Archer2019, tables 2, 3; Niessner2010, table 1].

use std::{fmt::Write, fs, path::PathBuf};

use clap::{Args, builder::NonEmptyStringValueParser};
use glam::Vec3;
use lanternfish::{
    Renderer,
    deep_images::{
        DeepImageBuilder, DeepImages,
        directions::DirectionSet,
        trace::{RayTracer, Structure, TracedRay},
    },
    gpu_scene::GpuScene,
    settings::{DeepBuilder, DeepImageSettings, Settings, Shadows},
};
use lanternfish_gpu::{AdapterChoice, Frame, Gpu, PassTime, Profiler, read_back};
use lanternfish_reference::{Random, Tracer};
use lanternfish_scene::Scene;
use serde::Serialize;

use crate::{args::adapter, error::CliError, output::write_text, progress::Progress, scene};

#[derive(Debug, Args)]
pub struct DeepImagesArgs {
    /// A glTF or OBJ file, or demo:NAME.
    #[arg(default_value = "demo:atrium", value_parser = NonEmptyStringValueParser::new())]
    pub scene: String,
    /// The folder for report.md and report.json. It is made if it is not there.
    #[arg(short, long, value_name = "FOLDER", default_value = "bench-deep-images")]
    pub output: PathBuf,
    /// How often everything is timed, after one run that is not; the least counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub runs: u32,
    /// Rays of each kind.
    #[arg(long, value_name = "N", default_value_t = 1 << 19, value_parser = clap::value_parser!(u32).range(1024..=1 << 22))]
    pub rays: u32,
    /// Where to run: a part of an adapter's name, or cpu for a software one.
    #[arg(long, value_name = "NAME|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
}

/// What building came to.
#[derive(Debug, Serialize)]
struct Built {
    builder: &'static str,
    directions: usize,
    resolution: u32,
    supersampling: u32,
    /// Milliseconds a step, least of all runs.
    sample_ms: f64,
    count_ms: f64,
    scan_ms: f64,
    fill_ms: f64,
    sort_ms: f64,
    compact_ms: f64,
    total_ms: f64,
    drawn: u64,
    kept: u64,
    bytes: u64,
}

/// What tracing came to.
#[derive(Debug, Serialize)]
struct Traced {
    structure: String,
    order: &'static str,
    resolution: u32,
    rays: u32,
    /// Million rays a second, best of all runs.
    rate: f64,
    /// Of the distance to the first hit, relative to the exact ray's: median and 95th percentile where both hit.
    error_median: f64,
    error_p95: f64,
    /// Shares of rays that miss what the exact ray meets, and meet something where it meets nothing.
    missed: f64,
    false_hits: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    scene: String,
    adapter: String,
    driver: String,
    triangles: usize,
    runs: u32,
    built: Vec<Built>,
    traced: Vec<Traced>,
}

struct Bench {
    gpu: Gpu,
    profiler: Profiler,
    uploaded: GpuScene,
    runs: u32,
}

pub fn run(args: &DeepImagesArgs) -> Result<(), CliError> {
    fs::create_dir_all(&args.output)
        .map_err(|error| CliError::new(format_args!("{}: {error}", args.output.display()), "choose another folder"))?;
    let mut progress = Progress::start(false);
    let scene = progress.step("load", &format!("Loading {}", args.scene), || scene::load_part(&args.scene, None))?;
    let gpu = Gpu::open(&args.adapter.clone().unwrap_or_default())?;
    // The builders draw the BVH's triangles.
    let settings = Settings { shadows: Shadows::Bvh, ..Settings::default() };
    let uploaded = Renderer::new(&gpu.device, &gpu.queue, settings)?.upload(&scene)?;
    let exact = Tracer::new(&scene, lanternfish_reference::Settings::default())
        .map_err(|error| CliError::new(error, "choose another scene"))?;
    let profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut bench = Bench { gpu, profiler, uploaded, runs: args.runs };

    let mut built = Vec::new();
    let default = DeepImageSettings::default();
    for count in [8, 16, 32, 64, 128, 169] {
        let directions = DirectionSet::ZonalEqualArea { count };
        built.push(bench.build(DeepImageSettings { directions, ..default })?.0);
    }
    for supersampling in [2, 3] {
        built.push(bench.build(DeepImageSettings { supersampling, ..default })?.0);
    }
    built.push(bench.build(DeepImageSettings { builder: DeepBuilder::PerDirection, ..default })?.0);
    let mut traced = Vec::new();
    for resolution in [64, 128, 256] {
        let settings = DeepImageSettings { resolution, ..default };
        let (figures, images) = bench.build(settings)?;
        built.push(figures);
        let rays = rays(&scene, &exact, &images, args.rays);
        traced.extend(bench.trace(&exact, &images, rays, resolution)?);
    }
    let description = &bench.gpu.description;
    let report = Report {
        scene: args.scene.clone(),
        adapter: description.name.clone(),
        driver: description.driver.clone(),
        triangles: exact.triangle_count(),
        runs: args.runs,
        built,
        traced,
    };
    let text = markdown(&report);
    print!("{text}");
    write_text(&args.output.join("report.md"), &text)?;
    let json = serde_json::to_string_pretty(&report).expect("numbers and texts");
    write_text(&args.output.join("report.json"), &(json + "\n"))
}

/// Rays from points of surfaces, in every direction that the surface sees.
fn rays(scene: &Scene, exact: &Tracer<'_>, images: &DeepImages, count: u32) -> Vec<TracedRay> {
    let bounds = scene.bounds();
    // A thousandth of a texel of the finest images: the surface itself is not met again.
    let offset = 0.75 * bounds.size().length() / images.chunks[0].grid.resolution as f32;
    let mut rays = Vec::with_capacity(count as usize);
    let mut tried = 0u64;
    while rays.len() < count as usize && tried < 100 * u64::from(count) {
        let mut random = Random::new(1, tried, 0);
        tried += 1;
        let mut unit = || random.unit() as f32;
        let inside = bounds.min + bounds.size() * Vec3::new(unit(), unit(), unit());
        let mut direction = || {
            let (z, turn) = (2.0 * unit() - 1.0, std::f32::consts::TAU * unit());
            let ring = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(ring * turn.cos(), ring * turn.sin(), z).normalize()
        };
        let (towards, away) = (direction(), direction());
        let Some(distance) = exact.nearest(inside.into(), towards.into()) else { continue };
        let origin = inside + 0.999 * distance * towards;
        rays.push(TracedRay::new(images, origin, away, offset));
    }
    rays
}

impl Bench {
    fn build(&mut self, settings: DeepImageSettings) -> Result<(Built, DeepImages), CliError> {
        let mut builder = DeepImageBuilder::new(&self.gpu.device, settings)?;
        let mut best: Option<(f64, Vec<PassTime>)> = None;
        let mut images = None;
        // A yardstick of a second and more needs no second run.
        let runs = if settings.builder == DeepBuilder::PerDirection { 1 } else { self.runs };
        for run in 0..=runs {
            drop(images.take());
            let mut frame = Frame::new(&self.gpu.device, &self.gpu.queue, &mut self.profiler);
            images = Some(builder.record(&mut frame, &self.uploaded)?);
            frame.submit();
            // Waits for the device.
            let last = &images.as_ref().expect("just built").chunks[0];
            read_back::<u32>(&self.gpu.device, &self.gpu.queue, &last.list_starts, 1)?;
            let passes = self.profiler.finished();
            let total: f64 = passes.iter().map(|pass| pass.ms).sum();
            if run > 0 && best.as_ref().is_none_or(|(least, _)| total < *least) {
                best = Some((total, passes));
            }
        }
        let (images, (total_ms, passes)) = (images.expect("built"), best.expect("run"));
        let step =
            |name: &str| passes.iter().filter(|pass| pass.name.starts_with(name)).map(|pass| pass.ms).sum::<f64>();
        let figures = Built {
            builder: settings.builder.name(),
            directions: images.directions.len(),
            resolution: settings.resolution,
            supersampling: settings.supersampling,
            sample_ms: step("deep_images/sample"),
            count_ms: step("deep_images/count"),
            scan_ms: step("deep_images/scan"),
            fill_ms: step("deep_images/fill"),
            sort_ms: step("deep_images/sort"),
            compact_ms: step("deep_images/compact"),
            total_ms,
            drawn: images.counts.drawn,
            kept: images.counts.kept,
            bytes: images.counts.bytes,
        };
        Ok((figures, images))
    }

    fn trace(
        &mut self,
        exact: &Tracer<'_>,
        images: &DeepImages,
        mut rays: Vec<TracedRay>,
        resolution: u32,
    ) -> Result<Vec<Traced>, CliError> {
        let tracer = RayTracer::new(&self.gpu.device)?;
        let mut traced = Vec::new();
        for order in ["random", "by direction"] {
            if order == "by direction" {
                rays.sort_by_key(|ray| ray.image_and_side);
            }
            let expected: Vec<Option<f32>> = rays.iter().map(|ray| nearest(exact, ray)).collect();
            let uploaded = tracer.upload(&self.gpu.device, &rays)?;
            for (name, structure) in [
                ("within a texel", Structure::WithinTexel(images)),
                ("across texels", Structure::AcrossTexels(images)),
                ("BVH in compute", Structure::Bvh),
            ] {
                let mut least = f64::INFINITY;
                let mut distances = Vec::new();
                for run in 0..=self.runs {
                    let mut frame = Frame::new(&self.gpu.device, &self.gpu.queue, &mut self.profiler);
                    let buffer = tracer.record(&mut frame, &self.uploaded, structure, &uploaded, rays.len() as u32)?;
                    frame.submit();
                    distances = read_back::<f32>(&self.gpu.device, &self.gpu.queue, &buffer, rays.len())?;
                    let ms: f64 = self.profiler.finished().iter().map(|pass| pass.ms).sum();
                    if run > 0 {
                        least = least.min(ms);
                    }
                }
                let rate = rays.len() as f64 / least / 1e3;
                traced.push(judged(name, order, resolution, rate, &distances, &expected));
            }
        }
        Ok(traced)
    }
}

/// Where the exact ray ends, if beyond its offset.
fn nearest(exact: &Tracer<'_>, ray: &TracedRay) -> Option<f32> {
    let start = ray.origin + ray.offset * ray.direction;
    exact.nearest(start.into(), ray.direction.into()).map(|distance| distance + ray.offset)
}

fn judged(
    name: &str,
    order: &'static str,
    resolution: u32,
    rate: f64,
    found: &[f32],
    expected: &[Option<f32>],
) -> Traced {
    let (mut errors, mut missed, mut false_hits) = (Vec::new(), 0, 0);
    for (found, expected) in found.iter().zip(expected) {
        match expected {
            Some(expected) if *found >= 0.0 => errors.push(f64::from((found - expected).abs() / expected)),
            Some(_) => missed += 1,
            None => false_hits += usize::from(*found >= 0.0),
        }
    }
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| errors.get((share * errors.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    let share = |count: usize| count as f64 / found.len().max(1) as f64;
    Traced {
        structure: name.to_owned(),
        order,
        resolution,
        rays: found.len() as u32,
        rate,
        error_median: at(0.5),
        error_p95: at(0.95),
        missed: share(missed),
        false_hits: share(false_hits),
    }
}

fn markdown(report: &Report) -> String {
    let mut text = format!(
        "# Deep images\n\n{}, {} triangles; {} on {}; least of {} runs.\n\n## Building\n\n| builder | directions | texels | finer | \
         sample | count | scan | fill | sort | compact | all, ms | drawn | kept | MB |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
        report.scene, report.triangles, report.adapter, report.driver, report.runs
    );
    for b in &report.built {
        let _ = writeln!(
            text,
            "| {} | {} | {}² | {}× | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {} | {} | {:.1} |",
            b.builder,
            b.directions,
            b.resolution,
            b.supersampling,
            b.sample_ms,
            b.count_ms,
            b.scan_ms,
            b.fill_ms,
            b.sort_ms,
            b.compact_ms,
            b.total_ms,
            b.drawn,
            b.kept,
            b.bytes as f64 / 1e6
        );
    }
    text += "\n## Tracing\n\nRays from surfaces in all directions; the error is that of the distance to the first hit, relative to an exact \
             ray along the ray's own direction (images have their own).\n\n| structure | order | texels | M rays/s | error, median | 95 % | \
             missed | false |\n|---|---|---:|---:|---:|---:|---:|---:|\n";
    for t in &report.traced {
        let _ = writeln!(
            text,
            "| {} | {} | {}² | {:.2} | {:.2} % | {:.1} % | {:.2} % | {:.2} % |",
            t.structure,
            t.order,
            t.resolution,
            t.rate,
            100.0 * t.error_median,
            100.0 * t.error_p95,
            100.0 * t.missed,
            100.0 * t.false_hits
        );
    }
    text
}
