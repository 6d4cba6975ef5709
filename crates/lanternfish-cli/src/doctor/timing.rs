//! Repeated runs: device times of frames and of their passes, after a warm-up.

use std::time::Instant;

use lanternfish::{Renderer, Report, Settings};
use lanternfish_gpu::{Engine, Frame, PassTime, Profiler, faulty_software};
use lanternfish_scene::Scene;

use super::{
    measure::Bench,
    report::{Rate, Timed, WATCHDOG_MS},
};
use crate::{error::CliError, pass_costs::pass_costs, times::sums, warm};

/// Most and least measured runs, after one warm-up run, and the time after which no further run starts, s. After twice that
/// time, fewer runs than the least suffice.
const MOST_RUNS: usize = 7;
const LEAST_RUNS: usize = 3;
const SECONDS: f64 = 2.0;

/// Results of repeated runs, and the clocks.
pub struct Runs<T> {
    all: Vec<T>,
    clocks: Option<String>,
}

/// Repeats a run within the time limit. Returns the results without those of the warm-up, which also compiles shaders.
pub fn repeated<T>(bench: &Bench, mut run: impl FnMut() -> Result<T, CliError>) -> Result<Runs<T>, CliError> {
    let clocks = warm::up(&bench.gpu, || run().map(drop))?;
    Ok(Runs { all: counted(run)?, clocks })
}

/// Repeats a run within the time limit.
fn counted<T>(mut run: impl FnMut() -> Result<T, CliError>) -> Result<Vec<T>, CliError> {
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
pub fn rate(name: String, unit: &str, count: usize, Runs { all, clocks }: Runs<f64>) -> Rate {
    let [median, least, most] = spread(all.iter().map(|ms| count as f64 / ms.max(1e-6) / 1e3));
    Rate { name, unit: unit.to_owned(), median, least, most, runs: all.len(), clocks, result: None }
}

/// Submits the frame that `record` fills and waits for it. Returns its time in milliseconds, from device timestamps or else
/// from the host's clock.
pub fn timed<R>(
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

/// The times of passes; empty if the driver's timestamps are wrong (Mesa 22.3: a thousand times too short).
pub fn sound(bench: &Bench, passes: Vec<PassTime>) -> Vec<PassTime> {
    if faulty_software(&bench.gpu.device.adapter_info()) { Vec::new() } else { passes }
}

/// Times of a frame, or the reason why there are none.
pub fn frame(
    bench: &Bench,
    engine: &Engine,
    name: &str,
    scene: &Scene,
    [width, height]: [u32; 2],
    settings: Settings,
) -> Timed {
    let camera = scene.default_camera(width as f32 / height as f32);
    let (mut commands, mut counters, mut memory) = (Vec::new(), Vec::new(), None);
    let runs = || -> Result<Runs<Run>, CliError> {
        let mut renderer = Renderer::with_engine(engine, settings)?;
        let uploaded = renderer.upload(scene)?;
        let runs = repeated(bench, || {
            let started = Instant::now();
            let rendering = renderer.render(&uploaded, &camera, [width, height])?;
            let wall = 1e3 * started.elapsed().as_secs_f64();
            let Report { passes, commands: of_frame, counters: counts, .. } = rendering.report;
            (commands, counters) = (of_frame, counts);
            Ok((wall, sound(bench, passes)))
        });
        let of_frames = renderer.memory();
        memory = Some((of_frames.bytes, of_frames.device_bytes));
        runs
    };
    let timed = of_runs(name, [width, height], scene.lights.len(), runs());
    let counter = |name: &str| counters.iter().find(|(n, _)| n == name).map(|(_, count)| *count);
    Timed { costs: pass_costs(&commands, counter), memory, counters, ..timed }
}

/// Host time of a frame, ms, and its passes.
pub type Run = (f64, Vec<PassTime>);

pub fn of_runs(name: &str, [width, height]: [u32; 2], lights: usize, runs: Result<Runs<Run>, CliError>) -> Timed {
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
        wall_ms: 0.0,
        costs: Vec::new(),
        memory: None,
        clocks: None,
        counters: Vec::new(),
        reason: None,
    };
    let Runs { all: runs, clocks } = match runs {
        Ok(runs) => runs,
        Err(error) => return Timed { reason: Some(error.what()), ..timed },
    };
    (timed.runs, timed.clocks) = (runs.len(), clocks);
    timed.wall_ms = spread(runs.iter().map(|(wall, _)| *wall))[0];
    timed.is_wall = runs.iter().all(|(_, passes)| passes.is_empty());
    let total = |(wall, passes): &(f64, Vec<PassTime>)| match passes.is_empty() {
        true => *wall,
        false => passes.iter().map(|pass| pass.ms).sum(),
    };
    [timed.median_ms, timed.least_ms, timed.most_ms] = spread(runs.iter().map(total));
    timed.over_watchdog = over_watchdog(runs.iter().flat_map(|(_, passes)| passes));
    timed.passes = pass_medians(&runs.iter().map(|(_, passes)| sums(passes.iter())).collect::<Vec<_>>());
    timed
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
fn pass_medians(runs: &[Vec<(&str, f64)>]) -> Vec<(String, f64)> {
    let Some(last) = runs.last() else { return Vec::new() };
    let median = |name: &str| {
        let of_runs = runs.iter().filter_map(|run| Some(run.iter().find(|(other, _)| *other == name)?.1));
        (name.to_owned(), spread(of_runs)[0])
    };
    last.iter().map(|(name, _)| median(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_taken_per_pass() {
        let pass = |name: &str, ms| PassTime { name: name.to_owned(), ms };
        let runs =
            [[1.0, 9.0], [5.0, 1.0], [2.0, 4.0]].map(|[a, b]| [pass("trace", a), pass("shade", b), pass("trace", 1.0)]);
        let runs = runs.each_ref().map(|run| sums(run.iter()));
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
        let fast = counted(|| {
            count += 1;
            Ok(count)
        });
        assert_eq!(fast.unwrap_or_default(), (1..=MOST_RUNS).collect::<Vec<_>>());
    }
}
