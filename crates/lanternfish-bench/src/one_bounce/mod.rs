//! Common parts of the benchmarks of one-bounce indirect light: a view of a scene under its lights alone, the path tracer's images of it,
//! and a walk through it.

mod frames;
pub mod walk;

use clap::Args;
use lanternfish::{
    RenderedImage, Renderer,
    settings::{Indirect, Settings},
};
use lanternfish_cli::{error::CliError, parse::Size, progress::Progress, report::grouped};
use lanternfish_gpu::PassTime;
use lanternfish_metrics::{ColorType, Pair, RgbImage, write_png};
use lanternfish_scene::{Camera, Scene};

use self::walk::{Walk, grey};
use crate::{
    document::Document,
    ground_truths::{self, GroundTruth},
    image::{self, energy, energy_of, hdr_flip, linear, shown},
    run::{Run, RunArgs, frame_ms, least},
    subject::{Subject, SubjectArgs},
    table::Row,
    technique,
};

/// Flags of the one-bounce benchmarks.
#[derive(Debug, Args)]
pub struct OneBounceArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Samples per pixel of the references: multiplied by 2 with one bounce, by 8 without. More: less noise, slower.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    spp: u64,
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
        self.only.is_empty() || name == "none" || self.only.iter().any(|words| name.contains(words))
    }
}

/// One configuration of indirect light.
#[derive(Clone, Debug)]
pub struct Case {
    /// The changed settings, by their names on the command line.
    pub name: String,
    pub settings: Settings,
}

/// Configurations of `look` with these techniques of indirect light.
pub fn named(look: &Settings, techniques: &[(&str, Indirect)]) -> Vec<Case> {
    let case = |(name, indirect): &(&str, Indirect)| Case {
        name: (*name).to_owned(),
        settings: look.clone().with_indirect(indirect.clone()),
    };
    techniques.iter().map(case).collect()
}

/// Errors against the path tracer.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Energy of indirect light alone, as a ratio to that of the reference.
    indirect_energy: f64,
    /// Mean HDR-FLIP of the complete image.
    flip: f64,
}

impl Errors {
    /// The errors as figures of a row.
    pub fn row(&self) -> Row {
        let row = Row::default().fixed("indirect_energy", "energy", 3, self.indirect_energy);
        row.fixed("flip", "FLIP", 4, self.flip)
    }
}

/// Inputs and references of all configurations.
pub struct Bench {
    run: Run,
    /// The scene without sky, environment and emission.
    pub scene: Scene,
    cameras: Vec<Camera>,
    /// Requested settings, with direct light only.
    pub look: Settings,
    pub size: Size,
    spp: u64,
    /// The path tracer's image with one bounce.
    ground_truth: RgbImage,
    /// Energy of the bounce alone, in that image.
    ground_truth_energy: f64,
    /// The path tracer's image without indirect light.
    direct_ground_truth: RgbImage,
    /// Energy of the renderer's own image without indirect light.
    direct_energy: f64,
    /// The report, to which its tables are added.
    pub report: Document,
}

impl Bench {
    /// Loads the scene, opens the adapter, and reads or traces the path tracer's images. `name` is the name of the benchmark.
    pub fn start(args: &OneBounceArgs, name: &str, title: &str, progress: &mut Progress) -> Result<Self, CliError> {
        let size = args.subject.size;
        let Subject { scene: complete, cameras, look } = Subject::load(&args.subject, false, progress)?;
        let run = Run::start_timed(&args.run, name)?;
        // For every reference, the lights are the only light: no emission and no environment.
        let scene = ground_truths::of_lights_alone(complete);
        let camera = &cameras[cameras.len() / 2];
        let subject =
            ground_truths::Subject { name: &scene.name, scene: &scene, camera, size, settings: &look, spp: args.spp };
        let ground_truth = |ground_truth| ground_truths::obtain(&run.folder, ground_truth, &subject);
        let direct = progress.step("ground_truth", "Tracing direct light", || ground_truth(GroundTruth::Direct))?;
        let one_bounce =
            progress.step("ground_truth", "Tracing one bounce", || ground_truth(GroundTruth::OneBounceFile))?;
        let ground_truth_energy = energy_of(&one_bounce.mean) - energy_of(&direct.mean);
        if ground_truth_energy <= 0.0 {
            let hint = "add lights, e.g. --lights rain:10, or choose another view";
            return Err(CliError::new("no light arrives by one bounce", hint));
        }
        let Size { width, height } = size;
        for (name, ground_truth) in [("ground_truth-zero-bounces", &direct), ("ground_truth-one-bounce", &one_bounce)] {
            let bytes = shown(&ground_truth.mean, look.image.exposure, look.image.tone_map).0;
            write_png(&run.folder.join(format!("{name}.png")), width, height, ColorType::Rgb, &bytes)?;
        }
        let report = report(title, args, &run, &scene, &one_bounce, ground_truth_energy);
        let mut bench = Self {
            run,
            scene,
            cameras,
            look,
            size,
            spp: args.spp,
            ground_truth: one_bounce.mean,
            ground_truth_energy,
            direct_ground_truth: direct.mean,
            direct_energy: 0.0,
            report,
        };
        bench.direct_energy = energy(&bench.render(&bench.without(), size)?.rendering);
        Ok(bench)
    }

