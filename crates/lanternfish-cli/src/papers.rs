//! `lanternfish papers`: a scene as each paper renders it, beside the ground truth.
//!
//! Each image is made by a process of its own, with the commands `reference` and `render`, so that the sheet shows what
//! a user gets.

use std::{
    collections::BTreeMap,
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

use clap::{Arg, ArgMatches, Args};
use lanternfish::settings::{Exposure, ToneMap};
use lanternfish_metrics::{ColorType, PIXELS_PER_DEGREE, Pair, RgbImage, read_exr, write_png};
use lanternfish_scene::Named as _;
use serde::Deserialize;

use crate::{
    args::{Selection, SharedFlags, TrustArgs, demos},
    document::Document,
    error::CliError,
    images::{energy_of, shown},
    output,
    paper::Paper,
    plot::escaped,
    program,
    progress::Progress,
    reference::shared_flags,
    report::grouped,
    scene::SceneName,
    sheet::{GLYPH, Sheet},
    shot::{self, Shot, shown::quoted},
    table::Row,
};

pub const HELP: &str = "\
Examples:
  lanternfish papers demo:atrium --lights rain:40 --sky 0.3,0.4,0.5 --size 320x180 -o papers
  lanternfish papers sponza.toml --spp 64 -o papers

In the ground truth lights have a radius of 5 cm, unless --light-radius says otherwise: all five in
one frame render it, papers with hard shadows do not. It has all light, of every bounce, which no
paper has. Mean light is over the ground truth's.
";

/// Ids of flags of `render` that do not apply to a sheet.
const OTHERS: [&str; 15] = [
    "scene",
    "output",
    "outputs",
    "classes",
    "legend",
    "open",
    "paper",
    "frames",
    "orbit",
    "fps",
    "skip_existing",
    "timings",
    "report",
    "progress",
    "stereo_layout",
];

/// Flags of `papers`.
#[derive(Debug, Args)]
pub struct PapersArgs {
    /// The scene.
    #[arg(help = format!("A scene or a shot, as for `render`: a file, or {}", demos()))]
    pub scene: SceneName,
    /// The folder for the sheet. It is created if missing.
    #[arg(id = "papers_output", short = 'o', long = "output", value_name = "FOLDER", default_value = "papers")]
    pub output: PathBuf,
    /// Samples per pixel of the path tracer. Four times as many: half the noise.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u64).range(1..=1 << 32))]
    pub spp: u64,
    /// Keeps the ground truth that is in the folder, if it is of the same scene and settings, and adds samples that it
    /// lacks.
    #[arg(long)]
    pub resume: bool,
    /// The flags of `render` that apply here.
    #[command(flatten)]
    pub shared: SharedFlags<SheetArgs>,
}

/// The flags of `render` that define an image and its scene. The processes of the images parse their values again.
#[derive(Debug)]
pub struct SheetArgs;

impl Selection for SheetArgs {
    fn flag(flag: &Arg) -> Option<Arg> {
        (!OTHERS.contains(&flag.get_id().as_str())).then(|| flag.clone())
    }
}

/// What is read of the report of `render`.
#[derive(Debug, Default, Deserialize)]
struct Cost {
    adapter: String,
    passes: Vec<Pass>,
    counters: BTreeMap<String, u64>,
}

#[derive(Debug, Deserialize)]
struct Pass {
    name: String,
    ms: Option<f64>,
}

/// One image of the sheet.
#[derive(Debug)]
struct Entry {
    /// The value of `--as`; none: the ground truth.
    paper: Option<Paper>,
    /// Display colours, RGB.
    display: Vec<u8>,
    /// Errors and cost, in words.
    lines: Vec<String>,
    /// The passes, with their times.
    passes: Vec<(String, String)>,
}

impl Entry {
    fn name(&self) -> &'static str {
        self.paper.map_or("path tracer", Paper::name)
    }

    fn file(&self) -> String {
        format!("{}.png", self.name().replace(' ', "-"))
    }
}

