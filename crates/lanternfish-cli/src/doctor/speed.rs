//! Rates of an adapter: rays of every tracer, sorted keys, frames of a fixed scene.

use std::time::Instant;

use glam::Vec3;
use lanternfish::{
    GpuScene, Renderer, Settings,
    rays::{RayTracer, Structure, TracedRay, TracedStructure},
    settings::{Quality, Shadows, Tracer},
};
use lanternfish_gpu::{
    Frame, PassTime, Profiler, faulty_software, primitives::RadixSort, read_back, storage_buffer_of,
};
use lanternfish_papers::{
    DeepImageSettings,
    deep_images::{DeepImageBuilder, DeepImages},
};
use lanternfish_reference::Random;
use lanternfish_scene::{
    Camera, Scene,
    generate::{demo, light_rain},
};

use super::{
    measure::{Bench, keys},
    report::{Rate, Timed, WATCHDOG_MS},
};
use crate::error::CliError;

/// Most and least measured runs, after one warm-up run, and the time after which no further run starts, s. After twice that
/// time, fewer runs than the least suffice.
const MOST_RUNS: usize = 7;
const LEAST_RUNS: usize = 3;
const SECONDS: f64 = 2.0;

/// The measurements and their sizes.
#[derive(Clone, Debug)]
pub struct Extent {
    /// Sizes of frames with direct light. On software adapters, frames with all light have half the width and height, because
    /// the radiance cache alone takes seconds.
    pub sizes: Vec<[u32; 2]>,
    /// Light counts of frames with direct light.
    pub lights: Vec<u32>,
    /// Rays per list.
    pub rays: u32,
    pub sorted_keys: u32,
    pub qualities: Vec<Quality>,
    /// True if deep images are built and traced.
    pub has_deep_images: bool,
    pub is_software: bool,
}

impl Extent {
    /// A graphics card gets a hundred times the work of a software adapter.
    pub fn new(is_software: bool, is_quick: bool, size: Option<[u32; 2]>) -> Self {
        let usual = if is_software { vec![[320, 180]] } else { vec![[1280, 720], [1920, 1080]] };
        let mut sizes = size.map_or(usual, |size| vec![size]);
        if is_quick {
            sizes.truncate(1);
        }
        Self {
            sizes,
            lights: if is_quick { vec![1000] } else { vec![10, 1000, 10_000, 100_000] },
            rays: if is_software { 1 << 16 } else { 1 << 20 },
            sorted_keys: if is_software { 1 << 18 } else { 1 << 22 },
            qualities: if is_quick { Vec::new() } else { vec![Quality::Draft, Quality::Good] },
            has_deep_images: !is_quick,
            is_software,
        }
    }

    /// The measurements, in order.
    pub fn steps(&self) -> Vec<Step> {
        let mut steps = vec![Step::Sort];
        let tracers = Tracer::all()
            .into_iter()
            .filter(|tracer| tracer.is_exact() || (self.has_deep_images && uses_deep_images(*tracer)));
        steps.extend(tracers.map(Step::Trace));
        for size in self.sizes.iter().copied() {
            steps.extend(self.lights.iter().map(|lights| Step::DirectLight { size, lights: *lights }));
            let size = if self.is_software { size.map(|edge| edge.div_ceil(2)) } else { size };
            steps.extend(self.qualities.iter().map(|quality| Step::AllLight { size, quality: *quality }));
        }
        steps.extend(self.has_deep_images.then_some(Step::DeepImages));
        steps
    }
}

/// One measurement.
#[derive(Clone, Copy, Debug)]
pub enum Step {
    Sort,
    Trace(Tracer),
    DirectLight { size: [u32; 2], lights: u32 },
    AllLight { size: [u32; 2], quality: Quality },
    DeepImages,
}

/// Light count of frames with all light.
const LIGHTS: u32 = 1000;

impl Step {
    pub fn name(self) -> String {
        match self {
            Self::Sort => "sorting".to_owned(),
            Self::Trace(tracer) => format!("tracing lists of rays, {tracer}"),
            Self::DirectLight { size: [width, height], lights } => {
                format!("direct light, {lights} lights, {width} x {height}")
            }
            Self::AllLight { size: [width, height], quality } => format!("all light, {quality}, {width} x {height}"),
            Self::DeepImages => "building deep images".to_owned(),
        }
    }

