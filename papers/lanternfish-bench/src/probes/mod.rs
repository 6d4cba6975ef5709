//! `lanternfish-bench probes`: techniques of indirect light along a walk with references of its own.

mod motion;
mod views;

use std::path::PathBuf;

use clap::Args;
use lanternfish::{
    RenderedImage,
    settings::{History, Quality, Settings},
    techniques::{Probes, Sampled},
};
use lanternfish_cli::{
    error::CliError,
    parse::{self, Size},
    times::ms_of,
};

use crate::{
    bench::{Bench, RunArgs, Stage, is_requested},
    case::{Case, changed},
    table::Row,
    view::View,
};

/// Flags of `probes`.
#[derive(Debug, Args)]
pub struct ProbesArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Measure the first scene whose name contains these words. Repeatable.
    #[arg(long = "scene", value_name = "WORDS")]
    scenes: Vec<String>,
    /// Measure only techniques whose name contains these words. Repeatable.
    #[arg(long = "technique", value_name = "WORDS")]
    techniques: Vec<String>,
    /// Small images, few frames and samples, to test the benchmark itself.
    #[arg(long)]
    quick: bool,
    /// Another size of every image, pixels; scenes that are not as wide keep their shape.
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    size: Option<Size>,
    /// Frames of the walk. Default: 120.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=4096))]
    frames: Option<u32>,
    /// Frames of the walk from one reference to the next.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=4096))]
    every: u32,
    /// Samples per pixel of the path tracer's images. More: less noise, slower. Default: 64.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    spp: Option<u64>,
    /// Diffuse rays a pixel of the references in motion, with a quarter as many glossy ones, without filter and clamp.
    /// 0: the path tracer. More: less noise, slower. Default: 128.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=4096))]
    reference_rays: Option<u32>,
    /// Folder whose `assets` folder holds the scenes that are not built in. Those without their file are left out.
    /// Default: the value of LANTERNFISH_SHARED, else ../shared.
    #[arg(long, value_name = "FOLDER")]
    shared: Option<PathBuf>,
}

/// The compared techniques: a row for each.
const TECHNIQUES: [&str; 4] = ["good", "good, history", "draft, history", "probes, history"];
/// No indirect light: the largest error, and what is subtracted to get indirect light alone.
const NONE: &str = "none";

/// A technique by its name, with the settings of a scene.
fn case(look: &Settings, name: &str) -> Case {
    let mut settings = look.clone();
    settings.history = if name.ends_with("history") { History::On } else { History::Off };
    settings.indirect = match name.split(',').next() {
        Some("good") => Quality::Good.sampled().into(),
        Some("draft") => Quality::Draft.sampled().into(),
        Some("probes") => Probes::default().into(),
        _ => return Case::new(name, changed(look, "indirect none")),
    };
    Case::new(name, settings)
}

/// Inputs of the tables.
struct InMotion<'a> {
    bench: Bench,
    args: &'a ProbesArgs,
    techniques: Vec<&'static str>,
    frames: u32,
    every: u32,
    spp: u64,
    reference_rays: u32,
}

/// Measures and writes the report.
pub fn run(args: &ProbesArgs) -> Result<(), CliError> {
    let quick = |usual, quick| if args.quick { quick } else { usual };
    let techniques: Vec<_> = TECHNIQUES.into_iter().filter(|name| is_requested(&args.techniques, name)).collect();
    if techniques.is_empty() {
        let hint = format!("choose from: {}", TECHNIQUES.join("; "));
        return Err(CliError::new("no technique has such a name", hint));
    }
    let of = InMotion {
        bench: Bench::start(&args.run, "probes", "Indirect light in motion", None)?.with_timestamps()?,
        args,
        techniques,
        frames: args.frames.unwrap_or(quick(120, 6)),
        every: args.every.min(quick(args.every, 3)),
        spp: args.spp.unwrap_or(quick(64, 16).into()),
        reference_rays: args.reference_rays.unwrap_or(quick(128, 8)),
    };
    of.bench.facts(Row::default().data("spp", of.spp));
    of.bench
        .report()
        .introduction("Frames alone, not means of frames", &format!("least of {} runs, device time", args.run.runs));
    of.motion()?;
    of.bench.report_seconds();
    of.bench.list_left_out();
    of.bench.finish()
}

/// What the passes of indirect light cost in a frame.
#[derive(Clone, Copy, Debug)]
struct Cost {
    /// Device time of these passes, ms.
    indirect_ms: f64,
    /// Device time of all passes, ms.
    frame_ms: f64,
}

/// Beginnings of the labels of indirect light's passes.
const INDIRECT: [&str; 2] = ["indirect/", "radiance_cache/"];

impl Cost {
    fn of(image: &RenderedImage) -> Self {
        let passes = &image.report.passes;
        let indirect_ms = INDIRECT.iter().map(|start| ms_of(passes, start)).sum();
        Self { indirect_ms, frame_ms: ms_of(passes, "") }
    }
}

/// True if every frame is a first one, whatever came before: there is no history.
fn restarts(stage: &Stage) -> bool {
    stage.renderer.settings().history == History::Off
}

impl InMotion<'_> {
    /// The compared techniques, with the settings of a view.
    fn cases(&self, view: &View) -> Vec<Case> {
        self.techniques.iter().map(|name| case(&view.look, name)).collect()
    }

    /// No indirect light, and the compared techniques.
    fn with_none(&self, view: &View) -> Vec<Case> {
        std::iter::once(case(&view.look, NONE)).chain(self.cases(view)).collect()
    }

    /// Settings of a frame with many rays from every pixel, without filter and clamp.
    ///
    /// A pixel's rays hit many entries of the radiance cache, so the noise of one entry matters little: no more samples
    /// for them.
    fn many_rays(&self, look: &Settings) -> Settings {
        let mut settings =
            changed(look, "history off, indirect sampled, first-rays 1, indirect-filter 0, indirect-clamp off");
        if let Some(sampled) = settings.indirect.get_mut::<Sampled>() {
            (sampled.diffuse_rays, sampled.glossy_rays) = (self.reference_rays, self.reference_rays.div_ceil(4));
        }
        settings
    }
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::PassTime;

    use super::*;
    use crate::testing::rendering;

    #[test]
    fn only_indirect_light_counts() {
        let mut image = rendering(vec![[0.0; 4]], 0);
        let passes = [("indirect/trace", 2.0), ("radiance_cache/trace", 1.0), ("shading/forward", 5.0)];
        image.report.passes = passes.map(|(name, ms)| PassTime { name: name.to_owned(), ms }).to_vec();
        let cost = Cost::of(&image);
        assert_eq!((cost.indirect_ms, cost.frame_ms), (3.0, 8.0));
    }

    #[test]
    fn techniques_are_distinct() {
        let look = Settings::direct_light();
        let all: Vec<Case> = TECHNIQUES.into_iter().chain([NONE]).map(|name| case(&look, name)).collect();
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a.name != b.name && a.settings != b.settings), "{}", a.name);
        }
    }
}