/// Renders every image, and writes them with the sheet.
pub fn run(args: &PapersArgs, matches: &ArgMatches, trust: TrustArgs) -> Result<(), CliError> {
    let shot = shot::resolve(&args.scene, matches)?;
    if shot.args.track.frames.is_some() || shot.args.track.orbit.is_some() || shot.args.paper.is_some() {
        let what = format_args!("{}: a sequence, or a shot that names a paper", args.scene).to_string();
        return Err(CliError::new(what, "a sheet is of one image, as every paper has it"));
    }
    let mut progress = Progress::start(shot.args.run.quiet);
    let folder = &args.output;
    fs::create_dir_all(folder)
        .map_err(|error| CliError::new(format_args!("{}: {error}", folder.display()), "name another folder"))?;
    let flags = Flags::of(&shot, matches, trust);
    let reference = folder.join("path-tracer.exr");
    progress.step("reference", "Tracing the ground truth", || {
        let spp = format!("--spp={}", args.spp);
        let words: &[&str] = if args.resume { &["reference", "--resume"] } else { &["reference"] };
        flags.run(args, words, &flags.shared, &[spp.into(), "-o".into(), reference.clone().into()])
    })?;
    let truth = read_exr(&reference).map_err(failed(&reference))?;
    let ImageLook { exposure, tone_map } = ImageLook::of(&shot.args.settings().image, &truth);
    let (display, truth_shown) = shown(&truth, exposure, tone_map);
    let lines = vec![format!("{} samples per pixel", grouped(args.spp))];
    let mut entries = vec![Entry { paper: None, display, lines, passes: Vec::new() }];
    let mut adapter = String::new();
    // All five first.
    let mut papers = Paper::all();
    papers.sort_by_key(|paper| *paper != Paper::Five);
    for paper in papers {
        let [image, report] = ["exr", "json"].map(|ending| folder.join(format!("{paper}.{ending}")));
        let made = progress.step("image", &format!("Rendering as {paper}"), || {
            let more = ["-o".into(), image.clone().into(), "--report".into(), report.clone().into()];
            flags.run(args, &["render", "--as", paper.name()], &flags.all, &more)
        });
        let made = made.and_then(|()| Ok((read_exr(&image).map_err(failed(&image))?, read_report(&report)?)));
        let entry = match made {
            Ok((image, cost)) => {
                adapter.clone_from(&cost.adapter);
                let (display, image_shown) = shown(&image, exposure, tone_map);
                let pair = Pair::new(image_shown, truth_shown.clone()).map_err(failed(folder))?;
                let flip = pair.mean_of(&pair.flip_ldr(PIXELS_PER_DEGREE).map_err(failed(folder))?);
                let energy = energy_of(&image) / energy_of(&truth);
                let lines = vec![format!("FLIP {flip:.3}, mean light {energy:.3}")];
                Entry { paper: Some(paper), display, lines: [lines, cost.lines()].concat(), passes: cost.times() }
            }
            // The other images are of use without this one.
            Err(error) => {
                let (what, display) = (error.to_string(), vec![0; 3 * truth.pixels.len()]);
                let lines = vec!["failed".to_owned(), what.lines().next().unwrap_or_default().to_owned()];
                progress.warn(Some(format!("{paper}: {what}")));
                Entry { paper: Some(paper), display, lines, passes: Vec::new() }
            }
        };
        entries.push(entry);
    }
    if adapter.is_empty() {
        return Err(CliError::new("no image could be rendered", "the warnings say why"));
    }
    let size = [truth.width, truth.height];
    for entry in &entries {
        let path = folder.join(entry.file());
        write_png(&path, size.map(|side| side as u32), ColorType::Rgb, &entry.display).map_err(failed(&path))?;
    }
    let title = format!("{}, {} x {}, {adapter}", args.scene, size[0], size[1]);
    let (sheet, path) = (draw(&entries, size, &title), folder.join("papers.png"));
    let pixels: Vec<u8> = sheet.pixels.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
    write_png(&path, [sheet.width as u32, sheet.height as u32], ColorType::Rgb, &pixels).map_err(failed(&path))?;
    let page = folder.join("papers.html");
    output::write_text(&page, &self::page(&entries, &title, &flags.command(args)).to_html())?;
    progress.finish();
    output::print(&format!("{}\n", page.display()))
}

