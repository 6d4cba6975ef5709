//! Rates of an adapter: rays of every tracer, sorted keys, frames of a fixed scene.

use std::time::Instant;

use glam::Vec3;
use lanternfish::{
    GpuScene, Renderer, Settings,
    rays::{RayTracer, Structure, TracedRay, TracedStructure},
    settings::{Preset, Shadows, Tracer},
};
use lanternfish_gpu::{Frame, Profiler, primitives::RadixSort, read_back, storage_buffer_of};
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
    ab::{self, VARIANTS, WalkCount},
    measure::{Bench, keys},
    report::{Rate, Report, Timed},
    timing::{Run, Runs, frame, of_runs, rate, repeated, sound, timed},
};
use crate::{error::CliError, repeat::Repeat};

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
    pub presets: Vec<Preset>,
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
            // Fewer rays end before a card has raised its clocks, and count how the device starts and drains.
            rays: if is_software { 1 << 16 } else { 1 << 22 },
            sorted_keys: if is_software { 1 << 18 } else { 1 << 22 },
            presets: if is_quick { Vec::new() } else { vec![Preset::Draft, Preset::Good] },
            has_deep_images: !is_quick,
            is_software,
        }
    }

    /// Comparisons of variants of the traversal, in order: what decides first.
    pub fn variant_steps(&self) -> Vec<Step> {
        let in_frames = (0..VARIANTS.len()).filter(|index| VARIANTS[*index].is_for_frames);
        let mut steps: Vec<_> = (0..VARIANTS.len()).map(|index| Step::Variant { index, lists: usize::MAX }).collect();
        steps.insert(1, Step::WalkCounts);
        steps.extend(in_frames.map(Step::VariantInFrames));
        steps.push(Step::Again(Table::Rates, Box::new(Step::Variant { index: 0, lists: 1 })));
        steps
    }

    /// The measurements, in order.
    pub fn steps(&self) -> Vec<Step> {
        let tracers = Tracer::all()
            .into_iter()
            .filter(|tracer| tracer.is_exact() || (self.has_deep_images && uses_deep_images(*tracer)));
        // The first row of each table is measured again at its end.
        let mut steps: Vec<Step> = tracers.map(Step::Trace).collect();
        steps.push(Step::Sort);
        steps.extend(steps.first().map(|first| Step::Again(Table::Rates, Box::new(first.clone()))));
        let rate_steps = steps.len();
        for size in self.sizes.iter().copied() {
            steps.extend(self.lights.iter().map(|lights| Step::DirectLight { size, lights: *lights }));
            let size = if self.is_software { size.map(|edge| edge.div_ceil(2)) } else { size };
            steps.extend(self.presets.iter().map(|preset| Step::AllLight { size, preset: *preset }));
        }
        steps.extend(self.has_deep_images.then_some(Step::DeepImages));
        steps.extend(steps.get(rate_steps).map(|first| Step::Again(Table::Frames, Box::new(first.clone()))));
        steps
    }
}

/// One measurement.
#[derive(Clone, Debug)]
pub enum Step {
    Sort,
    Trace(Tracer),
    DirectLight {
        size: [u32; 2],
        lights: u32,
    },
    AllLight {
        size: [u32; 2],
        preset: Preset,
    },
    DeepImages,
    /// A variant of the traversal by index, with the first so many lists of rays, and in frames.
    Variant {
        index: usize,
        lists: usize,
    },
    VariantInFrames(usize),
    /// Nodes, triangles and active lanes of a ray.
    WalkCounts,
    /// The step of a table's first row, whose row is compared.
    Again(Table, Box<Step>),
}

/// A table of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    Rates,
    Frames,
}

/// The measured rows.
#[derive(Debug, Default)]
pub struct Measured {
    pub rates: Vec<Rate>,
    pub frames: Vec<Timed>,
    pub walk_counts: Vec<WalkCount>,
    pub repeats: Vec<Repeat>,
}

/// Light count of frames with all light.
const LIGHTS: u32 = 1000;

