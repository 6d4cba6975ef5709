//! `lanternfish bench moving`: bringing what has moved to the device, beside uploading it afresh, and what the refit tree then
//! costs rays.

use std::{fmt::Write, path::PathBuf, time::Instant};

use clap::Args;
use glam::{Affine3A, Vec3};
use lanternfish::{
    GpuScene, Renderer,
    rays::{RayTracer, TracedRay},
    settings::{Settings, Shadows, Tracer},
};
use lanternfish_gpu::{AdapterChoice, Frame, Gpu, Profiler, read_back, storage_buffer};
use lanternfish_reference::Random;
use lanternfish_scene::{Bounds, Instance, Mesh, Scene};
use serde::Serialize;

use super::{make_folder, open};
use crate::{
    args::adapter,
    error::CliError,
    output::{print, write_text},
    progress::Progress,
    scene,
    scene::SceneName,
};

#[derive(Debug, Args)]
pub struct MovingArgs {
    /// A glTF or OBJ file, or demo:NAME.
    #[arg(default_value = "demo:atrium")]
    pub scene: SceneName,
    /// The folder for report.md and report.json. It is made if it is not there.
    #[arg(short, long, value_name = "FOLDER", default_value = "bench-moving")]
    pub output: PathBuf,
    /// How often everything is timed, after one run that is not; the least counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub runs: u32,
    /// Rays through the tree.
    #[arg(long, value_name = "N", default_value_t = 1 << 19, value_parser = clap::value_parser!(u32).range(1024..=1 << 22))]
    pub rays: u32,
    /// Where to run: a part of an adapter's name, or cpu for a software one.
    #[arg(long, value_name = "NAME|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
}

/// How far parts are shifted at most, shares of the scene's diagonal.
const REACHES: [f32; 4] = [0.001, 0.01, 0.1, 0.5];

/// One tracer's times, ms; least of all runs, the device's included.
#[derive(Debug, Serialize)]
struct Times {
    tracer: String,
    upload_ms: f64,
    /// After all parts have moved.
    update_ms: f64,
    /// After nothing has.
    unmoved_ms: f64,
}

/// Rays through a tree that was refit after a motion, and through one that was built then.
#[derive(Debug, Serialize)]
struct Refit {
    reach: f32,
    /// Million rays a second, best of all runs.
    refit_rate: f64,
    fresh_rate: f64,
    /// Rays whose distances are not the same to the last bit.
    differing: usize,
}

#[derive(Debug, Serialize)]
struct Report {
    scene: SceneName,
    adapter: String,
    driver: String,
    parts: usize,
    triangles: usize,
    runs: u32,
    times: Vec<Times>,
    refits: Vec<Refit>,
}

pub fn run(args: &MovingArgs) -> Result<(), CliError> {
    make_folder(&args.output)?;
    let mut progress = Progress::start(false);
    let scene = progress.step("load", &format!("Loading {}", args.scene), || scene::load_part(&args.scene, None))?;
    let scene = apart(&scene);
    let gpu = open(args.adapter.as_ref())?;
    let tracers: &[Shadows] =
        if gpu.description.ray_query { &[Shadows::BVH, Shadows::RAY_QUERY] } else { &[Shadows::BVH] };
    let times = tracers.iter().map(|tracer| times(&gpu, &scene, *tracer, args.runs)).collect::<Result<_, _>>()?;
    let refits = REACHES.iter().map(|reach| refit(&gpu, &scene, *reach, args)).collect::<Result<_, _>>()?;
    let report = Report {
        scene: args.scene.clone(),
        adapter: gpu.description.name.clone(),
        driver: gpu.description.driver.clone(),
        parts: scene.instances.len(),
        triangles: scene.triangle_counts().1,
        runs: args.runs,
        times,
        refits,
    };
    let text = markdown(&report);
    write_text(&args.output.join("report.md"), &text)?;
    let json = serde_json::to_string_pretty(&report).expect("numbers and texts");
    write_text(&args.output.join("report.json"), &(json + "\n"))?;
    print(&text)
}

/// The scene with every primitive of every instance a mesh of its own, so that each can move by itself.
fn apart(scene: &Scene) -> Scene {
    let mut parts = Scene { meshes: Vec::new(), instances: Vec::new(), ..scene.clone() };
    for instance in &scene.instances {
        for primitive in &scene.meshes[instance.mesh].primitives {
            parts.instances.push(Instance { mesh: parts.meshes.len(), ..instance.clone() });
            parts.meshes.push(Mesh { name: String::new(), primitives: vec![primitive.clone()] });
        }
    }
    parts
}

/// The scene with every part turned about its middle by up to half a radian, and shifted by up to `reach` of the diagonal.
fn moved(scene: &Scene, reach: f32) -> Scene {
    let mut moved = scene.clone();
    let length = reach * scene.bounds().size().length();
    for (index, instance) in moved.instances.iter_mut().enumerate() {
        let mut random = Random::new(2, index as u64, 0);
        let mut vector = || Vec3::from_array([0; 3].map(|_| 2.0 * random.unit() as f32 - 1.0));
        let mut bounds = Bounds::EMPTY;
        scene.meshes[instance.mesh].primitives.iter().for_each(|p| bounds.add_bounds(&p.bounds()));
        let middle = bounds.transformed(&instance.world_from_object).center();
        let turn = Affine3A::from_quat(glam::Quat::from_scaled_axis(5.0 * reach.min(0.1) * vector()));
        let back = Affine3A::from_translation(middle + length * vector());
        instance.world_from_object = back * turn * Affine3A::from_translation(-middle) * instance.world_from_object;
    }
    moved
}

