//! `lanternfish doctor`: lists the adapters, checks images and measures rays per second.

mod checks;
mod figure;
mod machine;
mod measure;
mod rays;
mod report;
mod scenes;
mod supervise;
#[cfg(test)]
mod tests;

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use clap::{Args, ValueEnum};
use lanternfish::settings::Tracer;
use lanternfish_gpu::{AdapterChoice, AdapterDescription, Engine, Gpu, adapters};

use self::{
    checks::{Plan, plans},
    measure::Bench,
    report::{Adapter, Check, FORMAT, Figure, Report, Technique, Verdict},
};
use crate::{
    error::CliError,
    output::{print, write_text},
    parse::adapter,
    progress::Progress,
    shaders,
};

pub const HELP: &str = "\
Examples:
  lanternfish doctor
  lanternfish doctor --adapter gpu --json doctor.json
  lanternfish doctor --quick
  lanternfish doctor --read doctor.json

Exits with 1 if a check fails, else with 0. The report names hardware, driver and system, and contains no personal data.";

#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// The adapter to check: a part of its name, gpu for a graphics card, cpu for software. Default: the most capable.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = adapter)]
    pub adapter: Option<AdapterChoice>,
    /// Runs one check of each kind, and times no tracers through deep images.
    #[arg(long)]
    pub quick: bool,
    /// Also writes the report as JSON. The file exists from the first check on and survives a crash of the driver.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Runs one part alone. Repeatable.
    #[arg(long, value_name = "PART", value_enum)]
    pub only: Vec<Part>,
    /// Runs only the checks whose group, name or scene contains this text.
    #[arg(long, value_name = "TEXT")]
    pub filter: Option<String>,
    /// Writes the compared images into this folder, as PNG: each image with its reference to the right.
    #[arg(long, value_name = "FOLDER")]
    pub images: Option<PathBuf>,
    /// Checks the shaders in this folder, the library's `src`, instead of the built-in ones.
    #[arg(long, value_name = "FOLDER")]
    pub shaders: Option<PathBuf>,
    /// Prints an existing report of --json, and checks nothing.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["adapter", "quick", "json", "only", "filter", "images", "shaders"])]
    pub read: Option<PathBuf>,
}

/// A part of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Correctness of images
    Checks,
    /// Rays per second
    Speed,
}

pub fn run(args: &DoctorArgs) -> Result<u8, CliError> {
    if let Some(file) = &args.read {
        let report = read(file)?;
        print(&report.to_table())?;
        return Ok(exit_code(&report));
    }
    if let Some(folder) = &args.images {
        fs::create_dir_all(folder).map_err(|error| {
            CliError::new(format_args!("{}: {error}", folder.display()), "name a folder that can be made")
        })?;
    }
    // Said before an adapter is looked for.
    if let Some(text) = &args.filter
        && !plans().iter().any(|plan| plan.matches(text))
    {
        return Err(no_such_check());
    }
    match std::env::var_os(supervise::WORKER) {
        Some(file) => work(args, Path::new(&file)),
        None => supervise::run(args),
    }
}

/// Runs the steps that the report in `file` lacks. An existing report comes from a process that a driver ended.
fn work(args: &DoctorArgs, file: &Path) -> Result<u8, CliError> {
    let texts = args.shaders.as_deref().map(shaders::read).transpose()?;
    let progress = Progress::start(false);
    let before = file.is_file().then(|| read(file)).transpose()?;
    let mut doctor = Doctor::new(args, file, before, &progress)?;
    if let Some(texts) = texts {
        lanternfish::shaders::edit(&doctor.bench.engine, texts);
    }
    doctor.examine(args)
}

fn no_such_check() -> CliError {
    CliError::new("no check has such a group, name or scene", "`lanternfish doctor` lists them")
}

fn exit_code(report: &Report) -> u8 {
    u8::from(report.failures().next().is_some() || !report.complete)
}

fn read(file: &Path) -> Result<Report, CliError> {
    let hint = "name a file that `lanternfish doctor --json` wrote";
    let what = |error: &dyn std::fmt::Display| CliError::new(format_args!("{}: {error}", file.display()), hint);
    let text = lanternfish_scene::read_text(file).map_err(|error| what(&error))?;
    let report: Report = serde_json::from_str(&text).map_err(|error| what(&error))?;
    match report.format {
        FORMAT => Ok(report),
        other => Err(what(&format_args!("its format is {other}, the supported one is {FORMAT}"))),
    }
}