    /// Runs the measurement. Returns an error if it cannot run at all; the row of a failed frame holds the reason.
    pub fn measure(
        self,
        bench: &Bench,
        extent: &Extent,
        rates: &mut Vec<Rate>,
        frames: &mut Vec<Timed>,
    ) -> Result<(), CliError> {
        match self {
            Self::Sort => rates.push(sort(bench, extent)?),
            Self::Trace(tracer) => bench.engine.within(|| trace(bench, extent, tracer, &demo("atrium")?, rates))?,
            Self::DirectLight { size, lights } => {
                frames.push(frame(bench, "direct light", &atrium(lights)?, size, Settings::direct_light()));
            }
            Self::AllLight { size, quality } => {
                let name = format!("all light, {quality}");
                frames.push(frame(bench, &name, &atrium(LIGHTS)?, size, Settings::of_quality(quality)));
            }
            Self::DeepImages => frames.push(deep_images(bench, &demo("atrium")?)),
        }
        Ok(())
    }
}

/// The atrium with `lights` lights: its own first, then light rain.
fn atrium(lights: u32) -> Result<Scene, CliError> {
    let mut scene = demo("atrium")?;
    let rain = (lights as usize).saturating_sub(scene.lights.len()) as u32;
    scene.lights.extend(light_rain(&scene.bounds(), rain, None, 0, 0.0));
    scene.lights.truncate(lights as usize);
    Ok(scene)
}

/// Repeats a run within the time limit. Returns the results without the first, which compiles shaders.
fn repeated<T>(mut run: impl FnMut() -> Result<T, CliError>) -> Result<Vec<T>, CliError> {
    run()?;
    let started = Instant::now();
    let mut all = Vec::new();
    while all.len() < LEAST_RUNS || (all.len() < MOST_RUNS && started.elapsed().as_secs_f64() < SECONDS) {
        all.push(run()?);
        // One result is enough for a run this slow.
        if started.elapsed().as_secs_f64() > 2.0 * SECONDS {
            break;
        }
    }
    Ok(all)
}

/// Median, least and most.
fn spread(values: impl IntoIterator<Item = f64>) -> [f64; 3] {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len() - 1;
    [0.5 * (sorted[last / 2] + sorted[sorted.len() / 2]), sorted[0], sorted[last]]
}

/// Millions per second, from runs of `count` items in these milliseconds.
fn rate(name: String, unit: &str, count: usize, ms: &[f64]) -> Rate {
    let [median, least, most] = spread(ms.iter().map(|ms| count as f64 / ms.max(1e-6) / 1e3));
    Rate { name, unit: unit.to_owned(), median, least, most, runs: ms.len() }
}

/// Submits the frame that `record` fills and waits for it. Returns its time in milliseconds, from device timestamps or else
/// from the host's clock.
fn timed<R>(
    bench: &Bench,
    profiler: &mut Profiler,
    record: impl FnOnce(&mut Frame<'_>) -> Result<R, CliError>,
) -> Result<(f64, R), CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let mut frame = Frame::new(device, queue, profiler);
    let result = record(&mut frame)?;
    let started = Instant::now();
    frame.submit();
    let lost = |error| CliError::new(format_args!("the device does not respond: {error}"), "");
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
    let wall = 1e3 * started.elapsed().as_secs_f64();
    let passes: f64 = sound(bench, profiler.finished()).iter().map(|pass| pass.ms).sum();
    Ok((if passes > 0.0 { passes } else { wall }, result))
}

fn sort(bench: &Bench, extent: &Extent) -> Result<Rate, CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let sort = RadixSort::new(device, "doctor/sort")?;
    let mut profiler = Profiler::new(device, queue);
    let pairs = keys(extent.sorted_keys);
    let [keys, values] = [0, 1].map(|i| pairs.iter().map(|pair| [pair.0, pair.1][i]).collect::<Vec<u32>>());
    let ms = repeated(|| {
        let upload = |list: &[u32]| storage_buffer_of(device, "doctor/sort", list, wgpu::BufferUsages::empty());
        let (keys, values) = (upload(&keys)?, upload(&values)?);
        let (ms, ()) =
            timed(bench, &mut profiler, |frame| Ok(sort.record(frame, &keys, &values, extent.sorted_keys, 32)?))?;
        Ok(ms)
    })?;
    Ok(rate(format!("sort, {} pairs of 32 bits", extent.sorted_keys), "Mkeys/s", pairs.len(), &ms))
}

/// True if the tracer needs ray lists with directions of deep images.
fn uses_deep_images(tracer: Tracer) -> bool {
    tracer.structure(&Structure::NONE).is::<DeepImageSettings>()
}

