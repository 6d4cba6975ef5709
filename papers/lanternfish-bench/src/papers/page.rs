//! The page: for each paper its claims with verdicts, its tables and its plots.

use lanternfish_gpu::AdapterDescription;
use serde::Deserialize;

use super::{
    Paper,
    claims::{NOT_MEASURED, Verdict},
    parts::{Form, Part},
    rows::{OF_CARDS, Reports},
    runner::Ran,
    tables::TABLES,
};
use crate::{
    clustered::figures::{Figures, page::plotted},
    document::Document,
    table::{Row, to_markdown},
};

impl Paper {
    /// For scripts.
    fn key(self) -> &'static str {
        match self {
            Self::Elagabani => "elagabani",
            Self::VanGelderen => "van_gelderen",
            Self::Niessner => "niessner",
            Self::Aalund => "aalund",
            Self::Archer => "archer",
        }
    }
}

/// Machine that measures.
pub struct Machine {
    pub adapter: String,
    pub driver: String,
    pub is_software: bool,
}

impl Machine {
    pub fn of(adapter: &AdapterDescription) -> Self {
        let is_software = adapter.device_type == "Cpu";
        Self { adapter: adapter.name.clone(), driver: adapter.driver.clone(), is_software }
    }
}

/// A part, as the page tells of it.
pub struct RanPart(pub Row);

impl RanPart {
    pub fn of(part: &Part, (arguments, ran): &(Option<Vec<String>>, Ran)) -> Self {
        let command = arguments.as_ref().map(|arguments| format!("lanternfish-bench {}", arguments.join(" ")));
        let outcome = ran
            .outcome
            .as_ref()
            .map_or_else(|reason| format!("{NOT_MEASURED}, because {reason}"), |_| "measured".to_owned());
        let row =
            Row::default().text("part", "part", &part.name).text("command", "command", command.unwrap_or_default());
        let row = row.maybe("seconds", "seconds", 0, ran.seconds).text("commit", "commit", &ran.commit);
        Self(row.text("outcome", "outcome", outcome.replace('|', "/")))
    }
}

/// All of it.
pub fn page(papers: &[Paper], machine: &Machine, form: Form, reports: &Reports, ran: &[RanPart]) -> Document {
    let header = Row::default().data("version", env!("CARGO_PKG_VERSION")).data("adapter", &machine.adapter);
    let header =
        header.data("driver", &machine.driver).data("software", machine.is_software).data("quick", form == Form::Quick);
    let mut page = Document::titled("Five papers, and what is measured here", header);
    page.paragraph(format!(
        "{} on {}, Lanternfish {}; {}. A rule stands beside each verdict. Counts, memory and errors hold on any adapter; the speed of a graphics \
         card has no verdict on a software adapter.",
        machine.adapter,
        machine.driver,
        env!("CARGO_PKG_VERSION"),
        match form {
            Form::Full => "the full run",
            Form::Quick => "the quick run, of small images",
            Form::Card => "the run of nine minutes for a graphics card",
        }
    ));
    page.paragraph(format!(
        "A claim on times is confirmed if the whole interval of the figure fulfils its rule, refuted if no part does, and else within noise. \
         Paired times: rows measured in turn, run by run, six runs or more; the figure is the median of the pairs, the interval has 95 %. Times \
         apart: all others; the interval is that of all runs, with a margin of {:.2} ×: by so much the times of rows of equal settings differ in this \
         run; {:.2} × in the stored reports of a card. Fitted: the rule is fulfilled by \
         values that the paper does not state, which were chosen to fulfil it. Lost by: the deliberate fault with which the claim is not confirmed, \
         `lanternfish-bench papers --fault NAME`.",
        reports.margin(""),
        reports.margin(OF_CARDS[0].0)
    ));
    page.show(counted(papers, reports));
    let mut claims = Vec::new();
    for paper in papers {
        let about = paper.about();
        page.heading(about.title);
        page.paragraph(about.theirs);
        page.paragraph(about.comparable(reports));
        let rows: Vec<Row> = paper.claims().iter().map(|claim| claim.judged(reports).row(paper.key())).collect();
        page.subheading("Claims");
        page.show(rows.iter().cloned());
        claims.extend(rows);
        let mut without_figures = Vec::new();
        for table in TABLES.iter().filter(|table| table.paper == *paper) {
            let rows = table.rows(reports);
            if rows.is_empty() {
                without_figures.push(table.heading.to_owned());
                continue;
            }
            page.subheading(table.heading);
            if !table.text.is_empty() {
                page.paragraph(table.text);
            }
            page.show(rows.iter().cloned());
            page.keep(table.key, rows);
        }
        if *paper == Paper::VanGelderen {
            plots(&mut page, reports);
        }
        if !without_figures.is_empty() {
            page.subheading("Not measured");
            page.list(without_figures);
        }
    }
    page.keep("claims", claims);
    let parts: Vec<Row> = ran.iter().map(|RanPart(row)| row.clone()).collect();
    page.section("Parts", "What was run for this page. Its reports lie in `parts/`.", "parts", parts);
    page
}

/// Adds the figures of the thesis that are plots, as far as there are any.
fn plots(page: &mut Document, reports: &Reports) {
    if let Ok(plot) = reports.part("attenuation") {
        page.subheading("Fig. A.1: attenuation functions");
        page.html(plot.json.as_str().unwrap_or_default().to_owned());
    }
    let figures = reports
        .part("clustered-track")
        .and_then(|report| Figures::deserialize(report.json).map_err(|error| format!("clustered-track: {error}")));
    match figures {
        Ok(figures) => plotted(page, &figures, Document::subheading),
        Err(reason) => page.paragraph(format!("Figures 6.2 to 6.10: not measured, because {reason}.")),
    }
}

/// How many claims of each paper have which verdict.
fn counted(papers: &[Paper], reports: &Reports) -> Vec<Row> {
    let row = |paper: &Paper| {
        let verdicts: Vec<_> = paper.claims().iter().map(|claim| claim.judged(reports).verdict.name()).collect();
        Verdict::NAMES.iter().fold(Row::default().text("paper", "paper", paper.about().title), |row, (key, verdict)| {
            row.number(*key, verdict, verdicts.iter().filter(|name| *name == verdict).count())
        })
    };
    papers.iter().map(row).collect()
}

/// The same as text.
pub fn summary(papers: &[Paper], reports: &Reports) -> String {
    to_markdown(&counted(papers, reports))
}