/// A run.
struct Doctor<'a> {
    bench: Bench,
    report: Report,
    file: &'a Path,
    progress: &'a Progress,
    started: Instant,
    seconds_before: f64,
    steps: usize,
}

/// A step. If the process ends during a step, the next process runs the remaining ones.
enum Step {
    /// Lists the techniques of an adapter that is not checked, by its index.
    Adapter(usize),
    Check(Plan),
    Time(Tracer),
}

/// The steps that no process has begun. Marks the last begun step as failed: its process did not finish it.
fn remaining<'s>(report: &mut Report, steps: &'s [Step]) -> &'s [Step] {
    let begun = report.begun.min(steps.len());
    if let Some(last) = begun.checked_sub(1) {
        mark_ended(report, &steps[last]);
    }
    &steps[begun..]
}

impl<'a> Doctor<'a> {
    /// Opens the adapter and describes the machine, unless a previous process has described it.
    fn new(
        args: &'a DoctorArgs,
        file: &'a Path,
        before: Option<Report>,
        progress: &'a Progress,
    ) -> Result<Self, CliError> {
        let started = Instant::now();
        let gpu = Gpu::open(&args.adapter.clone().unwrap_or_default())?;
        let engine = Engine::new(&gpu.device, &gpu.queue);
        let report = before.unwrap_or_else(|| begun(args, &gpu, &engine));
        let seconds_before = report.seconds;
        let bench = Bench::new(gpu, engine, args.images.clone());
        Ok(Self { bench, report, file, progress, started, seconds_before, steps: 0 })
    }

    /// Returns the exit code: [`supervise::LOST`] if another process has to continue.
    fn examine(&mut self, args: &DoctorArgs) -> Result<u8, CliError> {
        let is_filtered = args.filter.is_some();
        let wants = |part| match args.only.is_empty() {
            true => part == Part::Checks || part == Part::Speed && !is_filtered,
            false => args.only.contains(&part),
        };
        let plans = plans().into_iter().filter(|plan| plan.is_quick || !args.quick);
        let plans = plans.filter(|plan| args.filter.as_ref().is_none_or(|text| plan.matches(text)));
        let others = (0..self.report.adapters.len()).filter(|number| *number != self.report.chosen);
        let mut steps: Vec<Step> = others.filter(|_| !is_filtered).map(Step::Adapter).collect();
        let adapter_steps = steps.len();
        steps.extend(plans.map(Step::Check).filter(|_| wants(Part::Checks)));
        steps.extend(rays::tracers(args.quick).into_iter().map(Step::Time).filter(|_| wants(Part::Speed)));
        self.steps = steps.len();
        if steps.len() == adapter_steps {
            return Err(no_such_check());
        }
        for step in remaining(&mut self.report, &steps) {
            match step {
                Step::Adapter(number) => self.adapter(*number)?,
                Step::Check(plan) => self.check(plan)?,
                Step::Time(tracer) => self.time(*tracer)?,
            }
            // A killed run keeps the rows so far.
            self.write()?;
            if self.bench.is_lost() {
                return Ok(supervise::LOST);
            }
        }
        (self.report.complete, self.report.doing) = (true, None);
        self.write()?;
        Ok(0)
    }

    fn adapter(&mut self, number: usize) -> Result<(), CliError> {
        self.tell(format!("techniques of {}", self.report.adapters[number].name))?;
        if let Some(description) = adapters().get(number) {
            self.report.adapters[number] = other(description);
        }
        Ok(())
    }

    fn check(&mut self, plan: &Plan) -> Result<(), CliError> {
        let mut check = plan.check();
        self.tell(format!("{}: {}, {}", plan.group.name(), plan.name, check.scene))?;
        let started = Instant::now();
        match self.bench.run(plan) {
            Ok(Ok(figures)) => {
                let passes = figures.iter().all(Figure::passes);
                check.verdict = if passes { Verdict::Passed } else { Verdict::Failed };
                check.figures = figures;
            }
            Ok(Err(reason)) => (check.verdict, check.reason) = (Verdict::LeftOut, Some(reason)),
            Err(error) => check.reason = Some(error.what()),
        }
        check.seconds = started.elapsed().as_secs_f64();
        // If the device is lost, the next process reports this check.
        if !self.bench.is_lost() {
            self.report.checks.push(check);
        }
        Ok(())
    }

