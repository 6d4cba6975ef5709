//! Figures by pass: read, stored, compared.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use serde_json::{Value, json};

use super::hot::Hot;

/// Least and greatest value over the variants of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    pub least: u64,
    pub most: u64,
}

/// What a row states, in the order of [`COLUMNS`].
pub type Row = [Range; COLUMNS.len()];

/// The stored columns: 32-bit registers of a lane, percent of the most waves, bytes of a lane, bytes of a workgroup, instructions,
/// and the compiler's estimate of cycles.
pub const COLUMNS: [&str; 6] = ["VGPRs", "occupancy", "scratch", "LDS", "instructions", "inverse throughput"];

const OCCUPANCY: usize = 1;
const SCRATCH: usize = 2;

/// One entry point of one variant, as the tool prints it.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// File and sorted features.
    pub shader: String,
    pub entry: String,
    pub values: [u64; COLUMNS.len()],
}

/// The rows of one card.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Card {
    /// By the name of a hot pass.
    pub hot: BTreeMap<String, Row>,
    /// By file and entry point: the variants' number and the extremes of each column.
    pub passes: BTreeMap<String, (usize, Row)>,
}

/// A difference between stored and new figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub line: String,
    /// True if a hot pass has lower occupancy or more scratch.
    pub is_worse: bool,
}

impl Range {
    fn one(value: u64) -> Self {
        Self { least: value, most: value }
    }

    fn with(self, value: u64) -> Self {
        Self { least: self.least.min(value), most: self.most.max(value) }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.least == self.most {
            true => write!(f, "{}", self.most),
            false => write!(f, "{}–{}", self.least, self.most),
        }
    }
}

impl Compiled {
    /// Reads the tool's table: a line of column names, then one line for each entry point.
    pub fn read(table: &str) -> Result<Vec<Self>, String> {
        let mut lines = table.lines();
        let names: Vec<_> = lines.next().unwrap_or_default().split('\t').collect();
        lines.map(|line| Self::read_line(&names, line).ok_or_else(|| format!("no row: {line}"))).collect()
    }

    fn read_line(names: &[&str], line: &str) -> Option<Self> {
        let words: Vec<_> = line.split('\t').collect();
        let word = |name: &str| words.get(names.iter().position(|n| *n == name)?).copied();
        let number = |name: &str| word(name)?.parse::<u64>().ok();
        // RADV counts a wave of 64 lanes twice: 16 waves of 64 lanes are 32.
        let lanes = number("wave")?;
        let most_waves = if lanes == 64 { 32 } else { 16 };
        let values = [
            number("VGPRs")?,
            number("Subgroups per SIMD")? * 100 / most_waves,
            // Told of a wave.
            number("Scratch size")? / lanes,
            number("LDS size")?,
            number("Instructions")?,
            number("Inverse Throughput")?,
        ];
        Some(Self { shader: word("shader")?.to_owned(), entry: word("entry")?.to_owned(), values })
    }
}

impl Card {
    /// Rows by pass, and those of the hot passes. Returns an error if a hot pass was not compiled.
    pub fn of(compiled: &[Compiled], hot: &[Hot]) -> Result<Self, String> {
        let mut card = Self::default();
        for Compiled { shader, entry, values } in compiled {
            let file = shader.split('+').next().unwrap_or_default();
            let ranges = values.map(Range::one);
            let (count, row) = card.passes.entry(format!("{file} {entry}")).or_insert((0, ranges));
            *count += 1;
            row.iter_mut().zip(values).for_each(|(range, value)| *range = range.with(*value));
        }
        for hot in hot {
            let shader = hot.shader();
            let found = compiled.iter().find(|row| row.shader == shader && row.entry == hot.entry);
            let found = found.ok_or_else(|| format!("{}: no entry point {} of {shader}", hot.name, hot.entry))?;
            card.hot.insert(hot.name.to_owned(), found.values.map(Range::one));
        }
        Ok(card)
    }

