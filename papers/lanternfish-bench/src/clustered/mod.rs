//! `lanternfish-bench clustered`: the measurements of [VanGelderen2020, ch. 6] on any scene, as tables for one view, or as figures along
//! a track ([`figures`]).

pub mod cases;
mod compared;
pub mod figures;
mod measure;
mod schemes;
mod steps;

use clap::{Args, ValueEnum};
use lanternfish::techniques::{Assignment, ClusterShape};
use lanternfish_cli::{
    args::{PartArgs, ViewArgs},
    camera,
    choices::choice,
    error::CliError,
    parse::{self, Frames, Size},
    report::grouped,
    scene::SceneName,
    times::distinct,
};
use lanternfish_scene::{
    Camera, Light, Scene, StereoRig,
    generate::{light_rain, random_lights},
};
use serde::Serialize;

use self::{
    cases::{CONFIGURATIONS, DEPTH, LIGHT_COUNTS, OTHERS, QUICK_LIGHT_COUNTS, shapes},
    measure::ClusterBench,
};
use crate::{
    bench::{Bench, RunArgs, identical},
    document::{Document, LeftOut},
    table::Row,
    view,
};

/// Aspect ratio (width / height) of the HTC Vive's frusta, for square pixels.
const EYE_ASPECT: f32 = 0.9;

/// Flags of `clustered`.
#[derive(Debug, Args)]
pub struct ClusteredArgs {
    /// A shot (.toml), a glTF or OBJ file, or demo:NAME. A shot sets the view, and one with a track the frames of the thesis' figures. The
    /// scene's own lights are left out.
    #[arg(default_value = "demo:atrium")]
    scene: SceneName,
    #[command(flatten)]
    run: RunArgs,
    /// Width and height of the view, pixels; the default is the thesis'. Each eye has the same height, and a width of 0.9 times the height.
    /// Clusters are 16, 32, 64 and 128 pixels wide at a height of 720 pixels, and scale with the height.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse::size)]
    size: Size,
    /// Least depth range of the clusters, m; the default is the thesis'. 0: the depth of the scene.
    #[arg(long, value_name = "METRES", default_value_t = DEPTH, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    depth: u32,
    /// Number of frames to play along the shot's track for the figures. Default: the frames of the shot.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: Option<u32>,
    /// Measure one shape of each kind, with 10,000 and 100,000 lights only.
    #[arg(long)]
    quick: bool,
    /// Along a track: how lights are assigned. The thesis tests every light against every visible cluster: brute_force.
    #[arg(long, value_name = "NAME", value_parser = choice::<Assignment>(), default_value_t = Assignment::Hierarchy)]
    light_assignment: Assignment,
    /// Along a track: counts of one view alone, and times of no frame.
    #[arg(long)]
    counts: bool,
    /// The table of all schemes of light culling alone, without that of every shape of clusters and without plots.
    #[arg(long)]
    schemes: bool,
    /// Distribution of the lights. Their radius does not depend on it.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Distribution::Rain)]
    lights: Distribution,
    /// Seed of the light positions.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    #[command(flatten, next_help_heading = "View")]
    part: PartArgs,
    #[command(flatten, next_help_heading = "View")]
    view: ViewArgs,
}

impl ClusteredArgs {
    /// The measured numbers of lights.
    fn counts(&self) -> &'static [u32] {
        if self.quick { QUICK_LIGHT_COUNTS } else { LIGHT_COUNTS }
    }
}

/// Distribution of the lights in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Distribution {
    /// Light rain
    Rain,
    /// Uniformly random, by a rule that other renderers can reproduce
    Random,
}

/// The scene with `count` lights in place of its own. Their radius is such that 12 lights on average reach a point, for any `count`
/// [VanGelderen2020, §6.1.4].
fn lit(scene: &Scene, distribution: Distribution, count: u32, seed: u32) -> Scene {
    let bounds = scene.bounds();
    let rain = light_rain(&bounds, count, None, seed, 0.0);
    let radius = rain.first().and_then(|light: &Light| light.range);
    let lights = match (distribution, radius) {
        (Distribution::Random, Some(radius)) => random_lights(&bounds, count, radius, seed.into()),
        _ => rain,
    };
    Scene { lights, ..scene.clone() }
}

