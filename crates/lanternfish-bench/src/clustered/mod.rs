//! `lanternfish-bench clustered`: the measurements of [VanGelderen2020, ch. 6] on any scene: tables of one view, or the figures of a track
//! ([`figures`]).

mod configurations;
mod figures;
mod markdown;
mod measure;
mod pictures;
mod promises;
mod schemes;
mod steps;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use lanternfish_gpu::{AdapterChoice, Engine};
use lanternfish_scene::{
    Camera, Light, Scene, StereoRig,
    generate::{light_rain, random_lights},
};
use serde::Serialize;

use self::{
    configurations::{DEPTH, LIGHT_COUNTS, QUICK_LIGHT_COUNTS, shapes},
    measure::{Bench, LeftOut, Row},
    promises::{Promise, promises},
    schemes::{SchemeLeftOut, SchemeRow},
};
use super::{make_folder, open};
use lanternfish_cli::{
    args::{PartArgs, ViewArgs, adapter},
    camera,
    error::CliError,
    output, parse,
    parse::{Frames, Size},
    scene::{self, SceneName},
    shot,
};

/// Width over height of the Vive's frusta: square pixels.
const EYE_ASPECT: f32 = 0.9;

#[derive(Debug, Args)]
pub struct ClusteredArgs {
    /// A shot (.toml), which then says the view, or with a track the frames of the thesis' figures; a glTF or OBJ file, or demo:NAME. Its own lights are left out.
    #[arg(default_value = "demo:atrium")]
    pub scene: SceneName,
    /// The folder for report.md, report.json and the plots. It is made if it is not there.
    #[arg(short, long, value_name = "FOLDER", default_value = "bench-clustered")]
    pub output: PathBuf,
    /// Width and height of the view, pixels: by default the thesis'. Each eye has as many rows, and nine tenths as many columns. Clusters
    /// are as wide as 16, 32, 64 and 128 pixels are in 720 rows.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse::size)]
    pub size: Size,
    /// How far from the eye clusters reach at least, m: by default as far as in the thesis. 0: as far as the scene.
    #[arg(long, value_name = "METRES", default_value_t = DEPTH, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub depth: u32,
    /// Of a shot that has a track: how many frames of it are played for the figures. Without it: as many as the shot has.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub frames: Option<u32>,
    /// How often each configuration is timed, after one run that is not.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// One shape of each kind, and 10,000 and 100,000 lights only.
    #[arg(long)]
    pub quick: bool,
    /// The table of all schemes of light culling alone, without that of every shape of clusters and without plots.
    #[arg(long)]
    pub schemes: bool,
    /// Where the lights are. Their radius is the same either way.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Places::Rain)]
    pub lights: Places,
    /// Where to render: a part of an adapter's name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    /// Where the lights are: another seed, other places.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    #[command(flatten, next_help_heading = "View")]
    pub part: PartArgs,
    #[command(flatten, next_help_heading = "View")]
    pub view: ViewArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Places {
    /// Light rain
    Rain,
    /// At random, by a rule that other renderers can follow
    Random,
}

/// Everything the bench found.
#[derive(Debug, Serialize)]
pub struct Results {
    pub version: &'static str,
    pub scene: SceneName,
    pub adapter: String,
    pub driver: String,
    pub width: u32,
    pub height: u32,
    pub eye_width: u32,
    pub depth: u32,
    pub lights: Places,
    pub seed: u32,
    pub runs: u32,
    pub rows: Vec<Row>,
    pub left_out: Vec<LeftOut>,
    /// Schemes of light culling, clusters among them.
    pub schemes: Vec<SchemeRow>,
    pub schemes_left_out: Vec<SchemeLeftOut>,
    pub promises: Vec<Promise>,
}

/// `count` lights in place of the scene's own, each with the radius that lets 12 of them reach a point whatever their number
/// [VanGelderen2020, §6.1.4].
fn lit(scene: &Scene, places: Places, count: u32, seed: u32) -> Scene {
    let bounds = scene.bounds();
    let rain = light_rain(&bounds, count, None, seed, 0.0);
    let radius = rain.first().and_then(|light: &Light| light.range);
    let lights = match (places, radius) {
        (Places::Random, Some(radius)) => random_lights(&bounds, count, radius, seed.into()),
        _ => rain,
    };
    Scene { lights, ..scene.clone() }
}

pub fn run(args: &ClusteredArgs) -> Result<(), CliError> {
    let mut shot = shot::is_shot(&args.scene).then(|| shot::read(args.scene.path(), Vec::new())).transpose()?;
    if let Some(mut shot) = shot.take_if(|shot| !args.schemes && shot.frames().len() > 1) {
        if args.lights != Places::Rain {
            return Err(CliError::new("--lights random: along a track lights fall", "leave it out, or use --schemes"));
        }
        shot.args.track.frames = args.frames.map(Frames::Count).or(shot.args.track.frames);
        return figures::run(args, &shot);
    }
    if args.frames.is_some() {
        return Err(CliError::new("--frames: nothing is played here", "name a shot with a [track], without --schemes"));
    }
    let shot_view = shot.as_ref().map(|shot| shot.views().swap_remove(0));
    let (source, part, view) = match (&shot, &shot_view) {
        (Some(shot), Some(view)) => (&shot.args.scene, &shot.args.part, view),
        _ => (&args.scene, &args.part, &args.view),
    };
    let mut scene = scene::load_part(source, part.scene_of_file.as_deref())?;
    if scene.bounds().is_empty() {
        return Err(CliError::new(format_args!("{source}: nothing to see"), "name a scene that has surfaces"));
    }
    scene.environment = None;
    let Size { width, height } = args.size;
    let camera = camera::choose(&scene, view, width as f32 / height as f32)?;
    let eyes = StereoRig::vive().cameras(&camera, camera.projection.near().max(1e-5));
    let eye_width = ((EYE_ASPECT * height as f32).round() as u32).max(1);
    make_folder(&args.output)?;
    let gpu = open(args.adapter.as_ref())?;

    let engine = Engine::new(&gpu.device, &gpu.queue);
    let counts = if args.quick { QUICK_LIGHT_COUNTS } else { LIGHT_COUNTS };
    let bench = Bench {
        engine: &engine,
        runs: args.runs,
        depth: args.depth,
        mono: [(&camera, width, height)],
        stereo: views(&eyes, eye_width, height),
    };
    let shapes = if args.schemes { Vec::new() } else { shapes(height, args.quick) };
    let lit: Vec<Scene> = counts.iter().map(|count| lit(&scene, args.lights, *count, args.seed)).collect();
    let (schemes, schemes_left_out) = schemes::measure(&engine, args.runs, (&camera, width, height), &lit, args.quick)?;
    let (rows, left_out) = bench.measure(&shapes, &lit)?;
    let results = Results {
        version: env!("CARGO_PKG_VERSION"),
        scene: args.scene.clone(),
        adapter: gpu.description.name.clone(),
        driver: gpu.description.driver.clone(),
        width,
        height,
        eye_width,
        depth: args.depth,
        lights: args.lights,
        seed: args.seed,
        runs: args.runs,
        promises: promises(&rows),
        rows,
        left_out,
        schemes,
        schemes_left_out,
    };
    report(&results, args)
}

fn views(eyes: &[Camera; 2], width: u32, height: u32) -> [(&Camera, u32, u32); 2] {
    eyes.each_ref().map(|eye| (eye, width, height))
}

fn report(results: &Results, args: &ClusteredArgs) -> Result<(), CliError> {
    let file = |name: &str| args.output.join(name);
    let plots = if results.rows.is_empty() { Vec::new() } else { pictures::plots(results) };
    for (name, plot) in plots {
        output::write_text(&file(name), &plot)?;
    }
    let json = serde_json::to_string_pretty(results).expect("plain numbers and strings");
    output::write_text(&file("report.json"), &(json + "\n"))?;
    let page = markdown::to_markdown(results);
    output::write_text(&file("report.md"), &page)?;
    let text = format!("{page}\n{}\n", file("report.md").display());
    output::print(&text)?;
    let clusters = results.rows.iter().find(|row| row.differing_pixels > 0).map(|row| {
        let name = format!("{} with {} lights, {}, {}", row.clusters, row.lights, row.views, row.assignment);
        (name, row.differing_pixels)
    });
    let schemes = results.schemes.iter().find(|row| row.differing_pixels > 0);
    let schemes = schemes.map(|row| (format!("{} with {} lights", row.scheme, row.lights), row.differing_pixels));
    match clusters.or(schemes) {
        None => Ok(()),
        Some((name, pixels)) => Err(CliError::new(
            format_args!("{name}: {pixels} pixels differ from the first row of this view, none may"),
            "this is a fault of the renderer; please report it with the scene",
        )),
    }
}
