//! `lanternfish-bench papers`: every table and every figure with numbers of the five papers on one page, beside ours,
//! with a verdict on each claim.
//!
//! Other benches measure ([`mod@parts`]), each in a process of its own; this one reads their reports.

mod claims;
mod faults;
mod measure;
mod page;
mod parts;
mod rows;
mod runner;
mod tables;
#[cfg(test)]
mod tests;

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use clap::Args;
use lanternfish_cli::{error::CliError, output::print, parse::adapter};
use lanternfish_gpu::{AdapterChoice, Gpu};

pub use self::parts::Paper;
use self::{
    claims::Claim,
    page::{Machine, RanPart},
    parts::{Form, PAPERS, Part, parts},
    rows::Reports,
    runner::Ran,
    tables::{About, TABLES},
};
use crate::{bench::make_folder, document::Document};

/// Flags of `papers`.
#[derive(Debug, Args)]
pub struct PapersArgs {
    /// Only this paper. Repeatable.
    #[arg(long = "paper", value_name = "NAME", value_enum)]
    papers: Vec<Paper>,
    /// Only this part. Repeatable.
    #[arg(long = "part", value_name = "NAME", value_parser = part_name)]
    parts: Vec<String>,
    /// Small images: minutes on a processor. Without it: the papers' sizes, for a graphics card.
    #[arg(long)]
    quick: bool,
    /// Nine minutes on a graphics card: the rows that claims need, each part with seconds of its own.
    #[arg(long, conflicts_with = "quick")]
    card: bool,
    /// Ends after this time, seconds: parts and rows that would begin later are left out, and the page says so.
    #[arg(long, value_name = "SECONDS")]
    seconds: Option<f64>,
    /// Version of the sources. Default: what git says of them.
    #[arg(long, value_name = "TEXT", hide_short_help = true)]
    commit: Option<String>,
    /// Measures only what is not complete in the folder, or was measured with other arguments, by other sources or on
    /// another adapter.
    #[arg(long)]
    resume: bool,
    /// Measures nothing, and makes the page again from the stored run FOLDER.json with the parts FOLDER/PART.json.
    #[arg(long, value_name = "FOLDER", conflicts_with = "seconds")]
    from: Option<PathBuf>,
    /// Repeats a deliberate fault: its part is run wrongly, and the claims that it must turn are judged beside the stored
    /// run (`--from`; default: measured/papers-quick in the folder of --docs). Fails if one is still confirmed.
    #[arg(long, value_name = "NAME", value_parser = fault_name)]
    fault: Option<String>,
    /// The folder for the page and for the parts' reports. It is made if it is not there.
    #[arg(short, long, alias = "out", value_name = "FOLDER", default_value = "bench-papers")]
    output: PathBuf,
    /// The folder that has shots/ and tracks/. Where a shot or its scene is not there, a built-in scene stands for it.
    #[arg(long, value_name = "FOLDER", default_value = "docs")]
    docs: PathBuf,
    /// Where to run: a part of an adapter's name, gpu for a graphics card, cpu for software.
    #[arg(long, value_name = "NAME|gpu|cpu", value_parser = named_adapter)]
    adapter: Option<String>,
}

fn named_adapter(text: &str) -> Result<String, String> {
    adapter(text).map(|_| text.to_owned())
}

fn part_name(text: &str) -> Result<String, String> {
    let names: Vec<String> = parts().into_iter().map(|part| part.name).collect();
    let is_known = names.iter().any(|name| name == text);
    if is_known { Ok(text.to_owned()) } else { Err(format!("the parts are {}", names.join(", "))) }
}

fn fault_name(text: &str) -> Result<String, String> {
    let mut names: Vec<&str> = faults::all().map(|(_, fault)| fault.name).collect();
    names.sort_unstable();
    names.dedup();
    if names.contains(&text) { Ok(text.to_owned()) } else { Err(format!("the faults are {}", names.join(", "))) }
}

impl Paper {
    /// What stands above its claims.
    fn about(self) -> About {
        match self {
            Self::Elagabani => claims::elagabani::ABOUT,
            Self::VanGelderen => claims::van_gelderen::ABOUT,
            Self::Niessner => claims::niessner::ABOUT,
            Self::Aalund => claims::aalund::ABOUT,
            Self::Archer => claims::archer::ABOUT,
        }
    }

    fn claims(self) -> Vec<Claim> {
        match self {
            Self::Elagabani => claims::elagabani::claims(),
            Self::VanGelderen => claims::van_gelderen::claims(),
            Self::Niessner => claims::niessner::claims(),
            Self::Aalund => claims::aalund::claims(),
            Self::Archer => claims::archer::claims(),
        }
    }
}

