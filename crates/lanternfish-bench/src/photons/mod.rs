//! `lanternfish-bench photons`: photon differentials beside rays from every pixel, virtual lights and the path tracer
//! [Aalund2015, §5.2].

mod configurations;
mod markdown;
mod occlusion;

use lanternfish_gpu::PassTime;
use serde::Serialize;

use self::{
    configurations::{configurations, converging, walked},
    occlusion::OcclusionRow,
};
use super::one_bounce::{Bench, Configuration, Errors, Flicker, Heading, OneBounceArgs};
use lanternfish_cli::{error::CliError, progress::Progress};

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Report {
    #[serde(flatten)]
    heading: Heading,
    rows: Vec<Row>,
    means: Vec<Mean>,
    occlusion: Vec<OcclusionRow>,
    flicker: Vec<Flicker>,
}

/// One way to find indirect light.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub name: String,
    /// Device milliseconds of the whole frame, without the building of deep images; and of that.
    pub frame_ms: f64,
    pub deep_images_ms: f64,
    pub times: Times,
    /// Photons from the lights that surfaces reflect; those that they were split into that came to a surface; those that are splatted.
    pub reflected: u64,
    pub landed: u64,
    pub splatted: u64,
    /// Photons that left the scene, or are left out for they light nothing that is seen.
    pub escaped: u64,
    pub off_screen: u64,
    pub hidden: u64,
    #[serde(flatten)]
    pub errors: Errors,
}

/// Device milliseconds of photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Times {
    /// From the lights to the first surface.
    pub emit: f64,
    /// Rays alone, those that look for edges too.
    pub trace: f64,
    /// Putting those in order that are seen.
    pub keep: f64,
    /// Lists of photons.
    pub lists: f64,
    /// Adding them up.
    pub splat: f64,
}

impl Times {
    fn of(passes: &[PassTime]) -> Self {
        let mut times = Self::default();
        // Light culling is recorded twice: for the scene's lights before, and for photons after these are traced.
        let mut has_photons = false;
        for pass in passes {
            let own = pass.name.strip_prefix("indirect/photon_splatting/");
            has_photons = (has_photons || own.is_some()) && !pass.name.starts_with("shading/");
            let time = match own {
                Some("emit") => &mut times.emit,
                Some("trace" | "land") => &mut times.trace,
                Some("gather" | "splat" | "add") => &mut times.splat,
                Some(_) => &mut times.keep,
                None if pass.name.starts_with("light_culling/") && has_photons => &mut times.lists,
                None => continue,
            };
            *time += pass.ms;
        }
        times
    }
}

/// A mean of frames.
#[derive(Clone, Debug, Serialize)]
pub struct Mean {
    pub name: String,
    pub frames: u32,
    #[serde(flatten)]
    pub errors: Errors,
    /// Mean HDR-FLIP of the mean of as many frames without indirect light to the path tracer's direct light.
    pub direct_flip: f64,
}

pub fn run(args: &OneBounceArgs) -> Result<(), CliError> {
    let mut progress = Progress::start(false);
    let bench = Bench::start(args, "photons", &mut progress)?;
    let mut rows = Vec::new();
    for configuration in configurations(&bench.look, args.quick).iter().filter(|c| args.asks_for(&c.name)) {
        rows.push(progress.step("render", &configuration.name, || row(&bench, configuration))?);
    }
    let mut means = Vec::new();
    let asks_for = |c: &Configuration, table: &str| args.asks_for(&format!("{}, {table}", c.name));
    let converging: Vec<_> =
        converging(&bench.look, args.quick).into_iter().filter(|c| asks_for(c, "frames")).collect();
    let counts: &[u32] = if args.quick { &[1, 4] } else { &[1, 16, 64] };
    for frames in counts.iter().copied().filter(|_| !converging.is_empty()) {
        let (direct, direct_flip) = progress.step("mean", "direct light", || bench.direct_mean(frames))?;
        for configuration in &converging {
            let name = configuration.name.clone();
            let errors = progress.step("mean", &name, || bench.mean_row(configuration, frames, &direct))?;
            means.push(Mean { name, frames, errors, direct_flip });
        }
    }
    let occlusion = match !args.quick && args.asks_for("occlusion") {
        true => progress.step("occlusion", "Occlusion by 512 deep images", || occlusion::rows(&bench))?,
        false => Vec::new(),
    };
    let asked: Vec<_> = walked(&bench.look).into_iter().filter(|c| asks_for(c, "flicker")).collect();
    let flicker = if asked.is_empty() { Vec::new() } else { bench.flicker(&asked, &mut progress)? };
    progress.finish();

    let report = Report { heading: bench.heading.clone(), rows, means, occlusion, flicker };
    bench.write(&report, &markdown::to_markdown(&report))
}

fn row(bench: &Bench, configuration: &Configuration) -> Result<Row, CliError> {
    let (run, errors) = bench.row(configuration)?;
    let count = |name: &str| run.counter(&format!("photons/{name}"));
    let built = run.first.iter().filter(|pass| pass.name.starts_with("deep_images/"));
    Ok(Row {
        name: configuration.name.clone(),
        frame_ms: run.frame_ms(),
        deep_images_ms: built.map(|pass| pass.ms).sum(),
        times: Times::of(&run.picture.report.passes),
        reflected: count("reflected"),
        landed: count("landed"),
        splatted: count("splatted"),
        escaped: count("escaped"),
        off_screen: count("off_screen"),
        hidden: count("hidden"),
        errors,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_go_to_their_columns() {
        let pass = |(name, ms): (&str, f64)| PassTime { name: name.to_owned(), ms };
        let passes = [
            ("light_culling/clustered/mark", 100.0),
            ("indirect/photon_splatting/emit", 1.0),
            ("indirect/photon_splatting/trace", 2.0),
            ("indirect/photon_splatting/keep", 4.0),
            ("light_culling/clustered/mark", 8.0),
            ("indirect/photon_splatting/gather", 16.0),
            ("shading/forward", 1000.0),
            ("light_culling/tiled/count", 1000.0),
        ];
        let times = Times::of(&passes.map(pass));
        assert_eq!(times, Times { emit: 1.0, trace: 2.0, keep: 4.0, lists: 8.0, splat: 16.0 });
    }
}
