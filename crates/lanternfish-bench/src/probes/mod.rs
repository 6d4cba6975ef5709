//! `lanternfish-bench probes`: techniques of indirect light for frames in motion, side by side.
//!
//! 1. [`price`]: rays a pixel by count, and times by pass, of frames with a warm radiance cache.
//! 2. [`right`]: energy of indirect light alone and FLIP of a frame at rest, against the path tracer.
//! 3. [`leaks`]: light in a dark room beside a lit one.
//! 4. [`motion`]: a walk with references of its own, flicker, a light that goes out, an object that moves.

mod changes;
mod leaks;
mod motion;
mod price;
mod right;
mod rooms;
mod sheet;
mod views;

use std::path::PathBuf;

use clap::{Args, builder::PossibleValuesParser};
use lanternfish::{
    GpuScene, RenderedImage, Renderer,
    settings::{History, Quality, Settings},
    techniques::{IndirectClamp, Probes, Sampled},
};
use lanternfish_cli::{
    error::CliError,
    parse::{self, Size},
    progress::Progress,
};
use lanternfish_scene::{Camera, Scene};

use self::views::View;
use crate::{
    document::{Document, LeftOut},
    quality::shots,
    run::{Run, RunArgs, counter, ms_of},
    table::Row,
    technique,
};

const PARTS: [&str; 4] = ["price", "right", "leaks", "motion"];

/// Flags of `probes`.
#[derive(Debug, Args)]
pub struct ProbesArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Measure only this part. Repeatable.
    #[arg(long, value_name = "PART", value_parser = PossibleValuesParser::new(PARTS))]
    only: Vec<String>,
    /// Measure only scenes whose name contains these words; motion: the first of them. Repeatable.
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
    /// Frames of a view at rest before the measured one.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=4096))]
    warm: u32,
    /// Frames of the walk. Default: 120.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=4096))]
    frames: Option<u32>,
    /// Frames of the walk from one reference to the next.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=4096))]
    every: u32,
    /// Samples per pixel of the path tracer's images. More: less noise, slower. Default: 64.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    spp: Option<u64>,
    /// Diffuse rays a pixel of the references in motion, with a quarter as many glossy ones, without filter and clamp. 0: the path tracer.
    /// More: less noise, slower. Default: 128.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=4096))]
    reference_rays: Option<u32>,
    /// Folder whose `assets` folder holds the scenes that are not built in. Those without their file are left out.
    /// Default: the value of LANTERNFISH_SHARED, else ../shared.
    #[arg(long, value_name = "FOLDER")]
    shared: Option<PathBuf>,
}

/// One configuration of indirect light.
pub struct Case {
    pub name: &'static str,
    /// Its settings, from those of the scene.
    pub settings: fn(&Settings) -> Settings,
}

/// The compared techniques: a row for each.
fn cases() -> Vec<Case> {
    vec![
        Case { name: "good", settings: |look| with(look, Quality::Good.sampled(), History::Off) },
        Case { name: "good, history", settings: |look| with(look, Quality::Good.sampled(), History::On) },
        Case { name: "draft, history", settings: |look| with(look, Quality::Draft.sampled(), History::On) },
        Case {
            name: "probes, history",
            settings: |look| look.clone().with_indirect(Probes::default()).with_history(History::On),
        },
    ]
}

/// No indirect light: the largest error, and what is subtracted to get indirect light alone.
const NONE: Case = Case { name: "none", settings: |look| look.clone().with_indirect(technique::NO_INDIRECT) };

/// Settings with rays from every pixel.
fn with(look: &Settings, sampled: Sampled, history: History) -> Settings {
    look.clone().with_indirect(technique::sampled(sampled)).with_history(history)
}

/// Inputs of all parts.
struct Bench {
    run: Run,
    cases: Vec<Case>,
    assets: PathBuf,
    scenes: Vec<String>,
    size: Option<Size>,
    is_quick: bool,
    warm: u32,
    frames: u32,
    every: u32,
    spp: u64,
    reference_rays: u32,
    left_out: Vec<LeftOut>,
}

/// Measures and writes the report.
pub fn run(args: &ProbesArgs) -> Result<(), CliError> {
    let mut progress = Progress::start(false);
    let quick = |usual, quick| if args.quick { quick } else { usual };
    let mut cases = cases();
    cases.retain(|case| args.techniques.is_empty() || args.techniques.iter().any(|words| case.name.contains(words)));
    if cases.is_empty() {
        let names: Vec<&str> = self::cases().iter().map(|case| case.name).collect();
        return Err(CliError::new("no technique has such a name", format!("choose from: {}", names.join("; "))));
    }
    let mut bench = Bench {
        run: Run::start_timed(&args.run, "probes")?,
        cases,
        assets: shots::assets(args.shared.clone()),
        scenes: args.scenes.clone(),
        size: args.size,
        is_quick: args.quick,
        warm: args.warm,
        frames: args.frames.unwrap_or(quick(120, 6)),
        every: args.every.min(quick(args.every, 3)),
        spp: args.spp.unwrap_or(quick(64, 16).into()),
        reference_rays: args.reference_rays.unwrap_or(quick(128, 8)),
        left_out: Vec::new(),
    };
    let mut report = Document::new("Indirect light in motion", &bench.run.gpu, args.run.runs);
    report.facts(Row::default().data("warm_frames", bench.warm).data("spp", bench.spp));
    report.introduction(
        &format!("Frames alone, not means of frames; {} frames at rest before a measured one", bench.warm),
        &format!("least of {} runs, device time", args.run.runs),
    );
    for part in PARTS {
        if args.only.is_empty() || args.only.iter().any(|only| only == part) {
            match part {
                "price" => bench.prices(&mut report, &mut progress)?,
                "right" => bench.right(&mut report, &mut progress)?,
                "leaks" => bench.leaks(&mut report, &mut progress)?,
                _ => bench.motion(&mut report, &mut progress)?,
            }
        }
    }
    let seconds = progress.finish();
    let said = seconds.iter().map(|(step, seconds)| format!("{step} {seconds:.0} s"));
    report.paragraph(format!("Time taken: {}.", said.collect::<Vec<_>>().join(", ")));
    report.keep_data("seconds", &seconds);
    report.left_out(&bench.left_out);
    report.write(&bench.run.folder)
}

