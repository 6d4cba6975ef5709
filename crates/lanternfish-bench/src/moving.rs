//! `lanternfish-bench moving`: bringing what has moved to the device, beside uploading it afresh, and what the refit tree then
//! costs rays.

mod built;

use std::{fmt::Write, path::PathBuf, time::Instant};

use clap::Args;
use glam::{Affine3A, Vec3};
use lanternfish::{
    GpuScene, Renderer, Sent,
    rays::{RayTracer, TracedRay},
    settings::{Settings, Shadows, Tracer},
};
use lanternfish_gpu::{AdapterChoice, Frame, Gpu, Profiler, read_back, storage_buffer};
use lanternfish_reference::Random;
use lanternfish_scene::{Bounds, Instance, Mesh, Scene, generate::light_rain};
use serde::Serialize;

use self::built::{Built, built};
use super::{make_folder, open};
use lanternfish_cli::{
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
    /// Where to run: a part of an adapter's name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
}

/// How far parts are shifted at most, shares of the scene's diagonal.
const REACHES: [f32; 4] = [0.001, 0.01, 0.1, 0.5];

/// Moves of one part each, one after another.
const MOVES: u32 = 1000;
/// Lights, of which one is put elsewhere.
const LIGHTS: u32 = 100_000;

/// One tracer's times, ms; least of all runs, the device's included.
#[derive(Debug, Serialize)]
struct Times {
    tracer: String,
    upload_ms: f64,
    /// After all parts have moved.
    update_ms: f64,
    /// After nothing has.
    unmoved_ms: f64,
    /// One part moved by the device: until the host is free again, and until the device is done; and what was sent.
    one_host_ms: f64,
    one_ms: f64,
    one_bytes: u64,
    dispatches: u32,
    /// The same by an update.
    one_update_ms: f64,
}

/// One light of many put elsewhere.
#[derive(Debug, Serialize)]
struct OneLight {
    lights: usize,
    set_ms: f64,
    bytes: u64,
    update_ms: f64,
}

