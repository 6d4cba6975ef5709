//! `lanternfish-bench moving`: updates of moved instances and lights, compared with a new upload, and ray rates through the refit BVH.

mod built;
mod refit;

use std::time::Instant;

use clap::Args;
use glam::{Affine3A, Quat, Vec3};
use lanternfish::{
    Renderer, Sent,
    settings::{Settings, Shadows},
};
use lanternfish_cli::{args::PartArgs, error::CliError, scene, scene::SceneName, times::leasts};
use lanternfish_gpu::{read_back, storage_buffer};
use lanternfish_reference::Random;
use lanternfish_scene::{Bounds, Instance, Mesh, Scene, generate::light_rain};

use crate::{
    bench::{Bench, RunArgs},
    table::Row,
};

/// Flags of `moving`.
#[derive(Debug, Args)]
pub struct MovingArgs {
    /// A glTF or OBJ file, or demo:NAME.
    #[arg(default_value = "demo:atrium")]
    scene: SceneName,
    #[command(flatten)]
    run: RunArgs,
    /// Number of rays through the BVH.
    #[arg(long, value_name = "N", default_value_t = 1 << 19, value_parser = clap::value_parser!(u32).range(1024..=1 << 22))]
    rays: u32,
}

/// Number of lights, of which one is moved.
const LIGHTS: u32 = 100_000;

/// Inputs of all measurements.
struct Motion {
    bench: Bench,
    scene: Scene,
}

/// Measures and writes the report.
pub fn run(args: &MovingArgs) -> Result<(), CliError> {
    let bench = Bench::start(&args.run, "moving", "Motion", Some(&args.scene))?;
    let load = || scene::load_part(&args.scene, &PartArgs::default());
    let scene = bench.step("load", &format!("Loading {}", args.scene), load)?;
    let of = Motion { bench, scene: apart(&scene) };
    let has_ray_query = of.bench.gpu.description.ray_query;
    let tracers = [Shadows::BVH].into_iter().chain(has_ray_query.then_some(Shadows::RAY_QUERY));
    let times = of.bench.rows("times", tracers, Shadows::to_string, |tracer| of.times(*tracer))?;
    let (light, built, refits) = (of.one_light()?, of.built()?, of.refits(args.rays)?);

    let (parts, triangles) = (of.scene.instances.len(), of.scene.triangle_counts().1);
    of.bench.facts(Row::default().data("parts", parts).data("triangles", triangles));
    let what = format!("{}, {triangles} triangles in {parts} parts", args.scene);
    of.bench.report().introduction(&what, &format!("least of {} runs", args.run.runs));
    let text = "*Update*: after all parts have moved; *one, by an update*: after one part has moved. *One, by the device*: the host sends \
                one transform; *host* is the time on the host, *all* the time until the device is done.";
    of.bench.section("Milliseconds", text, "times", times);
    let mut report = of.bench.report();
    report.paragraph(format!(
        "Moving one of {} lights: {} ms, {} bytes sent; by an update {} ms.",
        light.get("lights"),
        light.words("set_ms"),
        light.get("bytes"),
        light.words("update_ms")
    ));
    report.keep_data("light", &light);
    report.paragraph(built::in_words(&built));
    report.keep_data("built", &built);
    refit::report(&mut report, refits);
    drop(report);
    of.bench.finish()
}

/// The scene with every primitive of every instance as a separate mesh, so that each can move alone.
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

/// The scene with every part rotated about its centre by up to half a radian along each axis, and shifted by up to `reach` of the diagonal
/// along each axis.
fn moved(scene: &Scene, reach: f32) -> Scene {
    let mut moved = scene.clone();
    let length = reach * scene.bounds().size().length();
    for (index, instance) in moved.instances.iter_mut().enumerate() {
        let mut random = Random::new(2, index as u64, 0);
        let mut vector = || Vec3::from_array([0; 3].map(|_| 2.0 * random.unit() as f32 - 1.0));
        let mut bounds = Bounds::EMPTY;
        scene.meshes[instance.mesh].primitives.iter().for_each(|p| bounds.add_bounds(&p.bounds()));
        let middle = bounds.transformed(&instance.world_from_object).center();
        let rotation = Affine3A::from_quat(Quat::from_scaled_axis(5.0 * reach.min(0.1) * vector()));
        let back = Affine3A::from_translation(middle + length * vector());
        instance.world_from_object = back * rotation * Affine3A::from_translation(-middle) * instance.world_from_object;
    }
    moved
}

