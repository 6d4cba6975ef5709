//! What benches of one bounce of indirect light share: a view of a scene that its lights alone light, the path tracer's pictures of it, and
//! a walk through it.

mod frames;
mod walk;

use std::path::PathBuf;

use clap::Args;
use lanternfish::{
    Picture, Renderer,
    settings::{Indirect, Settings},
};
use lanternfish_gpu::{AdapterChoice, Engine, PassTime};
use lanternfish_metrics::{ColorType, HdrFlip, Pair, RgbImage, write_png};
use lanternfish_scene::{Camera, Scene};
use serde::Serialize;

pub use self::walk::Flicker;
use self::walk::{Walk, grey};
use super::{
    forward_plus::rgb,
    make_folder, open_timed,
    quality::{
        shown,
        truths::{self, Truth},
    },
    subject::{Source, Subject},
};
use lanternfish_cli::{
    args::{LightArgs, PartArgs, ViewArgs, adapter},
    error::CliError,
    output::{print, write_text},
    parse::{self, Size},
    progress::Progress,
    scene::SceneName,
};

#[derive(Debug, Args)]
pub struct OneBounceArgs {
    /// A shot (.toml), which then says the view, the lights and the look, and along whose track flicker is measured; a glTF or OBJ
    /// file, or demo:NAME.
    #[arg(default_value = "demo:cornell")]
    pub scene: SceneName,
    /// The folder for report.md, report.json, the pictures, and the path tracer's, which a later run finds there. It is made if it is
    /// not there. Without it: bench- and the bench's name.
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Width and height of every picture, pixels.
    #[arg(long, value_name = "WxH", default_value = "480x270", value_parser = parse::size)]
    pub size: Size,
    /// How often everything is timed, after one run that is not; the least counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub runs: u32,
    /// Samples a pixel of the truths: twice as many with one bounce, eight times as many without. More: less noise, slower.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u64).range(2..=1 << 20))]
    pub spp: u64,
    /// Few configurations only.
    #[arg(long)]
    pub quick: bool,
    /// Only those whose name holds one of these words; the picture without indirect light is always there. Repeatable.
    #[arg(long, value_name = "WORDS")]
    pub only: Vec<String>,
    /// Where to run: a part of an adapter's name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
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

impl OneBounceArgs {
    /// Whether a configuration, or a table, is asked for.
    pub fn asks_for(&self, name: &str) -> bool {
        self.only.is_empty() || name == "none" || self.only.iter().any(|words| name.contains(words))
    }
}

/// One way to find indirect light.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// What it changes, by the names of the command line.
    pub name: String,
    pub settings: Settings,
    /// Whether its steps are beside the paper's.
    pub has_steps: bool,
}

/// Against the path tracer.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Sum of the radiance of indirect light alone over that of the truth.
    pub indirect_energy: f64,
    /// Mean HDR-FLIP of the whole picture.
    pub flip: f64,
}

/// What a bench is of, as its report says it.
#[derive(Clone, Debug, Serialize)]
pub struct Heading {
    pub version: &'static str,
    pub scene: SceneName,
    pub adapter: String,
    pub driver: String,
    pub triangles: usize,
    pub lights: usize,
    pub width: u32,
    pub height: u32,
    pub runs: u32,
    pub truth_samples: u64,
    /// Standard deviation of the energy of the truth's bounce by its noise, over that energy, at most.
    pub truth_noise: f64,
    /// Mean HDR-FLIP between the two halves of the truth's samples: an exact picture is about half as far from the truth.
    pub truth_halves_flip: f64,
}

/// What every configuration shares.
pub struct Bench {
    /// Configurations have much in common: it is compiled once.
    engine: Engine,
    pub folder: PathBuf,
    /// The scene, without light but that of its lights.
    pub scene: Scene,
    cameras: Vec<Camera>,
    /// Direct light as it is asked for.
    pub look: Settings,
    pub heading: Heading,
    pub size: Size,
    spp: u64,
    /// The path tracer's picture with one bounce, and the energy of the bounce alone.
    truth: RgbImage,
    truth_energy: f64,
    /// The path tracer's picture without indirect light.
    direct_truth: RgbImage,
    /// Energy of the renderer's own picture without indirect light.
    direct_energy: f64,
}

