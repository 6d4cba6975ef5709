//! What benches of one bounce of indirect light share: a view of a scene that its lights alone light, the path tracer's images of it, and
//! a walk through it.

mod frames;
mod walk;

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

/// Flags of benches of one bounce.
#[derive(Debug, Args)]
pub struct OneBounceArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Samples a pixel of the references: twice as many with one bounce, eight times as many without. More: less noise, slower.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    spp: u64,
    /// Few cases only.
    #[arg(long)]
    pub quick: bool,
    /// Only those whose name holds one of these words; the image without indirect light is always there. Repeatable.
    #[arg(long, value_name = "WORDS")]
    only: Vec<String>,
    #[command(flatten)]
    subject: SubjectArgs,
}

impl OneBounceArgs {
    /// Whether a case, or a table, is requested.
    pub fn requests(&self, name: &str) -> bool {
        self.only.is_empty() || name == "none" || self.only.iter().any(|words| name.contains(words))
    }
}

/// One way to find indirect light.
#[derive(Clone, Debug)]
pub struct Case {
    /// What it changes, by the names of the command line.
    pub name: String,
    pub settings: Settings,
}

/// Cases that are `look` with these kinds of indirect light.
pub fn named(look: &Settings, ways: &[(&str, Indirect)]) -> Vec<Case> {
    let case = |(name, indirect): &(&str, Indirect)| Case {
        name: (*name).to_owned(),
        settings: Settings { indirect: indirect.clone(), ..look.clone() },
    };
    ways.iter().map(case).collect()
}

/// Against the path tracer.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Sum of the radiance of indirect light alone over that of the reference.
    indirect_energy: f64,
    /// Mean HDR-FLIP of the whole image.
    flip: f64,
}

impl Errors {
    /// As figures.
    pub fn row(&self) -> Row {
        let row = Row::default().fixed("indirect_energy", "energy", 3, self.indirect_energy);
        row.fixed("flip", "FLIP", 4, self.flip)
    }
}

/// What every case shares.
pub struct Bench {
    run: Run,
    /// The scene, without light but that of its lights.
    pub scene: Scene,
    cameras: Vec<Camera>,
    /// Direct light as it is requested.
    pub look: Settings,
    pub size: Size,
    spp: u64,
    /// The path tracer's image with one bounce, and the energy of the bounce alone.
    ground_truth: RgbImage,
    ground_truth_energy: f64,
    /// The path tracer's image without indirect light.
    direct_ground_truth: RgbImage,
    /// Energy of the renderer's own image without indirect light.
    direct_energy: f64,
    /// The report, to which its tables are added.
    pub report: Document,
}

