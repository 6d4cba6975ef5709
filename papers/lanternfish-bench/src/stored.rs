//! `lanternfish-bench page`: the page of a stored report.

use std::{fs, path::PathBuf};

use clap::Args;
use lanternfish_cli::{error::CliError, output::print, report::grouped};
use serde_json::{Map, Value};

use crate::{
    document::Document,
    table::{DASH, Row},
};

/// Flags of `page`.
#[derive(Debug, Args)]
pub struct PageArgs {
    /// A report.json, or a file of docs/measured.
    file: PathBuf,
}

/// Prints the page.
pub fn run(args: &PageArgs) -> Result<(), CliError> {
    let hint = "name a report.json, or a file of docs/measured";
    let fault = |error: &dyn std::fmt::Display| CliError::new(format_args!("{}: {error}", args.file.display()), hint);
    let text = fs::read_to_string(&args.file).map_err(|error| fault(&error))?;
    let report: Map<String, Value> = serde_json::from_str(&text).map_err(|error| fault(&error))?;
    print(&page(&report))
}

/// A report as Markdown: its facts, and each list as a table or as lines. Columns have the keys of the report.
fn page(report: &Map<String, Value>) -> String {
    let title = report.get("title").and_then(Value::as_str).unwrap_or("Report");
    let mut page = Document::titled(title, Row::default());
    let is_list = |value: &Value| value.is_array() || value.is_object();
    let facts = report.iter().filter(|(key, value)| *key != "title" && !is_list(value));
    page.list(facts.map(|(key, value)| format!("{key}: {}", shown(value))));
    for (key, value) in report.iter().filter(|(_, value)| is_list(value)) {
        page.heading(key);
        let rows = value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice);
        let rows: Vec<Vec<(String, String)>> = rows.iter().map(|row| cells("", row)).collect();
        let mut keys: Vec<&str> = Vec::new();
        for (key, _) in rows.iter().flatten() {
            if !keys.contains(&key.as_str()) {
                keys.push(key);
            }
        }
        if keys.iter().all(|key| key.is_empty()) {
            page.list(rows.into_iter().flatten().map(|(_, value)| value));
            continue;
        }
        page.show(rows.iter().map(|cells| {
            let cell = |key: &str| cells.iter().find(|(known, _)| known == key).map_or(DASH, |(_, value)| value);
            keys.iter().fold(Row::default(), |row, key| row.text("", key, cell(key)))
        }));
    }
    page.to_markdown()
}

/// The figures of a row by their keys. Those of an object in it have its key before theirs.
fn cells(key: &str, value: &Value) -> Vec<(String, String)> {
    let join = |inner: &str| if key.is_empty() { inner.to_owned() } else { format!("{key}/{inner}") };
    match value {
        Value::Object(map) => map.iter().flat_map(|(inner, value)| cells(&join(inner), value)).collect(),
        _ => vec![(key.to_owned(), shown(value))],
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Null => DASH.to_owned(),
        Value::String(text) => text.replace('|', "\\|"),
        Value::Number(number) => number.as_u64().map_or_else(|| number.to_string(), grouped),
        Value::Array(values) => values.iter().map(shown).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_is_on_the_page() {
        let report = serde_json::json!({
            "title": "Rays", "runs": 3, "rows": [{ "name": "a | b", "rays": 1234567, "ms": { "all": 0.25 } }, { "name": "c" }],
            "notes": ["one", "two"],
        });
        let page = page(report.as_object().unwrap());
        for text in ["# Rays\n", "- runs: 3\n", "## rows\n", "a \\| b", "1,234,567", "0.25", "ms/all", "- one\n- two\n"]
        {
            assert!(page.contains(text), "{text} is not in\n{page}");
        }
        assert_eq!(page.lines().filter(|line| line.contains("| c |")).count(), 1);
    }

    #[test]
    fn stored_reports_have_pages() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/measured");
        for (file, rows) in [("nvidia-h200/clustered", 118), ("nvidia-h200/deep-images", 50), ("papers-quick", 75)] {
            let report = fs::read_to_string(format!("{folder}/{file}.json")).unwrap();
            let report: Map<String, Value> = serde_json::from_str(&report).unwrap();
            let page = page(&report);
            let longest = report.values().filter_map(Value::as_array).map(Vec::len).max();
            assert_eq!(longest, Some(rows), "{file}");
            assert!(page.starts_with("# ") && page.matches("\n## ").count() > 3, "{page}");
        }
    }
}