impl Bench {
    /// Loads the scene, opens the adapter, and has the path tracer's pictures, traced or found. `name`: the bench's.
    pub fn start(args: &OneBounceArgs, name: &str, progress: &mut Progress) -> Result<Self, CliError> {
        let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(format!("bench-{name}")));
        make_folder(&folder)?;
        let (view, lights) = (&args.view, &args.lights);
        let source = Source { scene: &args.scene, part: &args.part, view, lights, seed: args.seed, size: args.size };
        let Subject { scene: whole, cameras, look } = Subject::load(&source, progress)?;
        let gpu = open_timed(args.adapter.as_ref())?;
        // Light of the lights alone, whichever truth: nothing else shines, and nothing surrounds the scene.
        let scene = truths::of_lights_alone(whole);
        let camera = &cameras[cameras.len() / 2];
        let truth = |truth: Truth| {
            let (name, size) = (scene.name.as_str(), args.size);
            truths::obtain(
                &folder,
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
        let Size { width, height } = args.size;
        for (name, truth) in [("truth-zero-bounces", &direct), ("truth-one-bounce", &one_bounce)] {
            let bytes = shown(&truth.mean, look.exposure, look.tone_map).0;
            write_png(&folder.join(format!("{name}.png")), width, height, ColorType::Rgb, &bytes)?;
        }
        let heading = Heading {
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
            truth_halves_flip: one_bounce.figures.noise_hdr_flip,
        };
        let (size, truth) = (args.size, one_bounce.mean);
        let mut bench = Self {
            engine: Engine::new(&gpu.device, &gpu.queue),
            folder,
            scene,
            cameras,
            look,
            heading,
            size,
            spp: args.spp,
            truth,
            truth_energy,
            direct_truth: direct.mean,
            direct_energy: 0.0,
        };
        bench.direct_energy = energy(&bench.render(&bench.without(), size)?.picture);
        Ok(bench)
    }

    /// Settings without indirect light.
    fn without(&self) -> Settings {
        Settings { indirect: Indirect::None, ..self.look.clone() }
    }

    fn camera(&self) -> &Camera {
        &self.cameras[self.cameras.len() / 2]
    }

    /// The path tracer's picture of another scene from the same place, traced or found.
    pub fn truth_of(&self, truth: Truth, scene: &Scene) -> Result<RgbImage, CliError> {
        let (name, settings, spp) = (scene.name.as_str(), &self.look, self.spp);
        let subject = truths::Subject { name, scene, camera: self.camera(), size: self.size, settings, spp };
        Ok(truths::obtain(&self.folder, truth, &subject)?.mean)
    }

    /// Renders some frames, of which the first is not timed.
    pub fn render(&self, settings: &Settings, size: Size) -> Result<Run, CliError> {
        self.render_scene(&self.scene, settings, size)
    }

    /// The same of another scene.
    pub fn render_scene(&self, scene: &Scene, settings: &Settings, size: Size) -> Result<Run, CliError> {
        let mut renderer = Renderer::with_engine(&self.engine, settings.clone())?;
        let uploaded = renderer.upload(scene)?;
        let mut frame = || renderer.render(&uploaded, self.camera(), size.width, size.height);
        // Deep images are built in the first frame alone.
        let first = frame()?.report.passes;
        let mut pictures = Vec::new();
        for _ in 0..self.heading.runs {
            pictures.push(frame()?);
        }
        let ms = |picture: &Picture| frame_ms(&picture.report.passes);
        let picture = pictures.into_iter().min_by(|a, b| ms(a).total_cmp(&ms(b))).expect("one run at least");
        Ok(Run { picture, first })
    }

    /// Renders a configuration of the table, and compares it. Its picture goes to the folder.
    pub fn row(&self, configuration: &Configuration) -> Result<(Run, Errors), CliError> {
        let run = self.render(&configuration.settings, self.size)?;
        let errors = self.keep(&configuration.name, &run.picture)?;
        Ok((run, errors))
    }

    /// Compares a picture, which goes to the folder under a name.
    pub fn keep(&self, name: &str, picture: &Picture) -> Result<Errors, CliError> {
        let file = format!("{}.png", name.replace([' ', ',', '.'], "-").replace("--", "-"));
        write_png(&self.folder.join(file), picture.width, picture.height, ColorType::Rgb, &rgb(picture))?;
        let (flip, _) = self.against(picture, &self.truth)?;
        Ok(self.errors(picture, self.direct_energy, flip))
    }

    /// Errors of a picture, of whose energy so much is direct light.
    fn errors(&self, picture: &Picture, direct_energy: f64, flip: f64) -> Errors {
        Errors { indirect_energy: (energy(picture) - direct_energy) / self.truth_energy, flip }
    }

    /// Compares the mean of so many frames, which goes to the folder. Of its light that is indirect which is not in the mean of as many
    /// frames without: edges and highlights of a mean are not those of one frame.
    pub fn mean_row(&self, configuration: &Configuration, frames: u32, direct: &Picture) -> Result<Errors, CliError> {
        let mean = self.mean(&configuration.settings, frames)?;
        let flip = self.keep(&format!("{}, {frames} frames", configuration.name), &mean)?.flip;
        Ok(self.errors(&mean, energy(direct), flip))
    }

    /// The mean of so many frames without indirect light, and its HDR-FLIP to the path tracer's direct light: what remains of the error
    /// of such a mean where indirect light is right.
    pub fn direct_mean(&self, frames: u32) -> Result<(Picture, f64), CliError> {
        let mean = self.mean(&self.without(), frames)?;
        let (flip, _) = self.against(&mean, &self.direct_truth)?;
        Ok((mean, flip))
    }

    /// Mean HDR-FLIP of a picture to a truth, and its sum over the truth's.
    pub fn against(&self, picture: &Picture, truth: &RgbImage) -> Result<(f64, f64), CliError> {
        let pair = Pair::new(linear(picture)?, truth.clone())?;
        Ok((pair.mean_of(&pair.flip_hdr(&HdrFlip::default())?.map), energy(picture) / energy_of(truth)))
    }

    /// The mean of so many frames.
    pub fn mean(&self, settings: &Settings, frames: u32) -> Result<Picture, CliError> {
        let settings = Settings { accumulate: frames, ..settings.clone() };
        let mut renderer = Renderer::with_engine(&self.engine, settings)?;
        let uploaded = renderer.upload(&self.scene)?;
        Ok(renderer.render(&uploaded, self.camera(), self.size.width, self.size.height)?)
    }

    /// Writes the report to the folder, as JSON and as a page, which is printed too.
    pub fn write(&self, report: &impl Serialize, page: &str) -> Result<(), CliError> {
        let json = serde_json::to_string_pretty(report).expect("plain numbers and strings");
        write_text(&self.folder.join("report.json"), &(json + "\n"))?;
        let file = self.folder.join("report.md");
        write_text(&file, page)?;
        print(&format!("{page}\n{}\n", file.display()))
    }

    /// How much each flickers along the track; nothing where there is none.
    pub fn flicker(&self, walked: &[Configuration], progress: &mut Progress) -> Result<Vec<Flicker>, CliError> {
        if self.cameras.len() < 2 {
            return Ok(Vec::new());
        }
        let scene = grey(&self.scene);
        let walk = Walk::new(&self.engine, &scene, &self.cameras, self.size, &self.without())?;
        let of = |c: &Configuration| {
            progress.step("walk", &format!("Walking: {}", c.name), || walk.flicker(&c.name, &c.settings))
        };
        walked.iter().map(of).collect()
    }
}

/// Frames of one configuration.
pub struct Run {
    /// The one that took least.
    pub picture: Picture,
    /// The passes of the first, which builds what is kept.
    pub first: Vec<PassTime>,
}

impl Run {
    /// A counter of the picture; 0 where it has none of this name.
    pub fn counter(&self, name: &str) -> u64 {
        self.picture.report.counters.iter().find(|(known, _)| known == name).map_or(0, |(_, count)| *count)
    }

