//! Common parts of the benchmarks of one-bounce indirect light: a view of a scene under its lights alone, and the path
//! tracer's images of it.

use std::{cell::OnceCell, cmp::Ordering};

use clap::Args;
use lanternfish::RenderedImage;
use lanternfish_cli::{
    error::CliError,
    images::{energy, energy_of},
};
use lanternfish_scene::{Light, LightKind, Scene};

use crate::{
    bench::{Bench, RunArgs, TimedFrames, is_requested},
    case::{Case, changed},
    ground_truths::{self, GroundTruth, GroundTruthFigures},
    reference::{IndirectErrors, Reference},
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
    /// Measure only configurations whose name contains these words; the image without indirect light is always
    /// included. Repeatable.
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

/// A view, and the path tracer's images of it.
pub struct Lit {
    /// The scene without sky, environment and emission, from the camera in the middle of the track.
    pub view: View,
    /// The path tracer's image with one bounce.
    reference: Reference,
    /// Energy of the renderer's own image without indirect light.
    pub direct_energy: f64,
}

/// Inputs and references of all configurations.
pub struct OneBounce {
    pub bench: Bench,
    pub lit: Lit,
    /// The same under the main light alone, if a case needs it.
    of_one_light: OnceCell<Lit>,
    spp: u64,
}

impl Lit {
    /// Reads or traces the path tracer's images of a view. `name` follows the names of their files.
    fn trace(bench: &Bench, view: View, spp: u64, name: &str) -> Result<(Self, GroundTruthFigures), CliError> {
        let trace =
            |doing: &str, ground_truth| bench.step("ground_truth", doing, || view.reference(bench, ground_truth, spp));
        let direct = trace("Tracing direct light", GroundTruth::Direct)?;
        let one_bounce = trace("Tracing one bounce", GroundTruth::OneBounceFile)?;
        bench.write_linear(&format!("ground_truth-zero-bounces{name}"), &direct.mean, &view.look)?;
        bench.write_linear(&format!("ground_truth-one-bounce{name}"), &one_bounce.mean, &view.look)?;
        let hint = "add lights, e.g. --lights rain:10, or choose another view";
        let reference = Reference::new(one_bounce.mean, energy_of(&direct.mean), hint)?;
        let direct_energy = energy(&bench.first_frame(&view, &changed(&view.look, "indirect none"))?);
        Ok((Self { view, reference, direct_energy }, one_bounce.figures))
    }

    fn errors(&self, image: &RenderedImage) -> Result<IndirectErrors, CliError> {
        Ok(self.reference.errors(image, self.direct_energy)?)
    }
}

/// The scene with its main light alone: the brightest directional one, else the brightest.
fn under_one_light(mut scene: Scene) -> Scene {
    let rank = |light: &Light| (light.kind == LightKind::Directional, light.intensity.element_sum());
    let brighter = |a: &Light, b: &Light| rank(a).partial_cmp(&rank(b)).unwrap_or(Ordering::Equal);
    scene.lights = scene.lights.into_iter().max_by(brighter).into_iter().collect();
    scene
}

impl OneBounce {
    /// Opens the adapter, loads the scene, and reads or traces the path tracer's images. `name` is the name of the
    /// benchmark.
    pub fn start(args: &OneBounceArgs, name: &str, title: &str) -> Result<Self, CliError> {
        let bench = Bench::start(&args.run, name, title, Some(&args.subject.scene))?.with_timestamps()?;
        let (mut view, cameras) = View::load(&args.subject, false, &bench)?;
        // For every reference, the lights are the only light: no emission and no environment.
        view.scene = ground_truths::of_lights_alone(view.scene);
        view.camera = cameras[cameras.len() / 2].clone();
        let (lit, figures) = Lit::trace(&bench, view, args.spp, "")?;
        let noise = lit.reference.noise(figures.noise_energy);
        let (spp, halves) = (figures.spp, figures.noise_hdr_flip);
        let facts = lit.view.facts().data("truth_samples", spp).data("truth_noise", noise);
        bench.facts(facts.data("truth_halves_flip", halves));
        bench.report().introduction(&lit.view.text(), &format!("least of {} runs, device time", bench.runs));
        bench.report().paragraph(format!(
            "Reference: {spp} samples per pixel, energy of its bounce ± {:.1} %, FLIP between its halves {halves:.4}, of which an exact image \
             would have about half. *Energy*: ratio of indirect light alone to the path tracer's one bounce. *FLIP*: HDR-FLIP of the \
             complete image.",
            100.0 * noise
        ));
        Ok(Self { bench, lit, of_one_light: OnceCell::new(), spp: args.spp })
    }

    /// What a case is measured on.
    pub fn lit(&self, case: &Case) -> Result<&Lit, CliError> {
        if !case.has_one_light || self.lit.view.scene.lights.len() == 1 {
            return Ok(&self.lit);
        }
        if self.of_one_light.get().is_none() {
            let view = self.lit.view.with(under_one_light(self.lit.view.scene.clone()));
            let (lit, _) = Lit::trace(&self.bench, view, self.spp, ", one light")?;
            let _ = self.of_one_light.set(lit);
        }
        Ok(self.of_one_light.get().expect("just set"))
    }

    /// Renders a configuration of the table, compares its image, and writes it to the folder.
    pub fn row(&self, case: &Case) -> Result<(TimedFrames, IndirectErrors), CliError> {
        let lit = self.lit(case)?;
        let timed = self.bench.timed(&lit.view, &self.bench.made(&format!("light: {}", case.name), &case.settings))?;
        self.bench.write(&case.name, &timed.image)?;
        let errors = lit.errors(&timed.image)?;
        Ok((timed, errors))
    }
}

/// Rows of a table of one-bounce cases: each is rendered, compared, and described by `row`.
pub fn rows(
    of: &OneBounce,
    cases: &[Case],
    row: impl Fn(&Case, &TimedFrames) -> Result<Row, CliError>,
) -> Result<Vec<Row>, CliError> {
    let of_case = |case: &&Case| {
        let (timed, errors) = of.row(case)?;
        Ok(row(case, &timed)?.and(errors.row("indirect_energy")))
    };
    of.bench.rows("render", cases, |case| case.name.clone(), of_case)
}

#[test]
fn the_main_light_is_the_sun_else_the_brightest() {
    use glam::Vec3;
    let light = |kind, intensity: f32| Light { kind, ..Light::point(Vec3::ZERO, Vec3::splat(intensity)) };
    let left = |lights: &[Light]| under_one_light(Scene { lights: lights.to_vec(), ..Scene::default() }).lights;
    let lights = [light(LightKind::Point, 5.0), light(LightKind::Directional, 1.0), light(LightKind::Point, 9.0)];
    assert_eq!(left(&lights), [lights[1].clone()]);
    assert_eq!(left(&[lights[0].clone(), lights[2].clone()]), [lights[2].clone()]);
    assert!(left(&[]).is_empty());
}
