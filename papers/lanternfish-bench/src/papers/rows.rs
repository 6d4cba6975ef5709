//! The reports of the parts, and their rows, as claims and tables read them.
//!
//! The runs of a time stand in its row under its key and `_runs`; rows with `in_turn` were measured in turn, run by run.

use std::{
    cell::RefCell,
    collections::{BTreeMap, BTreeSet},
};

use lanternfish_cli::timed::Timed;
use serde_json::Value;

use super::measure::Measure;

/// A figure, or why there is none.
pub type Found<T> = Result<T, String>;

/// Reports of a graphics card that are stored, which claims read where the adapter is software.
pub const OF_CARDS: [(&str, &str); 2] = [
    ("nvidia-h200/clustered", include_str!("../../../../docs/measured/nvidia-h200/clustered.json")),
    ("nvidia-h200/deep-images", include_str!("../../../../docs/measured/nvidia-h200/deep-images.json")),
];

/// Samples a pixel of the path tracer's image below which no claim on errors is judged.
const LEAST_SAMPLES: f64 = 32.0;

/// By how much a time differs at most between rows of equal settings in several tables of a report; none without such
/// rows.
fn repeated(report: &Value) -> Option<f64> {
    const TIMES: [&str; 3] = ["total_ms", "rate_random", "random_m_s"];
    const SIZES: [&str; 3] = ["directions", "resolution", "supersampling"];
    let mut all = BTreeMap::<_, Vec<f64>>::new();
    for (table, rows) in report.as_object()? {
        for row in rows.as_array().into_iter().flatten().filter(|row| row.get("group").is_some()) {
            let is_setting = |key: &str, value: &Value| key != "group" && value.is_string() || SIZES.contains(&key);
            let settings = row.as_object().into_iter().flatten().filter(|(key, value)| is_setting(key, value));
            let settings: Vec<_> = settings.map(|(_, value)| value.to_string()).collect();
            for (key, time) in TIMES.iter().filter_map(|key| Some((*key, row.get(key)?.as_f64()?))) {
                all.entry((table, key, settings.clone())).or_default().push(time);
            }
        }
    }
    let spreads = all.into_values().filter(|times| times.len() > 1).map(|runs| Timed { runs });
    spreads.map(|times| times.most() / times.least()).reduce(f64::max)
}

fn is_of_card(part: &str) -> bool {
    OF_CARDS.iter().any(|(known, _)| *known == part)
}

/// The reports of all parts that were requested; of one that failed, its reason.
#[derive(Debug, Default)]
pub struct Reports {
    parts: BTreeMap<String, Found<Value>>,
    /// Of parts with rows that are repeated, by how much these differ.
    spreads: BTreeMap<String, f64>,
    /// Whether the adapter is a processor, whose times say nothing of a graphics card's.
    pub is_software: bool,
    /// Part, table and number of each row that was read.
    read: RefCell<BTreeSet<(String, String, usize)>>,
}

impl Reports {
    /// Those of the cards alone.
    pub fn of(is_software: bool) -> Self {
        let mut reports = Self { is_software, ..Self::default() };
        for (name, text) in OF_CARDS {
            reports.add(name, serde_json::from_str(text).map_err(|error| error.to_string()));
        }
        reports
    }

    pub fn add(&mut self, part: &str, outcome: Found<Value>) {
        // With a fault a part has few rows: the stored run still says how steady the machine is.
        if let Some(spread) = outcome.as_ref().ok().and_then(repeated) {
            self.spreads.insert(part.to_owned(), spread);
        }
        self.parts.insert(part.to_owned(), outcome);
    }

    /// By how much times of a part that were not measured in turn may differ: as its repeated rows do, or else as those
    /// of the other parts by the same adapter; at least by a tenth, and by half beside other work of a processor.
    pub fn margin(&self, part: &str) -> f64 {
        let alike = self.spreads.iter().filter(|(other, _)| is_of_card(other) == is_of_card(part));
        let least = if self.is_software && !is_of_card(part) { 1.5 } else { 1.1 };
        self.spreads.get(part).copied().unwrap_or(alike.fold(least, |most, (_, spread)| most.max(*spread))).max(least)
    }

