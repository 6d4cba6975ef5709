//! `lanternfish bench virtual-lights`: virtual point lights with ranges, beside rays from every pixel and the path tracer
//! [Archer2019, §4; VanGelderen2020, app. B].

mod configurations;
mod markdown;
mod measure;
mod steps;
mod walk;

use std::path::PathBuf;

use clap::Args;
use lanternfish::{
    indirect::virtual_lights::MapSize,
    settings::{Indirect, Settings},
};
use lanternfish_gpu::AdapterChoice;
use lanternfish_metrics::{ColorType, write_png};
use serde::Serialize;

use self::{
    configurations::{configurations, walked},
    measure::{Bench, RangeRow, Row, energy, energy_of},
    walk::{Flicker, Walk, grey},
};
use super::{
    make_folder, open_timed,
    quality::{
        shown,
        truths::{self, Truth},
    },
    subject::{Source, Subject},
};
use crate::{
    args::{LightArgs, PartArgs, ViewArgs, adapter},
    error::CliError,
    output::{print, write_text},
    parse::{self, Size},
    progress::Progress,
    scene::SceneName,
};

#[derive(Debug, Args)]
pub struct VirtualLightsArgs {
    /// A shot (.toml), which then says the view, the lights and the look, and along whose track flicker is measured; a glTF or OBJ
    /// file, or demo:NAME.
    #[arg(default_value = "demo:cornell")]
    pub scene: SceneName,
    /// The folder for report.md, report.json, the pictures, and the path tracer's, which a later run finds there. It is made if it is
    /// not there.
    #[arg(short, long, value_name = "FOLDER", default_value = "bench-virtual-lights")]
    pub output: PathBuf,
    /// Width and height of every picture, pixels.
    #[arg(long, value_name = "WxH", default_value = "480x270", value_parser = parse::size)]
    pub size: Size,
    /// How often everything is timed, after one run that is not; the least counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub runs: u32,
    /// Samples a pixel of the truths: twice as many with one bounce, eight times as many without. More: less noise, slower.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    pub spp: u64,
    /// Few configurations and small maps only.
    #[arg(long)]
    pub quick: bool,
    /// Only those whose name holds one of these words; the picture without indirect light is always there. Repeatable.
    #[arg(long, value_name = "WORDS")]
    pub only: Vec<String>,
    /// Where to run: a part of an adapter's name, or cpu for a software one.
    #[arg(long, value_name = "NAME|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    /// Where the rain of --lights falls.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    #[command(flatten, next_help_heading = "View")]
    pub part: PartArgs,
    #[command(flatten, next_help_heading = "View")]
    pub view: ViewArgs,
    #[command(flatten, next_help_heading = "Lights (beside those of the file)")]
    pub lights: LightArgs,
}

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Report {
    version: &'static str,
    scene: SceneName,
    adapter: String,
    driver: String,
    triangles: usize,
    lights: usize,
    width: u32,
    height: u32,
    runs: u32,
    truth_samples: u64,
    /// Standard deviation of the energy of the truth's bounce by its noise, over that energy, at most.
    truth_noise: f64,
    rows: Vec<Row>,
    ranges: Vec<RangeRow>,
    flicker: Vec<Flicker>,
}

pub fn run(args: &VirtualLightsArgs) -> Result<(), CliError> {
    make_folder(&args.output)?;
    let mut progress = Progress::start(false);
    let (view, lights) = (&args.view, &args.lights);
    let source = Source { scene: &args.scene, part: &args.part, view, lights, seed: args.seed, size: args.size };
    let Subject { scene: whole, cameras, look } = Subject::load(&source, &mut progress)?;
    let gpu = open_timed(args.adapter.as_ref())?;
    // Light of the lights alone, whichever truth: nothing else shines, and nothing surrounds the scene.
    let scene = truths::of_lights_alone(whole);
    let camera = &cameras[cameras.len() / 2];
    let truth = |truth: Truth| {
        let (name, size) = (scene.name.as_str(), args.size);
        truths::obtain(
            &args.output,
            truth,
            &truths::Subject { name, scene: &scene, camera, size, settings: &look, spp: args.spp },
        )
    };
    let direct = progress.step("truth", "Tracing direct light", || truth(Truth::Direct))?;
    let one_bounce = progress.step("truth", "Tracing one bounce", || truth(Truth::OneBounceFile))?;
    let truth_energy = energy_of(&one_bounce.mean) - energy_of(&direct.mean);
    if truth_energy <= 0.0 {
        return Err(CliError::new(
            "no light arrives by one bounce",
            "add lights, e.g. --lights rain:10, or look elsewhere",
        ));
    }
    for (name, truth) in [("truth-zero-bounces", &direct), ("truth-one-bounce", &one_bounce)] {
        let bytes = shown(&truth.mean, look.exposure, look.tone_map).0;
        let Size { width, height } = args.size;
        write_png(&args.output.join(format!("{name}.png")), width, height, ColorType::Rgb, &bytes)?;
    }

    let mut bench = Bench {
        gpu: &gpu,
        folder: &args.output,
        scene: &scene,
        camera,
        size: args.size,
        runs: args.runs,
        truth: &one_bounce.mean,
        truth_energy,
        direct_energy: 0.0,
    };
    let without = Settings { indirect: Indirect::None, ..look.clone() };
    bench.direct_energy = energy(&bench.render(&without, args.size)?.0);
    let is_asked =
        |name: &str| args.only.is_empty() || name == "none" || args.only.iter().any(|words| name.contains(words));
    let mut rows = Vec::new();
    for configuration in configurations(&look, args.quick).iter().filter(|c| is_asked(&c.name)) {
        rows.push(progress.step("render", &configuration.name, || bench.row(configuration))?);
    }
    let maps = if args.quick { &MapSize::ALL[..1] } else { &MapSize::ALL[2..] };
    let mut ranges = Vec::new();
    for map in maps.iter().filter(|_| args.only.is_empty() || is_asked("ranges")) {
        ranges.push(progress.step("ranges", &format!("Ranges, {map}²"), || bench.ranges(&look, *map))?);
    }
    let mut flicker = Vec::new();
    if cameras.len() > 1 && (args.only.is_empty() || is_asked("flicker")) {
        let scene = grey(&scene);
        let walk = Walk::new(&gpu, &scene, &cameras, args.size, &without)?;
        for configuration in &walked(&look) {
            let doing = format!("Walking: {}", configuration.name);
            flicker.push(progress.step("walk", &doing, || walk.flicker(configuration))?);
        }
    }
    progress.finish();

    let Size { width, height } = args.size;
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.clone(),
        adapter: gpu.description.name.clone(),
        driver: gpu.description.driver.clone(),
        triangles: scene.triangle_counts().1,
        lights: scene.lights.len(),
        width,
        height,
        runs: args.runs,
        truth_samples: one_bounce.figures.spp,
        truth_noise: one_bounce.figures.noise_energy * energy_of(&one_bounce.mean) / truth_energy,
        rows,
        ranges,
        flicker,
    };
    let json = serde_json::to_string_pretty(&report).expect("plain numbers and strings");
    write_text(&args.output.join("report.json"), &(json + "\n"))?;
    let page = markdown::to_markdown(&report);
    let file = args.output.join("report.md");
    write_text(&file, &page)?;
    print(&format!("{page}\n{}\n", file.display()))
}
