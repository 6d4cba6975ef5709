//! Variants of the traversal ([`variants`]), compared with the library's own on the rays of frames ([`lists`]), and in frames.

mod lists;
mod variants;

use lanternfish::{
    GpuScene, Renderer, Settings,
    rays::{RayTracer, TracedRay},
    settings::{Samples, Shadows, Tracer},
    shaders::edit,
};
use lanternfish_gpu::{Engine, Frame, Profiler, read_back};
use lanternfish_scene::Scene;
use serde::{Deserialize, Serialize};

use self::variants::{Edit, NODES, TRIANGLES, Variant, edited};
use super::{
    measure::Bench,
    report::Rate,
    speed::{Extent, atrium, lists as plain_lists},
    timing::{frame, rate, repeated, timed},
};
use crate::error::CliError;

pub use self::variants::VARIANTS;

/// Lights of the frames.
const LIGHTS: u32 = 1000;

/// Passes whose rays are measured in frames.
const PASSES: [&str; 4] = ["shadows/trace", "indirect/trace", "radiance_cache/shadow", "radiance_cache/trace"];

/// What a ray of a list takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkCount {
    pub list: String,
    /// Nodes that a ray visits, and triangles that it is tested with: means.
    pub nodes: f64,
    pub triangles: f64,
    /// Mean fraction of lanes that still visit nodes, in groups of 32 and of 64 rays that end with their longest.
    pub active_of_32: f64,
    pub active_of_64: f64,
}

impl WalkCount {
    /// Describes it.
    pub fn text(&self) -> String {
        let Self { list, nodes, triangles, active_of_32, active_of_64 } = self;
        let [of_32, of_64] = [active_of_32, active_of_64].map(|fraction| 100.0 * fraction);
        let walked = format!("{list}: {nodes:.1} nodes and {triangles:.1} triangles a ray");
        format!("{walked}, active lanes {of_32:.0} % of 32, {of_64:.0} % of 64")
    }
}

/// Lists of rays and the scene that they are traced through.
pub struct Subject {
    scene: Scene,
    lists: Vec<(&'static str, Vec<TracedRay>)>,
}

impl Subject {
    pub fn new(bench: &Bench, extent: &Extent) -> Result<Self, CliError> {
        let scene = atrium(LIGHTS)?;
        // Five lists and eleven variants: an eighth of the rays of other rates on a software adapter.
        let count = if extent.is_software { extent.rays / 8 } else { extent.rays };
        let [coherent, random] = plain_lists(&scene, &scene.default_camera(1.0), None, count);
        let traced = Traced::new(bench, &scene, &AS_SHIPPED, extent.is_software)?;
        let distances = traced.distances(bench, &coherent.1)?;
        let of_frame = lists::of_frame(&scene, &coherent.1, &distances, count as usize);
        let lists = [coherent, random].into_iter().chain(of_frame).filter(|(_, rays)| !rays.is_empty());
        Ok(Self { scene, lists: lists.collect() })
    }
}

const AS_SHIPPED: Variant = VARIANTS[0];

/// A variant, ready to trace.
struct Traced {
    engine: Engine,
    through: Tracer,
    scene: GpuScene,
    tracer: RayTracer,
    /// Fraction of the rays that it traces.
    part: usize,
}

/// An engine with the variant's shaders.
fn engine(bench: &Bench, variant: &Variant) -> Result<Engine, CliError> {
    let engine = Engine::new(&bench.gpu.device, &bench.gpu.queue);
    edit(&engine, edited(variant.edits)?);
    // Safety: the library's shaders index within bounds and end. A test compares the results of every variant.
    unsafe { engine.set_runtime_checks(variant.checks) };
    Ok(engine)
}

fn settings(through: Tracer) -> Settings {
    Settings::direct_light().with_shadows(Shadows::Traced(through))
}

impl Traced {
    fn new(bench: &Bench, scene: &Scene, variant: &Variant, is_software: bool) -> Result<Self, CliError> {
        let (engine, through) = (engine(bench, variant)?, variant.tracer);
        // The scene needs none of the variant's shaders.
        let scene = Renderer::with_engine(&bench.engine, settings(through))?.upload(scene)?;
        let tracer = engine.within(|| RayTracer::of(&bench.gpu.device, &[through]))?;
        // A software adapter's own acceleration structure is slow.
        let part = if is_software && through == Tracer::RAY_QUERY { 8 } else { 1 };
        Ok(Self { engine, through, scene, tracer, part })
    }

