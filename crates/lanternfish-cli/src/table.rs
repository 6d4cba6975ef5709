//! Tables of figures. A figure is declared once, with a key for scripts, a column heading for people, and a number of
//! digits. JSON, text, Markdown and HTML are generated from that.

use std::{borrow::Cow, fmt::Display};

use serde::{Serialize, Serializer, ser::SerializeMap};
use serde_json::Value;

use crate::plot::escaped;

/// The key of a figure or a table in JSON.
pub type Key = Cow<'static, str>;

/// A figure of a row.
#[derive(Clone, Debug, PartialEq)]
struct Cell {
    /// JSON key; `None` for figures that are shown only.
    key: Option<Key>,
    /// Column heading; `None` for figures in JSON only.
    heading: Option<String>,
    value: Value,
    shown: String,
    is_text: bool,
}

/// Figures in the order of their columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row(Vec<Cell>);

impl Row {
    fn with(mut self, key: Option<Key>, heading: Option<&str>, value: Value, shown: String) -> Self {
        self.0.push(Cell { key, heading: heading.map(str::to_owned), value, shown, is_text: false });
        self
    }

    /// Adds a text.
    pub fn text(self, key: impl Into<Key>, heading: &str, words: impl Display) -> Self {
        let words = words.to_string();
        let mut row = self.with(Some(key.into()), Some(heading), words.clone().into(), words);
        row.0.last_mut().expect("just added").is_text = true;
        row
    }

    /// Adds a number, shown with its own format.
    pub fn number(self, key: impl Into<Key>, heading: &str, number: impl Serialize + Display) -> Self {
        self.with(Some(key.into()), Some(heading), value(&number), number.to_string())
    }

    /// Adds a number, shown as a dash if it is `None`.
    pub fn optional(self, key: impl Into<Key>, heading: &str, number: Option<impl Serialize + Display>) -> Self {
        let shown = number.as_ref().map_or_else(|| DASH.to_owned(), ToString::to_string);
        self.with(Some(key.into()), Some(heading), value(&number), shown)
    }

    /// Adds a count, shown with commas between thousands.
    pub fn count(self, key: impl Into<Key>, heading: &str, count: u64) -> Self {
        self.with(Some(key.into()), Some(heading), count.into(), grouped(count))
    }

    /// Adds a number, shown with `digits` decimal places, or as a dash if it is `None`.
    pub fn maybe(self, key: impl Into<Key>, heading: &str, digits: usize, number: Option<f64>) -> Self {
        self.optional(key, heading, number).said_as(number.map_or(DASH.to_owned(), |number| fixed(digits, number)))
    }

    /// Adds a number of bytes, shown in megabytes.
    pub fn megabytes(self, key: impl Into<Key>, heading: &str, bytes: u64) -> Self {
        self.count(key, heading, bytes).said_as(format_args!("{:.1}", bytes as f64 / 1e6))
    }

    /// Adds the side of a square image, texels.
    pub fn texels(self, key: impl Into<Key>, texels: u32) -> Self {
        self.number(key, "texels", texels).said_as(format_args!("{texels}²"))
    }

    /// Adds a number, shown with `digits` decimal places.
    pub fn fixed(self, key: impl Into<Key>, heading: &str, digits: usize, number: f64) -> Self {
        self.with(Some(key.into()), Some(heading), number.into(), fixed(digits, number))
    }

    /// Adds a ratio, shown in percent with `digits` decimal places.
    pub fn percent(self, key: impl Into<Key>, heading: &str, digits: usize, ratio: f64) -> Self {
        self.with(Some(key.into()), Some(heading), ratio.into(), percent(digits, ratio))
    }

    /// Adds data to JSON only.
    pub fn data(self, key: impl Into<Key>, data: impl Serialize) -> Self {
        self.with(Some(key.into()), None, value(&data), String::new())
    }

