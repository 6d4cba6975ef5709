//! Common parts of the benchmarks of one-bounce indirect light: a view of a scene under its lights alone, the path tracer's images of it,
//! and a walk through it.

pub mod walk;

use clap::Args;
use lanternfish::{RenderedImage, settings::Settings};
use lanternfish_cli::{
    error::CliError,
    images::{energy, energy_of},
};
use lanternfish_metrics::RgbImage;
use lanternfish_scene::Camera;

use self::walk::{Walk, grey};
use crate::{
    bench::{Bench, RunArgs, Timed, is_requested},
    case::{Case, changed},
    ground_truths::{self, GroundTruth},
    reference::{IndirectErrors, Reference, flip},
    table::Row,
    view::{SubjectArgs, View},
};

/// Flags of the one-bounce benchmarks.
#[derive(Debug, Args)]
pub struct OneBounceArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Samples per pixel of the references: multiplied by 2 with one bounce, by 8 without. More: less noise, slower.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    pub spp: u64,
    /// Measure few configurations only.
    #[arg(long)]
    pub quick: bool,
    /// Measure only configurations whose name contains these words; the image without indirect light is always included. Repeatable.
    #[arg(long, value_name = "WORDS")]
    only: Vec<String>,
    #[command(flatten)]
    subject: SubjectArgs,
}

impl OneBounceArgs {
    /// True if a configuration or a table is requested.
    pub fn requests(&self, name: &str) -> bool {
        name == "none" || is_requested(&self.only, name)
    }

    /// The requested ones of these configurations.
    pub fn requested(&self, cases: Vec<Case>) -> Vec<Case> {
        cases.into_iter().filter(|case| self.requests(&case.name)).collect()
    }
}

/// Inputs and references of all configurations.
pub struct OneBounce {
    pub bench: Bench,
    /// The scene without sky, environment and emission, from the camera in the middle of the track.
    pub view: View,
    pub cameras: Vec<Camera>,
    /// The path tracer's image with one bounce.
    reference: Reference,
    /// The path tracer's image without indirect light.
    direct_reference: RgbImage,
    /// Energy of the renderer's own image without indirect light.
    direct_energy: f64,
}

impl OneBounce {
    /// Opens the adapter, loads the scene, and reads or traces the path tracer's images. `name` is the name of the benchmark.
    pub fn start(args: &OneBounceArgs, name: &str, title: &str) -> Result<Self, CliError> {
        let bench = Bench::start(&args.run, name, title, Some(&args.subject.scene))?.with_timestamps()?;
        let (mut view, cameras) = View::load(&args.subject, false, &bench)?;
        // For every reference, the lights are the only light: no emission and no environment.
        view.scene = ground_truths::of_lights_alone(view.scene);
        view.camera = cameras[cameras.len() / 2].clone();
        let trace = |doing: &str, ground_truth| {
            bench.step("ground_truth", doing, || view.reference(&bench, ground_truth, args.spp))
        };
        let direct = trace("Tracing direct light", GroundTruth::Direct)?;
        let one_bounce = trace("Tracing one bounce", GroundTruth::OneBounceFile)?;
        bench.write_linear("ground_truth-zero-bounces", &direct.mean, &view.look)?;
        bench.write_linear("ground_truth-one-bounce", &one_bounce.mean, &view.look)?;
        let hint = "add lights, e.g. --lights rain:10, or choose another view";
        let reference = Reference::new(one_bounce.mean, energy_of(&direct.mean), hint)?;
        let noise = reference.noise(one_bounce.figures.noise_energy);
        let (spp, halves) = (one_bounce.figures.spp, one_bounce.figures.noise_hdr_flip);
        let facts = view.facts().data("truth_samples", spp).data("truth_noise", noise);
        bench.facts(facts.data("truth_halves_flip", halves));
        bench.report().introduction(&view.text(), &format!("least of {} runs, device time", bench.runs));
        bench.report().paragraph(format!(
            "Reference: {spp} samples per pixel, energy of its bounce ± {:.1} %, FLIP between its halves {halves:.4}, of which an exact image \
             would have about half. *Energy*: ratio of indirect light alone to the path tracer's one bounce. *FLIP*: HDR-FLIP of the \
             complete image.",
            100.0 * noise
        ));
        let direct_energy = energy(&bench.first_frame(&view, &changed(&view.look, "indirect none"))?);
        Ok(Self { bench, view, cameras, reference, direct_reference: direct.mean, direct_energy })
    }

    /// Settings without indirect light.
    fn without(&self) -> Settings {
        changed(&self.view.look, "indirect none")
    }

    /// Renders a configuration of the table, compares its image, and writes it to the folder.
    pub fn row(&self, case: &Case) -> Result<(Timed, IndirectErrors), CliError> {
        let timed = self.bench.timed(&self.view, &case.settings)?;
        let errors = self.keep(&case.name, &timed.image)?;
        Ok((timed, errors))
    }

    /// Compares an image, which goes to the folder under a name.
    pub fn keep(&self, name: &str, image: &RenderedImage) -> Result<IndirectErrors, CliError> {
        self.bench.write(name, image)?;
        Ok(self.reference.errors(image, self.direct_energy)?)
    }

    /// Renders the mean of `frames` frames, writes it to the folder, and compares it. Its direct light is that of `direct`, a mean of as many
    /// frames without indirect light, because edges and highlights of a mean differ from those of one frame.
    pub fn mean_row(&self, case: &Case, frames: u32, direct: &RenderedImage) -> Result<IndirectErrors, CliError> {
        let mean = self.bench.mean(&self.view, &case.settings, frames)?;
        self.bench.write(&format!("{}, {frames} frames", case.name), &mean)?;
        Ok(self.reference.errors(&mean, energy(direct))?)
    }

    /// The mean of `frames` frames without indirect light, and its HDR-FLIP against the path tracer's direct light. That is the error of a
    /// mean with exact indirect light.
    pub fn direct_mean(&self, frames: u32) -> Result<(RenderedImage, f64), CliError> {
        let mean = self.bench.mean(&self.view, &self.without(), frames)?;
        let flip = flip(&mean, &self.direct_reference)?;
        Ok((mean, flip))
    }

    /// Measures the flicker of each configuration along the track, if there is one, and writes the report.
    pub fn finish(self, walked: &[Case]) -> Result<(), CliError> {
        let mut rows = Vec::new();
        if self.cameras.len() > 1 && !walked.is_empty() {
            let walk = Walk::new(&self.bench, self.view.with(grey(&self.view.scene)), &self.cameras, &self.without())?;
            rows = walk.rows(walked)?;
        }
        self.bench.section("Flicker along the track", walk::TEXT, "flicker", rows);
        self.bench.finish()
    }
}

/// Rows of a table of one-bounce cases: each is rendered, compared, and described by `row`.
pub fn rows(
    of: &OneBounce,
    cases: &[Case],
    row: impl Fn(&Case, &Timed) -> Result<Row, CliError>,
) -> Result<Vec<Row>, CliError> {
    let of_case = |case: &&Case| {
        let (timed, errors) = of.row(case)?;
        Ok(row(case, &timed)?.and(errors.row("indirect_energy")))
    };
    of.bench.rows("render", cases, |case| case.name.clone(), of_case)
}