fn failed<E: std::fmt::Display>(path: &Path) -> impl Fn(E) -> CliError {
    let path = path.display().to_string();
    move |error| CliError::new(format_args!("{path}: {error}"), "")
}

fn read_report(path: &Path) -> Result<Cost, CliError> {
    let text = lanternfish_scene::read_text(path).map_err(failed(path))?;
    serde_json::from_str(&text).map_err(failed(path))
}

/// How radiance is shown: one exposure for all images.
struct ImageLook {
    exposure: Exposure,
    tone_map: ToneMap,
}

impl ImageLook {
    fn of(given: &lanternfish::settings::ImageSettings, truth: &RgbImage) -> Self {
        let ev = given.exposure.of(truth.pixels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]));
        Self { exposure: Exposure::Ev(ev), tone_map: given.tone_map }
    }
}

/// The flags as given, for the processes of the images.
struct Flags {
    /// Of `render`.
    all: Vec<OsString>,
    /// Those of them that `reference` has.
    shared: Vec<OsString>,
    /// What may be read, and how much memory may be taken.
    trusted: Vec<OsString>,
}

impl Flags {
    fn of(shot: &Shot, matches: &ArgMatches, trust: TrustArgs) -> Self {
        let settings = shot.args.settings();
        let value = |name: &str| format!("--{name}={}", settings.get(name).unwrap_or_default());
        // What a shot says of lights and materials stays, whatever a paper has.
        let of_scene = ["light-radius", "sun-diameter", "materials"].into_iter().filter(|name| shot.gives(name));
        let mut all: Vec<OsString> = of_scene.map(|name| value(name).into()).collect();
        all.extend(shot::words(matches));
        let known = shared_flags();
        let name = |word: &str| word.trim_start_matches("--").split('=').next().map(str::to_owned);
        let is_known = |word: &&OsString| name(&word.to_string_lossy()).is_some_and(|name| known.contains(&name));
        // `reference` has another `--seed`: that of its noise.
        let renamed = |word: &OsString| match word.to_string_lossy().strip_prefix("--seed=") {
            Some(seed) => format!("--rain-seed={seed}").into(),
            None => word.clone(),
        };
        let mut shared: Vec<OsString> = all.iter().filter(is_known).map(renamed).collect();
        if !shot.gives("light-radius") {
            let radius = Paper::Five.settings().lights.radius;
            shared.push(format!("--light-radius={radius}").into());
        }
        // The same sun in all images, as wide in the path tracer's as in the others.
        if !shot.gives("environment_sun") {
            shared.push("--environment-sun=light".into());
        }
        let mut trusted: Vec<OsString> = trust.confine.then(|| "--confine".into()).into_iter().collect();
        trusted.extend(trust.memory_limit.map(|bytes| format!("--memory-limit={bytes}").into()));
        Self { all, shared, trusted }
    }

    /// The command that makes the sheet again.
    fn command(&self, args: &PapersArgs) -> String {
        let words = self.all.iter().map(|word| word.to_string_lossy().into_owned());
        let output = args.output.to_string_lossy().into_owned();
        let own = [format!("--spp={}", args.spp), "-o".to_owned(), output, args.scene.spelling().display().to_string()];
        let quoted: Vec<_> = words.chain(own).map(|word| quoted(&word)).collect();
        format!("lanternfish papers {}", quoted.join(" "))
    }

