//! The driver of every benchmark: adapter, output folder, progress, frames, images and the report.

use std::{
    cell::{Cell, RefCell, RefMut},
    fmt::Display,
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use clap::Args;
use lanternfish::{GpuScene, RenderError, RenderedImage, Renderer, settings::Settings, shaders};
use lanternfish_cli::{
    error::{self, CliError},
    images::{rgb, shown},
    parse::adapter,
    progress::Progress,
    scene::SceneName,
    timed::Timed,
    times::frame_ms,
};
use lanternfish_gpu::{AdapterChoice, Engine, Gpu, PassTime, ShaderTexts, driver_warning};
use lanternfish_metrics::{ColorType, RgbImage, write_png};
use lanternfish_scene::Scene;

use crate::{
    case::changed,
    document::{Document, LeftOut},
    stage::{Left, Stage},
    table::Row,
    view::View,
};

/// Flags of every benchmark.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Folder of the report and its images, created if missing. Default: bench- and the benchmark's name.
    #[arg(short, long, alias = "out", value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Number of timed runs, after one warm-up run.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// Leaves out rows that would not end within this time. The first row of each table is measured.
    #[arg(long, value_name = "SECONDS", hide_short_help = true)]
    pub seconds: Option<f64>,
    /// A deliberate fault, ROW = CHANGES: rows whose names contain ROW are made with these changes of settings, and
    /// keep their names. One a run: claims compare rows of one table.
    #[arg(long, value_name = "ROW = CHANGES", value_parser = fault, hide = true)]
    pub fault: Option<(String, String)>,
    /// Adapter: a part of its name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
}

fn fault(text: &str) -> Result<(String, String), String> {
    let (row, changes) = text.split_once(" = ").ok_or("expected ROW = CHANGES")?;
    Ok((row.to_owned(), changes.to_owned()))
}

/// What takes longer the first time is not repeated.
pub const LONG: Duration = Duration::from_secs(4);

/// A running benchmark.
pub struct Bench {
    pub folder: PathBuf,
    pub gpu: Gpu,
    /// Shared by all configurations, so that common pipelines are compiled once.
    pub engine: Engine,
    pub runs: u32,
    fault: Option<(String, String)>,
    /// When no further row begins.
    deadline: Option<Instant>,
    /// Of all steps but ground truths.
    longest: Cell<Duration>,
    progress: RefCell<Progress>,
    report: RefCell<Document>,
    left_out: RefCell<Vec<LeftOut>>,
    left: Left,
}

/// Frames of one configuration.
pub struct TimedFrames {
    /// The fastest frame.
    pub image: RenderedImage,
    /// Passes of the first frame, which builds reused structures.
    pub first: Vec<PassTime>,
    /// Passes of every timed frame.
    pub runs: Vec<Vec<PassTime>>,
}