impl Motion {
    fn renderer(&self, shadows: Shadows) -> Result<Renderer, CliError> {
        Ok(self.bench.renderer(&Settings::direct_light().with_shadows(shadows))?)
    }

    /// Runs `work`, waits for the device, and returns the time, ms.
    fn timed(&self, work: impl FnOnce() -> Result<(), CliError>) -> Result<f64, CliError> {
        let gpu = &self.bench.gpu;
        let start = Instant::now();
        work()?;
        // The read-back completes after all submitted work.
        read_back::<u32>(&gpu.device, &gpu.queue, &storage_buffer(&gpu.device, "bench/last", 4)?, 1)?;
        Ok(1e3 * start.elapsed().as_secs_f64())
    }

    /// Times of one tracer, ms, device time included; least of all runs.
    fn times(&self, shadows: Shadows) -> Result<Row, CliError> {
        let (renderer, scene) = (self.renderer(shadows)?, &self.scene);
        let elsewhere = moved(scene, 0.01);
        // The instance in the middle of the list.
        let one = scene.instances.len() / 2;
        let mut one_moved = elsewhere.clone();
        one_moved.instances[one].world_from_object = scene.instances[one].world_from_object;
        let mut sent = Sent::default();
        let [upload, update, unmoved, one_update, one_host, one_all] = leasts(self.bench.runs, || {
            let mut uploaded = None;
            let upload = self.timed(|| {
                uploaded = Some(renderer.upload(scene)?);
                Ok(())
            })?;
            let mut uploaded = uploaded.expect("just uploaded");
            let update = self.timed(|| Ok(renderer.update(&mut uploaded, &elsewhere)?))?;
            let unmoved = self.timed(|| Ok(renderer.update(&mut uploaded, &elsewhere)?))?;
            let one_update = self.timed(|| Ok(renderer.update(&mut uploaded, &one_moved)?))?;
            let mut to_and_fro = |to: &Scene| {
                let mut host = 0.0;
                let all = self.timed(|| {
                    let start = Instant::now();
                    let moved = [(one, to.instances[one].world_from_object)];
                    sent = renderer.move_instances(&mut uploaded, &moved)?;
                    host = 1e3 * start.elapsed().as_secs_f64();
                    Ok(())
                })?;
                Ok::<_, CliError>([host, all])
            };
            // The first move compiles pipelines.
            to_and_fro(&elsewhere)?;
            let [host, all] = to_and_fro(&one_moved)?;
            Ok::<_, CliError>([upload, update, unmoved, one_update, host, all])
        })?;
        Ok(Row::default()
            .text("tracer", "tracer", shadows)
            .fixed("upload_ms", "upload", 1, upload)
            .fixed("update_ms", "update", 1, update)
            .fixed("unmoved_ms", "nothing moved", 2, unmoved)
            .fixed("one_update_ms", "one, by an update", 1, one_update)
            .fixed("one_host_ms", "one, by the device: host", 2, one_host)
            .fixed("one_ms", "all", 1, one_all)
            .number("one_bytes", "bytes sent", sent.bytes)
            .number("dispatches", "dispatches", sent.dispatches))
    }

    /// Times of moving one light of many, ms.
    fn one_light(&self) -> Result<Row, CliError> {
        let (renderer, mut scene) = (self.renderer(Shadows::BVH)?, self.scene.clone());
        scene.lights = light_rain(&scene.bounds(), LIGHTS, None, 0, 0.0);
        let mut uploaded = renderer.upload(&scene)?;
        let mut bytes = 0;
        let [set, update] = leasts(self.bench.runs, || {
            scene.lights[7].position.y += 0.01;
            let set = self.timed(|| {
                bytes = renderer.set_light(&mut uploaded, 7, &scene.lights[7])?.bytes;
                Ok(())
            })?;
            scene.lights[7].position.y += 0.01;
            Ok::<_, CliError>([set, self.timed(|| Ok(renderer.update(&mut uploaded, &scene)?))?])
        })?;
        let row = Row::default().data("lights", scene.lights.len()).fixed("set_ms", "", 2, set);
        Ok(row.data("bytes", bytes).fixed("update_ms", "", 1, update))
    }
}