    /// Settings without indirect light.
    fn without(&self) -> Settings {
        self.look.clone().with_indirect(technique::NO_INDIRECT)
    }

    fn camera(&self) -> &Camera {
        &self.cameras[self.cameras.len() / 2]
    }

    /// Reads or traces the path tracer's image of another scene with the same camera.
    pub fn ground_truth_of(&self, ground_truth: GroundTruth, scene: &Scene) -> Result<RgbImage, CliError> {
        let (name, settings, spp) = (scene.name.as_str(), &self.look, self.spp);
        let subject = ground_truths::Subject { name, scene, camera: self.camera(), size: self.size, settings, spp };
        Ok(ground_truths::obtain(&self.run.folder, ground_truth, &subject)?.mean)
    }

    /// Renders a warm-up frame and timed frames.
    pub fn render(&self, settings: &Settings, size: Size) -> Result<Rendered, CliError> {
        self.render_scene(&self.scene, settings, size)
    }

    /// As [`Self::render`], with another scene.
    pub fn render_scene(&self, scene: &Scene, settings: &Settings, size: Size) -> Result<Rendered, CliError> {
        let mut renderer = Renderer::with_engine(&self.run.engine, settings.clone())?;
        let uploaded = renderer.upload(scene)?;
        let frame = || renderer.render(&uploaded, self.camera(), size.width, size.height);
        // Deep images are built in the first frame only.
        let (first, rendering) = least(self.run.runs, frame, |rendering| frame_ms(&rendering.report.passes))?;
        Ok(Rendered { rendering, first: first.report.passes })
    }

    /// Renders a configuration of the table, compares its image, and writes it to the folder.
    pub fn row(&self, case: &Case) -> Result<(Rendered, Errors), CliError> {
        let rendered = self.render(&case.settings, self.size)?;
        let errors = self.keep(&case.name, &rendered.rendering)?;
        Ok((rendered, errors))
    }

    /// Writes an image to the folder under a name.
    pub fn write(&self, name: &str, rendering: &RenderedImage) -> Result<(), CliError> {
        let file = format!("{}.png", name.replace([' ', ',', '.'], "-").replace("--", "-"));
        image::write(&self.run.folder.join(file), rendering)
    }

    /// Compares an image, which goes to the folder under a name.
    pub fn keep(&self, name: &str, rendering: &RenderedImage) -> Result<Errors, CliError> {
        self.write(name, rendering)?;
        let (flip, _) = self.against(rendering, &self.ground_truth)?;
        Ok(self.errors(rendering, self.direct_energy, flip))
    }

    /// Errors of an image with the energy `direct_energy` of direct light.
    fn errors(&self, rendering: &RenderedImage, direct_energy: f64, flip: f64) -> Errors {
        Errors { indirect_energy: (energy(rendering) - direct_energy) / self.ground_truth_energy, flip }
    }

    /// Renders the mean of `frames` frames, writes it to the folder, and compares it. Its direct light is that of `direct`, a mean of as many
    /// frames without indirect light, because edges and highlights of a mean differ from those of one frame.
    pub fn mean_row(&self, case: &Case, frames: u32, direct: &RenderedImage) -> Result<Errors, CliError> {
        let mean = self.mean(&case.settings, frames)?;
        let flip = self.keep(&format!("{}, {frames} frames", case.name), &mean)?.flip;
        Ok(self.errors(&mean, energy(direct), flip))
    }