    /// Exchanges two values of a key in all rows of a part.
    pub fn swap(&mut self, part: &str, key: &str, [a, b]: [&str; 2]) {
        let Some(Ok(Value::Object(report))) = self.parts.get_mut(part) else { return };
        for row in report.values_mut().filter_map(Value::as_array_mut).flatten() {
            let other = [(a, b), (b, a)].into_iter().find(|(from, _)| row.get(key).is_some_and(|value| value == from));
            if let Some((_, to)) = other {
                row[key] = to.into();
            }
        }
    }

    /// The report of a part.
    pub fn part(&self, name: &str) -> Found<Node<'_>> {
        let outcome = self.parts.get(name).ok_or_else(|| format!("{name} was not run"))?;
        let json = outcome.as_ref().map_err(|reason| format!("{name}: {reason}"))?;
        Ok(Node { place: name.to_owned(), json, part: json, margin: self.margin(name) })
    }

    /// The rows of a table of a part that fulfil a condition; at least one.
    pub fn rows(&self, part: &str, table: &str, is: impl Fn(&Node<'_>) -> bool) -> Found<Vec<Node<'_>>> {
        let of = self.part(part)?;
        let place = format!("{part}, table `{table}`");
        let all = of.json.get(table).and_then(Value::as_array).ok_or_else(|| format!("{place}: there is none"))?;
        let node = |(i, json)| (i, Node { place: format!("{place}, row {}", i + 1), json, ..of.clone() });
        let found: Vec<_> = all.iter().enumerate().map(node).filter(|(_, row)| is(row)).collect();
        let read = found.iter().map(|(i, _)| (part.to_owned(), table.to_owned(), *i));
        self.read.borrow_mut().extend(read);
        if found.is_empty() {
            Err(format!("{place}: no such row"))
        } else {
            Ok(found.into_iter().map(|(_, row)| row).collect())
        }
    }

    /// The first of [`Self::rows`].
    pub fn row(&self, part: &str, table: &str, is: impl Fn(&Node<'_>) -> bool) -> Found<Node<'_>> {
        Ok(self.rows(part, table, is)?.swap_remove(0))
    }

    /// The row of this name.
    pub fn named(&self, part: &str, table: &str, name: &str) -> Found<Node<'_>> {
        let named = self.row(part, table, |row| row.is("name", name));
        named.map_err(|why| if why.ends_with("no such row") { format!("{why} as `{name}`") } else { why })
    }

    /// Nothing was read yet.
    pub fn forget(&mut self) {
        self.read.get_mut().clear();
    }

    /// What was read of a part: its facts, and the rows of its tables.
    pub fn read_of(&self, part: &str) -> Value {
        let Some(Ok(Value::Object(report))) = self.parts.get(part) else { return Value::Null };
        let read = self.read.borrow();
        let is_read = |table: &str, i| read.contains(&(part.to_owned(), table.to_owned(), i));
        let kept = report.iter().filter_map(|(key, value)| match value {
            Value::Array(rows) => {
                let rows: Vec<Value> =
                    rows.iter().enumerate().filter(|(i, _)| is_read(key, *i)).map(|(_, row)| row.clone()).collect();
                (!rows.is_empty()).then(|| (key.clone(), rows.into()))
            }
            Value::Object(_) => None,
            fact => Some((key.clone(), fact.clone())),
        });
        Value::Object(kept.collect())
    }

    /// What a part showed, with the size of its images.
    pub fn scene_of(&self, name: &str) -> String {
        let Ok(part) = self.part(name) else { return "nothing (not measured)".to_owned() };
        let scene = ["scene", "source"].map(|key| part.words(key)).concat();
        match (part.f64("width"), part.f64("height"), part.f64("size/0"), part.f64("size/1")) {
            (Ok(width), Ok(height), ..) | (_, _, Ok(width), Ok(height)) => format!("{scene} at {width} x {height}"),
            _ => scene,
        }
    }
}

/// A number by its key, or by keys between slashes; `*` is the sum of all.
fn number(json: &Value, key: &str) -> Option<f64> {
    let Some(key) = key.strip_suffix('*') else { return json.pointer(&format!("/{key}"))?.as_f64() };
    let inner = key.strip_suffix('/').map_or(Some(json), |key| json.get(key))?;
    match inner {
        Value::Array(numbers) => Some(numbers.iter().filter_map(Value::as_f64).sum()),
        Value::Object(numbers) => Some(numbers.values().filter_map(Value::as_f64).sum()),
        _ => None,
    }
}

/// A report, or a row of one of its tables.
#[derive(Clone, Debug)]
pub struct Node<'a> {
    /// Where it stands, for errors.
    place: String,
    pub json: &'a Value,
    part: &'a Value,
    margin: f64,
}

impl<'a> Node<'a> {
    /// A number by its key, or by keys between slashes; `*` is the sum of all.
    pub fn f64(&self, key: &str) -> Found<f64> {
        number(self.json, key).ok_or_else(|| format!("{}: no number `{key}`", self.place))
    }

    /// Words by their key; none where there are none.
    pub fn words(&self, key: &str) -> &'a str {
        self.json.get(key).and_then(Value::as_str).unwrap_or_default()
    }

    /// True if the value by this key is equal; a number whether it is whole or not.
    pub fn is(&self, key: &str, value: impl Into<Value>) -> bool {
        let (known, value) = (self.json.get(key).unwrap_or(&Value::Null), value.into());
        *known == value || known.as_f64().is_some_and(|known| value.as_f64() == Some(known))
    }

    /// A count, a size, or another number that no run changes.
    pub fn count(&self, key: &str) -> Found<Measure> {
        self.f64(key).map(Measure::exact)
    }

    /// An error against the path tracer; none if its image has few samples.
    pub fn error(&self, key: &str) -> Found<Measure> {
        let samples = number(self.part, "truth_samples").unwrap_or(LEAST_SAMPLES);
        if samples < LEAST_SAMPLES {
            return Err(format!(
                "{}: the path tracer's image has {samples} samples a pixel, errors need {LEAST_SAMPLES}",
                self.place
            ));
        }
        self.count(key)
    }

    /// A time or a rate, with its runs.
    pub fn time(&self, key: &str) -> Found<Measure> {
        let value = self.f64(key)?;
        let (base, inner) = key.split_once('/').map_or((key, None), |(base, inner)| (base, Some(inner)));
        let runs = self.json.get(format!("{base}_runs")).and_then(Value::as_array);
        let of_run = |run| inner.map_or_else(|| Value::as_f64(run), |inner| number(run, inner));
        let runs = runs.into_iter().flatten().filter_map(of_run).collect();
        let table = self.place.rsplit_once(", row ").map_or(&*self.place, |(table, _)| table);
        let together = if self.json.get("in_turn").is_some() { table } else { &self.place };
        Ok(Measure::time(value, runs, self.margin, Some(together.to_owned())))
    }

    /// The sum of several times.
    pub fn times<const N: usize>(&self, keys: [&str; N]) -> Found<Measure> {
        sum(keys.map(|key| self.time(key)))
    }
}