    fn record(&self, frame: &mut Frame<'_>, list: &wgpu::Buffer, count: u32) -> Result<wgpu::Buffer, CliError> {
        Ok(self.engine.within(|| self.tracer.record(frame, &self.scene, self.through, None, list, count))?)
    }

    /// The distances of rays, m; -1 on a miss. Variants that count write counts.
    fn distances(&self, bench: &Bench, rays: &[TracedRay]) -> Result<Vec<f32>, CliError> {
        let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
        let list = self.tracer.upload(device, rays)?;
        let mut profiler = Profiler::new(device, queue);
        let mut frame = Frame::new(device, queue, &mut profiler);
        let distances = self.record(&mut frame, &list, rays.len() as u32)?;
        frame.submit();
        Ok(read_back::<f32>(device, queue, &distances, rays.len())?)
    }
}

/// Adds the rates of a variant for the first so many lists, if the device supports it.
pub fn trace(
    bench: &Bench,
    extent: &Extent,
    subject: &Subject,
    variant: &Variant,
    lists: usize,
    rates: &mut Vec<Rate>,
) -> Result<(), CliError> {
    let (device, queue) = (&bench.gpu.device, &bench.gpu.queue);
    if !variant.tracer.is_supported(device) {
        return Ok(());
    }
    let traced = Traced::new(bench, &subject.scene, variant, extent.is_software)?;
    let mut profiler = Profiler::new(device, queue);
    for (name, rays) in subject.lists.iter().take(lists) {
        let rays = &rays[..rays.len() / traced.part];
        let list = traced.tracer.upload(device, rays)?;
        let mut last = None;
        let ms = repeated(bench, || {
            let (ms, distances) = timed(bench, &mut profiler, |frame| traced.record(frame, &list, rays.len() as u32))?;
            last = Some(distances);
            Ok(ms)
        })?;
        let distances = last.map(|buffer| read_back::<f32>(device, queue, &buffer, rays.len())).transpose()?;
        let mut rate = rate(format!("{name}: {}", variant.name), "Mrays/s", rays.len(), ms);
        rate.result = distances.map(|distances| hash(&distances));
        rates.push(rate);
    }
    Ok(())
}

/// A hash of every bit (FNV-1a).
fn hash(values: &[f32]) -> String {
    let fold = |hash: u64, value: &f32| (hash ^ u64::from(value.to_bits())).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", values.iter().fold(0xcbf2_9ce4_8422_2325, fold))
}

/// Nodes, triangles and active lanes of every list.
pub fn count(bench: &Bench, subject: &Subject) -> Result<Vec<WalkCount>, CliError> {
    let counting = |edits: &'static [Edit]| Traced::new(bench, &subject.scene, &Variant { edits, ..AS_SHIPPED }, false);
    let (nodes, triangles) = (counting(NODES)?, counting(TRIANGLES)?);
    let one = |(list, rays): &(&'static str, Vec<TracedRay>)| {
        let nodes = nodes.distances(bench, rays)?;
        Ok(WalkCount {
            list: (*list).to_owned(),
            triangles: mean(&triangles.distances(bench, rays)?),
            active_of_32: active(&nodes, 32),
            active_of_64: active(&nodes, 64),
            nodes: mean(&nodes),
        })
    };
    subject.lists.iter().map(one).collect()
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len().max(1) as f64
}

/// The fraction of lanes that are active in groups of this size, which take as many steps as their longest ray.
fn active(steps: &[f32], size: usize) -> f64 {
    let longest = |group: &[f32]| f64::from(group.iter().copied().fold(0.0, f32::max)) * group.len() as f64;
    let all: f64 = steps.chunks(size).map(longest).sum();
    steps.iter().map(|count| f64::from(*count)).sum::<f64>() / all.max(1.0)
}

/// Adds the rates of passes of frames with the variant's shaders: direct light of all lights, and all light with one sample a pixel.
pub fn in_frames(bench: &Bench, extent: &Extent, variant: &Variant, rates: &mut Vec<Rate>) -> Result<(), CliError> {
    if !variant.tracer.is_supported(&bench.gpu.device) {
        return Ok(());
    }
    let engine = engine(bench, variant)?;
    let scene = atrium(LIGHTS)?;
    let all = Settings::default().with_samples(Samples::One);
    let all = all.with_shadows(Shadows::Traced(variant.tracer));
    let size = if extent.is_software { [160, 90] } else { [1920, 1080] };
    for (name, settings) in [("direct light", settings(variant.tracer)), ("all light", all)] {
        let timed = frame(bench, &engine, name, &scene, size, settings);
        if let Some(reason) = timed.reason {
            return Err(CliError::new(reason, ""));
        }
        for pass in PASSES {
            let ms = timed.passes.iter().find(|(label, _)| label == pass).map(|(_, ms)| *ms);
            let rays = timed.costs.iter().find(|cost| cost.name == pass).and_then(|cost| cost.rays);
            let Some((ms, rays)) = ms.zip(rays).filter(|(ms, _)| *ms > 0.0) else { continue };
            let median = rays as f64 / ms / 1e3;
            let name = format!("{pass}, {name}: {}", variant.name);
            let clocks = timed.clocks.clone();
            let (least, most) = (median, median);
            rates.push(Rate {
                name,
                unit: "Mrays/s".to_owned(),
                median,
                least,
                most,
                runs: timed.runs,
                clocks,
                result: None,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::{Gpu, testing};

    use super::*;

    fn bench(gpu: &Gpu) -> Bench {
        let gpu = Gpu { device: gpu.device.clone(), queue: gpu.queue.clone(), description: gpu.description.clone() };
        let engine = Engine::new(&gpu.device, &gpu.queue);
        Bench::new(gpu, engine, None)
    }

    /// A variant that finds other hits would compare other work.
    #[gpu_test(full)]
    fn gpu_every_variant_finds_the_same_hits(gpu: &Gpu) {
        let bench = bench(gpu);
        let extent = Extent { rays: 1 << 15, ..Extent::new(true, true, None) };
        let subject = Subject::new(&bench, &extent).unwrap();
        let names: Vec<_> = subject.lists.iter().map(|(name, rays)| (*name, rays.len())).collect();
        let all = ["coherent", "random", "shadow rays", "indirect rays", "cache rays"].map(|name| (name, 1 << 12));
        assert_eq!(names, all);
        let traced = |variant: &Variant, rays: &[TracedRay]| {
            let traced = Traced::new(&bench, &subject.scene, variant, false).unwrap();
            traced.distances(&bench, rays).unwrap()
        };
        let (_, rays) = &subject.lists[3];
        let expected = traced(&AS_SHIPPED, rays);
        assert!(expected.iter().filter(|t| **t > 0.0).count() > rays.len() / 2, "most rays hit something");
        for variant in VARIANTS.iter().filter(|variant| variant.tracer == Tracer::BVH) {
            let found = traced(variant, rays);
            let hits = found.iter().zip(&expected);
            if variant.name == "without masks" {
                // Masked leaves stop these rays.
                assert!(hits.clone().all(|(t, expected)| *expected < 0.0 || (0.0..=*expected).contains(t)));
                assert!(hits.filter(|(t, expected)| t == expected).count() > rays.len() * 9 / 10);
                continue;
            }
            let others: Vec<_> = hits.enumerate().filter(|(_, (t, expected))| t != expected).take(5).collect();
            assert!(others.is_empty(), "{}: other hits: {others:?}", variant.name);
        }
        let wrong = [("rays/bvh/walk", "const GRID_CELLS = 255.0;", "const GRID_CELLS = -1e9;")];
        let wrong = Variant { edits: Box::leak(Box::new(wrong)), ..AS_SHIPPED };
        assert!(traced(&wrong, rays) != expected, "a wrong box test changes nothing");
        let counts = count(&bench, &subject).unwrap();
        println!("{counts:#?}");
        for count in &counts {
            assert!(count.nodes > 2.0 && count.triangles > 0.1, "{count:?}");
            assert!(0.0 < count.active_of_64 && count.active_of_64 <= count.active_of_32 && count.active_of_32 < 1.0);
        }
        assert!(counts[0].active_of_32 > counts[1].active_of_32, "coherent rays keep more lanes busy");
    }

    #[test]
    fn lanes_wait_for_the_longest_ray_of_their_group() {
        assert_eq!(active(&[4.0, 4.0, 1.0, 3.0], 2), 12.0 / 14.0);
        assert_eq!(active(&[4.0, 4.0, 1.0, 3.0], 4), 12.0 / 16.0);
        assert_eq!(active(&[2.0; 5], 4), 1.0);
    }
}
