//! Reports of benchmarks: tables with texts, written as report.json for scripts, and as Markdown or HTML for people.

use std::path::Path;

use lanternfish_gpu::Gpu;
use serde::{Deserialize, Serialize, Serializer, ser::SerializeMap};
use serde_json::Value;

use crate::{
    error::CliError,
    output::{print, write_text},
    plot::escaped,
    scene::SceneName,
    table::{self, Key, Row},
};

/// Style of all pages.
const STYLE: &str = "body{font:15px/1.4 sans-serif;margin:1rem auto;max-width:100rem;padding:0 1rem;color:#222}\
                     p,li{max-width:60em}table{border-collapse:collapse}svg,img{max-width:100%;height:auto}\
                     td,th{padding:.15rem .6rem;text-align:right;border-bottom:1px solid #ddd;vertical-align:top}\
                     .text{text-align:left}.noise{color:#777;font-style:italic}.marked{color:#b30}\
                     .row{display:grid;grid-template-columns:repeat(auto-fit,minmax(22rem,1fr));gap:.4rem}\
                     figure{display:inline-block;margin:0 1em 1em 0;vertical-align:top}figcaption{font-size:13px;color:#555}\
                     .small img{width:288px;image-rendering:pixelated}";

/// A part of a page.
#[derive(Debug)]
enum Block {
    /// A level and a text.
    Heading(usize, String),
    Paragraph(String),
    List(Vec<String>),
    Table(Vec<Row>),
    /// Content of the HTML page only: images, plots.
    Html(String),
}

/// Results of a benchmark, as data and as a page.
#[derive(Debug)]
pub struct Document {
    title: String,
    /// Facts common to all results, for scripts.
    header: Row,
    data: Vec<(Key, Value)>,
    rows: Vec<(Key, Vec<Row>)>,
    page: Vec<Block>,
}

/// A case without figures.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LeftOut {
    pub what: String,
    pub reason: String,
}

impl Document {
    /// Returns a document of one scene, named in title and header.
    pub fn of_scene(title: &str, scene: &SceneName, gpu: &Gpu, runs: u32) -> Self {
        let mut document = Self::new(&format!("{title}: {scene}"), gpu, runs);
        document.facts(Row::default().data("scene", scene));
        document
    }

    /// Returns a document whose header holds version, adapter, driver and number of runs.
    pub fn new(title: &str, gpu: &Gpu, runs: u32) -> Self {
        let adapter = &gpu.description;
        let header = Row::default()
            .data("version", env!("CARGO_PKG_VERSION"))
            .data("adapter", &adapter.name)
            .data("driver", &adapter.driver)
            .data("runs", runs);
        Self::titled(title, header)
    }

    /// A document with what all its figures share.
    pub fn titled(title: &str, header: Row) -> Self {
        Self { title: title.to_owned(), header, data: Vec::new(), rows: Vec::new(), page: Vec::new() }
    }

    /// Adds facts to the header.
    pub fn facts(&mut self, facts: Row) {
        self.header = std::mem::take(&mut self.header).and(facts);
    }

    /// Adds a paragraph about the origin of the results: `what`, then adapter, driver and version, then the statistic
    /// of the times.
    pub fn introduction(&mut self, what: &str, times: &str) {
        let said = |key| self.header.get(key).as_str().unwrap_or_default();
        let text = format!(
            "{what}; {} on {}, Lanternfish {}. Times: {times}; compare them within this page only. Counts and errors are exact.",
            said("adapter"),
            said("driver"),
            said("version")
        );
        self.paragraph(text);
    }

    pub fn heading(&mut self, text: &str) {
        self.page.push(Block::Heading(2, text.to_owned()));
    }

    pub fn subheading(&mut self, text: &str) {
        self.page.push(Block::Heading(3, text.to_owned()));
    }

    pub fn paragraph(&mut self, text: impl Into<String>) {
        self.page.push(Block::Paragraph(text.into()));
    }

    pub fn list(&mut self, lines: impl IntoIterator<Item = String>) {
        let lines: Vec<_> = lines.into_iter().collect();
        if !lines.is_empty() {
            self.page.push(Block::List(lines));
        }
    }

    /// Shows a table.
    pub fn show(&mut self, rows: impl IntoIterator<Item = Row>) {
        self.page.push(Block::Table(rows.into_iter().collect()));
    }

    /// Adds content to the HTML page only.
    pub fn html(&mut self, html: String) {
        self.page.push(Block::Html(html));
    }

    /// Adds rows to the JSON report.
    pub fn keep(&mut self, key: impl Into<Key>, rows: Vec<Row>) {
        self.rows.push((key.into(), rows));
    }

    /// Adds other data to the JSON report.
    pub fn keep_data(&mut self, key: &'static str, data: &impl Serialize) {
        self.data.push((key.into(), serde_json::to_value(data).expect("plain numbers and strings")));
    }

