//! Rays per second of every tracer, in the built-in atrium.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use glam::{Quat, Vec3};
use lanternfish::{
    GpuScene, Renderer, Settings,
    rays::{RayTracer, Structure, TracedRay, TracedStructure},
    settings::{Shadows, Tracer},
};
use lanternfish_gpu::{Frame, Profiler, faulty_software};
use lanternfish_reference::Random;
use lanternfish_scene::{Camera, Scene, generate::demo};

use super::{measure::Bench, report::Rate};
use crate::{error::CliError, timed::Timed, warm};

/// Rays of a list. Fewer end before a card has raised its clocks, and count how the device starts and drains.
const RAYS: u32 = 1 << 22;
const RAYS_ON_SOFTWARE: u32 = 1 << 16;

/// Most timed runs of a list, and the time after which none begins.
const RUNS: u32 = 7;
const TIME: Duration = Duration::from_secs(2);

/// Least distance of a hit of random rays, fraction of the scene's size: three quarters of a texel of deep images.
const OFFSET: f32 = 0.75 / 64.0;

/// The timed tracers. Those through a structure, which has to be built, are left out of a quick run.
pub fn tracers(is_quick: bool) -> Vec<Tracer> {
    Tracer::all().into_iter().filter(|tracer| tracer.is_exact() || !is_quick).collect()
}

/// Rays per second of a tracer, by order of the rays. None if the device does not support it. The time is that of the
/// pass, or of the host where the device cannot time it.
pub fn trace(bench: &Bench, through: Tracer) -> Result<Vec<Rate>, CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    if !through.is_supported(device) {
        return Ok(Vec::new());
    }
    let scene = demo("atrium")?;
    let shadows = if through.is_exact() { Shadows::Traced(through) } else { Shadows::BVH };
    let settings = Settings::direct_light().with_shadows(shadows);
    let uploaded = Renderer::with_engine(&bench.engine, settings)?.upload(&scene)?;
    let mut profiler = Profiler::new(device, queue);
    let built = built(bench, &mut profiler, &uploaded, &through.structure(&Structure::NONE))?;
    let structure = built.as_deref();
    let tracer = RayTracer::of(device, &[through])?;
    let count = match bench.gpu.description.kind == wgpu::DeviceType::Cpu {
        // A software adapter's own acceleration structure is slow.
        true if through == Tracer::RAY_QUERY => RAYS_ON_SOFTWARE / 8,
        true => RAYS_ON_SOFTWARE,
        false => RAYS,
    };
    let rate = |(order, rays): (&str, Vec<TracedRay>)| {
        let list = tracer.upload(device, &rays)?;
        let mut run = || {
            let mut frame = Frame::new(device, queue, &mut profiler);
            tracer.record(&mut frame, &uploaded, through, structure, &list, count)?;
            let started = Instant::now();
            frame.submit();
            device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
            let host_ms = 1e3 * started.elapsed().as_secs_f64();
            // Mesa 22.3 has timestamps a thousand times too short.
            let is_faulty = faulty_software(&device.adapter_info());
            let device_ms: f64 = profiler.finished().iter().map(|pass| pass.ms).sum();
            let ms = if device_ms > 0.0 && !is_faulty { device_ms } else { host_ms };
            Ok::<_, CliError>(f64::from(count) / ms.max(1e-6) / 1e3)
        };
        warm::up(&bench.gpu, || run().map(drop))?;
        let mrays_per_second = Timed::within(RUNS, TIME, run)?;
        Ok::<_, CliError>(Rate { name: format!("{through}, {order} rays"), mrays_per_second })
    };
    lists(&scene, &scene.default_camera(1.0), structure, count).into_iter().map(rate).collect()
}

/// Coherent rays from the camera through neighbouring pixels, and random rays from all over the scene.
fn lists(
    scene: &Scene,
    camera: &Camera,
    structure: Option<&dyn TracedStructure>,
    count: u32,
) -> [(&'static str, Vec<TracedRay>); 2] {
    let bounds = scene.bounds();
    let ray = |origin, direction, offset| match structure {
        Some(structure) => structure.ray(origin, direction, offset),
        None => TracedRay { origin, direction, offset, ..TracedRay::default() },
    };
    let offset = OFFSET * bounds.size().length();
    let width = f64::from(count).sqrt() as u32;
    let through = |i: u32| {
        // Squares of 8 x 8 pixels, like the workgroups of a frame.
        let (square, inside) = (i / 64, i % 64);
        let across = (width / 8).max(1);
        let (x, y) = (square % across * 8 + inside % 8, square / across * 8 + inside / 8);
        let at = |v: u32| 2.0 * (v as f32 + 0.5) / width as f32 - 1.0;
        let direction = camera.world_from_camera.transform_vector3(Vec3::new(0.5 * at(x), -0.5 * at(y), -1.0));
        ray(camera.eye(), direction.normalize(), 0.0)
    };
    let anywhere = |i: u32| {
        let mut random = Random::new(3, u64::from(i), 0);
        let mut vector = || Vec3::from_array([0; 3].map(|_| random.unit() as f32 - 0.5));
        let origin = bounds.center() + bounds.size() * vector();
        ray(origin, (vector() + Vec3::splat(1e-9)).normalize(), offset)
    };
    [("coherent", (0..count).map(through).collect()), ("random", (0..count).map(anywhere).collect())]
}

/// Builds a structure, if it is one, and waits for it.
fn built(
    bench: &Bench,
    profiler: &mut Profiler,
    scene: &GpuScene,
    structure: &Structure,
) -> Result<Option<Arc<dyn TracedStructure>>, CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let Some(structure) = structure.technique() else { return Ok(None) };
    let mut kept = structure.build(device)?;
    let mut frame = Frame::new(device, queue, profiler);
    let built = kept.get(&mut frame, scene, Quat::IDENTITY);
    frame.submit();
    let built = built?;
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
    profiler.finished();
    Ok(Some(built))
}

fn lost(error: wgpu::PollError) -> CliError {
    CliError::new(format_args!("the device does not respond: {error}"), "")
}