/// Coherent rays from the camera through neighbouring pixels, and random rays from all over the scene.
fn lists(
    scene: &Scene,
    camera: &Camera,
    images: Option<&DeepImages>,
    count: u32,
) -> [(&'static str, Vec<TracedRay>); 2] {
    let bounds = scene.bounds();
    let ray = |origin, direction, offset| match images {
        Some(images) => images.ray(origin, direction, offset),
        None => TracedRay { origin, direction, offset, ..TracedRay::default() },
    };
    // Three quarters of a texel.
    let offset = 0.75 * bounds.size().length() / RESOLUTION as f32;
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

/// Rays per second of a tracer, if the device supports it.
fn trace(
    bench: &Bench,
    extent: &Extent,
    through: Tracer,
    scene: &Scene,
    rates: &mut Vec<Rate>,
) -> Result<(), CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    if !through.is_supported(device) {
        return Ok(());
    }
    let shadows = if through == Tracer::RAY_QUERY { Shadows::RAY_QUERY } else { Shadows::BVH };
    let settings = Settings { shadows, ..Settings::direct_light() };
    let uploaded = Renderer::with_engine(&bench.engine, settings)?.upload(scene)?;
    let mut profiler = Profiler::new(device, queue);
    let images = (!through.is_exact()).then(|| built(bench, &mut profiler, &uploaded)).transpose()?;
    let tracer = RayTracer::new(device)?;
    let camera = scene.default_camera(1.0);
    // A software adapter's own acceleration structure is slow.
    let count = if extent.is_software && through == Tracer::RAY_QUERY { extent.rays / 8 } else { extent.rays };
    for (order, rays) in lists(scene, &camera, images.as_ref(), count) {
        let list = tracer.upload(device, &rays)?;
        let ms = repeated(|| {
            let (ms, _) = timed(bench, &mut profiler, |frame| {
                Ok(tracer.record(
                    frame,
                    &uploaded,
                    through,
                    images.as_ref().map(|images| images as &dyn TracedStructure),
                    &list,
                    count,
                )?)
            })?;
            Ok(ms)
        })?;
        rates.push(rate(format!("{through}, {order} rays, closest hit"), "Mrays/s", count as usize, &ms));
    }
    Ok(())
}

/// Texels across each deep image.
const RESOLUTION: u32 = 64;

/// Builds deep images with the default directions and waits for them.
fn built(bench: &Bench, profiler: &mut Profiler, scene: &GpuScene) -> Result<DeepImages, CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let settings = DeepImageSettings { resolution: RESOLUTION, ..DeepImageSettings::default() };
    let mut builder = DeepImageBuilder::new(device, settings)?;
    let mut frame = Frame::new(device, queue, profiler);
    let images = builder.record(&mut frame, scene);
    frame.submit();
    let images = images?;
    read_back::<u32>(device, queue, &images.chunks[0].list_starts, 1)?;
    profiler.finished();
    Ok(images)
}

/// The times of passes; empty if the driver's timestamps are wrong (Mesa 22.3: a thousand times too short).
fn sound(bench: &Bench, passes: Vec<PassTime>) -> Vec<PassTime> {
    if faulty_software(&bench.gpu.device.adapter_info()) { Vec::new() } else { passes }
}

/// Times of a frame, or the reason why there are none.
fn frame(bench: &Bench, name: &str, scene: &Scene, [width, height]: [u32; 2], settings: Settings) -> Timed {
    let camera = scene.default_camera(width as f32 / height as f32);
    let mut counters = Vec::new();
    let runs = || -> Result<Vec<(f64, Vec<PassTime>)>, CliError> {
        let mut renderer = Renderer::with_engine(&bench.engine, settings)?;
        let uploaded = renderer.upload(scene)?;
        repeated(|| {
            let started = Instant::now();
            let rendering = renderer.render(&uploaded, &camera, width, height)?;
            let wall = 1e3 * started.elapsed().as_secs_f64();
            counters = rendering.report.counters;
            Ok((wall, sound(bench, rendering.report.passes)))
        })
    };
    of_runs(name, [width, height], scene.lights.len(), runs(), counters)
}

/// Times of building deep images with the default directions, 64 x 64 texels each.
fn deep_images(bench: &Bench, scene: &Scene) -> Timed {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let runs = || -> Result<Vec<(f64, Vec<PassTime>)>, CliError> {
        let settings = Settings { shadows: Shadows::BVH, ..Settings::direct_light() };
        let uploaded = Renderer::with_engine(&bench.engine, settings)?.upload(scene)?;
        let mut profiler = Profiler::new(device, queue);
        let images = DeepImageSettings { resolution: RESOLUTION, ..DeepImageSettings::default() };
        let mut builder = bench.engine.within(|| DeepImageBuilder::new(device, images))?;
        repeated(|| {
            let started = Instant::now();
            let mut frame = Frame::new(device, queue, &mut profiler);
            let made = builder.record(&mut frame, &uploaded)?;
            frame.submit();
            read_back::<u32>(device, queue, &made.chunks[0].list_starts, 1)?;
            Ok((1e3 * started.elapsed().as_secs_f64(), sound(bench, profiler.finished())))
        })
    };
    of_runs("building deep images", [RESOLUTION, RESOLUTION], scene.lights.len(), runs(), Vec::new())
}