/// Measures and writes the report.
///
/// # Errors
///
/// Fails if images that must be identical differ.
pub fn run(args: &ClusteredArgs) -> Result<(), CliError> {
    let mut shot = view::shot_of(&args.scene)?;
    if let Some(mut shot) = shot.take_if(|shot| !args.schemes && shot.frames().len() > 1) {
        if args.lights != Distribution::Rain {
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
    let bench = Bench::start(&args.run, "clustered", "Clustered light culling", Some(&args.scene))?;
    let view = shot.as_ref().map_or_else(|| args.view.clone(), |shot| shot.views().swap_remove(0));
    let mut scene = view::load(&args.scene, &args.part, shot.as_ref(), true, &bench)?;
    scene.environment = None;
    let Size { width, height } = args.size;
    let camera = camera::choose(&scene, &view, width as f32 / height as f32)?;
    let eyes = StereoRig::vive().cameras(&camera, camera.projection.near().max(1e-5));
    let eye_width = eye_width(args.size);

    let mono = (&camera, [width, height]);
    let stereo = eyes.each_ref().map(|eye| (eye, [eye_width, height]));
    let back = looking_back(&camera, &scene);
    let unaligned = [mono, (&back, mono.1)];
    let of = ClusterBench { bench: &bench, depth: args.depth, mono: [mono], stereo, unaligned };
    // Of the orthographic ones all sizes, also of a quick run: the thesis' size suits the Bistro.
    let cubes = shapes(height, false).into_iter().filter(|shape| matches!(shape, ClusterShape::Orthographic { .. }));
    let mut measured = if args.schemes { Vec::new() } else { shapes(height, args.quick) };
    let missing: Vec<_> = cubes.filter(|shape| !args.schemes && !measured.contains(shape)).collect();
    measured.extend(missing);
    let lit: Vec<Scene> = args.counts().iter().map(|count| lit(&scene, args.lights, *count, args.seed)).collect();
    let (schemes, schemes_left_out) = schemes::measure(&bench, mono, &lit, args.quick)?;
    let rows = of.measure(&measured, &lit, CONFIGURATIONS, &[])?;
    let tuned = if args.schemes { Vec::new() } else { cases::shapes(height, true) };
    let others = of.measure(&tuned, &lit, OTHERS, &rows)?;

    let facts = Row::default().data("width", width).data("height", height).data("eye_width", eye_width);
    bench.facts(facts.data("depth", args.depth).data("lights", args.lights).data("seed", args.seed));
    let distribution = match args.lights {
        Distribution::Rain => "light rain",
        Distribution::Random => "lights at random",
    };
    let what = format!(
        "{width} x {height} pixels, each eye {eye_width} x {height} pixels (HTC Vive, 63 mm apart); {distribution}, seed {}, with a radius that lets 12 \
         lights reach a point for any number of lights; no shadows",
        args.seed
    );
    bench.report().introduction(&what, &format!("medians of {}", bench.runs));
    let wrong = wrong(rows.iter().chain(&others), &schemes);
    let text = "Lists and tests are those of opaque surfaces. Build time includes transparent surfaces, for which `tiled` and `raster-grid` \
                make separate lists. KiB: cells, lists and their inputs.";
    bench.section("Schemes, one view", text, "schemes", schemes);
    if !rows.is_empty() {
        clusters(&mut bench.report(), args, &rows);
        let shapes = compared::shapes(&rows, &tuned[0].to_string());
        bench.section("Shapes over perspective clusters", compared::SHAPES, "shapes", shapes);
        let grids = compared::grids(rows.iter().chain(&others));
        bench.section("One grid around two views", compared::GRIDS, "grids", grids);
    }
    bench.report().keep_data("rows", &rows);
    bench.report().keep_data("other_rows", &others);
    bench.report().keep_data("schemes_left_out", &schemes_left_out);
    bench.list_left_out();
    bench.report().list(schemes_left_out.iter().map(|LeftOut { what, reason }| format!("{what}: {reason}")));
    bench.finish()?;
    identical(wrong.map(|case| format!("{case} pixels differ from the first row of this view")))
}

/// A camera that looks back at this one, from halfway to where its axis leaves the scene, as a mirror's image of it does.
fn looking_back(camera: &Camera, scene: &Scene) -> Camera {
    let (bounds, eye) = (scene.bounds(), camera.eye());
    let forward = -glam::Vec3::from(camera.world_from_camera.matrix3.z_axis);
    // Where the axis passes the planes of the box ahead.
    let ahead = (0..3).map(|axis| {
        let wall = if forward[axis] < 0.0 { bounds.min[axis] } else { bounds.max[axis] };
        (wall - eye[axis]) / forward[axis]
    });
    let leaves = ahead.filter(|distance| *distance > 0.0).fold(f32::INFINITY, f32::min);
    let distance = if leaves.is_finite() { 0.5 * leaves } else { 0.5 * bounds.size().length() };
    Camera::look_at(eye + distance * forward, eye, camera.projection)
}

/// Width of an eye's image with the height of `size`.
fn eye_width(size: Size) -> u32 {
    ((EYE_ASPECT * size.height as f32).round() as u32).max(1)
}

/// Adds the tables of clusters, one per number of lights.
fn clusters(report: &mut Document, args: &ClusteredArgs, rows: &[measure::Measured]) {
    report.heading("Clusters");
    report.paragraph(format!(
        "Clusters are named as in `--clusters`: 16, 32, 64 and 128 pixels wide at a height of 720 pixels, or cubes of 1 to 8 m, or displaced by \
         8 and 32 m. Their depth range is at least {} m.",
        args.depth
    ));
    for lights in distinct(rows.iter().map(|row| row.lights)) {
        report.heading(&format!("{} lights", grouped(lights as u64)));
        report.show(rows.iter().filter(|row| row.lights == lights).map(measure::Measured::row));
    }
    report.paragraph(
        "Visibility: the depth pass and counting fragments, as in fig. 6.8. Lighting operations: length of the cluster's light list, summed over \
         all fragments. Figures are plotted along a track, and clusters are drawn from above in `lanternfish view` (V).",
    );
}

/// The first configuration whose image differs from the others, with the number of differing pixels.
fn wrong<'r>(mut rows: impl Iterator<Item = &'r measure::Measured>, schemes: &[Row]) -> Option<String> {
    let clusters = rows.find(|row| row.differing_pixels > 0);
    let scheme = schemes.iter().find(|row| row.f64("differing_pixels") > 0.0);
    let clusters = clusters.map(|row| format!("{}: {}", row.in_words(), row.differing_pixels));
    let of = |row: &Row| {
        let [scheme, lights] = ["scheme", "lights"].map(|key| row.words(key));
        format!("{scheme}, {lights} lights: {}", row.get("differing_pixels"))
    };
    clusters.or_else(|| scheme.map(of))
}