    /// Adds a text to the shown table only: a value derived from other figures, or a paper's value.
    pub fn shown(self, heading: &str, words: impl Display) -> Self {
        self.with(None, Some(heading), Value::Null, words.to_string())
    }

    /// Replaces the shown text of the last figure.
    pub fn said_as(mut self, words: impl Display) -> Self {
        self.0.last_mut().expect("a figure to show").shown = words.to_string();
        self
    }

    /// Appends the figures of another row.
    pub fn and(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    fn cell(&self, key: &str) -> &Cell {
        self.0.iter().find(|cell| cell.key.as_deref() == Some(key)).unwrap_or_else(|| panic!("no {key} in {self:?}"))
    }

    /// Value of the figure with this key.
    pub fn get(&self, key: &str) -> &Value {
        &self.cell(key).value
    }

    /// Number with this key; 0 if the figure is not a number.
    pub fn f64(&self, key: &str) -> f64 {
        self.get(key).as_f64().unwrap_or_default()
    }

    /// Text with this key, shown or not.
    pub fn words_of(&self, key: &str) -> &str {
        self.get(key).as_str().unwrap_or_default()
    }

    /// Shown text of the figure with this key.
    pub fn words(&self, key: &str) -> &str {
        &self.cell(key).shown
    }

    /// Headings and cells of the shown figures.
    fn columns(&self) -> impl Iterator<Item = (&str, &Cell)> {
        self.0.iter().filter_map(|cell| Some((cell.heading.as_deref()?, cell)))
    }
}

/// Serializes to an object of all figures with a key, in order.
impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        self.entries(&mut map)?;
        map.end()
    }
}

impl Row {
    /// Adds all figures with a key to an object.
    pub fn entries<M: SerializeMap>(&self, map: &mut M) -> Result<(), M::Error> {
        self.0
            .iter()
            .filter_map(|cell| Some((cell.key.as_ref()?, &cell.value)))
            .try_for_each(|(k, v)| map.serialize_entry(k, v))
    }
}

/// Shown text of a missing figure.
pub const DASH: &str = "–";

/// Formats a number with `digits` decimal places.
pub fn fixed(digits: usize, number: f64) -> String {
    format!("{number:.digits$}")
}

/// Formats a ratio in percent, with `digits` decimal places.
pub fn percent(digits: usize, ratio: f64) -> String {
    format!("{:.digits$} %", 100.0 * ratio)
}

/// The `f64` with the shortest decimal digits that identify `number`, so that JSON has no extra digits.
pub fn decimal(number: f32) -> f64 {
    number.to_string().parse().unwrap_or_else(|_| number.into())
}

/// Formats a count with commas between thousands.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Data as JSON, indented, with a line's end.
pub fn to_json(data: &impl Serialize) -> String {
    serde_json::to_string_pretty(data).expect("plain numbers and strings") + "\n"
}

fn value(data: &impl Serialize) -> Value {
    serde_json::to_value(data).expect("plain numbers and strings")
}

/// Formats rows, which have the same columns, as a Markdown table. Empty without rows.
pub fn to_markdown(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let line = |cells: Vec<&str>| format!("| {} |\n", cells.join(" | "));
    let rule = first.columns().map(|(_, cell)| if cell.is_text { "---|" } else { "---:|" });
    let mut text = line(first.columns().map(|(heading, _)| heading).collect());
    text += &format!("|{}\n", rule.collect::<String>());
    for row in rows {
        debug_assert!(row.columns().map(|(heading, _)| heading).eq(first.columns().map(|(heading, _)| heading)));
        text += &line(row.columns().map(|(_, cell)| cell.shown.as_str()).collect());
    }
    text
}