/// What the passes of indirect light cost in a frame.
#[derive(Clone, Copy, Debug)]
struct Cost {
    /// Device time of these passes, ms.
    indirect_ms: f64,
    /// Device time of all passes, ms.
    frame_ms: f64,
}

/// Beginnings of the labels of indirect light's passes and counters.
const INDIRECT: [&str; 2] = ["indirect/", "radiance_cache/"];

fn is_indirect(name: &str) -> bool {
    INDIRECT.iter().any(|start| name.starts_with(start))
}

impl Cost {
    fn of(image: &RenderedImage) -> Self {
        let passes = &image.report.passes;
        let indirect_ms = INDIRECT.iter().map(|start| ms_of(passes, start)).sum();
        Self { indirect_ms, frame_ms: ms_of(passes, "") }
    }
}

/// Rays of a frame's indirect light: every counter of rays, and a ray for each sample of the radiance cache.
fn rays(image: &RenderedImage) -> u64 {
    let counters = image.report.counters.iter();
    let rays = counters.filter(|(name, _)| is_indirect(name) && name.ends_with("rays")).map(|(_, count)| count);
    rays.sum::<u64>() + counter(&image.report, "radiance_cache/samples")
}

/// True if every frame is a first one, whatever came before: there is no history.
fn restarts(renderer: &Renderer) -> bool {
    renderer.settings().history == History::Off
}

impl Bench {
    fn renderer(&self, settings: Settings) -> Result<Renderer, CliError> {
        Ok(Renderer::with_engine(&self.run.engine, settings)?)
    }

    fn frame(
        &self,
        renderer: &mut Renderer,
        scene: &GpuScene,
        camera: &Camera,
        size: Size,
    ) -> Result<RenderedImage, CliError> {
        Ok(renderer.render(scene, camera, size.width, size.height)?)
    }

    /// Renders one frame with new history.
    fn first_frame(&self, view: &View, settings: Settings) -> Result<RenderedImage, CliError> {
        let mut renderer = self.renderer(settings)?;
        let uploaded = renderer.upload(&view.scene)?;
        self.frame(&mut renderer, &uploaded, &view.camera, view.size)
    }

    /// Renders the frames of a view at rest, `count` of them after the warm ones.
    fn at_rest(&self, view: &View, settings: Settings, count: u32) -> Result<Vec<RenderedImage>, CliError> {
        let mut renderer = self.renderer(settings)?;
        let uploaded = renderer.upload(&view.scene)?;
        for _ in 0..self.warm_frames(&renderer) {
            self.frame(&mut renderer, &uploaded, &view.camera, view.size)?;
        }
        (0..count).map(|_| self.frame(&mut renderer, &uploaded, &view.camera, view.size)).collect()
    }

    /// Frames before a measured one. Without a history every frame is a first one; one frame then makes buffers large enough.
    fn warm_frames(&self, renderer: &Renderer) -> u32 {
        if restarts(renderer) { 1 } else { self.warm }
    }

    /// Settings of a frame with many rays from every pixel, without filter and clamp.
    ///
    /// A pixel's rays hit many entries of the radiance cache, so the noise of one entry matters little: no more samples for them.
    fn many_rays(&self, look: &Settings) -> Settings {
        let sampled = Sampled {
            diffuse_rays: self.reference_rays,
            glossy_rays: self.reference_rays.div_ceil(4),
            filter_radius: 0,
            clamp: IndirectClamp::Off,
            first_rays: 1,
            ..Quality::Good.sampled()
        };
        with(look, sampled, History::Off)
    }

    /// Path of an image of the report.
    fn path(&self, words: &[&str]) -> PathBuf {
        let name = words.join("-").replace(", ", "-").replace([' ', ':'], "-");
        self.run.folder.join(format!("{name}.png"))
    }

    /// A scene with its lights and its view, with another scene in it.
    fn view_with(&self, view: &View, scene: Scene) -> View {
        View { scene, ..view.clone() }
    }
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::PassTime;

    use super::*;
    use crate::image::rendering;

    #[test]
    fn only_indirect_light_counts() {
        let mut image = rendering(vec![[0.0; 4]], 0);
        let counters = [
            ("indirect/rays", 7),
            ("indirect/hits", 100),
            ("indirect/probes/rays", 20),
            ("shadows/rays", 1000),
            ("radiance_cache/samples", 3),
            ("radiance_cache/entries", 500),
        ];
        image.report.counters = counters.map(|(name, count)| (name.to_owned(), count)).to_vec();
        let passes = [("indirect/trace", 2.0), ("radiance_cache/trace", 1.0), ("shading/forward", 5.0)];
        image.report.passes = passes.map(|(name, ms)| PassTime { name: name.to_owned(), ms }).to_vec();
        assert_eq!(rays(&image), 30);
        let cost = Cost::of(&image);
        assert_eq!((cost.indirect_ms, cost.frame_ms), (3.0, 8.0));
    }

    #[test]
    fn names_of_techniques_are_unique() {
        let names: Vec<&str> = cases().iter().chain([&NONE]).map(|case| case.name).collect();
        assert!((1..names.len()).all(|i| !names[..i].contains(&names[i])), "{names:?}");
    }
}
