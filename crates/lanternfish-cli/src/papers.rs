//! `lanternfish papers`: a scene as each paper renders it, beside the ground truths.
//!
//! Each image is made by a process of its own, with the commands `reference` and `render`, so that the sheet shows what
//! a user gets: all five for two eyes first, then in one view, then each, and all five without each.

use std::{
    collections::BTreeMap,
    ffi::OsString,
    fs,
    path::{Path, PathBuf},
};

use clap::{Arg, ArgMatches, Args};
use lanternfish::settings::{Exposure, ToneMap};
use lanternfish_metrics::{ColorType, MetricsError, PIXELS_PER_DEGREE, Pair, RgbImage, read_exr, write_png};
use lanternfish_scene::{Eyes, Named as _};
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

An image is 480 x 270, unless --size says otherwise. In the ground truth lights have a radius of 5 cm,
unless --light-radius says otherwise, and it has all light, of every bounce. A paper is also compared
with its own light: direct, or with one bounce, of lights without a radius. Percent: mean light over
the ground truth's.
";

/// Ids of flags of `render` that do not apply to a sheet.
const OTHERS: [&str; 16] = [
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
    "stereo",
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
    without_effect: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct Pass {
    name: String,
    ms: Option<f64>,
}

/// The ground truths: their names, and flags of `reference`. The light of a paper has no radius.
const TRUTHS: [(&str, &str); 3] = [("path tracer", ""), ("direct", "--max-depth=2"), ("one bounce", "--max-depth=3")];

/// The index of the ground truth of what a paper computes; none: of all light.
fn truth_of(paper: Paper) -> Option<usize> {
    match paper {
        Paper::Elagabani | Paper::VanGelderen => Some(1),
        Paper::Niessner | Paper::Aalund | Paper::Archer => Some(2),
        Paper::Five => None,
    }
}

/// One image of the sheet.
#[derive(Debug, Default)]
struct Entry {
    name: String,
    about: String,
    /// Width, pixels.
    width: usize,
    /// Display colours, RGB.
    display: Vec<u8>,
    /// Errors and cost, in words.
    lines: Vec<String>,
    cost: Cost,
}

impl Entry {
    fn file(&self) -> String {
        format!("{}.png", self.name.replace(' ', "-"))
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
    let mut truths = Vec::new();
    for (name, depth) in TRUTHS {
        let path = folder.join(format!("{}.exr", name.replace(' ', "-")));
        progress.step("reference", &format!("Tracing the ground truth: {name}"), || {
            let words: &[&str] = if args.resume { &["reference", "--resume"] } else { &["reference"] };
            let own = (!depth.is_empty()).then(|| [depth.into(), flags.hard.clone()]).into_iter().flatten();
            let more: Vec<OsString> = own.chain([format!("--spp={}", args.spp).into(), "-o".into()]).collect();
            flags.run(args, words, &flags.shared, &[more, vec![path.clone().into()]].concat())
        })?;
        truths.push(read_exr(&path).map_err(failed(&path))?);
    }
    let look = ImageLook::of(&shot.args.settings().image, &truths[0]);
    let (display, width) = (shown(&truths[0], look.exposure, look.tone_map).0, truths[0].width);
    let lines = vec![format!("{} samples per pixel", grouped(args.spp))];
    let about = "the ground truth: every bounce".to_owned();
    let truth = Entry { name: TRUTHS[0].0.to_owned(), about, width, display, lines, ..Entry::default() };
    // All five first, for two eyes.
    let across = (truths[0].height as f32 * Eyes::Vive.aspect().expect("it has one")).round() as usize;
    let eye = format!("--size={}x{}", across.min(width / 2).max(1), truths[0].height);
    let two_eyes = ["--stereo=vive".to_owned(), eye];
    let without = |paper: Paper| {
        let changes = paper.without().iter().map(|(name, value)| format!("--{name}={value}"));
        // One grid differs from several for two eyes alone.
        let eyes = two_eyes.iter().filter(|_| paper == Paper::VanGelderen).cloned();
        (format!("five without {paper}"), Paper::Five, changes.chain(eyes).collect::<Vec<_>>())
    };
    let mut requested = vec![("five for two eyes".to_owned(), Paper::Five, two_eyes.to_vec())];
    let mut papers = Paper::all();
    papers.sort_by_key(|paper| *paper != Paper::Five);
    requested.extend(papers.iter().map(|paper| (paper.to_string(), *paper, Vec::new())));
    requested.extend(papers.iter().filter(|paper| **paper != Paper::Five).map(|paper| without(*paper)));
    let mut entries = Vec::new();
    for (name, paper, changes) in requested {
        let [image, report] = ["exr", "json"].map(|ending| folder.join(format!("{}.{ending}", name.replace(' ', "-"))));
        let made = progress.step("image", &format!("Rendering {name}"), || {
            let files = ["-o".into(), image.clone().into(), "--report".into(), report.clone().into()];
            let more: Vec<OsString> = changes.iter().map(OsString::from).chain(files).collect();
            flags.run(args, &["render", "--as", paper.name()], &flags.all, &more)
        });
        let made = made.and_then(|()| Ok((read_exr(&image).map_err(failed(&image))?, read_report(&report)?)));
        let about = if changes.is_empty() { paper.help().to_owned() } else { changes.join(" ") };
        let entry = Entry { name: name.clone(), about, ..Entry::default() };
        entries.push(match made {
            Ok((image, cost)) => {
                let display = shown(&image, look.exposure, look.tone_map).0;
                let is_alone = changes.is_empty();
                let mut lines = Vec::new();
                // The ground truths are of one view.
                if !changes.contains(&two_eyes[0]) {
                    lines.push(format!("all light: {}", look.compared(&image, &truths[0])?));
                    let own = truth_of(paper).filter(|_| is_alone);
                    let own = own.map(|own| Ok::<_, CliError>((own, look.compared(&image, &truths[own])?)));
                    lines.extend(own.transpose()?.map(|(own, text)| format!("{}: {text}", TRUTHS[own].0)));
                }
                lines.extend(cost.lines());
                Entry { width: image.width, display, lines, cost, ..entry }
            }
            // The other images are of use without this one.
            Err(error) => {
                let (what, display) = (error.to_string(), vec![0; 3 * truths[0].pixels.len()]);
                let lines = vec!["failed".to_owned(), what.lines().next().unwrap_or_default().to_owned()];
                progress.warn(Some(format!("{name}: {what}")));
                Entry { width, display, lines, ..entry }
            }
        });
    }
    let Some(adapter) = entries.iter().map(|entry| entry.cost.adapter.clone()).find(|name| !name.is_empty()) else {
        return Err(CliError::new("no image could be rendered", "the warnings say why"));
    };
    entries.insert(1, truth);
    for entry in &entries {
        let path = folder.join(entry.file());
        let size = [entry.width, entry.display.len() / 3 / entry.width].map(|side| side as u32);
        write_png(&path, size, ColorType::Rgb, &entry.display).map_err(failed(&path))?;
    }
    let title = format!("{}, {} x {}, {adapter}", args.scene, width, truths[0].height);
    let (sheet, path) = (draw(&entries, [width, truths[0].height], &title), folder.join("papers.png"));
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

    /// The error of an image, and its light over that of the ground truth, in words.
    fn compared(&self, image: &RgbImage, truth: &RgbImage) -> Result<String, CliError> {
        let [image_shown, truth_shown] = [image, truth].map(|image| shown(image, self.exposure, self.tone_map).1);
        let wrong = |error: MetricsError| CliError::new(error.to_string(), "");
        let pair = Pair::new(image_shown, truth_shown).map_err(wrong)?;
        let flip = pair.mean_of(&pair.flip_ldr(PIXELS_PER_DEGREE).map_err(wrong)?);
        Ok(format!("FLIP {flip:.3}, {:.0} %", 100.0 * energy_of(image) / energy_of(truth)))
    }
}

/// The flags as given, for the processes of the images.
struct Flags {
    /// Of `render`.
    all: Vec<OsString>,
    /// Those of them that `reference` has.
    shared: Vec<OsString>,
    /// The radius of lights in the ground truth of a paper alone.
    hard: OsString,
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
        if !shot.gives("size") {
            all.push("--size=480x270".into());
        }
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
        let mut hard: OsString = value("light-radius").into();
        if !shot.gives("light-radius") {
            let radius = Paper::Five.settings().lights.radius;
            shared.push(format!("--light-radius={radius}").into());
            hard = "--light-radius=0".into();
        }
        // The same sun in all images, as wide in the path tracer's as in the others.
        if !shot.gives("environment_sun") {
            shared.push("--environment-sun=light".into());
        }
        let mut trusted: Vec<OsString> = trust.confine.then(|| "--confine".into()).into_iter().collect();
        trusted.extend(trust.memory_limit.map(|bytes| format!("--memory-limit={bytes}").into()));
        Self { all, shared, hard, trusted }
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
const COUNTS: [(&str, &str); 6] = [
    ("shadows/rays", "shadow rays"),
    ("light_culling/visible_clusters", "clusters"),
    ("light_culling/listed_lights", "listed lights"),
    ("indirect/rays", "rays of other light"),
    ("virtual_lights/listed", "virtual lights"),
    ("photons/splatted", "photons"),
];

impl Cost {
    /// Time, counts, and what had no effect.
    fn lines(&self) -> Vec<String> {
        let ms: f64 = self.passes.iter().filter_map(|pass| pass.ms).sum();
        let time = format!("{ms:.0} ms, {} passes", self.passes.len());
        let count = |(name, words): &(&str, &str)| {
            self.counters.get(*name).filter(|count| **count > 0).map(|count| format!("{} {words}", grouped(*count)))
        };
        let counts = COUNTS.iter().filter_map(count);
        [time].into_iter().chain(counts).chain(self.without_effect.iter().cloned()).collect()
    }

    /// Milliseconds of each stage: of passes with the same first part of their labels, in the order of the frame.
    fn stages(&self) -> Vec<(&str, f64)> {
        let mut stages: Vec<(&str, f64)> = Vec::new();
        for pass in &self.passes {
            let (stage, ms) = (pass.name.split('/').next().unwrap_or_default(), pass.ms.unwrap_or_default());
            match stages.iter_mut().find(|(name, _)| *name == stage) {
                Some((_, sum)) => *sum += ms,
                None => stages.push((stage, ms)),
            }
        }
        stages
    }
}

/// The sheet as a page: images, errors, times of every stage, and what each paper sets.
fn page(entries: &[Entry], title: &str, command: &str) -> Document {
    let mut page = Document::titled("Five papers, all at once, and the path tracer", Row::default());
    page.paragraph(title);
    page.html(format!("<pre>{}</pre>", escaped(command)));
    for entry in entries {
        let Entry { name, about, lines, .. } = entry;
        let (file, lines) = (entry.file(), escaped(&lines.join("\n")).replace('\n', "<br>"));
        page.html(format!(
            "<figure><img src=\"{file}\" alt=\"{name}\"><figcaption><b>{name}</b>: {}<br>{lines}</figcaption></figure>",
            escaped(about)
        ));
    }
    page.heading("Milliseconds by stage");
    let stages: Vec<_> = entries[0].cost.stages().into_iter().map(|(stage, _)| stage).collect();
    page.show(entries.iter().filter(|entry| !entry.cost.passes.is_empty()).map(|entry| {
        let times = entry.cost.stages();
        let ms = |stage: &&str| times.iter().find(|(name, _)| name == stage).map(|(_, ms)| *ms);
        let row = Row::default().text("", "image", &entry.name);
        stages.iter().fold(row, |row, stage| row.maybe(stage.to_string(), stage, 0, ms(stage)))
    }));
    for paper in Paper::all() {
        page.heading(paper.name());
        page.show(paper.rows().into_iter().map(|row| {
            Row::default().text("", "setting", row.name).text("", "value", row.value).text("", "why", row.source)
        }));
    }
    page
}

/// Images in a row of the sheet, pixels between them, and lines of text below each. A letter is twice its glyph.
const COLUMNS: usize = 4;
const GAP: usize = 8;
const LINES: usize = 12;
const LETTERS: usize = 2;

fn draw(entries: &[Entry], [width, height]: [usize; 2], title: &str) -> Sheet {
    let line = LETTERS * GLYPH + 4;
    let cell = [width + GAP, height + GAP + LINES * line];
    // Two eyes take the cells that they need.
    let mut next = 0;
    let mut places = Vec::new();
    for entry in entries {
        let cells = (entry.width + GAP).div_ceil(cell[0]);
        if next % COLUMNS + cells > COLUMNS {
            next = next.next_multiple_of(COLUMNS);
        }
        places.push(next);
        next += cells;
    }
    let tall = next.div_ceil(COLUMNS);
    let mut sheet = Sheet::new(COLUMNS * cell[0] + GAP, tall * cell[1] + GAP + 2 * line, LETTERS);
    sheet.write(GAP, GAP, title);
    for (place, entry) in places.into_iter().zip(entries) {
        let [left, top] = [GAP + place % COLUMNS * cell[0], GAP + 2 * line + place / COLUMNS * cell[1]];
        let pixels: Vec<[u8; 4]> = entry.display.as_chunks::<3>().0.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        sheet.paste(left, top, entry.width, &pixels);
        let text = [&entry.name].into_iter().chain(&entry.lines);
        let letters = entry.width.max(width) / (LETTERS * GLYPH);
        for (row, text) in text.flat_map(|text| wrapped(text, letters)).take(LINES).enumerate() {
            sheet.write(left, top + height + 4 + row * line, &text);
        }
    }
    sheet
}

/// A text in lines of at most this many letters, unless a word is longer.
fn wrapped(text: &str, letters: usize) -> Vec<String> {
    text.split(' ').fold(Vec::new(), |mut lines: Vec<String>, word| {
        match lines.last_mut() {
            Some(last) if last.len() + 1 + word.len() <= letters => *last += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
        lines
    })
}

#[test]
fn labels_are_wrapped_between_words() {
    assert_eq!(wrapped("all light: FLIP 0.283, 98 %", 20), ["all light: FLIP", "0.283, 98 %"]);
    assert_eq!(wrapped("five without van-gelderen", 25).len(), 1);
}