    /// Device milliseconds of the frame.
    pub fn frame_ms(&self) -> f64 {
        frame_ms(&self.picture.report.passes)
    }
}

/// Device milliseconds of a frame, without those that build deep images, which are kept as long as nothing moves.
pub fn frame_ms(passes: &[PassTime]) -> f64 {
    passes.iter().filter(|pass| !pass.name.starts_with("deep_images/")).map(|pass| pass.ms).sum()
}

/// What the report says of itself, and of flicker, as Markdown.
pub fn heading(heading: &Heading) -> String {
    format!(
        "{} x {}, {} triangles, {} lights; {} on {}, Lanternfish {}. Times: the least of {} runs, device ms, to be compared within this \
         page only. Counts and errors are exact. Truth: {} samples a pixel, energy of its bounce ± {:.1} %, FLIP of its halves \
         {:.4}: an exact picture would have about half of it.\n",
        heading.width,
        heading.height,
        lanternfish_cli::report::grouped(heading.triangles as u64),
        lanternfish_cli::report::grouped(heading.lights as u64),
        heading.adapter,
        heading.driver,
        heading.version,
        heading.runs,
        heading.truth_samples,
        100.0 * heading.truth_noise,
        heading.truth_halves_flip
    )
}

/// The table of flicker.
pub fn flicker_table(rows: &[Flicker]) -> String {
    let mut page = "\n## Flicker along the track\n\nSurfaces are grey and diffuse and do not move, lights neither. Standard deviation of the \
                    indirect light of a place over the frames that see it, and its mean change from one to the next, both over its mean.\n\n\
                    | | frames | places | deviation, % | of 95 % of places at most | change a frame, % |\n|---|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for row in rows {
        page += &format!(
            "| {} | {} | {} | {:.2} | {:.2} | {:.2} |\n",
            row.name,
            row.frames,
            lanternfish_cli::report::grouped(row.places as u64),
            100.0 * row.mean,
            100.0 * row.percentile_95,
            100.0 * row.step
        );
    }
    page
}

/// Sum of all channels of all pixels.
fn energy(picture: &Picture) -> f64 {
    picture.radiance.iter().flat_map(|pixel| &pixel[..3]).map(|value| f64::from(*value)).sum()
}

/// The same of a picture of the path tracer.
fn energy_of(image: &RgbImage) -> f64 {
    image.pixels.iter().flatten().map(|value| f64::from(*value)).sum()
}

fn linear(picture: &Picture) -> Result<RgbImage, CliError> {
    let pixels = picture.radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    Ok(RgbImage::new(picture.width as usize, picture.height as usize, pixels)?)
}
