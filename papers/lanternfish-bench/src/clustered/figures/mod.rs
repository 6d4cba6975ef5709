//! Figures 6.2 to 6.10 of `[VanGelderen2020]`: every cluster shape over the frames of a track, in mono and stereo.
//!
//! Each configuration is replayed as by `lanternfish replay`: one counting run, then timed runs. The least time of each
//! pass and frame is reported ([`lanternfish_cli::replay`]).

pub mod page;

use lanternfish::techniques::ClusterShape;
use lanternfish_cli::{
    error::CliError,
    output,
    parse::Size,
    replay::{category::Category, counted::Clusters, measure::Player, page::least_of, plan::Plan, report::Report},
    report::grouped,
    shot::Shot,
};
use lanternfish_scene::Eyes;
use serde::{Deserialize, Serialize};

use super::{
    ClusteredArgs,
    cases::{Views, settings, shapes},
};
use crate::{bench::Bench, document::LeftOut};

/// One configuration over all frames.
#[derive(Debug, Serialize, Deserialize)]
pub struct Played {
    pub clusters: String,
    pub views: Views,
    pub lights: u32,
    pub report: Report,
}

/// All that is in the figures.
#[derive(Debug, Serialize, Deserialize)]
pub struct Figures {
    pub source: String,
    pub frames: usize,
    pub size: [u32; 2],
    pub eye_width: u32,
    pub depth: u32,
    pub runs: u32,
    pub seed: u32,
    pub light_assignment: String,
    pub played: Vec<Played>,
    pub left_out: Vec<LeftOut>,
}

impl Played {
    /// Time of all passes for each frame, ms.
    pub fn frame_ms(&self) -> Vec<f64> {
        least_of(&self.report, |_| true).unwrap_or_default()
    }

    /// Clustering time for each frame, ms. As in the thesis, it includes the depth pass and marking.
    pub fn clustering_ms(&self) -> Vec<f64> {
        least_of(&self.report, Category::is_clustering).unwrap_or_default()
    }

    /// Shading time for each frame, ms.
    pub fn shading_ms(&self) -> Vec<f64> {
        least_of(&self.report, |category| category == Category::Shading).unwrap_or_default()
    }

    /// Number of clusters with visible fragments, for each frame.
    pub fn visible(&self) -> Vec<f64> {
        self.counted(|clusters| clusters.visible as f64)
    }

    /// Lighting operations for each frame: the length of the cluster's light list, summed over all fragments.
    pub fn operations(&self) -> Vec<f64> {
        self.counted(|clusters| clusters.lighting_operations as f64)
    }

    fn counted(&self, of: fn(&Clusters) -> f64) -> Vec<f64> {
        self.report.frames.iter().filter_map(|frame| frame.clusters.as_ref().map(of)).collect()
    }
}

/// Mean of the values; 0 if there are none.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

pub fn run(args: &ClusteredArgs, shot: &Shot) -> Result<(), CliError> {
    let bench = Bench::start(&args.run, "clustered", "Clusters along a track", Some(&args.scene))?;
    let mut figures = Figures {
        source: args.scene.path().file_name().unwrap_or_default().to_string_lossy().into_owned(),
        frames: shot.frames().len(),
        size: [args.size.width, args.size.height],
        eye_width: super::eye_width(args.size),
        depth: args.depth,
        runs: bench.runs,
        seed: args.seed,
        light_assignment: args.light_assignment.to_string(),
        played: Vec::new(),
        left_out: Vec::new(),
    };
    for lights in args.counts() {
        play(args, shot, &bench, *lights, &mut figures)?;
    }
    bench.end_progress();
    let file = |name: &str| bench.folder.join(name);
    let json = serde_json::to_string(&figures).map_err(|error| CliError::new(error, "this is a bug"))?;
    output::write_text(&file("report.json"), &(json + "\n"))?;
    output::write_text(&file("figures.html"), &page::page(&figures, &bench.gpu).to_html())?;
    output::print(&format!("{}\n", file("figures.html").display()))
}

/// Replays every shape in mono and the best shapes of the thesis in stereo, with `lights` lights.
fn play(args: &ClusteredArgs, shot: &Shot, bench: &Bench, lights: u32, figures: &mut Figures) -> Result<(), CliError> {
    let mut plan = bench.with_progress(|progress| Plan::of(shot, None, progress))?;
    plan.rain_alone(lights, args.seed);
    let size = args.size;
    let best = shapes(size.height, true);
    let mono = shapes(size.height, args.quick).into_iter().map(|shape| (shape, Views::Mono));
    let in_stereo = best.iter().filter(|shape| !matches!(shape, ClusterShape::Displaced { .. }));
    let stereo =
        in_stereo.flat_map(|shape| [Views::StereoIndividual, Views::StereoEnclosed].map(|views| (*shape, views)));
    let settings = |shape: ClusterShape, views: Views| {
        let settings = settings(shape, views.grouping(), args.light_assignment, args.depth);
        bench.made(&format!("{shape}, {views}"), &settings)
    };
    plan.settings = settings(best[0], Views::Mono);
    let mut player = bench.with_progress(|progress| Player::new(&bench.gpu, plan, progress))?;
    // What one grid around two eyes saves is in the tables of one view too.
    for (shape, views) in mono.chain(stereo.filter(|_| !args.counts)) {
        let (eyes, size) = match views {
            Views::Mono => (None, size),
            _ => (Some(Eyes::Vive), Size { width: figures.eye_width, height: size.height }),
        };
        let (clusters, what) = (shape.to_string(), format!("{shape}, {views}, {} lights", grouped(lights.into())));
        if !figures.played.is_empty() && !bench.has_time(&what) {
            figures.left_out.push(LeftOut { what, reason: "no time left".to_owned() });
            continue;
        }
        player.set(&settings(shape, views), eyes, size)?;
        let mut report = player.report(&figures.source, shot.args.scene.to_string(), bench.runs as usize, args.seed);
        match bench.with_progress(|progress| player.count(progress)) {
            Ok(frames) => report.frames = frames,
            // Too many clusters, or views that no grid encloses: continue with the next configuration.
            Err(error) => {
                figures.left_out.push(LeftOut { what, reason: error.to_string() });
                continue;
            }
        }
        if !args.counts {
            let times = bench.with_progress(|progress| player.time(bench.runs as usize, progress))?;
            (report.passes, report.host) = (times.passes, times.host);
            report.estimate();
        }
        figures.played.push(Played { clusters, views, lights, report });
    }
    Ok(())
}
