//! The papers as they are declared in the TOML files beside this one: claims and tables, computed from the reports.

use std::{collections::BTreeMap, fmt};

use serde::Deserialize;

use super::{
    Paper,
    claims::{Claim, Figure, Judged, NOT_MEASURED},
    query::{Found, Reports},
    special,
};
use crate::table::{DASH, Row};

/// Samples a pixel of the path tracer's image below which no claim on errors is judged.
const LEAST_SAMPLES: f64 = 32.0;

/// A paper, beside ours.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declared {
    pub title: String,
    /// The paper's scenes, sizes and hardware.
    pub theirs: String,
    /// What can be compared with it, and what cannot; `<part>` is what a part showed.
    comparable: String,
    /// Beginnings of queries by name.
    #[serde(default)]
    lets: BTreeMap<String, String>,
    pub claims: Vec<Claim>,
    pub tables: Vec<Table>,
}

/// A table of a paper, beside ours.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// For scripts.
    pub key: String,
    pub heading: String,
    /// What stands above it.
    #[serde(default)]
    pub text: String,
    /// The part whose report shows it too.
    #[serde(default)]
    pub of: String,
    /// The paper's values.
    #[serde(default)]
    rows: Vec<Vec<Value>>,
    /// `key; heading; $0`: a value of the row. `key; heading; digits; expression`: a measured figure; `words` in place of the digits: words.
    /// In an expression `$0` stands for the row's first value.
    #[serde(default)]
    columns: Vec<String>,
    /// A table that no list of columns gives.
    #[serde(default)]
    special: String,
}

impl Table {
    /// True if a column has a figure that was measured.
    pub fn has_figures(&self, rows: &[Row]) -> bool {
        let mut keys = self.columns.iter().filter(|column| column.matches(';').count() > 2);
        let is_figure = |row: &Row, key: &str| {
            let value = row.get(key);
            value.is_number() || value.as_str().is_some_and(|words| words != DASH)
        };
        let is_measured = |key: &str| rows.iter().any(|row| is_figure(row, key));
        match self.columns.is_empty() {
            true => !rows.is_empty(),
            false => {
                keys.any(|column| column.contains('{') && is_measured(column.split(';').next().unwrap_or_default()))
            }
        }
    }
}

/// A value of the paper.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Value {
    Integer(i64),
    Number(f64),
    Words(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(number) => number.fmt(f),
            Self::Number(number) => number.fmt(f),
            Self::Words(words) => words.fmt(f),
        }
    }
}

impl Paper {
    /// Reads the declaration.
    ///
    /// Panics if it is wrong: a bug, which a test finds.
    pub fn declared(self) -> Declared {
        let text = match self {
            Self::Elagabani => include_str!("elagabani.toml"),
            Self::VanGelderen => include_str!("van_gelderen.toml"),
            Self::Niessner => include_str!("niessner.toml"),
            Self::Aalund => include_str!("aalund.toml"),
            Self::Archer => include_str!("archer.toml"),
        };
        toml::from_str(text).unwrap_or_else(|error| panic!("{self:?}: {error}"))
    }
}

impl Declared {
    /// What can be compared, with what the parts showed.
    pub fn comparable(&self, reports: &Reports) -> String {
        filled(&self.comparable, |part| reports.scene_of(part))
    }

    /// All claims with their verdicts.
    pub fn judged(&self, reports: &Reports) -> Vec<Judged> {
        self.claims.iter().map(|claim| claim.judged(self.figure(claim, reports), reports.is_software)).collect()
    }

    fn figure(&self, claim: &Claim, reports: &Reports) -> Found<Figure> {
        if !claim.special.is_empty() {
            return special::figure(&claim.special, reports);
        }
        let expression = self.resolved(&claim.figure);
        has_reference(&expression, reports)?;
        let measure = reports.measure(&expression)?;
        let note = filled(&claim.note, |field| {
            let (expression, digits) = field.split_once(';').unwrap_or((field, "2"));
            self.shown(reports, expression, digits.trim()).unwrap_or(DASH.to_owned())
        });
        Ok(Figure::of(measure, note))
    }

    /// A figure with so many digits; `+2`: with its sign.
    fn shown(&self, reports: &Reports, expression: &str, digits: &str) -> Found<String> {
        let value = reports.value(&self.resolved(expression))?;
        let places = digits.trim_start_matches('+').parse().map_err(|_| format!("{digits}: not a number of digits"))?;
        Ok(if digits.starts_with('+') { format!("{value:+.places$}") } else { format!("{value:.places$}") })
    }

    /// An expression with the beginnings of its queries.
    fn resolved(&self, expression: &str) -> String {
        let replaced = |text: String, (name, query): (&String, &String)| {
            text.replace(&format!("{{{name} |"), &format!("{{{query} |"))
        };
        self.lets.iter().fold(expression.trim().to_owned(), replaced)
    }