impl Bench {
    /// Creates the folder, opens the adapter, and prints a warning about known driver faults. `name` is the benchmark's
    /// name; `title` and the scene head the report.
    pub fn start(args: &RunArgs, name: &str, title: &str, scene: Option<&SceneName>) -> Result<Self, CliError> {
        let progress = Progress::start(false);
        if let Some(missing) = scene.filter(|scene| scene.demo().is_none() && !scene.path().exists()) {
            return Err(CliError::new(format_args!("{missing}: there is no such file"), "check the path"));
        }
        let folder = args.output.clone().unwrap_or_else(|| format!("bench-{name}").into());
        make_folder(&folder)?;
        let gpu = Gpu::open(&args.adapter.clone().unwrap_or_default())?;
        if let Some(warning) = driver_warning(&gpu.device.adapter_info()) {
            error::say(&format_args!("warning: {warning}"));
        }
        let engine = Engine::new(&gpu.device, &gpu.queue);
        let report = match scene {
            Some(scene) => Document::of_scene(title, scene, &gpu, args.runs),
            None => Document::new(title, &gpu, args.runs),
        };
        let (progress, report, left_out, left) = (progress.into(), report.into(), RefCell::default(), Left::default());
        let deadline = args.seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds.max(0.0)));
        let longest = Cell::default();
        let (runs, fault) = (args.runs, args.fault.clone());
        Ok(Self { folder, gpu, engine, runs, fault, deadline, longest, progress, report, left_out, left })
    }

    /// Fails if the adapter has no timestamps.
    pub fn with_timestamps(self) -> Result<Self, CliError> {
        if self.gpu.description.timestamps {
            return Ok(self);
        }
        let name = &self.gpu.description.name;
        let hint = "choose another adapter with --adapter";
        Err(CliError::new(format_args!("{name} has no timestamps to time passes"), hint))
    }

    /// True if the adapter is a software renderer.
    pub fn is_software(&self) -> bool {
        self.gpu.description.device_type == "Cpu"
    }

    /// Runs a step, as [`Progress::step`]. A step within another one is part of that.
    pub fn step<T, E>(&self, name: &'static str, doing: &str, work: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let started = Instant::now();
        let done = match self.progress.try_borrow_mut() {
            Ok(mut progress) => progress.step(name, doing, work),
            Err(_) => work(),
        };
        if name != "ground_truth" {
            self.longest.set(self.longest.get().max(started.elapsed()));
        }
        done
    }

    /// Passes the progress to `work`.
    pub fn with_progress<T>(&self, work: impl FnOnce(&mut Progress) -> T) -> T {
        work(&mut self.progress.borrow_mut())
    }

    /// True if a row that takes as long as the longest step would end in time; else `what` is listed as left out.
    pub fn has_time(&self, what: &str) -> bool {
        let has_time = self.deadline.is_none_or(|deadline| Instant::now() + self.longest.get() < deadline);
        if !has_time {
            self.leave_out(what, "no time left");
        }
        has_time
    }

    /// Rows of all cases, of which those after the first are left out without time. A case that fails with [`Err`] ends
    /// the benchmark.
    pub fn rows<C, R, E>(
        &self,
        step: &'static str,
        cases: impl IntoIterator<Item = C>,
        name: impl Fn(&C) -> String,
        mut row: impl FnMut(&C) -> Result<R, E>,
    ) -> Result<Vec<R>, E> {
        let cases = cases.into_iter().enumerate().filter(|(i, case)| *i == 0 || self.has_time(&name(case)));
        cases.map(|(_, case)| self.step(step, &name(&case), || row(&case))).collect()
    }

    /// The report, to which tables are added.
    pub fn report(&self) -> RefMut<'_, Document> {
        self.report.borrow_mut()
    }

    /// Adds facts to the header of the report.
    pub fn facts(&self, facts: Row) {
        self.report().facts(facts);
    }

    /// Adds a section to the report, as [`Document::section`].
    pub fn section(&self, heading: &str, text: &str, key: &'static str, rows: Vec<Row>) {
        self.report().section(heading, text, key, rows);
    }

    /// Lists a case without results, once.
    pub fn leave_out(&self, what: impl Into<String>, reason: impl Display) {
        let (what, mut left_out) = (what.into(), self.left_out.borrow_mut());
        if !left_out.iter().any(|left_out| left_out.what == what) {
            left_out.push(LeftOut { what, reason: reason.to_string() });
        }
    }

    /// Removes the progress line, so that results can be printed, and returns the seconds of each step.
    pub fn end_progress(&self) -> Vec<(&'static str, f64)> {
        self.progress.replace(Progress::hidden()).finish()
    }

    /// Adds the cases without results to the report.
    pub fn list_left_out(&self) {
        self.report().left_out(&self.left_out.take());
    }

    /// Removes the progress line, adds the cases without results, writes the report and prints it.
    pub fn finish(self) -> Result<(), CliError> {
        self.progress.into_inner().finish();
        let (mut report, left_out) = (self.report.into_inner(), self.left_out.into_inner());
        if !left_out.is_empty() {
            report.left_out(&left_out);
        }
        report.write(&self.folder)
    }

    /// The settings with which the row of this name is made: those given, with the changes of the deliberate fault.
    pub fn made(&self, row: &str, settings: &Settings) -> Settings {
        let fault = self.fault.as_ref().filter(|(words, _)| row.contains(words.as_str()));
        fault.map_or_else(|| settings.clone(), |(_, changes)| changed(settings, changes))
    }

    /// A renderer with these settings.
    pub fn renderer(&self, settings: &Settings) -> Result<Renderer, RenderError> {
        Renderer::with_engine(&self.engine, settings.clone())
    }

    /// The scene on the device, for these settings.
    pub fn upload(&self, scene: &Scene, settings: &Settings) -> Result<GpuScene, RenderError> {
        self.renderer(&settings.for_scene(scene))?.upload(scene)
    }

    /// A renderer with these settings and the scene.
    pub fn stage(&self, scene: &Scene, settings: &Settings) -> Result<Stage, RenderError> {
        Stage::new(self.renderer(&settings.for_scene(scene))?, scene, &self.left)
    }

    /// As [`Self::stage`], with texts that replace those of the library's shaders.
    pub fn edited_stage(&self, scene: &Scene, settings: &Settings, texts: ShaderTexts) -> Result<Stage, RenderError> {
        let engine = Engine::new(&self.gpu.device, &self.gpu.queue);
        shaders::edit(&engine, texts);
        Stage::new(Renderer::with_engine(&engine, settings.for_scene(scene))?, scene, &self.left)
    }

    /// The first frame of a view: with a new history, or the mean of `settings.image.accumulate` frames.
    pub fn first_frame(&self, view: &View, settings: &Settings) -> Result<RenderedImage, RenderError> {
        self.stage(&view.scene, settings)?.frame(view)
    }

    /// The mean of `frames` frames of a view.
    pub fn mean(&self, view: &View, settings: &Settings, frames: u32) -> Result<RenderedImage, RenderError> {
        self.first_frame(view, &settings.clone().with_accumulate(frames))
    }

    /// Renders a warm-up frame of a view and timed frames.
    pub fn timed(&self, view: &View, settings: &Settings) -> Result<TimedFrames, RenderError> {
        self.timed_on(&mut self.stage(&view.scene, settings)?, view)
    }

    /// As [`Self::timed`], with an uploaded scene.
    pub fn timed_on(&self, stage: &mut Stage, view: &View) -> Result<TimedFrames, RenderError> {
        let first = stage.frame(view)?.report.passes;
        let mut runs = Vec::new();
        let (_, image) = Timed::fastest(self.runs, || {
            let image = stage.frame(view)?;
            runs.push(image.report.passes.clone());
            Ok::<_, RenderError>((frame_ms(&image.report.passes), image))
        })?;
        Ok(TimedFrames { image, first, runs })
    }

    /// Path of an image of the report, from words.
    pub fn path(&self, words: &str) -> PathBuf {
        self.folder.join(format!("{}.png", file_name(words)))
    }

    /// Writes the display colours of an image; `name` becomes the file's name.
    pub fn write(&self, name: &str, image: &RenderedImage) -> Result<(), CliError> {
        self.write_rgb(name, [image.width, image.height], &rgb(image))
    }

    /// Writes RGB bytes as an image; `name` becomes the file's name.
    pub fn write_rgb(&self, name: &str, [width, height]: [u32; 2], rgb: &[u8]) -> Result<(), CliError> {
        Ok(write_png(&self.path(name), [width, height], ColorType::Rgb, rgb)?)
    }

    /// Writes linear radiance as it is displayed with the look of `settings`, and returns the display colours, 0..=1.
    pub fn write_linear(&self, name: &str, linear: &RgbImage, settings: &Settings) -> Result<RgbImage, CliError> {
        let (bytes, displayed) = shown(linear, settings.image.exposure, settings.image.tone_map);
        self.write_rgb(name, [linear.width as u32, linear.height as u32], &bytes)?;
        Ok(displayed)
    }
}

/// Words as a file name: a hyphen in place of spaces and punctuation.
pub fn file_name(words: &str) -> String {
    let words = words.strip_suffix(".png").unwrap_or(words);
    words.replace(", ", "-").replace([' ', ',', '.', ':'], "-")
}

/// Creates a folder and its parents.
pub fn make_folder(folder: &Path) -> Result<(), CliError> {
    fs::create_dir_all(folder).map_err(|error| {
        CliError::new(format_args!("{}: {error}", folder.display()), "choose a folder that can be created")
    })
}

/// True if `name` contains one of the requested words, or if none are requested.
pub fn is_requested(words: &[String], name: &str) -> bool {
    words.is_empty() || words.iter().any(|words| name.contains(words.as_str()))
}

/// Fails with the description of images that differ and must not.
pub fn identical(wrong: Option<String>) -> Result<(), CliError> {
    let hint = "this is a fault of the renderer; please report it with the scene";
    wrong.map_or(Ok(()), |wrong| Err(CliError::new(format_args!("{wrong}, none may"), hint)))
}
