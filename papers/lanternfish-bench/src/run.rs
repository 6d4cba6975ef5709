//! Common parts of all benchmarks: flags, adapter, output folder, timing.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::Args;
use lanternfish::Report;
use lanternfish_cli::{
    args::adapter,
    error::{self, CliError},
};
use lanternfish_gpu::{AdapterChoice, Engine, Gpu, PassTime, driver_warning};

/// Flags of every benchmark.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Folder of the report and its images, created if missing. Default: bench- and the benchmark's name.
    #[arg(short, long, alias = "out", value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Number of timed runs, after one warm-up run.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// Adapter: a part of its name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
}

/// A running benchmark.
pub struct Run {
    pub folder: PathBuf,
    pub gpu: Gpu,
    /// Shared by all configurations, so that common pipelines are compiled once.
    pub engine: Engine,
    pub runs: u32,
}

impl Run {
    /// Creates the folder, opens the adapter, and prints a warning about known driver faults. `name` is the name of the benchmark.
    pub fn start(args: &RunArgs, name: &str) -> Result<Self, CliError> {
        let folder = args.output.clone().unwrap_or_else(|| format!("bench-{name}").into());
        make_folder(&folder)?;
        let gpu = Gpu::open(&args.adapter.clone().unwrap_or_default())?;
        if let Some(warning) = driver_warning(&gpu.device.adapter_info()) {
            error::say(&format_args!("warning: {warning}"));
        }
        let engine = Engine::new(&gpu.device, &gpu.queue);
        Ok(Self { folder, gpu, engine, runs: args.runs })
    }

    /// As [`Self::start`], but fails if the adapter has no timestamps.
    pub fn start_timed(args: &RunArgs, name: &str) -> Result<Self, CliError> {
        let run = Self::start(args, name)?;
        if run.gpu.description.timestamps {
            return Ok(run);
        }
        let name = &run.gpu.description.name;
        Err(CliError::new(
            format_args!("{name} has no timestamps to time passes"),
            "choose another adapter with --adapter",
        ))
    }
}

/// Creates a folder and its parents.
pub fn make_folder(folder: &Path) -> Result<(), CliError> {
    fs::create_dir_all(folder).map_err(|error| {
        CliError::new(format_args!("{}: {error}", folder.display()), "choose a folder that can be created")
    })
}

/// Returns the result of a first run, and of `runs` more runs the one with the least time `ms`.
pub fn least<T, E>(runs: u32, mut run: impl FnMut() -> Result<T, E>, ms: impl Fn(&T) -> f64) -> Result<(T, T), E> {
    let first = run()?;
    let mut best = run()?;
    for _ in 1..runs {
        let next = run()?;
        if ms(&next) < ms(&best) {
            best = next;
        }
    }
    Ok((first, best))
}

/// Least of each figure over `runs` runs, after a warm-up run.
pub fn leasts<const N: usize, E>(runs: u32, mut run: impl FnMut() -> Result<[f64; N], E>) -> Result<[f64; N], E> {
    run()?;
    let mut least = [f64::INFINITY; N];
    for _ in 0..runs {
        let figures = run()?;
        least = std::array::from_fn(|i| least[i].min(figures[i]));
    }
    Ok(least)
}

/// Median of each figure over `runs` runs, without a warm-up run.
pub fn medians<const N: usize, E>(runs: u32, run: impl FnMut() -> Result<[f64; N], E>) -> Result<[f64; N], E> {
    let all = std::iter::repeat_with(run).take(runs as usize).collect::<Result<Vec<_>, _>>()?;
    Ok(std::array::from_fn(|i| median(&mut all.iter().map(|figures| figures[i]).collect::<Vec<_>>())))
}

/// The middle value, or the upper of the two middle values; 0 if there are none.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Value of the counter `name`; 0 if there is none.
pub fn counter(report: &Report, name: &str) -> u64 {
    report.counters.iter().find(|(counter, _)| counter == name).map_or(0, |(_, count)| *count)
}

/// Device time of the passes whose names begin with `start`, ms.
pub fn ms_of(passes: &[PassTime], start: &str) -> f64 {
    // A fold, because the empty `sum` is -0.0.
    passes.iter().filter(|pass| pass.name.starts_with(start)).fold(0.0, |sum, pass| sum + pass.ms)
}

/// Device time of a frame, ms, without building deep images, which are reused while nothing moves.
pub fn frame_ms(passes: &[PassTime]) -> f64 {
    passes.iter().filter(|pass| !pass.name.starts_with("deep_images/")).fold(0.0, |sum, pass| sum + pass.ms)
}

/// Sums the device times of passes by category, ms. `of` returns the category of a pass and is called in execution order. Passes without a
/// category are ignored.
pub fn sorted<const N: usize>(passes: &[PassTime], mut of: impl FnMut(&str) -> Option<usize>) -> [f64; N] {
    let mut sums = [0.0; N];
    for pass in passes {
        if let Some(kind) = of(&pass.name) {
            sums[kind] += pass.ms;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_leasts_ignore_outliers() {
        assert_eq!([median(&mut [3.0, 1.0, 2.0]), median(&mut [4.0, 1.0]), median(&mut [])], [2.0, 4.0, 0.0]);
        let runs = |values: &'static [f64]| {
            let mut values = values.iter();
            move || Ok::<_, ()>([*values.next().unwrap(); 2])
        };
        assert_eq!(leasts(2, runs(&[1.0, 9.0, 5.0])), Ok([5.0; 2]), "the first run does not count");
        assert_eq!(medians(3, runs(&[1.0, 9.0, 5.0])), Ok([5.0; 2]));
        assert_eq!(least(2, runs(&[1.0, 9.0, 5.0]), |figures| figures[0]), Ok(([1.0; 2], [5.0; 2])));
        assert_eq!(medians(1, || Err::<[f64; 1], _>("no")), Err("no"));
    }

    #[test]
    fn deep_images_are_no_part_of_a_frame() {
        let passes = [("deep_images/sort", 4.0), ("prepass", 1.0), ("shading/forward", 2.0)];
        let passes = passes.map(|(name, ms)| PassTime { name: name.to_owned(), ms });
        assert_eq!([frame_ms(&passes), ms_of(&passes, "deep_images/"), ms_of(&passes, "sky")], [3.0, 4.0, 0.0]);
        let report = Report { passes: passes.into(), counters: vec![("rays".to_owned(), 7)], ..Report::default() };
        assert_eq!([counter(&report, "rays"), counter(&report, "lights")], [7, 0]);
    }
}