/// Measures, and writes the page.
pub fn run(args: &PapersArgs) -> Result<(), CliError> {
    make_folder(&args.output)?;
    if let Some(name) = &args.fault {
        return faults::repeat(args, name);
    }
    let is_requested = |paper: &Paper| args.papers.is_empty() || args.papers.contains(paper);
    let papers: Vec<Paper> = PAPERS.into_iter().filter(is_requested).collect();
    if let Some(folder) = &args.from {
        let (reports, machine, ran) = runner::stored(folder)?;
        write(args, &papers, &machine, &reports, &ran)?;
        return print(&page::summary(&papers, &reports));
    }
    let choice = match &args.adapter {
        Some(name) => adapter(name).map_err(|error| CliError::new(error, "see the help of --adapter"))?,
        None => AdapterChoice::default(),
    };
    let machine = Machine::of(&Gpu::open(&choice)?.description);
    let mut parts = parts();
    parts.retain(|part| part.papers.iter().any(is_requested));
    parts.retain(|part| args.parts.is_empty() || args.parts.contains(&part.name));
    let of = Run { args, adapter: &machine.adapter, started: Instant::now(), commit: args.commit() };
    let mut reports = Reports::of(machine.is_software);
    let mut ran = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        let done = of.measure(part, &format!("{}/{}", i + 1, parts.len()))?;
        ran.push(RanPart::of(part, &done));
        reports.add(&part.name, done.1.outcome);
        // After every part: whoever ends the program has a page of what there is.
        write(args, &papers, &machine, &reports, &ran)?;
    }
    let page = args.output.join("papers.html");
    print(&format!("{}\n{}\n", page::summary(&papers, &reports), page.display()))
}

/// Adds the tables of a paper to the report of a part, beside its figures.
pub fn beside(paper: Paper, part: &str, report: &mut Document) {
    let mut reports = Reports::default();
    reports.add(part, serde_json::to_value(&*report).map_err(|error| error.to_string()));
    for table in TABLES.iter().filter(|table| table.paper == paper && table.of[0] == part) {
        report.section(table.heading, table.text, table.key, table.rows(&reports));
    }
}

impl PapersArgs {
    fn form(&self) -> Form {
        match (self.quick, self.card) {
            (true, _) => Form::Quick,
            (_, true) => Form::Card,
            _ => Form::Full,
        }
    }

    /// The stored run beside which faults are judged.
    fn stored(&self) -> PathBuf {
        self.from.clone().unwrap_or_else(|| self.docs.join(Path::new("measured").join("papers-quick")))
    }

    fn commit(&self) -> String {
        self.commit.clone().unwrap_or_else(runner::commit)
    }
}

/// What all parts of a run share.
struct Run<'r> {
    args: &'r PapersArgs,
    /// The adapter's name.
    adapter: &'r str,
    started: Instant,
    commit: String,
}

/// A part has as much more time to write its report, seconds.
const TO_WRITE: f64 = 10.0;

impl Run<'_> {
    /// Seconds that a part may take: its own, and those that are left. None: any.
    fn seconds_of(&self, part: &Part) -> Option<f64> {
        let left = self.args.seconds.map(|seconds| seconds - self.started.elapsed().as_secs_f64());
        let own = part.card_seconds.filter(|_| self.args.card);
        [left, own].into_iter().flatten().reduce(f64::min)
    }

    /// Runs a part, or finds what it left. With its arguments, where it has some in this form.
    fn measure(&self, part: &Part, number: &str) -> Result<(Option<Vec<String>>, Ran), CliError> {
        let (args, name) = (self.args, &part.name);
        let folder = args.output.join("parts").join(name);
        let Some(arguments) = part.arguments(args.form(), &args.docs, &folder, args.adapter.as_deref()) else {
            return Ok((None, Ran::left_out("it is left out of this run")));
        };
        let command = format!("lanternfish-bench {}", arguments.join(" "));
        let with = runner::made_with(&arguments, self.adapter, &self.commit);
        if let Some(ran) = runner::kept(part, &folder, &with).filter(|_| args.resume) {
            eprintln!("{number} {name}: kept, {command}");
            return Ok((Some(arguments), ran));
        }
        let seconds = self.seconds_of(part);
        if seconds.is_some_and(|seconds| seconds <= 0.0) {
            eprintln!("{number} {name}: left out, no time left");
            return Ok((Some(arguments), Ran::left_out("no time was left")));
        }
        eprintln!("{number} {name}: {command}");
        let deadline =
            seconds.filter(|_| part.measures()).map(|seconds| ["--seconds".to_owned(), format!("{seconds:.0}")]);
        let words: Vec<String> = arguments.iter().cloned().chain(deadline.into_iter().flatten()).collect();
        let most = seconds.map(|seconds| Duration::from_secs_f64(seconds + TO_WRITE));
        let ran = runner::run(part, &words, &folder, &with, most)?;
        let seconds = ran.seconds.unwrap_or_default();
        match &ran.outcome {
            Ok(_) => eprintln!("{number} {name}: {seconds:.0} s"),
            Err(reason) => eprintln!("{number} {name}: {seconds:.0} s, failed: {reason}"),
        }
        Ok((Some(arguments), ran))
    }
}

fn write(
    args: &PapersArgs,
    papers: &[Paper],
    machine: &Machine,
    reports: &Reports,
    ran: &[RanPart],
) -> Result<(), CliError> {
    page::page(papers, machine, args.form(), reports, ran).store(&args.output, "papers")
}