impl Step {
    pub fn name(&self) -> String {
        match self {
            Self::Sort => "sorting".to_owned(),
            Self::Trace(tracer) => format!("tracing lists of rays, {tracer}"),
            Self::DirectLight { size: [width, height], lights } => {
                format!("direct light, {lights} lights, {width} x {height}")
            }
            Self::AllLight { size: [width, height], preset } => format!("all light, {preset}, {width} x {height}"),
            Self::DeepImages => "building deep images".to_owned(),
            Self::Variant { index, .. } => format!("rays: {}", VARIANTS[*index].name),
            Self::VariantInFrames(index) => format!("frames: {}", VARIANTS[*index].name),
            Self::WalkCounts => "nodes a ray".to_owned(),
            Self::Again(_, first) => format!("{} again", first.name()),
        }
    }

    /// True if it ends in time after so many seconds of at `most`, if it and the repetition after it take as long as the `longest` before
    /// them. Repetitions are always in time.
    pub fn is_in_time(&self, seconds: f64, longest: f64, most: f64) -> bool {
        matches!(self, Self::Again(..)) || seconds + 2.0 * longest <= most
    }

    /// Runs the measurement. `before`: the report with the rows before it. Returns an error if it cannot run at all; the row of a failed
    /// frame holds the reason.
    pub fn measure(&self, bench: &Bench, extent: &Extent, before: &Report) -> Result<Measured, CliError> {
        let mut measured = Measured::default();
        let Measured { rates, frames, .. } = &mut measured;
        match self {
            Self::Sort => rates.push(sort(bench, extent)?),
            Self::Trace(tracer) => bench.engine.within(|| trace(bench, extent, *tracer, &demo("atrium")?, rates))?,
            Self::DirectLight { size, lights } => {
                frames.push(frame(
                    bench,
                    &bench.engine,
                    "direct light",
                    &atrium(*lights)?,
                    *size,
                    Settings::direct_light(),
                ));
            }
            Self::AllLight { size, preset } => {
                let name = format!("all light, {preset}");
                frames.push(frame(bench, &bench.engine, &name, &atrium(LIGHTS)?, *size, Settings::of_preset(*preset)));
            }
            Self::DeepImages => frames.push(deep_images(bench, &demo("atrium")?)),
            Self::Variant { index, lists } => {
                ab::trace(bench, extent, bench.subject(extent)?, &VARIANTS[*index], *lists, rates)?;
            }
            Self::VariantInFrames(index) => ab::in_frames(bench, extent, &VARIANTS[*index], rates)?,
            Self::WalkCounts => measured.walk_counts = ab::count(bench, bench.subject(extent)?)?,
            Self::Again(table, first) => {
                let again = first.measure(bench, extent, before)?;
                let (firsts, lasts) = match table {
                    Table::Rates => (before.rates.first().map(row_of_rate), again.rates.first().map(row_of_rate)),
                    Table::Frames => (before.frames.first().map(row_of_frame), again.frames.first().map(row_of_frame)),
                };
                let pair = firsts.zip(lasts).filter(|(first, last)| first.0 == last.0);
                measured.repeats.extend(pair.map(|((name, first), (_, last))| Repeat::new(name, first, last)));
            }
        }
        Ok(measured)
    }
}

/// The atrium with `lights` lights: its own first, then light rain.
pub(super) fn atrium(lights: u32) -> Result<Scene, CliError> {
    let mut scene = demo("atrium")?;
    let rain = (lights as usize).saturating_sub(scene.lights.len()) as u32;
    scene.lights.extend(light_rain(&scene.bounds(), rain, None, 0, 0.0));
    scene.lights.truncate(lights as usize);
    Ok(scene)
}

fn row_of_rate(rate: &Rate) -> (String, f64) {
    (rate.name.clone(), rate.median)
}

fn row_of_frame(frame: &Timed) -> (String, f64) {
    let Timed { name, lights, width, height, .. } = frame;
    (format!("{name}, {lights} lights, {width} x {height}"), frame.median_ms)
}

fn sort(bench: &Bench, extent: &Extent) -> Result<Rate, CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let sort = RadixSort::new(device, "doctor/sort")?;
    let mut profiler = Profiler::new(device, queue);
    let pairs = keys(extent.sorted_keys);
    let [keys, values] = [0, 1].map(|i| pairs.iter().map(|pair| [pair.0, pair.1][i]).collect::<Vec<u32>>());
    let ms = repeated(bench, || {
        let upload = |list: &[u32]| storage_buffer_of(device, "doctor/sort", list, wgpu::BufferUsages::empty());
        let (keys, values) = (upload(&keys)?, upload(&values)?);
        let (ms, ()) =
            timed(bench, &mut profiler, |frame| Ok(sort.record(frame, &keys, &values, extent.sorted_keys, 32)?))?;
        Ok(ms)
    })?;
    Ok(rate(format!("sort, {} pairs of 32 bits", extent.sorted_keys), "Mkeys/s", pairs.len(), ms))
}