    /// Runs a command of this program on the scene.
    fn run(&self, args: &PapersArgs, first: &[&str], flags: &[OsString], more: &[OsString]) -> Result<(), CliError> {
        let mut command = program::again()?;
        command
            .args(first)
            .args(flags)
            .args(&self.trusted)
            .args(more)
            .args(["--quiet", "--"])
            .arg(args.scene.spelling());
        let output =
            command.output().map_err(|error| CliError::new(format_args!("{}: {error}", first.join(" ")), ""))?;
        if output.status.success() {
            return Ok(());
        }
        let error = String::from_utf8_lossy(&output.stderr);
        Err(CliError::new(error.trim().trim_start_matches("error: "), format!("the command is `{}`", first.join(" "))))
    }
}

/// Counters that are shown: name, words.
const COUNTS: [(&str, &str); 5] = [
    ("shadows/rays", "shadow rays"),
    ("light_culling/listed_lights", "listed lights"),
    ("indirect/rays", "rays of indirect light"),
    ("virtual_lights/listed", "virtual lights"),
    ("photons/splatted", "photons"),
];

impl Cost {
    /// Time and counts.
    fn lines(&self) -> Vec<String> {
        let ms: f64 = self.passes.iter().filter_map(|pass| pass.ms).sum();
        let time = format!("{ms:.0} ms, {} passes", self.passes.len());
        let count = |(name, words): &(&str, &str)| {
            self.counters.get(*name).filter(|count| **count > 0).map(|count| format!("{} {words}", grouped(*count)))
        };
        [time].into_iter().chain(COUNTS.iter().filter_map(count)).collect()
    }

    fn times(&self) -> Vec<(String, String)> {
        let time = |pass: &Pass| pass.ms.map_or_else(String::new, |ms| format!("{ms:.2}"));
        self.passes.iter().map(|pass| (pass.name.clone(), time(pass))).collect()
    }
}

/// The sheet as a page: images, errors, times of every pass, and what each paper sets.
fn page(entries: &[Entry], title: &str, command: &str) -> Document {
    let mut page = Document::titled("Five papers, all at once, and the path tracer", Row::default());
    page.paragraph(title);
    page.html(format!("<pre>{}</pre>", escaped(command)));
    for entry in entries {
        let (file, name, lines) = (entry.file(), entry.name(), escaped(&entry.lines.join("\n")).replace('\n', "<br>"));
        let about = escaped(entry.paper.map_or("the ground truth: every bounce", |paper| paper.help()));
        page.html(format!(
            "<figure><img src=\"{file}\" alt=\"{name}\"><figcaption><b>{name}</b>: {about}<br>{lines}</figcaption></figure>"
        ));
    }
    for (entry, paper) in entries.iter().filter_map(|entry| Some((entry, entry.paper?))) {
        page.heading(paper.name());
        page.show(paper.rows().into_iter().map(|row| {
            Row::default().text("", "setting", row.name).text("", "value", row.value).text("", "why", row.source)
        }));
        page.show(entry.passes.iter().map(|(name, ms)| Row::default().text("", "pass", name).shown("ms", ms)));
    }
    page
}

/// Images in a row of the sheet, pixels between them, and lines of text below each.
const COLUMNS: usize = 4;
const GAP: usize = 8;
const LINES: usize = 7;

fn draw(entries: &[Entry], [width, height]: [usize; 2], title: &str) -> Sheet {
    let line = GLYPH + 4;
    let (cell, tall) = ([width + GAP, height + GAP + LINES * line], entries.len().div_ceil(COLUMNS));
    let mut sheet = Sheet::new(COLUMNS * cell[0] + GAP, tall * cell[1] + GAP + 2 * line, 1);
    sheet.write(GAP, GAP, title);
    for (i, entry) in entries.iter().enumerate() {
        let [left, top] = [GAP + i % COLUMNS * cell[0], GAP + 2 * line + i / COLUMNS * cell[1]];
        let pixels: Vec<[u8; 4]> = entry.display.as_chunks::<3>().0.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        sheet.paste(left, top, width, &pixels);
        let text = [entry.name()].into_iter().chain(entry.lines.iter().map(String::as_str));
        for (row, text) in text.take(LINES).enumerate() {
            sheet.write(left, top + height + 4 + row * line, text.get(..width / GLYPH).unwrap_or(text));
        }
    }
    sheet
}