    /// Reads what [`Self::to_json`] writes.
    pub fn from_json(card: &Value) -> Option<Self> {
        let row = |values: &Value| -> Option<Row> {
            let range = |value: &Value| match value.as_u64() {
                Some(value) => Some(Range::one(value)),
                None => Some(Range { least: value.get(0)?.as_u64()?, most: value.get(1)?.as_u64()? }),
            };
            values.as_array()?.iter().map(range).collect::<Option<Vec<_>>>()?.try_into().ok()
        };
        let hot = card["hot"].as_object()?.iter().map(|(name, values)| Some((name.clone(), row(values)?)));
        let passes = card["passes"]
            .as_object()?
            .iter()
            .map(|(name, pass)| Some((name.clone(), (pass["variants"].as_u64()? as usize, row(&pass["figures"])?))));
        Some(Self { hot: hot.collect::<Option<_>>()?, passes: passes.collect::<Option<_>>()? })
    }

    /// One line a row, so that a difference of two files shows rows.
    pub fn to_json(&self) -> String {
        let range = |range: &Range| match range.least == range.most {
            true => json!(range.most),
            false => json!([range.least, range.most]),
        };
        let row = |row: &Row| Value::from(row.iter().map(range).collect::<Vec<_>>());
        let hot: Vec<_> = self.hot.iter().map(|(name, values)| format!("{}: {}", json!(name), row(values))).collect();
        let pass = |(name, (count, values)): (&String, &(usize, Row))| {
            format!("{}: {}", json!(name), json!({ "variants": count, "figures": row(values) }))
        };
        let passes: Vec<_> = self.passes.iter().map(pass).collect();
        format!("{{\n\"hot\": {{\n{}\n}},\n\"passes\": {{\n{}\n}}\n}}", hot.join(",\n"), passes.join(",\n"))
    }

    /// The hot passes that differ from those stored.
    pub fn hot_changes(&self, stored: &Self) -> Vec<Change> {
        let change = |name: &String| {
            let rows = [stored, self].map(|card| card.hot.get(name));
            let is_worse = match rows {
                [Some(before), Some(now)] => {
                    now[OCCUPANCY].least < before[OCCUPANCY].least || now[SCRATCH].most > before[SCRATCH].most
                }
                // A row that is not stored was never judged.
                [before, _] => before.is_none(),
            };
            difference(rows).map(|what| Change { line: format!("{name}: {what}"), is_worse })
        };
        names(&stored.hot, &self.hot).into_iter().filter_map(change).collect()
    }

    /// The passes whose figures over all variants differ from those stored.
    pub fn pass_changes(&self, stored: &Self) -> Vec<Change> {
        let change = |name: &String| {
            let passes = [stored, self].map(|card| card.passes.get(name));
            let what = difference(passes.map(|pass| pass.map(|(_, row)| row)))?;
            let count = passes[1].or(passes[0])?.0;
            Some(Change { line: format!("{name}, {count} variants: {what}"), is_worse: false })
        };
        names(&stored.passes, &self.passes).into_iter().filter_map(change).collect()
    }
}

fn names<'a, T>(stored: &'a BTreeMap<String, T>, new: &'a BTreeMap<String, T>) -> BTreeSet<&'a String> {
    stored.keys().chain(new.keys()).collect()
}

/// The columns that differ; `None` if none does.
fn difference([before, now]: [Option<&Row>; 2]) -> Option<String> {
    let shown = |row: &Row| COLUMNS.iter().zip(row).map(|(name, range)| format!("{name} {range}")).collect::<Vec<_>>();
    match (before, now) {
        (None, None) => None,
        (None, Some(now)) => Some(format!("new: {}", shown(now).join(", "))),
        (Some(_), None) => Some("gone".to_owned()),
        (Some(before), Some(now)) => {
            let columns = COLUMNS.iter().zip(before.iter().zip(now)).filter(|(_, (before, now))| before != now);
            let columns: Vec<_> = columns.map(|(name, (before, now))| format!("{name} {before} -> {now}")).collect();
            (!columns.is_empty()).then(|| columns.join(", "))
        }
    }
}
