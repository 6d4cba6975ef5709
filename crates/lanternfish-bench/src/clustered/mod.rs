//! `lanternfish-bench clustered`: the measurements of [VanGelderen2020, ch. 6] on any scene: tables of one view, or the figures of a track
//! ([`figures`]).

mod cases;
mod figures;
mod measure;
mod plots;
mod promises;
mod schemes;
mod steps;

use clap::{Args, ValueEnum};
use lanternfish::techniques::Assignment;
use lanternfish_cli::{
    args::{PartArgs, ViewArgs},
    camera,
    choices::choice,
    error::CliError,
    output,
    parse::{self, Frames, Size},
    progress::Progress,
    report::grouped,
    scene::SceneName,
};
use lanternfish_scene::{
    Light, Scene, StereoRig,
    generate::{light_rain, random_lights},
};
use serde::Serialize;

use self::{
    cases::{DEPTH, LIGHT_COUNTS, QUICK_LIGHT_COUNTS, shapes},
    measure::Bench,
    promises::promises,
};
use crate::{
    document::{Document, LeftOut},
    run::{Run, RunArgs},
    subject,
    table::Row,
};

/// Width over height of the Vive's frusta: square pixels.
const EYE_ASPECT: f32 = 0.9;

/// Flags of `clustered`.
#[derive(Debug, Args)]
pub struct ClusteredArgs {
    /// A shot (.toml), which then says the view, or with a track the frames of the thesis' figures; a glTF or OBJ file, or demo:NAME. Its own lights are left out.
    #[arg(default_value = "demo:atrium")]
    scene: SceneName,
    #[command(flatten)]
    run: RunArgs,
    /// Width and height of the view, pixels: by default the thesis'. Each eye has as many rows, and nine tenths as many columns. Clusters
    /// are as wide as 16, 32, 64 and 128 pixels are in 720 rows.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse::size)]
    size: Size,
    /// How far from the eye clusters reach at least, m: by default as far as in the thesis. 0: as far as the scene.
    #[arg(long, value_name = "METRES", default_value_t = DEPTH, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    depth: u32,
    /// Of a shot that has a track: how many frames of it are played for the figures. Without it: as many as the shot has.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: Option<u32>,
    /// One shape of each kind, and 10,000 and 100,000 lights only.
    #[arg(long)]
    quick: bool,
    /// Along a track: how lights are assigned. The thesis tests every light against every visible cluster: brute_force.
    #[arg(long, value_name = "NAME", value_parser = choice::<Assignment>(), default_value_t = Assignment::Hierarchy)]
    light_assignment: Assignment,
    /// The table of all schemes of light culling alone, without that of every shape of clusters and without plots.
    #[arg(long)]
    schemes: bool,
    /// Where the lights are. Their radius is the same either way.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Places::Rain)]
    lights: Places,
    /// Where the lights are: another seed, other places.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    #[command(flatten, next_help_heading = "View")]
    part: PartArgs,
    #[command(flatten, next_help_heading = "View")]
    view: ViewArgs,
}

/// Where lights are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Places {
    /// Light rain
    Rain,
    /// At random, by a rule that other renderers can follow
    Random,
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