/// Runs `work` and waits for the device; ms.
fn timed(gpu: &Gpu, work: impl FnOnce() -> Result<(), CliError>) -> Result<f64, CliError> {
    let start = Instant::now();
    work()?;
    // What is read back comes after all that was handed over.
    read_back::<u32>(&gpu.device, &gpu.queue, &storage_buffer(&gpu.device, "bench/last", 4)?, 1)?;
    Ok(1e3 * start.elapsed().as_secs_f64())
}

fn renderer(gpu: &Gpu, shadows: Shadows) -> Result<Renderer, CliError> {
    Ok(Renderer::new(&gpu.device, &gpu.queue, Settings { shadows, ..Settings::direct_light() })?)
}

fn times(gpu: &Gpu, scene: &Scene, shadows: Shadows, runs: u32) -> Result<Times, CliError> {
    let renderer = renderer(gpu, shadows)?;
    let elsewhere = moved(scene, 0.01);
    let mut least = [f64::INFINITY; 3];
    for run in 0..=runs {
        let mut uploaded = None;
        let upload = timed(gpu, || {
            uploaded = Some(renderer.upload(scene)?);
            Ok(())
        })?;
        let mut uploaded = uploaded.expect("just uploaded");
        let update = timed(gpu, || Ok(renderer.update(&mut uploaded, &elsewhere)?))?;
        let unmoved = timed(gpu, || Ok(renderer.update(&mut uploaded, &elsewhere)?))?;
        if run > 0 {
            for (least, ms) in least.iter_mut().zip([upload, update, unmoved]) {
                *least = least.min(ms);
            }
        }
    }
    let [upload_ms, update_ms, unmoved_ms] = least;
    Ok(Times { tracer: shadows.to_string(), upload_ms, update_ms, unmoved_ms })
}

fn refit(gpu: &Gpu, scene: &Scene, reach: f32, args: &MovingArgs) -> Result<Refit, CliError> {
    let renderer = renderer(gpu, Shadows::BVH)?;
    let elsewhere = moved(scene, reach);
    let bounds = elsewhere.bounds();
    let ray = |index: u32| {
        let mut random = Random::new(3, index.into(), 0);
        let mut vector = || Vec3::from_array([0; 3].map(|_| random.unit() as f32 - 0.5));
        let origin = bounds.center() + bounds.size() * vector();
        TracedRay { origin, direction: (vector() + Vec3::splat(1e-9)).normalize(), ..TracedRay::default() }
    };
    let rays: Vec<TracedRay> = (0..args.rays).map(ray).collect();
    let mut uploaded = renderer.upload(scene)?;
    renderer.update(&mut uploaded, &elsewhere)?;
    let (refit_rate, found) = rate(gpu, &uploaded, &rays, args.runs)?;
    let (fresh_rate, expected) = rate(gpu, &renderer.upload(&elsewhere)?, &rays, args.runs)?;
    let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
    Ok(Refit { reach, refit_rate, fresh_rate, differing })
}

/// Million rays a second, and how far each went.
fn rate(gpu: &Gpu, uploaded: &GpuScene, rays: &[TracedRay], runs: u32) -> Result<(f64, Vec<f32>), CliError> {
    let tracer = RayTracer::new(&gpu.device)?;
    let buffer = tracer.upload(&gpu.device, rays)?;
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let (mut least, mut distances) = (f64::INFINITY, Vec::new());
    for run in 0..=runs {
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let found = tracer.record(&mut frame, uploaded, Tracer::Bvh, None, &buffer, rays.len() as u32)?;
        let ms = timed(gpu, || {
            frame.submit();
            Ok(())
        })?;
        if run > 0 {
            least = least.min(ms);
        }
        distances = read_back::<f32>(&gpu.device, &gpu.queue, &found, rays.len())?;
    }
    Ok((rays.len() as f64 / least / 1e3, distances))
}

fn markdown(report: &Report) -> String {
    let mut text = format!(
        "# What moves\n\n{}, {} triangles in {} parts that all move; {} on {}; least of {} runs.\n\n## Milliseconds\n\n\
         | tracer | upload | update | nothing moved |\n|---|---:|---:|---:|\n",
        report.scene, report.triangles, report.parts, report.adapter, report.driver, report.runs
    );
    for t in &report.times {
        let _ = writeln!(text, "| {} | {:.1} | {:.1} | {:.2} |", t.tracer, t.upload_ms, t.update_ms, t.unmoved_ms);
    }
    text += "\n## Rays through the BVH, closest hit\n\nFrom all over the scene's box in all directions, after every part has turned and \
             been shifted by up to so much of the scene's diagonal.\n\n| shift | refit, M rays/s | built anew | ratio | distances that differ \
             |\n|---:|---:|---:|---:|---:|\n";
    for r in &report.refits {
        let _ = writeln!(
            text,
            "| {} % | {:.2} | {:.2} | {:.2} | {} |",
            100.0 * r.reach,
            r.refit_rate,
            r.fresh_rate,
            r.refit_rate / r.fresh_rate,
            r.differing
        );
    }
    text
}
