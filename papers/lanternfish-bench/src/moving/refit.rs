//! Ray rates through a BVH that was refit after a motion, compared with one built after it.

use std::time::Instant;

use glam::Vec3;
use lanternfish::{
    GpuScene,
    rays::{RayTracer, TracedRay},
    settings::{Shadows, Tracer},
};
use lanternfish_cli::error::CliError;
use lanternfish_gpu::{Frame, Profiler, read_back};
use lanternfish_reference::Random;

use super::{Motion, moved};
use crate::{
    document::Document,
    table::{Row, decimal},
};

/// Greatest shifts of parts, as ratios to the scene's diagonal.
const REACHES: [f32; 4] = [0.001, 0.01, 0.1, 0.5];

/// Number of successive moves of one part each.
const MOVES: u32 = 1000;

impl Motion {
    /// Measures one motion of all parts by the host, and many motions of one part each by the device.
    pub fn refits(&self, rays: u32) -> Result<Vec<Row>, CliError> {
        let cases = REACHES.map(|reach| (0, reach)).into_iter().chain([(MOVES, 0.01)]);
        cases.map(|(moves, reach)| self.refit(moves, reach, rays)).collect()
    }

    fn refit(&self, moves: u32, reach: f32, rays: u32) -> Result<Row, CliError> {
        let (renderer, scene) = (self.renderer(Shadows::BVH)?, &self.scene);
        let mut elsewhere = moved(scene, reach);
        let mut list = Vec::new();
        if moves > 0 {
            // Each move is relative to the part's last position. Parts of a large scene move once or twice, those of a small scene often.
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
        let rays: Vec<TracedRay> = (0..rays).map(ray).collect();
        let mut uploaded = renderer.upload(scene)?;
        let (mut rebuilt, mut longest_ms, mut most_bytes) = (0, 0.0f64, 0);
        if moves == 0 {
            renderer.update(&mut uploaded, &elsewhere)?;
        }
        for (i, one) in list.iter().enumerate() {
            let start = Instant::now();
            let sent = renderer.move_instances(&mut uploaded, std::slice::from_ref(one))?;
            // The first move compiles pipelines.
            if i > 0 {
                longest_ms = longest_ms.max(1e3 * start.elapsed().as_secs_f64());
                most_bytes = most_bytes.max(sent.bytes);
            }
            rebuilt += u32::from(sent.has_rebuilt);
        }
        let fresh = renderer.upload(&elsewhere)?;
        let [(refit, actual), (built, expected)] = self.rates([&uploaded, &fresh], &rays)?;
        let differing = actual.iter().zip(&expected).filter(|(a, b)| a != b).count();
        Ok(Row::default()
            .number("moves", "moves", moves)
            .number("reach", "shift", decimal(reach))
            .said_as(format_args!("{} %", 100.0 * reach))
            .number("rebuilt", "in the background", rebuilt)
            .data("longest_ms", longest_ms)
            .data("most_bytes", most_bytes)
            .fixed("refit_rate", "refit, M rays/s", 2, refit)
            .fixed("fresh_rate", "built again", 2, built)
            .shown("ratio", format_args!("{:.2}", refit / built))
            .number("differing", "distances that differ", differing))
    }

    /// Traces two scenes alternately. Returns for each the best ray rate of all runs, millions per second, and the distance of each ray, m.
    fn rates(&self, scenes: [&GpuScene; 2], rays: &[TracedRay]) -> Result<[(f64, Vec<f32>); 2], CliError> {
        let gpu = &self.bench.gpu;
        let tracer = RayTracer::new(&gpu.device)?;
        let buffer = tracer.upload(&gpu.device, rays)?;
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut rates = [0; 2].map(|_| (0.0f64, Vec::new()));
        for run in 0..=self.bench.runs {
            for (scene, (rate, distances)) in scenes.into_iter().zip(&mut rates) {
                let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
                let buffer_of_distances =
                    tracer.record(&mut frame, scene, Tracer::BVH, None, &buffer, rays.len() as u32)?;
                let ms = self.timed(|| {
                    frame.submit();
                    Ok(())
                })?;
                if run > 0 {
                    *rate = rate.max(rays.len() as f64 / ms / 1e3);
                }
                *distances = read_back::<f32>(&gpu.device, &gpu.queue, &buffer_of_distances, rays.len())?;
            }
        }
        Ok(rates)
    }
}

/// Adds the table to a report.
pub fn report(report: &mut Document, rows: Vec<Row>) {
    let longest = rows.iter().filter(|row| row.f64("moves") > 0.0).map(|row| {
        let (moves, ms, bytes) = (row.get("moves"), row.f64("longest_ms"), row.get("most_bytes"));
        format!("The longest of {moves} moves blocked the host for {ms:.1} ms; a move sent at most {bytes} bytes.")
    });
    let longest: Vec<String> = longest.collect();
    let text = "Rays start anywhere in the scene's bounding box, in all directions. *Shift*: greatest shift of the parts, relative to the \
                scene's diagonal; parts are rotated too. *Moves*: number of moves of one part each, by the device; 0: one motion of all \
                parts, by the host. *In the background*: number of rebuilds of the BVH in the background.";
    report.section("Rays through the BVH, closest hit", text, "refits", rows);
    longest.into_iter().for_each(|text| report.paragraph(text));
}