    /// Every query of the claims and tables, with the values of the tables' rows.
    #[cfg(test)]
    pub fn queries(&self) -> Vec<String> {
        let claims = self.claims.iter().flat_map(|claim| [claim.figure.clone(), claim.note.clone()]);
        let of_row = |table: &'_ Table, values: &[Value]| -> Vec<String> {
            table.columns.iter().map(|column| with_values(column, values)).collect()
        };
        let tables = self.tables.iter().flat_map(|table| table.rows.iter().flat_map(move |row| of_row(table, row)));
        let texts: Vec<String> = claims.chain(tables).map(|text| self.resolved(&text)).collect();
        let between = |text: &String| -> Vec<String> {
            text.split('{').skip(1).filter_map(|rest| Some(rest.split_once('}')?.0.to_owned())).collect()
        };
        texts.iter().flat_map(between).collect()
    }

    /// The rows of a table.
    pub fn rows(&self, table: &Table, reports: &Reports) -> Vec<Row> {
        if !table.special.is_empty() {
            return special::rows(&table.special, reports);
        }
        table.rows.iter().map(|values| self.row(&table.columns, values, reports)).collect()
    }

    fn row(&self, columns: &[String], values: &[Value], reports: &Reports) -> Row {
        columns.iter().fold(Row::default(), |row, column| {
            let fields: Vec<&str> = column.splitn(4, ';').map(str::trim).collect();
            match fields[..] {
                [key, heading, value] => {
                    let (value, unit) = value.split_at(2);
                    let i: usize = value[1..].parse().unwrap_or_default();
                    let row = match &values[i] {
                        Value::Words(words) => row.text(key.to_owned(), heading, words),
                        Value::Integer(number) => row.number(key.to_owned(), heading, number),
                        Value::Number(number) => row.number(key.to_owned(), heading, number),
                    };
                    row.said_as(format_args!("{}{unit}", values[i]))
                }
                [key, heading, "words", query] => {
                    let words = reports.words(&self.resolved(&with_values(query, values))).unwrap_or(DASH.to_owned());
                    row.text(key.to_owned(), heading, words)
                }
                [key, heading, digits, expression] => {
                    let expression = with_values(expression, values);
                    let shown = self.shown(reports, &expression, digits);
                    let value = reports.value(&self.resolved(&expression)).ok();
                    row.optional(key.to_owned(), heading, value).said_as(shown.unwrap_or(NOT_MEASURED.to_owned()))
                }
                _ => panic!("{column}: not a column"),
            }
        })
    }
}

/// A text with the values of a row in place of `$0`, `$1` and so on.
fn with_values(text: &str, values: &[Value]) -> String {
    let replaced = |all: String, (i, value): (usize, &Value)| all.replace(&format!("${i}"), &value.to_string());
    values.iter().enumerate().fold(text.to_owned(), replaced)
}

/// Fails if an error against the path tracer is asked for whose image has few samples.
fn has_reference(expression: &str, reports: &Reports) -> Found<()> {
    let is_error = ["| flip}", "| energy}", "| indirect_energy}"].iter().any(|key| expression.contains(key));
    let part = expression.trim_start_matches(['(', '{']).split('|').next().unwrap_or_default().trim();
    let samples = reports.part(part).and_then(|part| part.f64("truth_samples")).unwrap_or(LEAST_SAMPLES);
    if is_error && samples < LEAST_SAMPLES {
        return Err(format!(
            "{part}: the path tracer's image has {samples} samples a pixel, errors need {LEAST_SAMPLES}"
        ));
    }
    Ok(())
}

/// A text with every field between `<` and `>` replaced.
fn filled(text: &str, field: impl Fn(&str) -> String) -> String {
    let mut parts = text.split('<');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| match part.split_once('>') {
        Some((name, rest)) => all + &field(name) + rest,
        None => all + "<" + part,
    })
}

#[test]
fn declarations_are_complete_and_every_expression_can_be_read() {
    let none = Reports::default();
    for paper in super::PAPERS {
        let declared = paper.declared();
        for claim in &declared.claims {
            assert!(claim.figure.is_empty() != claim.special.is_empty(), "{}: one figure", claim.what);
            let error = declared.figure(claim, &none).unwrap_err();
            assert!(error.ends_with(" was not run"), "{}: {error}", claim.what);
            assert!(!claim.note.contains('<') || claim.note.matches('<').count() == claim.note.matches("; ").count());
        }
        for table in &declared.tables {
            assert!(table.special.is_empty() != table.columns.is_empty(), "{}", table.key);
            let rows = declared.rows(table, &none);
            assert_eq!(rows.len(), table.rows.len(), "{}", table.key);
        }
        assert!(!declared.comparable(&none).contains('<'), "{paper:?}");
    }
}

#[test]
fn errors_need_an_image_with_many_samples() {
    let mut reports = Reports::default();
    reports.add("photons", Ok(serde_json::json!({ "truth_samples": 4 })));
    let of = |key: &str| has_reference(&format!("({{photons | rows | name=a | {key}}}) / 2"), &reports).is_ok();
    assert_eq!(["flip", "indirect_energy", "bytes"].map(of), [false, false, true]);
}