/// True if the tracer needs ray lists with directions of deep images.
fn uses_deep_images(tracer: Tracer) -> bool {
    tracer.structure(&Structure::NONE).is::<DeepImageSettings>()
}

/// Coherent rays from the camera through neighbouring pixels, and random rays from all over the scene.
pub(super) fn lists(
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
    let shadows = if through.is_exact() { Shadows::Traced(through) } else { Shadows::BVH };
    let settings = Settings::direct_light().with_shadows(shadows);
    let uploaded = Renderer::with_engine(&bench.engine, settings)?.upload(scene)?;
    let mut profiler = Profiler::new(device, queue);
    let images = (!through.is_exact()).then(|| built(bench, &mut profiler, &uploaded)).transpose()?;
    let tracer = RayTracer::new(device)?;
    let camera = scene.default_camera(1.0);
    // A software adapter's own acceleration structure is slow.
    let count = if extent.is_software && through == Tracer::RAY_QUERY { extent.rays / 8 } else { extent.rays };
    for (order, rays) in lists(scene, &camera, images.as_ref(), count) {
        let list = tracer.upload(device, &rays)?;
        let ms = repeated(bench, || {
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
        rates.push(rate(format!("{through}, {order} rays, closest hit"), "Mrays/s", count as usize, ms));
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

/// Times of building deep images with the default directions, 64 x 64 texels each.
fn deep_images(bench: &Bench, scene: &Scene) -> Timed {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    let runs = || -> Result<Runs<Run>, CliError> {
        let settings = Settings::direct_light().with_shadows(Shadows::BVH);
        let uploaded = Renderer::with_engine(&bench.engine, settings)?.upload(scene)?;
        let mut profiler = Profiler::new(device, queue);
        let images = DeepImageSettings { resolution: RESOLUTION, ..DeepImageSettings::default() };
        let mut builder = bench.engine.within(|| DeepImageBuilder::new(device, images))?;
        repeated(bench, || {
            let started = Instant::now();
            let mut frame = Frame::new(device, queue, &mut profiler);
            let made = builder.record(&mut frame, &uploaded)?;
            frame.submit();
            read_back::<u32>(device, queue, &made.chunks[0].list_starts, 1)?;
            Ok((1e3 * started.elapsed().as_secs_f64(), sound(bench, profiler.finished())))
        })
    };
    of_runs("building deep images", [RESOLUTION, RESOLUTION], scene.lights.len(), runs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_beyond_the_deadline_are_left_out_except_repetitions() {
        let steps = Extent::new(true, true, None).variant_steps();
        let at = |seconds| steps.iter().filter(|step| step.is_in_time(seconds, 10.0, 100.0)).count();
        assert_eq!((at(0.0), at(80.0), at(80.1)), (steps.len(), steps.len(), 1));
        assert!(matches!(steps.last(), Some(Step::Again(..))) && steps[0].name() == "rays: as it is");
    }

    #[test]
    fn each_table_ends_with_its_first_row() {
        for (is_software, is_quick) in [(true, true), (true, false), (false, true), (false, false)] {
            let steps = Extent::new(is_software, is_quick, None).steps();
            let names: Vec<_> = steps.iter().map(Step::name).collect();
            let again: Vec<_> = steps.iter().enumerate().filter(|(_, step)| matches!(step, Step::Again(..))).collect();
            let [(end_of_rates, of_rates), (end, of_frames)] = again[..] else { panic!("{names:?}") };
            assert_eq!(of_rates.name(), format!("{} again", names[0]));
            assert_eq!((of_frames.name(), end), (format!("{} again", names[end_of_rates + 1]), steps.len() - 1));
        }
        assert!(Extent::new(false, false, None).rays >= 1 << 22 && Extent::new(true, false, None).rays < 1 << 20);
    }
}