/// Formats rows, which have the same columns, as aligned text. Empty without rows, and without a line of headings if
/// all are empty.
pub fn to_text(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let mut lines: Vec<Vec<&str>> = vec![first.columns().map(|(heading, _)| heading).collect()];
    lines.extend(rows.iter().map(|row| row.columns().map(|(_, cell)| cell.shown.as_str()).collect()));
    let width = |i: usize| lines.iter().map(|line| line[i].chars().count()).max().unwrap_or(0);
    let columns: Vec<_> = first.columns().enumerate().map(|(i, (_, cell))| (width(i), cell.is_text)).collect();
    let cell = |(text, (width, is_text)): (&&str, &(usize, bool))| match is_text {
        true => format!("{text:<width$}"),
        false => format!("{text:>width$}"),
    };
    let line = |line: &Vec<&str>| line.iter().zip(&columns).map(cell).collect::<Vec<_>>().join("  ");
    let lines = lines.iter().skip_while(|line| line.iter().all(|heading| heading.is_empty()));
    lines.flat_map(|cells| [line(cells).trim_end().to_owned(), "\n".to_owned()]).collect()
}

/// Formats rows as an HTML table. A figure that ends in a star has the class `marked`, a row that begins with a star
/// the class `noise`.
pub fn to_html(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let class = |cell: &Cell| if cell.is_text { " class=\"text\"" } else { "" };
    let head = |(heading, cell): (&str, &Cell)| format!("<th{}>{}", class(cell), escaped(heading));
    let head: String = first.columns().map(head).collect();
    let mut text = format!("<table>\n<tr>{head}\n");
    for row in rows {
        let is_noise = row.columns().next().is_some_and(|(_, cell)| cell.shown.starts_with('*'));
        text += if is_noise { "<tr class=\"noise\">" } else { "<tr>" };
        for (_, cell) in row.columns() {
            let class = if cell.shown.ends_with(" *") { " class=\"marked\"" } else { class(cell) };
            text += &format!("<td{class}>{}", escaped(cell.shown.trim_matches('*')));
        }
        text.push('\n');
    }
    text + "</table>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> [Row; 2] {
        let row = |name: &str, rays| {
            Row::default()
                .text("name", "", name)
                .count("rays", "rays", rays)
                .fixed("ms", "frame, ms", 1, 2.25)
                .percent("missed", "missed", 2, 0.125)
                .optional("texels", "texels", None::<u32>)
                .shown("paper", "11–16")
                .data("size", [4, 3])
        };
        [row("a < b", 1000), row("*noise*", 2)]
    }

    #[test]
    fn a_figure_is_for_scripts_and_for_people() {
        let rows = rows();
        let expected = "|  | rays | frame, ms | missed | texels | paper |\n|---|---:|---:|---:|---:|---:|\n\
                        | a < b | 1,000 | 2.2 | 12.50 % | – | 11–16 |\n| *noise* | 2 | 2.2 | 12.50 % | – | 11–16 |\n";
        assert_eq!(to_markdown(&rows), expected);
        let expected = "          rays  frame, ms   missed  texels  paper\n\
                        a < b    1,000        2.2  12.50 %       –  11–16\n\
                        *noise*      2        2.2  12.50 %       –  11–16\n";
        assert_eq!(to_text(&rows), expected);
        let json = serde_json::to_string(&rows[0]).unwrap();
        assert_eq!(json, r#"{"name":"a < b","rays":1000,"ms":2.25,"missed":0.125,"texels":null,"size":[4,3]}"#);
        let html = to_html(&rows);
        assert!(
            html.contains("<td class=\"text\">a &lt; b<td>1,000") && html.contains("<tr class=\"noise\">"),
            "{html}"
        );
        assert_eq!([to_markdown(&[]), to_html(&[]), to_text(&[])], [const { String::new() }; 3]);
        assert_eq!((rows[0].f64("ms"), rows[0].words("rays")), (2.25, "1,000"));
    }

    #[test]
    fn thousands_are_grouped() {
        for (count, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (262_267, "262,267"), (1_000_000, "1,000,000")] {
            assert_eq!(grouped(count), text);
        }
    }

    #[test]
    #[should_panic(expected = "no rate in")]
    fn a_missing_figure_panics() {
        rows()[0].get("rate");
    }
}