    /// Adds a section with a table, and its rows to the JSON report. Without rows there is no section.
    pub fn section(&mut self, heading: &str, text: &str, key: impl Into<Key>, rows: Vec<Row>) {
        self.section_shown(heading, text, rows.clone());
        self.keep(key, rows);
    }

    /// Adds a section with a table to the page only. Without rows there is no section.
    pub fn section_shown(&mut self, heading: &str, text: &str, rows: Vec<Row>) {
        if !rows.is_empty() {
            self.heading(heading);
            if !text.is_empty() {
                self.paragraph(text);
            }
            self.show(rows);
        }
    }

    /// Adds the list of configurations without results, with reasons.
    pub fn left_out(&mut self, left_out: &[LeftOut]) {
        if !left_out.is_empty() {
            self.heading("Left out");
        }
        self.list(left_out.iter().map(|left_out| format!("{}: {}", left_out.what, left_out.reason)));
        self.keep_data("left_out", &left_out);
    }

    pub fn to_markdown(&self) -> String {
        let mut text = format!("# {}\n", self.title);
        for (i, block) in self.page.iter().enumerate() {
            text += &match block {
                // Of plots, which are not here.
                Block::Heading(..) if matches!(self.page.get(i + 1), Some(Block::Html(_))) => continue,
                Block::Heading(level, heading) => format!("\n{} {heading}\n", "#".repeat(*level)),
                Block::Paragraph(words) => format!("\n{words}\n"),
                Block::List(lines) => lines.iter().fold("\n".to_owned(), |text, line| text + "- " + line + "\n"),
                Block::Table(rows) => format!("\n{}", table::to_markdown(rows)),
                Block::Html(_) => continue,
            };
        }
        text
    }

    /// Returns a self-contained HTML page without scripts.
    pub fn to_html(&self) -> String {
        let title = escaped(&self.title);
        let mut text = format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style></head>\
             <body>\n<h1>{title}</h1>\n"
        );
        for block in &self.page {
            text += &match block {
                Block::Heading(level, heading) => format!("<h{level}>{}</h{level}>\n", escaped(heading)),
                Block::Paragraph(words) => format!("<p>{}</p>\n", escaped(words)),
                Block::List(lines) => {
                    let items = lines.iter().map(|line| format!("<li>{}</li>\n", escaped(line)));
                    format!("<ul>{}</ul>\n", items.collect::<String>())
                }
                Block::Table(rows) => table::to_html(rows),
                Block::Html(html) => format!("{html}\n"),
            };
        }
        text + "</body></html>\n"
    }

    /// Writes report.json, report.md and report.html, and prints the page.
    pub fn write(&self, folder: &Path) -> Result<(), CliError> {
        self.store(folder, "report")?;
        print(&format!("{}\n{}\n", self.to_markdown(), folder.join("report.md").display()))
    }

    /// Writes the page as NAME.json, NAME.md and NAME.html.
    pub fn store(&self, folder: &Path, name: &str) -> Result<(), CliError> {
        let file = |ending: &str| folder.join(format!("{name}.{ending}"));
        write_text(&file("json"), &table::to_json(self))?;
        write_text(&file("md"), &self.to_markdown())?;
        write_text(&file("html"), &self.to_html())
    }
}

/// Serializes to an object with the title and the entries of the header, then every table under its key.
impl Serialize for Document {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("title", &self.title)?;
        self.header.entries(&mut map)?;
        self.rows.iter().try_for_each(|(key, rows)| map.serialize_entry(key, rows))?;
        self.data.iter().try_for_each(|(key, data)| map.serialize_entry(key, data))?;
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_is_for_scripts_and_for_people() {
        let mut document = Document::titled("Rays & images", Row::default().data("runs", 3));
        document.facts(Row::default().data("triangles", 36));
        document.section("None", "", "none", Vec::new());
        document.section("Rays", "Of *one* frame.", "rows", vec![Row::default().count("rays", "rays", 7)]);
        document.heading("A plot");
        document.html("<svg/>".to_owned());
        document.left_out(&[LeftOut { what: "samples".to_owned(), reason: "refused".to_owned() }]);
        let markdown = "# Rays & images\n\n## Rays\n\nOf *one* frame.\n\n| rays |\n|---:|\n| 7 |\n\n## Left out\n\n- samples: refused\n";
        assert_eq!(document.to_markdown(), markdown);
        let html = document.to_html();
        assert!(
            html.contains("<h1>Rays &amp; images</h1>")
                && html.contains("<h2>A plot</h2>\n<svg/>")
                && html.contains("<li>samples: refused</li>")
        );
        let json = serde_json::to_string(&document).unwrap();
        let expected = r#"{"title":"Rays & images","runs":3,"triangles":36,"none":[],"rows":[{"rays":7}],"left_out":[{"reason":"refused","what":"samples"}]}"#;
        assert_eq!(json, expected);
    }
}