/// The sum of figures, of which there is at least one.
pub fn sum(all: impl IntoIterator<Item = Found<Measure>>) -> Found<Measure> {
    all.into_iter().reduce(|sum, next| Ok(sum? + next?)).unwrap_or_else(|| Err("there is nothing to add".to_owned()))
}

/// The least of figures.
pub fn least(all: impl IntoIterator<Item = Measure>) -> Option<Measure> {
    all.into_iter().min_by(|a, b| a.value.total_cmp(&b.value))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn reports() -> Reports {
        let mut reports = Reports::default();
        let rows = json!([
            { "name": "none", "ms": 2, "times": { "trace": 1.5, "splat": 0.5 } },
            { "name": "deep, 50²", "ms": 4, "ms_runs": [4, 5], "steps": [1, 2], "texels": 50.0, "flip": 0.25 },
        ]);
        reports.add("photons", Ok(json!({ "runs": 3, "truth_samples": 16, "rows": rows, "left_out": [1] })));
        reports.add("indirect", Err("the image is black".to_owned()));
        reports.add("forward-plus", Ok(json!({ "scene": "demo:atrium", "width": 4, "height": 3 })));
        reports.add("track", Ok(json!({ "source": "walk.toml", "size": [8, 6] })));
        reports
    }

    #[test]
    fn rows_give_words_counts_and_times() {
        let reports = reports();
        let deep = reports.row("photons", "rows", |row| row.is("texels", 50)).unwrap();
        assert_eq!((deep.words("name"), deep.f64("steps/1"), deep.f64("steps/*")), ("deep, 50²", Ok(2.0), Ok(3.0)));
        assert_eq!(deep.count("ms").unwrap().interval(), None);
        let none = reports.named("photons", "rows", "none").unwrap();
        let ratio = deep.time("ms").unwrap() / none.times(["times/trace", "times/splat"]).unwrap();
        assert!(ratio.value == 2.0 && ratio.interval().is_some(), "{ratio:?}");
        assert_eq!(sum([]), Err("there is nothing to add".to_owned()));
        let read = json!({ "runs": 3, "truth_samples": 16, "rows": reports.part("photons").unwrap().json["rows"] });
        assert_eq!(reports.read_of("photons"), read, "facts, and what was read");
    }

    #[test]
    fn the_margin_is_the_difference_of_repeated_rows() {
        let row = |group: &str, images: &str, ms: f64| json!({ "group": group, "images": images, "total_ms": ms });
        let rows = |last| json!({ "built": [row("1", "arrays", 2.0), row("1", "lists", 8.0), row("2", last, 5.0)] });
        let mut reports = Reports { is_software: true, ..Reports::default() };
        let margins = |reports: &Reports| ["a", "b", OF_CARDS[0].0].map(|part| reports.margin(part));
        reports.add("a", Ok(rows("trees")));
        assert_eq!(margins(&reports), [1.5, 1.5, 1.1], "nothing is repeated");
        reports.add("a", Ok(rows("arrays")));
        assert_eq!(margins(&reports), [2.5, 2.5, 1.1], "also of what repeats nothing, but not of another adapter");
        reports.add("a", Ok(rows("trees")));
        assert_eq!(reports.margin("a"), 2.5, "a fault's rows do not narrow it");
        let time = reports.row("a", "built", |_| true).unwrap().time("total_ms").unwrap();
        assert!((time.interval().unwrap().0[1] / 2.0 - 2.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn rows_are_swapped_by_a_value() {
        let mut reports = reports();
        reports.swap("photons", "name", ["none", "deep, 50²"]);
        assert_eq!(reports.named("photons", "rows", "none").unwrap().f64("ms"), Ok(4.0));
    }

    #[test]
    fn what_is_missing_is_named() {
        let reports = reports();
        let row = |part: &str, table: &str, name: &str| reports.named(part, table, name).err().unwrap();
        assert_eq!(row("photons", "rows", "plain"), "photons, table `rows`: no such row as `plain`");
        assert_eq!(row("photons", "means", "none"), "photons, table `means`: there is none");
        assert_eq!(row("indirect", "rows", "none"), "indirect: the image is black");
        assert_eq!(row("clustered", "rows", "none"), "clustered was not run");
        let deep = reports.named("photons", "rows", "deep, 50²").unwrap();
        assert_eq!(deep.f64("bytes"), Err("photons, table `rows`, row 2: no number `bytes`".to_owned()));
        assert!(deep.error("flip").unwrap_err().contains("16 samples"));
        let scenes = ["forward-plus", "track", "indirect"].map(|part| reports.scene_of(part));
        assert_eq!(scenes, ["demo:atrium at 4 x 3", "walk.toml at 8 x 6", "nothing (not measured)"]);
    }
}