/// Measures, and writes the report. An error where images that must be the same are not.
pub fn run(args: &ClusteredArgs) -> Result<(), CliError> {
    let mut shot = subject::shot_of(&args.scene)?;
    if let Some(mut shot) = shot.take_if(|shot| !args.schemes && shot.frames().len() > 1) {
        if args.lights != Places::Rain {
            return Err(CliError::new("--lights random: along a track lights fall", "leave it out, or use --schemes"));
        }
        shot.args.track.frames = args.frames.map(Frames::Count).or(shot.args.track.frames);
        return figures::run(args, &shot);
    }
    if args.light_assignment != Assignment::Hierarchy {
        return Err(CliError::new("--light-assignment: without a track both are measured", "leave it out"));
    }
    if args.frames.is_some() {
        return Err(CliError::new("--frames: nothing is played here", "name a shot with a [track], without --schemes"));
    }
    let view = shot.as_ref().map_or_else(|| args.view.clone(), |shot| shot.views().swap_remove(0));
    let mut scene = subject::load(&args.scene, &args.part, shot.as_ref(), true, &mut Progress::hidden())?;
    scene.environment = None;
    let Size { width, height } = args.size;
    let camera = camera::choose(&scene, &view, width as f32 / height as f32)?;
    let eyes = StereoRig::vive().cameras(&camera, camera.projection.near().max(1e-5));
    let eye_width = ((EYE_ASPECT * height as f32).round() as u32).max(1);
    let run = Run::start(&args.run, "clustered")?;

    let counts = if args.quick { QUICK_LIGHT_COUNTS } else { LIGHT_COUNTS };
    let bench = Bench {
        run: &run,
        depth: args.depth,
        mono: [(&camera, width, height)],
        stereo: eyes.each_ref().map(|eye| (eye, eye_width, height)),
    };
    let shapes = if args.schemes { Vec::new() } else { shapes(height, args.quick) };
    let lit: Vec<Scene> = counts.iter().map(|count| lit(&scene, args.lights, *count, args.seed)).collect();
    let (schemes, schemes_left_out) = schemes::measure(&run, (&camera, width, height), &lit, args.quick)?;
    let (rows, left_out) = bench.measure(&shapes, &lit)?;

    let mut report = Document::of_scene("Clustered light culling", &args.scene, &run.gpu, run.runs);
    let facts = Row::default().data("width", width).data("height", height).data("eye_width", eye_width);
    report.facts(facts.data("depth", args.depth).data("lights", args.lights).data("seed", args.seed));
    let places = match args.lights {
        Places::Rain => "light rain",
        Places::Random => "lights at random",
    };
    let what = format!(
        "{width} x {height}, each eye {eye_width} x {height} (HTC Vive, 63 mm apart); {places}, seed {}, whose radius lets 12 lights reach a \
         point whatever their number; no shadows",
        args.seed
    );
    report.introduction(&what, &format!("medians of {}", run.runs));
    let wrong = wrong(&rows, &schemes);
    let text = "Lists and tests are those for the surfaces; building is for transparent ones too, of which `tiled` and `raster-grid` make \
                lists of their own. KiB: cells, lists, and what they are made from.";
    report.section("Schemes, one view", text, "schemes", schemes);
    if !(rows.is_empty() && left_out.is_empty()) {
        clusters(&mut report, args, &rows);
    }
    if !rows.is_empty() {
        for (name, plot) in plots::plots(&args.scene, &rows) {
            output::write_text(&run.folder.join(name), &plot)?;
        }
    }
    report.keep_data("promises", &promises(&rows));
    report.keep_data("rows", &rows);
    report.keep_data("schemes_left_out", &schemes_left_out);
    report.left_out(&left_out);
    report.list(schemes_left_out.iter().map(|LeftOut { what, reason }| format!("{what}: {reason}")));
    report.write(&run.folder)?;
    let hint = "this is a fault of the renderer; please report it with the scene";
    let what = |case| format!("{case} pixels differ from the first row of this view, none may");
    wrong.map_or(Ok(()), |case| Err(CliError::new(what(case), hint)))
}

/// The tables of clusters, by numbers of lights.
fn clusters(report: &mut Document, args: &ClusteredArgs, rows: &[measure::Measured]) {
    report.heading("Clusters");
    report.paragraph(format!(
        "Clusters are named as `--clusters` has them: as wide as 16, 32, 64 and 128 pixels are in 720 rows, or cubes of 1 to 8 m, or displaced \
         by 8 and 32 m, and reach at least {} m from the eye.",
        args.depth
    ));
    report.list(promises(rows).iter().map(promises::Promise::line));
    let mut counts: Vec<usize> = rows.iter().map(|row| row.lights).collect();
    counts.sort_unstable();
    counts.dedup();
    for lights in counts {
        report.heading(&format!("{} lights", grouped(lights as u64)));
        report.show(rows.iter().filter(|row| row.lights == lights).map(measure::Measured::row));
    }
    report.paragraph(
        "Visibility: the depth pass and counting fragments, as in fig. 6.8. Lighting operations: lights of its cluster's list, summed over all \
         fragments. Plots: light tests by the number of lights (`light-tests.svg`), steps of a frame (`steps.svg`, fig. 6.7 and 6.8), clusters \
         by their lights and by their fragments (`clusters-by-*.svg`, fig. 6.9 and 6.10).",
    );
}

/// The first case whose image is not that of the others, and by how many pixels.
fn wrong(rows: &[measure::Measured], schemes: &[Row]) -> Option<String> {
    let clusters = rows.iter().find(|row| row.differing_pixels > 0);
    let scheme = schemes.iter().find(|row| row.f64("differing_pixels") > 0.0);
    let clusters = clusters.map(|row| format!("{}: {}", row.in_words(), row.differing_pixels));
    let of = |row: &Row| {
        let [scheme, lights] = ["scheme", "lights"].map(|key| row.words(key));
        format!("{scheme}, {lights} lights: {}", row.get("differing_pixels"))
    };
    clusters.or_else(|| scheme.map(of))
}