fn of_runs(
    name: &str,
    [width, height]: [u32; 2],
    lights: usize,
    runs: Result<Vec<(f64, Vec<PassTime>)>, CliError>,
    counters: Vec<(String, u64)>,
) -> Timed {
    let mut timed = Timed {
        name: name.to_owned(),
        width,
        height,
        lights,
        runs: 0,
        median_ms: 0.0,
        least_ms: 0.0,
        most_ms: 0.0,
        is_wall: false,
        passes: Vec::new(),
        over_watchdog: Vec::new(),
        counters,
        reason: None,
    };
    let runs = match runs {
        Ok(runs) => runs,
        Err(error) => return Timed { reason: Some(error.what()), ..timed },
    };
    timed.runs = runs.len();
    timed.is_wall = runs.iter().all(|(_, passes)| passes.is_empty());
    let total = |(wall, passes): &(f64, Vec<PassTime>)| match passes.is_empty() {
        true => *wall,
        false => passes.iter().map(|pass| pass.ms).sum(),
    };
    [timed.median_ms, timed.least_ms, timed.most_ms] = spread(runs.iter().map(total));
    timed.over_watchdog = over_watchdog(runs.iter().flat_map(|(_, passes)| passes));
    timed.passes = pass_medians(&runs.iter().map(|(_, passes)| by_name(passes)).collect::<Vec<_>>());
    timed
}

/// The passes of a run. Passes of one name are summed.
fn by_name(passes: &[PassTime]) -> Vec<(String, f64)> {
    let mut all: Vec<(String, f64)> = Vec::new();
    for pass in passes {
        match all.iter_mut().find(|(name, _)| *name == pass.name) {
            Some((_, ms)) => *ms += pass.ms,
            None => all.push((pass.name.clone(), pass.ms)),
        }
    }
    all
}

/// The longest command over [`WATCHDOG_MS`] of each pass.
fn over_watchdog<'p>(commands: impl Iterator<Item = &'p PassTime>) -> Vec<(String, f64)> {
    let mut longest: Vec<(String, f64)> = Vec::new();
    for command in commands.filter(|command| command.ms > WATCHDOG_MS) {
        match longest.iter_mut().find(|(name, _)| *name == command.name) {
            Some((_, ms)) => *ms = ms.max(command.ms),
            None => longest.push((command.name.clone(), command.ms)),
        }
    }
    longest
}

/// The median over all runs, for each pass of the last run.
fn pass_medians(runs: &[Vec<(String, f64)>]) -> Vec<(String, f64)> {
    let Some(last) = runs.last() else { return Vec::new() };
    let median = |name: &String| {
        let of_runs = runs.iter().filter_map(|run| Some(run.iter().find(|(other, _)| other == name)?.1));
        (name.clone(), spread(of_runs)[0])
    };
    last.iter().map(|(name, _)| median(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_taken_per_pass() {
        let pass = |name: &str, ms| PassTime { name: name.to_owned(), ms };
        let runs = [[1.0, 9.0], [5.0, 1.0], [2.0, 4.0]]
            .map(|[a, b]| by_name(&[pass("trace", a), pass("shade", b), pass("trace", 1.0)]));
        assert_eq!(pass_medians(&runs), [("trace".to_owned(), 3.0), ("shade".to_owned(), 4.0)]);
        assert_eq!(spread([3.0, 1.0, 2.0]), [2.0, 1.0, 3.0]);
        assert_eq!(spread([3.0, 1.0, 2.0, 9.0]), [2.5, 1.0, 9.0]);
    }

    #[test]
    fn the_watchdog_limit_applies_to_single_commands() {
        let pass = |name: &str, ms| PassTime { name: name.to_owned(), ms };
        let commands = [pass("relax", 1500.0), pass("relax", 1500.0), pass("trace", 2100.0), pass("trace", 2500.0)];
        assert_eq!(over_watchdog(commands.iter()), [("trace".to_owned(), 2500.0)]);
    }

    #[test]
    fn slow_runs_stop_early_and_fast_ones_repeat() {
        let mut count = 0;
        let fast = repeated(|| {
            count += 1;
            Ok(count)
        });
        assert_eq!(fast.unwrap_or_default(), (2..=MOST_RUNS + 1).collect::<Vec<_>>(), "the first does not count");
    }
}