    fn time(&mut self, tracer: Tracer) -> Result<(), CliError> {
        self.tell(timing(tracer))?;
        match self.bench.engine.within(|| rays::trace(&self.bench, tracer)) {
            Ok(rates) => self.report.rates.extend(rates),
            Err(error) if !self.bench.is_lost() => self.report.not_timed.push((timing(tracer), error.what())),
            Err(_) => {}
        }
        Ok(())
    }

    /// Announces the next step on the terminal and in the file, which then names it if the process ends.
    fn tell(&mut self, doing: String) -> Result<(), CliError> {
        self.progress.bar().show(self.report.begun as f64 / self.steps.max(1) as f64, doing.clone());
        self.report.begun += 1;
        self.report.doing = Some(doing);
        self.write()
    }

    fn write(&mut self) -> Result<(), CliError> {
        self.report.seconds = self.seconds_before + self.started.elapsed().as_secs_f64();
        write_text(self.file, &self.report.to_json())
    }
}

/// Adds the row of a step that ended the process.
fn mark_ended(report: &mut Report, step: &Step) {
    let reason = "the device was lost, or the process ended: a fault of the driver, or of this program".to_owned();
    match step {
        Step::Adapter(number) => {
            let technique = Technique { name: "anything".to_owned(), reason: Some(reason) };
            report.adapters[*number].techniques = vec![technique];
        }
        Step::Check(plan) => report.checks.push(Check { reason: Some(reason), ..plan.check() }),
        Step::Time(tracer) => report.not_timed.push((timing(*tracer), reason)),
    }
}

fn timing(tracer: Tracer) -> String {
    format!("rays through {tracer}")
}

/// A report with the machine's description, without the techniques of adapters that are not checked.
fn begun(args: &DoctorArgs, gpu: &Gpu, engine: &Engine) -> Report {
    let available = adapters();
    let chosen = available.iter().position(|adapter| adapter.is(&gpu.description)).unwrap_or_default();
    let adapters = available.iter().enumerate().map(|(i, description)| match i == chosen {
        true => described(gpu, engine),
        false => machine::describe(description, None),
    });
    Report {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: command(args),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        adapters: adapters.collect(),
        chosen,
        ..Report::default()
    }
}

/// Describes an open adapter and its techniques.
fn described(gpu: &Gpu, engine: &Engine) -> Adapter {
    let adapter = machine::describe(&gpu.description, Some(&gpu.device.adapter_info()));
    let subpixel_bits = Some(engine.subpixel_bits());
    Adapter { subpixel_bits, techniques: machine::techniques(engine), ..adapter }
}

/// Describes an adapter that is not checked. It is open only while its techniques are listed.
fn other(description: &AdapterDescription) -> Adapter {
    match Gpu::open_listed(description) {
        Ok(gpu) => described(&gpu, &Engine::new(&gpu.device, &gpu.queue)),
        Err(error) => {
            let technique = Technique { name: "anything".to_owned(), reason: Some(error.to_string()) };
            Adapter { techniques: vec![technique], ..machine::describe(description, None) }
        }
    }
}

/// The command line, with the flags that affect the measurement.
fn command(args: &DoctorArgs) -> String {
    let mut words = vec!["lanternfish doctor".to_owned()];
    match &args.adapter {
        Some(AdapterChoice::Cpu) => words.push("--adapter cpu".to_owned()),
        Some(AdapterChoice::Hardware) => words.push("--adapter gpu".to_owned()),
        Some(AdapterChoice::Name(name)) => words.push(format!("--adapter {name:?}")),
        Some(AdapterChoice::Auto) | None => {}
    }
    words.extend(args.quick.then(|| "--quick".to_owned()));
    words.extend(args.only.iter().filter_map(|part| Some(format!("--only {}", part.to_possible_value()?.get_name()))));
    words.extend(args.filter.as_ref().map(|text| format!("--filter {text:?}")));
    words.extend(args.shaders.as_ref().map(|_| "--shaders FOLDER".to_owned()));
    words.join(" ")
}
