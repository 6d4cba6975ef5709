//! Common steps of all benches: flags, adapter, output folder, timed cases.

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

/// Flags of every bench.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The folder for the report and its images. It is made if it is not there. Without it: bench- and the bench's name.
    #[arg(short, long, alias = "out", value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// How often everything is timed, after one run that is not.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// Where to run: a part of an adapter's name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
}

/// A bench that runs.
pub struct Run {
    pub folder: PathBuf,
    pub gpu: Gpu,
    /// Cases have much in common: it is compiled once.
    pub engine: Engine,
    pub runs: u32,
}

impl Run {
    /// Makes the folder, opens the adapter, and says what is wrong with its driver. `name`: the bench's.
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

    /// As [`Self::start`]; an error where the adapter cannot time its passes.
    pub fn start_timed(args: &RunArgs, name: &str) -> Result<Self, CliError> {
        let run = Self::start(args, name)?;
        if run.gpu.description.timestamps {
            return Ok(run);
        }
        let name = &run.gpu.description.name;
        Err(CliError::new(format_args!("{name} cannot time its passes"), "choose another adapter with --adapter"))
    }
}

/// With all folders above it.
pub fn make_folder(folder: &Path) -> Result<(), CliError> {
    fs::create_dir_all(folder)
        .map_err(|error| CliError::new(format_args!("{}: {error}", folder.display()), "name a folder that can be made"))
}

/// What the first run gives, and of `runs` others the one that took least by `ms`.
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

/// The least of each figure over `runs` runs, after one that does not count.
pub fn leasts<const N: usize, E>(runs: u32, mut run: impl FnMut() -> Result<[f64; N], E>) -> Result<[f64; N], E> {
    run()?;
    let mut least = [f64::INFINITY; N];
    for _ in 0..runs {
        let found = run()?;
        least = std::array::from_fn(|i| least[i].min(found[i]));
    }
    Ok(least)
}

/// The median of each figure over `runs` runs, all of which count.
pub fn medians<const N: usize, E>(runs: u32, run: impl FnMut() -> Result<[f64; N], E>) -> Result<[f64; N], E> {
    let found = std::iter::repeat_with(run).take(runs as usize).collect::<Result<Vec<_>, _>>()?;
    Ok(std::array::from_fn(|i| median(&mut found.iter().map(|figures| figures[i]).collect::<Vec<_>>())))
}

/// The middle value, or the upper of the two middle ones; 0 of none.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A counter; 0 where there is none of this name.
pub fn counter(report: &Report, name: &str) -> u64 {
    report.counters.iter().find(|(known, _)| known == name).map_or(0, |(_, count)| *count)
}

/// Device milliseconds of the passes whose names start so.
pub fn ms_of(passes: &[PassTime], start: &str) -> f64 {
    // The sum of nothing is minus zero.
    passes.iter().filter(|pass| pass.name.starts_with(start)).fold(0.0, |sum, pass| sum + pass.ms)
}

/// Device milliseconds of a frame, without those that build deep images, which are kept as long as nothing moves.
pub fn frame_ms(passes: &[PassTime]) -> f64 {
    passes.iter().filter(|pass| !pass.name.starts_with("deep_images/")).fold(0.0, |sum, pass| sum + pass.ms)
}

/// Sums device milliseconds by what each pass is for; `of` is asked in the order in which they ran. Those of none are left aside.
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
    fn medians_and_leasts_leave_outliers_aside() {
        assert_eq!([median(&mut [3.0, 1.0, 2.0]), median(&mut [4.0, 1.0]), median(&mut [])], [2.0, 4.0, 0.0]);
        let runs = |values: &'static [f64]| {
            let mut values = values.iter();
            move || Ok::<_, ()>([*values.next().unwrap(); 2])
        };
        assert_eq!(leasts(2, runs(&[1.0, 9.0, 5.0])), Ok([5.0; 2]), "the first run does not count");
        assert_eq!(medians(3, runs(&[1.0, 9.0, 5.0])), Ok([5.0; 2]));
        assert_eq!(least(2, runs(&[1.0, 9.0, 5.0]), |found| found[0]), Ok(([1.0; 2], [5.0; 2])));
        assert_eq!(medians(1, || Err::<[f64; 1], _>("no")), Err("no"));
    }

    #[test]
    fn deep_images_are_no_part_of_a_frame() {
        let passes = [("deep_images/sort", 4.0), ("prepass", 1.0), ("shading/forward", 2.0)];
        let passes = passes.map(|(name, ms)| PassTime { name: name.to_owned(), ms });
        assert_eq!([frame_ms(&passes), ms_of(&passes, "deep_images/"), ms_of(&passes, "sky")], [3.0, 4.0, 0.0]);
        let report = Report { passes: passes.into(), counters: vec![("rays".to_owned(), 7)] };
        assert_eq!([counter(&report, "rays"), counter(&report, "lights")], [7, 0]);
    }
}