    /// The mean of `frames` frames without indirect light, and its HDR-FLIP against the path tracer's direct light. That is the error of a
    /// mean with exact indirect light.
    pub fn direct_mean(&self, frames: u32) -> Result<(RenderedImage, f64), CliError> {
        let mean = self.mean(&self.without(), frames)?;
        let (flip, _) = self.against(&mean, &self.direct_ground_truth)?;
        Ok((mean, flip))
    }

    /// Mean HDR-FLIP of an image against a reference, and the ratio of their energies.
    pub fn against(&self, rendering: &RenderedImage, ground_truth: &RgbImage) -> Result<(f64, f64), CliError> {
        let pair = Pair::new(linear(rendering)?, ground_truth.clone())?;
        Ok((hdr_flip(&pair)?, energy(rendering) / energy_of(ground_truth)))
    }

    /// Renders the mean of `frames` frames.
    fn mean(&self, settings: &Settings, frames: u32) -> Result<RenderedImage, CliError> {
        let settings = settings.clone().with_accumulate(frames);
        let mut renderer = Renderer::with_engine(&self.run.engine, settings)?;
        let uploaded = renderer.upload(&self.scene)?;
        Ok(renderer.render(&uploaded, self.camera(), self.size.width, self.size.height)?)
    }

    /// Measures the flicker of each configuration along the track, if there is one, and writes the report.
    pub fn finish(mut self, walked: &[Case], mut progress: Progress) -> Result<(), CliError> {
        let mut rows = Vec::new();
        if self.cameras.len() > 1 && !walked.is_empty() {
            let scene = grey(&self.scene);
            let walk = Walk::new(&self.run.engine, &scene, &self.cameras, self.size, &self.without())?;
            for Case { name, settings } in walked {
                let doing = format!("Walking: {name}");
                rows.push(progress.step("walk", &doing, || walk.flicker(name, settings))?.row());
            }
        }
        progress.finish();
        let text = "Surfaces are grey, diffuse and static, and so are lights. Standard deviation of the indirect light of a surface point over \
                    the frames in which it is visible, and its mean change from frame to frame, both relative to its mean.";
        self.report.section("Flicker along the track", text, "flicker", rows);
        self.report.write(&self.run.folder)
    }
}

/// The report with its header.
fn report(
    title: &str,
    args: &OneBounceArgs,
    run: &Run,
    scene: &Scene,
    ground_truth: &ground_truths::Traced,
    energy: f64,
) -> Document {
    let (source, Size { width, height }) = (&args.subject.scene, args.subject.size);
    let (triangles, lights) = (scene.triangle_counts().1, scene.lights.len());
    let noise = ground_truth.figures.noise_energy * energy_of(&ground_truth.mean) / energy;
    let (spp, halves) = (ground_truth.figures.spp, ground_truth.figures.noise_hdr_flip);
    let mut report = Document::of_scene(title, source, &run.gpu, run.runs);
    let facts = Row::default().data("triangles", triangles).data("lights", lights).data("width", width);
    let facts = facts.data("height", height).data("truth_samples", spp);
    report.facts(facts.data("truth_noise", noise).data("truth_halves_flip", halves));
    let [triangles, lights] = [triangles as u64, lights as u64].map(grouped);
    let what = format!("{width} x {height} pixels, {triangles} triangles, {lights} lights");
    report.introduction(&what, &format!("least of {} runs, device time", run.runs));
    report.paragraph(format!(
        "Reference: {spp} samples per pixel, energy of its bounce ± {:.1} %, FLIP between its halves {halves:.4}, of which an exact image would \
         have about half. *Energy*: ratio of indirect light alone to the path tracer's one bounce. *FLIP*: HDR-FLIP of the complete image.",
        100.0 * noise
    ));
    report
}

/// Frames of one configuration.
pub struct Rendered {
    /// The fastest frame.
    pub rendering: RenderedImage,
    /// Passes of the first frame, which builds reused structures.
    pub first: Vec<PassTime>,
}