/// Rays through a tree that was refit after a motion, and through one that was built then.
#[derive(Debug, Serialize)]
struct Refit {
    /// Moves before: one of all parts by the host, or so many of one part by the device.
    moves: u32,
    reach: f32,
    /// How often a tree that was built in the background took the place of the one before.
    rebuilt: u32,
    /// The longest that the host was held by one of the moves, ms; and the most that one of them sent.
    longest_ms: f64,
    most_bytes: u64,
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
    light: OneLight,
    built: Built,
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
    let light = one_light(&gpu, &scene, args.runs)?;
    let built = built(&gpu, &scene, args.runs)?;
    let mut refits = REACHES.iter().map(|reach| refit(&gpu, &scene, 0, *reach, args)).collect::<Result<Vec<_>, _>>()?;
    refits.push(refit(&gpu, &scene, MOVES, 0.01, args)?);
    let report = Report {
        scene: args.scene.clone(),
        adapter: gpu.description.name.clone(),
        driver: gpu.description.driver.clone(),
        parts: scene.instances.len(),
        triangles: scene.triangle_counts().1,
        runs: args.runs,
        times,
        light,
        built,
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
    // The middle one.
    let one = scene.instances.len() / 2;
    let mut one_moved = elsewhere.clone();
    one_moved.instances[one].world_from_object = scene.instances[one].world_from_object;
    let mut least = [f64::INFINITY; 6];
    let mut sent = Sent::default();
    for run in 0..=runs {
        let mut uploaded = None;
        let upload = timed(gpu, || {
            uploaded = Some(renderer.upload(scene)?);
            Ok(())
        })?;
        let mut uploaded = uploaded.expect("just uploaded");
        let update = timed(gpu, || Ok(renderer.update(&mut uploaded, &elsewhere)?))?;
        let unmoved = timed(gpu, || Ok(renderer.update(&mut uploaded, &elsewhere)?))?;
        let one_update = timed(gpu, || Ok(renderer.update(&mut uploaded, &one_moved)?))?;
        let mut to_and_fro = |scene: &Scene| {
            let mut host = 0.0;
            let all = timed(gpu, || {
                let start = Instant::now();
                let moved = [(one, scene.instances[one].world_from_object)];
                sent = renderer.move_instances(&mut uploaded, &moved)?;
                host = 1e3 * start.elapsed().as_secs_f64();
                Ok(())
            })?;
            Ok::<_, CliError>([host, all])
        };
        // The first move of all compiles.
        to_and_fro(&elsewhere)?;
        let [host, all] = to_and_fro(&one_moved)?;
        if run > 0 {
            for (least, ms) in least.iter_mut().zip([upload, update, unmoved, one_update, host, all]) {
                *least = least.min(ms);
            }
        }
    }
    let [upload_ms, update_ms, unmoved_ms, one_update_ms, one_host_ms, one_ms] = least;
    let Sent { bytes: one_bytes, dispatches, .. } = sent;
    let tracer = shadows.to_string();
    Ok(Times { tracer, upload_ms, update_ms, unmoved_ms, one_host_ms, one_ms, one_bytes, dispatches, one_update_ms })
}

fn one_light(gpu: &Gpu, scene: &Scene, runs: u32) -> Result<OneLight, CliError> {
    let renderer = renderer(gpu, Shadows::BVH)?;
    let mut scene = scene.clone();
    scene.lights = light_rain(&scene.bounds(), LIGHTS, None, 0, 0.0);
    let mut uploaded = renderer.upload(&scene)?;
    let mut least = [f64::INFINITY; 2];
    let mut bytes = 0;
    for run in 0..=runs {
        scene.lights[7].position.y += 0.01;
        let set = timed(gpu, || {
            bytes = renderer.set_light(&mut uploaded, 7, &scene.lights[7])?.bytes;
            Ok(())
        })?;
        scene.lights[7].position.y += 0.01;
        let update = timed(gpu, || Ok(renderer.update(&mut uploaded, &scene)?))?;
        if run > 0 {
            least = [least[0].min(set), least[1].min(update)];
        }
    }
    Ok(OneLight { lights: scene.lights.len(), set_ms: least[0], bytes, update_ms: least[1] })
}

/// `moves`: of one part each, by the device; 0: all parts at once, by the host.
fn refit(gpu: &Gpu, scene: &Scene, moves: u32, reach: f32, args: &MovingArgs) -> Result<Refit, CliError> {
    let renderer = renderer(gpu, Shadows::BVH)?;
    let mut elsewhere = moved(scene, reach);
    let mut list = Vec::new();
    if moves > 0 {
        // Each a step from where its part stood; parts of a large scene move once or twice, those of a small one wander.
        let steps = std::mem::replace(&mut elsewhere, scene.clone());
        for i in 0..moves as usize {
            let part = (i * 7919) % scene.instances.len();
            let step = steps.instances[part].world_from_object * scene.instances[part].world_from_object.inverse();
            let instance = &mut elsewhere.instances[part];
            instance.world_from_object = step * instance.world_from_object;
            list.push((part, instance.world_from_object));
        }
    }
    let bounds = elsewhere.bounds();
    let ray = |index: u32| {
        let mut random = Random::new(3, index.into(), 0);
        let mut vector = || Vec3::from_array([0; 3].map(|_| random.unit() as f32 - 0.5));
        let origin = bounds.center() + bounds.size() * vector();
        TracedRay { origin, direction: (vector() + Vec3::splat(1e-9)).normalize(), ..TracedRay::default() }
    };
    let rays: Vec<TracedRay> = (0..args.rays).map(ray).collect();
    let mut uploaded = renderer.upload(scene)?;
    let (mut rebuilt, mut longest_ms, mut most_bytes) = (0, 0.0f64, 0);
    match moves {
        0 => renderer.update(&mut uploaded, &elsewhere)?,
        _ => {
            for (i, one) in list.iter().enumerate() {
                let start = Instant::now();
                let sent = renderer.move_instances(&mut uploaded, std::slice::from_ref(one))?;
                // The first compiles.
                if i > 0 {
                    longest_ms = longest_ms.max(1e3 * start.elapsed().as_secs_f64());
                    most_bytes = most_bytes.max(sent.bytes);
                }
                rebuilt += u32::from(sent.has_rebuilt);
            }
        }
    }
    let fresh = renderer.upload(&elsewhere)?;
    let [(refit_rate, found), (fresh_rate, expected)] = rates(gpu, [&uploaded, &fresh], &rays, args.runs)?;
    let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
    Ok(Refit { moves, reach, rebuilt, longest_ms, most_bytes, refit_rate, fresh_rate, differing })
}

/// Of two scenes, traced in turn: million rays a second, and how far each ray went.
fn rates(gpu: &Gpu, scenes: [&GpuScene; 2], rays: &[TracedRay], runs: u32) -> Result<[(f64, Vec<f32>); 2], CliError> {
    let tracer = RayTracer::new(&gpu.device)?;
    let buffer = tracer.upload(&gpu.device, rays)?;
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut rates = [0; 2].map(|_| (0.0f64, Vec::new()));
    for run in 0..=runs {
        for (scene, (rate, distances)) in scenes.into_iter().zip(&mut rates) {
            let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
            let found = tracer.record(&mut frame, scene, Tracer::Bvh, None, &buffer, rays.len() as u32)?;
            let ms = timed(gpu, || {
                frame.submit();
                Ok(())
            })?;
            if run > 0 {
                *rate = rate.max(rays.len() as f64 / ms / 1e3);
            }
            *distances = read_back::<f32>(&gpu.device, &gpu.queue, &found, rays.len())?;
        }
    }
    Ok(rates)
}

fn markdown(report: &Report) -> String {
    let mut text = format!(
        "# What moves\n\n{}, {} triangles in {} parts; {} on {}; least of {} runs.\n\n## Milliseconds\n\n*Update*: all parts have moved; \
         *one, by an update*: one of them. *One, by the device*: the host sends its transform; until the host is free again, and until \
         the device is done.\n\n\
         | tracer | upload | update | nothing moved | one, by an update | one, by the device: host | all | bytes sent | dispatches |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
        report.scene, report.triangles, report.parts, report.adapter, report.driver, report.runs
    );
    for t in &report.times {
        let _ = writeln!(
            text,
            "| {} | {:.1} | {:.1} | {:.2} | {:.1} | {:.2} | {:.1} | {} | {} |",
            t.tracer,
            t.upload_ms,
            t.update_ms,
            t.unmoved_ms,
            t.one_update_ms,
            t.one_host_ms,
            t.one_ms,
            t.one_bytes,
            t.dispatches
        );
    }
    let OneLight { lights, set_ms, bytes, update_ms } = &report.light;
    let _ = writeln!(
        text,
        "\nOne of {lights} lights put elsewhere: {set_ms:.2} ms, {bytes} bytes sent; by an update {update_ms:.1} ms."
    );
    text += &built::markdown(&report.built);
    text += "\n## Rays through the BVH, closest hit\n\nFrom all over the scene's box in all directions, after every part has turned and \
             been shifted by up to so much of the scene's diagonal; or, with moves, after so many of one part each, by the device. \
             *In the background*: how often another tree was built there and took the place of the one before.\n\n\
             | moves | shift | in the background | refit, M rays/s | built anew | ratio | distances that differ |\n\
             |---:|---:|---:|---:|---:|---:|---:|\n";
    for r in &report.refits {
        let _ = writeln!(
            text,
            "| {} | {} % | {} | {:.2} | {:.2} | {:.2} | {} |",
            r.moves,
            100.0 * r.reach,
            r.rebuilt,
            r.refit_rate,
            r.fresh_rate,
            r.refit_rate / r.fresh_rate,
            r.differing
        );
    }
    for r in report.refits.iter().filter(|r| r.moves > 0) {
        let _ = writeln!(
            text,
            "\nThe longest of {} moves held the host for {:.1} ms; the most that one of them sent are {} bytes.",
            r.moves, r.longest_ms, r.most_bytes
        );
    }
    text
}