impl Bench {
    /// Loads the scene, opens the adapter, and has the path tracer's images, traced or found. `name`: the bench's.
    pub fn start(args: &OneBounceArgs, name: &str, title: &str, progress: &mut Progress) -> Result<Self, CliError> {
        let size = args.subject.size;
        let Subject { scene: whole, cameras, look } = Subject::load(&args.subject, false, progress)?;
        let run = Run::start_timed(&args.run, name)?;
        // Light of the lights alone, whichever reference: nothing else is emissive, and nothing surrounds the scene.
        let scene = ground_truths::of_lights_alone(whole);
        let camera = &cameras[cameras.len() / 2];
        let subject =
            ground_truths::Subject { name: &scene.name, scene: &scene, camera, size, settings: &look, spp: args.spp };
        let ground_truth = |ground_truth| ground_truths::obtain(&run.folder, ground_truth, &subject);
        let direct = progress.step("ground_truth", "Tracing direct light", || ground_truth(GroundTruth::Direct))?;
        let one_bounce =
            progress.step("ground_truth", "Tracing one bounce", || ground_truth(GroundTruth::OneBounceFile))?;
        let ground_truth_energy = energy_of(&one_bounce.mean) - energy_of(&direct.mean);
        if ground_truth_energy <= 0.0 {
            let hint = "add lights, e.g. --lights rain:10, or look elsewhere";
            return Err(CliError::new("no light arrives by one bounce", hint));
        }
        let Size { width, height } = size;
        for (name, ground_truth) in [("ground_truth-zero-bounces", &direct), ("ground_truth-one-bounce", &one_bounce)] {
            let bytes = shown(&ground_truth.mean, look.exposure, look.tone_map).0;
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
        Settings { indirect: technique::NO_INDIRECT, ..self.look.clone() }
    }

    fn camera(&self) -> &Camera {
        &self.cameras[self.cameras.len() / 2]
    }

    /// The path tracer's image of another scene from the same place, traced or found.
    pub fn ground_truth_of(&self, ground_truth: GroundTruth, scene: &Scene) -> Result<RgbImage, CliError> {
        let (name, settings, spp) = (scene.name.as_str(), &self.look, self.spp);
        let subject = ground_truths::Subject { name, scene, camera: self.camera(), size: self.size, settings, spp };
        Ok(ground_truths::obtain(&self.run.folder, ground_truth, &subject)?.mean)
    }

    /// Renders some frames, of which the first is not timed.
    pub fn render(&self, settings: &Settings, size: Size) -> Result<Rendered, CliError> {
        self.render_scene(&self.scene, settings, size)
    }

    /// The same of another scene.
    pub fn render_scene(&self, scene: &Scene, settings: &Settings, size: Size) -> Result<Rendered, CliError> {
        let mut renderer = Renderer::with_engine(&self.run.engine, settings.clone())?;
        let uploaded = renderer.upload(scene)?;
        let frame = || renderer.render(&uploaded, self.camera(), size.width, size.height);
        // Deep images are built in the first frame alone.
        let (first, rendering) = least(self.run.runs, frame, |rendering| frame_ms(&rendering.report.passes))?;
        Ok(Rendered { rendering, first: first.report.passes })
    }

    /// Renders a case of the table, and compares it. Its image goes to the folder.
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

    /// Errors of an image, of whose energy so much is direct light.
    fn errors(&self, rendering: &RenderedImage, direct_energy: f64, flip: f64) -> Errors {
        Errors { indirect_energy: (energy(rendering) - direct_energy) / self.ground_truth_energy, flip }
    }

    /// Compares the mean of so many frames, which goes to the folder. Of its light that is indirect which is not in the mean of as many
    /// frames without: edges and highlights of a mean are not those of one frame.
    pub fn mean_row(&self, case: &Case, frames: u32, direct: &RenderedImage) -> Result<Errors, CliError> {
        let mean = self.mean(&case.settings, frames)?;
        let flip = self.keep(&format!("{}, {frames} frames", case.name), &mean)?.flip;
        Ok(self.errors(&mean, energy(direct), flip))
    }

    /// The mean of so many frames without indirect light, and its HDR-FLIP to the path tracer's direct light: what remains of the error
    /// of such a mean where indirect light is right.
    pub fn direct_mean(&self, frames: u32) -> Result<(RenderedImage, f64), CliError> {
        let mean = self.mean(&self.without(), frames)?;
        let (flip, _) = self.against(&mean, &self.direct_ground_truth)?;
        Ok((mean, flip))
    }

    /// Mean HDR-FLIP of an image to a reference, and its sum over the reference's.
    pub fn against(&self, rendering: &RenderedImage, ground_truth: &RgbImage) -> Result<(f64, f64), CliError> {
        let pair = Pair::new(linear(rendering)?, ground_truth.clone())?;
        Ok((hdr_flip(&pair)?, energy(rendering) / energy_of(ground_truth)))
    }

    /// The mean of so many frames.
    fn mean(&self, settings: &Settings, frames: u32) -> Result<RenderedImage, CliError> {
        let settings = Settings { accumulate: frames, ..settings.clone() };
        let mut renderer = Renderer::with_engine(&self.run.engine, settings)?;
        let uploaded = renderer.upload(&self.scene)?;
        Ok(renderer.render(&uploaded, self.camera(), self.size.width, self.size.height)?)
    }

    /// Adds to the report how much each flickers along the track, where there is one, and writes it.
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
        let text = "Surfaces are grey and diffuse and do not move, lights neither. Standard deviation of the indirect light of a place over \
                    the frames that see it, and its mean change from one to the next, both over its mean.";
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
    let what = format!("{width} x {height}, {triangles} triangles, {lights} lights");
    report.introduction(&what, &format!("the least of {} runs, device ms", run.runs));
    report.paragraph(format!(
        "Reference: {spp} samples a pixel, energy of its bounce ± {:.1} %, FLIP of its halves {halves:.4}: an exact image would have about \
         half of it. *Energy*: of indirect light alone, over the path tracer's one bounce. *FLIP*: HDR-FLIP of the whole image.",
        100.0 * noise
    ));
    report
}

/// Frames of one case.
pub struct Rendered {
    /// The one that took least.
    pub rendering: RenderedImage,
    /// The passes of the first, which builds what is kept.
    pub first: Vec<PassTime>,
}
