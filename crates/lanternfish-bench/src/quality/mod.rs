//! `lanternfish-bench quality`: every technique of the renderer on a fixed list of shots, compared with the path tracer.
//!
//! 1. For each shot ([`shots`]) and each ground truth that a technique names (`techniques`), read or trace the ground truth and its parts
//!    without indirect light ([`ground_truths`]).
//! 2. Render each technique at a higher resolution than its ground truth, box-filter the image, and compare ([`measure`]).
//! 3. Write the report ([`report`]).

mod bounces;
mod measure;
mod report;
pub mod shots;
mod techniques;

use std::path::PathBuf;

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use lanternfish_cli::{
    error::CliError,
    parse::{self, Size},
};
use lanternfish_scene::Environment;

use self::{
    measure::Bench,
    report::{LeftOut, ShotReport},
    shots::{SHOTS, Shot},
    techniques::techniques,
};
use crate::{
    ground_truths::{self, GroundTruth, Subject},
    image::shown,
    run::{Run, RunArgs, make_folder},
};

/// Flags of `quality`.
#[derive(Debug, Args)]
pub struct QualityArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Measure one shot only. Repeatable.
    #[arg(long, value_name = "SHOT", value_parser = PossibleValuesParser::new(SHOTS.iter().map(|shot| shot.name)))]
    only: Vec<String>,
    /// Measure only techniques that are compared with this ground truth. Repeatable.
    #[arg(long = "ground-truth", alias = "truth", value_name = "IMAGE", value_parser = ground_truth())]
    ground_truths: Vec<GroundTruth>,
    /// Measure only techniques whose name contains these words. Repeatable.
    #[arg(long = "technique", value_name = "WORDS")]
    techniques: Vec<String>,
    /// Samples per pixel of the ground truths with all light; multiplied by up to 8 for those with short paths. More: less noise, slower.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    spp: u64,
    /// Another image size for every shot, pixels, to test the benchmark itself. Results then do not compare with those of other sizes.
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    size: Option<Size>,
    /// Folder whose `assets` folder holds the scenes that are not built in. Shots without their scene are left out.
    /// Default: the value of LANTERNFISH_SHARED, else ../shared.
    #[arg(long, value_name = "FOLDER")]
    shared: Option<PathBuf>,
    /// Name of the source revision in the report.
    #[arg(long, value_name = "TEXT")]
    commit: Option<String>,
}

impl QualityArgs {
    /// True if a technique is requested.
    fn requests(&self, name: &str) -> bool {
        self.techniques.is_empty() || self.techniques.iter().any(|words| name.contains(words))
    }

    fn assets(&self) -> PathBuf {
        shots::assets(self.shared.clone())
    }
}

fn ground_truth() -> impl TypedValueParser<Value = GroundTruth> {
    PossibleValuesParser::new(compared_ground_truths().map(|ground_truth| ground_truth.name()))
        .map(|name| name.parse().expect("clap lets only known names through"))
}

/// Ground truths that techniques are compared with.
fn compared_ground_truths() -> impl Iterator<Item = GroundTruth> {
    GroundTruth::ALL.iter().copied().filter(|ground_truth| ground_truth.is_compared())
}

/// Measures and writes the reports.
pub fn run(args: &QualityArgs) -> Result<(), CliError> {
    let run = Run::start(&args.run, "quality")?;
    make_folder(&run.folder.join("renderings"))?;
    let (mut shots, mut left_out) = (Vec::new(), Vec::new());
    let assets = args.assets();
    let environment_light = shots::environment_light(&assets)?;
    for shot in SHOTS.iter().filter(|shot| args.only.is_empty() || args.only.iter().any(|name| name == shot.name)) {
        eprintln!("{}", shot.name);
        if let Some(reason) = shot.missing(&assets) {
            eprintln!("  left out: {reason}");
            left_out.push(LeftOut { shot: shot.name, reason });
            continue;
        }
        let mut shot = *shot;
        shot.size = args.size.unwrap_or(shot.size);
        shots.push(run_shot(args, &run, &shot, &environment_light)?);
    }
    report::write(&run, args.spp, args.commit.as_deref(), &shots, &left_out)
}

fn run_shot(
    args: &QualityArgs,
    run: &Run,
    shot: &Shot,
    environment_light: &Environment,
) -> Result<ShotReport, CliError> {
    let (complete, camera) = shot.load(&args.assets())?;
    let settings = shot.settings();
    let bench = Bench { run, shot, camera: &camera };
    let mut result = ShotReport::new(shot, &complete);
    let mut techniques = techniques(&settings, complete.bounds().size().length());
    techniques.retain(|technique| args.requests(&technique.name));
    let mut first = None;
    for ground_truth in compared_ground_truths()
        .filter(|ground_truth| args.ground_truths.is_empty() || args.ground_truths.contains(ground_truth))
    {
        let (scene, settings) = (&ground_truth.scene(&complete, environment_light), ground_truth.seen(&settings));
        let subject =
            Subject { name: shot.name, scene, camera: &camera, size: shot.size, settings: &settings, spp: args.spp };
        let mut traced = ground_truths::obtain(&run.folder, ground_truth, &subject)?;
        let scene_of = |ground_truth: GroundTruth| ground_truth.scene(&complete, environment_light);
        traced.figures.energy_without_indirect =
            ground_truths::energy_without_indirect(&run.folder, ground_truth, &traced.mean, scene_of, &subject)?;
        bench.write(
            &traced.figures.rendering,
            &shown(&traced.mean, settings.image.exposure, settings.image.tone_map).0,
        )?;
        result.ground_truths.push(traced.figures);
        for technique in techniques.iter().filter(|technique| technique.ground_truth == ground_truth) {
            eprintln!("  {}", technique.name);
            result.rows.push(bench.row(technique, scene, &traced.mean, &mut first)?);
        }
    }
    Ok(result)
}
