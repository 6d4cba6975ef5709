//! `lanternfish-bench papers`: every table and every figure with numbers of the five papers on one page, beside ours, with a verdict on
//! each claim.
//!
//! Other benches measure ([`mod@parts`]), each in a process of its own; this one reads their reports.

mod claims;
mod declared;
mod measure;
mod page;
mod parts;
mod query;
mod runner;
mod special;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use lanternfish_cli::{
    args::adapter,
    error::CliError,
    output::{print, write_text},
};
use lanternfish_gpu::{AdapterChoice, Gpu};
use serde::Deserialize;

use self::{
    page::{Machine, RanPart},
    parts::{Part, parts},
    query::Reports,
    runner::Ran,
};
use crate::{bench::make_folder, document::Document};

/// Flags of `papers`.
#[derive(Debug, Args)]
pub struct PapersArgs {
    /// Only this paper. Repeatable.
    #[arg(long = "paper", value_name = "NAME", value_enum)]
    papers: Vec<Paper>,
    /// Small images: minutes on a processor. Without it: the papers' sizes, for a graphics card.
    #[arg(long)]
    quick: bool,
    /// Measures only what is not complete in the folder, or was measured with other arguments or on another adapter.
    #[arg(long)]
    resume: bool,
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

/// A paper, as `parts.toml` names it too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Paper {
    /// Elagabani 2025, hybrid Forward+
    Elagabani,
    /// Van Gelderen 2020, clustered shading for two eyes
    VanGelderen,
    /// Niessner 2010, indirect light through layered depth images
    Niessner,
    /// Aalund 2015, occlusion and photons through layered depth maps
    Aalund,
    /// Archer 2019, virtual lights with ranges through deep images
    Archer,
}

/// All papers, in the order of the page.
pub const PAPERS: [Paper; 5] = [Paper::Elagabani, Paper::VanGelderen, Paper::Niessner, Paper::Aalund, Paper::Archer];

/// Measures, and writes the page.
pub fn run(args: &PapersArgs) -> Result<(), CliError> {
    make_folder(&args.output)?;
    let choice = match &args.adapter {
        Some(name) => adapter(name).map_err(|error| CliError::new(error, "see the help of --adapter"))?,
        None => AdapterChoice::default(),
    };
    let machine = Machine::of(&Gpu::open(&choice)?.description);
    let is_requested = |paper: &Paper| args.papers.is_empty() || args.papers.contains(paper);
    let papers: Vec<Paper> = PAPERS.into_iter().filter(is_requested).collect();
    let mut parts = parts();
    parts.retain(|part| part.papers.iter().any(is_requested));
    let mut reports = Reports::of(machine.is_software);
    let mut ran = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        let done = measure(args, part, &machine.adapter, &format!("{}/{}", i + 1, parts.len()))?;
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
    let declared = paper.declared();
    for table in declared.tables.iter().filter(|table| table.of == part) {
        report.section(&table.heading, &table.text, table.key.clone(), declared.rows(table, &reports));
    }
}

/// Runs a part, or finds what it left. With its arguments, where it has some in this form.
fn measure(
    args: &PapersArgs,
    part: &Part,
    adapter: &str,
    number: &str,
) -> Result<(Option<Vec<String>>, Ran), CliError> {
    let folder = args.output.join("parts").join(&part.name);
    let Some(arguments) = part.arguments(args.quick, &args.docs, &folder, args.adapter.as_deref()) else {
        let outcome = Err("it is left out of the quick run".to_owned());
        return Ok((None, Ran { outcome, seconds: None }));
    };
    let with = runner::made_with(&arguments, adapter);
    let command = format!("lanternfish-bench {}", arguments.join(" "));
    let ran = match runner::kept(part, &folder, &with).filter(|_| args.resume) {
        Some(report) => {
            eprintln!("{number} {}: kept, {command}", part.name);
            Ran { outcome: Ok(report), seconds: None }
        }
        None => {
            eprintln!("{number} {}: {command}", part.name);
            let ran = runner::run(part, &arguments, &folder, &with)?;
            let seconds = ran.seconds.unwrap_or_default();
            match &ran.outcome {
                Ok(_) => eprintln!("{number} {}: {seconds:.0} s", part.name),
                Err(reason) => eprintln!("{number} {}: {seconds:.0} s, failed: {reason}", part.name),
            }
            ran
        }
    };
    Ok((Some(arguments), ran))
}

fn write(
    args: &PapersArgs,
    papers: &[Paper],
    machine: &Machine,
    reports: &Reports,
    ran: &[RanPart],
) -> Result<(), CliError> {
    let document = page::page(papers, machine, args.quick, reports, ran);
    let file = |name: &str| -> PathBuf { Path::new(&args.output).join(name) };
    write_text(&file("papers.json"), &document.to_json())?;
    write_text(&file("papers.md"), &document.to_markdown())?;
    write_text(&file("papers.html"), &document.to_html(page::STYLE))
}
