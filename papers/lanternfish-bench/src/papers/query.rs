//! Figures of the parts' reports, by expressions: what the claims and tables of a paper are computed from.
//!
//! A query is `{part | table | conditions | key}` or `{part | key}`: the number by its key in the first row that fulfils all conditions, which
//! stand between `&`. A condition is `last` (the last such row), a key alone (the row has it), or a key, an operator and a value: `=` equal,
//! `^` begins with, `~` contains, `!~` does not contain, `>` greater. The key `steps/2` is a number in a list or an object, `steps/*` the sum of
//! all in it. `mean{…}` is the mean over all such rows. Expressions have `+ - * /`, parentheses, and `a or b`: b where a is missing.
//!
//! The runs of a time stand in its row under its key and `_runs`; rows with `in_turn` were measured in turn, run by run.

use serde_json::Value;

use super::measure::{Measure, margin};

/// Keys of times beside those that end in `_ms` or `_rate`, or begin with `rate_`.
const TIMES: [&str; 9] = ["ms", "times", "steps", "frame", "culling", "ranges", "range_rays", "shadow_part", "saved"];

/// A figure, or why there is none.
pub type Found<T> = Result<T, String>;

/// The reports of all parts that were requested; of one that failed, its reason.
#[derive(Debug, Default)]
pub struct Reports {
    parts: Vec<(String, Found<Value>)>,
    /// Whether the adapter is a processor, whose times say nothing of a graphics card's.
    pub is_software: bool,
}

impl Reports {
    /// None yet.
    pub fn of(is_software: bool) -> Self {
        Self { is_software, parts: Vec::new() }
    }

    pub fn add(&mut self, part: &str, outcome: Found<Value>) {
        self.parts.push((part.to_owned(), outcome));
    }

    /// The report of a part.
    pub fn part(&self, name: &str) -> Found<Node<'_>> {
        let (_, outcome) =
            self.parts.iter().find(|(known, _)| known == name).ok_or_else(|| format!("{name} was not run"))?;
        let json = outcome.as_ref().map_err(|reason| format!("{name}: {reason}"))?;
        Ok(Node { place: name.to_owned(), json })
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

    /// Rows of a query, and its key.
    fn query(&self, query: &str) -> Found<(Vec<Node<'_>>, String)> {
        self.query_by(query, |condition| condition)
    }

    /// The same, with each condition as `of` makes it.
    fn query_by(&self, query: &str, of: fn(&str) -> &str) -> Found<(Vec<Node<'_>>, String)> {
        let fields: Vec<&str> = query.split('|').map(str::trim).collect();
        let (part, key) = (fields[0], fields[fields.len() - 1].to_owned());
        let part = self.part(part)?;
        let (table, conditions) = match fields.len() {
            2 => return Ok((vec![part], key)),
            3 => (fields[1], ""),
            _ => (fields[1], fields[2]),
        };
        let conditions: Vec<&str> = conditions.split('&').map(str::trim).filter(|c| !c.is_empty()).map(of).collect();
        let mut rows = part.rows(table)?;
        rows.retain(|row| conditions.iter().all(|condition| row.fulfils(condition)));
        if conditions.contains(&"last") {
            rows.drain(..rows.len().saturating_sub(1));
        }
        let missing = || format!("{}, table `{table}`: no row {}", part.place, conditions.join(" and "));
        if rows.is_empty() { Err(missing()) } else { Ok((rows, key)) }
    }

    /// Fails if the reports have not what a query reads: the table, the key, and a row of these names. Of a condition on a number only the key
    /// is asked for, because sizes differ from run to run.
    #[cfg(test)]
    pub fn is_written(&self, query: &str) -> Found<()> {
        fn without_numbers(condition: &str) -> &str {
            let key = condition.split_once(['=', '>']).filter(|(_, value)| value.parse::<f64>().is_ok());
            key.map_or(condition, |(key, _)| key)
        }
        let (rows, key) = self.query_by(query, without_numbers)?;
        let has = |row: &Node<'_>| row.f64(&key).is_ok() || !row.words(&key).is_empty();
        if rows.iter().any(has) { Ok(()) } else { Err(format!("{{{query}}}: no `{key}`")) }
    }

    /// Words of the first row of a query.
    pub fn words(&self, query: &str) -> Found<String> {
        let (rows, key) = self.query(query.trim_matches(['{', '}']))?;
        Ok(rows[0].words(&key).to_owned())
    }

    /// The value of an expression.
    pub fn value(&self, expression: &str) -> Found<f64> {
        Ok(self.measure(expression)?.value)
    }

    /// The value of an expression, with the runs of its times.
    pub fn measure(&self, expression: &str) -> Found<Measure> {
        let mut parser = Parser { reports: self, rest: expression.trim() };
        let value = parser.any()?;
        if parser.rest.is_empty() { value } else { Err(format!("{expression}: {} is left", parser.rest)) }
    }

    /// The mean of a key over rows.
    pub fn mean<'a>(&self, rows: impl IntoIterator<Item = &'a Node<'a>>, key: &str) -> Found<Measure> {
        let mut all = rows.into_iter().map(|row| row.measure(key, margin(self.is_software)));
        let first = all.next().unwrap_or_else(|| Err(format!("no rows with `{key}`")));
        let mut count = 1.0;
        let sum = all.try_fold(first?, |sum, next| {
            count += 1.0;
            Ok::<_, String>(sum.with(next?, |a, b| a + b))
        })?;
        Ok(sum.with(Measure::exact(count), |a, b| a / b))
    }
}

/// Reads an expression from left to right. The outer result is a fault of the expression, the inner one a missing figure.
struct Parser<'a> {
    reports: &'a Reports,
    rest: &'a str,
}

impl Parser<'_> {
    fn takes(&mut self, token: &str) -> bool {
        let rest = self.rest.strip_prefix(token);
        self.rest = rest.unwrap_or(self.rest).trim_start();
        rest.is_some()
    }

    fn any(&mut self) -> Found<Found<Measure>> {
        let mut value = self.sum()?;
        while self.takes("or ") {
            let other = self.sum()?;
            value = value.or(other);
        }
        Ok(value)
    }

    fn sum(&mut self) -> Found<Found<Measure>> {
        let mut value = self.product()?;
        loop {
            value = if self.takes("+ ") {
                both(value, self.product()?, |a, b| a + b)
            } else if self.takes("- ") {
                both(value, self.product()?, |a, b| a - b)
            } else {
                return Ok(value);
            }
        }
    }

    fn product(&mut self) -> Found<Found<Measure>> {
        let mut value = self.one()?;
        loop {
            value = if self.takes("* ") {
                both(value, self.one()?, |a, b| a * b)
            } else if self.takes("/ ") {
                both(value, self.one()?, |a, b| a / b)
            } else {
                return Ok(value);
            }
        }
    }

    fn one(&mut self) -> Found<Found<Measure>> {
        if self.takes("(") {
            let value = self.any()?;
            return if self.takes(")") { Ok(value) } else { Err(format!("no ) before {}", self.rest)) };
        }
        let is_mean = self.takes("mean");
        if self.takes("{") {
            let (query, rest) = self.rest.split_once('}').ok_or_else(|| format!("no }} after {}", self.rest))?;
            self.rest = rest.trim_start();
            let found = self
                .reports
                .query(query)
                .and_then(|(rows, key)| self.reports.mean(&rows[..if is_mean { rows.len() } else { 1 }], &key));
            return Ok(found);
        }
        let end = self.rest.find([' ', ')']).unwrap_or(self.rest.len());
        let number = self.rest[..end].parse().map_err(|_| format!("{}: not a number", &self.rest[..end]))?;
        self.rest = self.rest[end..].trim_start();
        Ok(Ok(Measure::exact(number)))
    }
}

fn both(a: Found<Measure>, b: Found<Measure>, of: fn(f64, f64) -> f64) -> Found<Measure> {
    Ok(a?.with(b?, of))
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
}

impl<'a> Node<'a> {
    /// A number by its key, or by keys between slashes; `*` is the sum of all.
    pub fn f64(&self, key: &str) -> Found<f64> {
        number(self.json, key).ok_or_else(|| format!("{}: no number `{key}`", self.place))
    }

    /// The same with the runs, if it is a time.
    pub fn measure(&self, key: &str, margin: f64) -> Found<Measure> {
        let value = self.f64(key)?;
        let (base, inner) = key.split_once('/').map_or((key, None), |(base, inner)| (base, Some(inner)));
        let is_time =
            base.ends_with("_ms") || base.ends_with("_rate") || base.starts_with("rate_") || TIMES.contains(&base);
        if !is_time {
            return Ok(Measure::exact(value));
        }
        let runs = self.json.get(format!("{base}_runs")).and_then(Value::as_array);
        let of_run = |run| inner.map_or_else(|| Value::as_f64(run), |inner| number(run, inner));
        let runs = runs.into_iter().flatten().filter_map(of_run).collect();
        let table = self.place.rsplit_once(", row ").map_or(&*self.place, |(table, _)| table);
        // A part of a frame is of one frame, whenever that was.
        let is_of_one = self.json.get("in_turn").is_some() || base == "shadow_part";
        let together = if is_of_one { table } else { &self.place };
        Ok(Measure::time(value, runs, margin, Some(together.to_owned())))
    }

    /// Words by their key; none where there are none.
    pub fn words(&self, key: &str) -> &'a str {
        self.json.get(key).and_then(Value::as_str).unwrap_or_default()
    }

    /// The rows of a table, or the values of a list.
    pub fn rows(&self, table: &str) -> Found<Vec<Node<'a>>> {
        let place = format!("{}, table `{table}`", self.place);
        let rows = self.json.get(table).and_then(Value::as_array).ok_or_else(|| format!("{place}: there is none"))?;
        let node = |(i, json)| Node { place: format!("{place}, row {}", i + 1), json };
        Ok(rows.iter().enumerate().map(node).collect())
    }

    fn fulfils(&self, condition: &str) -> bool {
        if condition == "last" {
            return true;
        }
        for (operator, holds) in [
            ("!~", (|words: &str, value: &str| !words.contains(value)) as fn(&str, &str) -> bool),
            ("~", |words, value| words.contains(value)),
            ("^", |words, value| words.starts_with(value)),
            (">", |number, value| number.parse::<f64>().is_ok_and(|n| value.parse().is_ok_and(|least: f64| n > least))),
            ("=", |words, value| words == value),
        ] {
            if let Some((key, value)) = condition.split_once(operator) {
                let words = self.f64(key).map_or_else(|_| self.words(key).to_owned(), |number| number.to_string());
                return holds(&words, value);
            }
        }
        self.json.pointer(&format!("/{condition}")).is_some_and(|value| !value.is_null())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn reports() -> Reports {
        let mut reports = Reports::default();
        let rows = json!([
            { "name": "none", "ms": 2, "times": { "trace": 1.5, "splat": 0.5 } },
            { "name": "deep, 50²", "ms": 4, "steps": [1, 2], "texels": 50 },
        ]);
        reports.add("photons", Ok(json!({ "runs": 3, "rows": rows })));
        reports.add("indirect", Err("the image is black".to_owned()));
        reports.add("forward-plus", Ok(json!({ "scene": "demo:atrium", "width": 4, "height": 3 })));
        reports.add("track", Ok(json!({ "source": "walk.toml", "size": [8, 6] })));
        reports
    }

    #[test]
    fn expressions_are_computed_from_rows() {
        let reports = reports();
        for (expression, expected) in [
            ("{photons | runs} * 2 + 1", 7.0),
            ("{photons | rows | name=none | ms} / {photons | rows | name^deep & texels=50 | ms}", 0.5),
            ("1 - ({photons | rows | name=none | times/trace} + 1) / 5", 0.5),
            ("{photons | rows | name=none | times/*} + {photons | rows | last | steps/*}", 5.0),
            ("mean{photons | rows | ms>1 | ms}", 3.0),
            ("mean{photons | rows | name!~deep | ms}", 2.0),
            ("{photons | rows | steps | steps/1}", 2.0),
            ("{indirect | rows | ms} or {photons | rows | name~50² | ms}", 4.0),
        ] {
            assert_eq!(reports.value(expression), Ok(expected), "{expression}");
        }
        assert_eq!(reports.words("{photons | rows | texels>49 | name}"), Ok("deep, 50²".to_owned()));
    }

    #[test]
    fn sizes_may_differ_but_names_and_keys_may_not() {
        let reports = reports();
        for query in
            ["photons | runs", "photons | rows | name^deep & texels=200 | ms", "photons | rows | times/splat>9 | name"]
        {
            assert_eq!(reports.is_written(query), Ok(()), "{query}");
        }
        for query in [
            "photons | rows | name=plain | ms",
            "photons | rows | name=none & texels=50 | ms",
            "photons | rows | distance=50 | ms",
            "photons | rows | name=none | flip",
            "photons | means | name=none | ms",
        ] {
            assert!(reports.is_written(query).is_err(), "{query}");
        }
    }

    #[test]
    fn what_is_missing_is_named() {
        let reports = reports();
        let error = |expression: &str| reports.value(expression).unwrap_err();
        assert_eq!(
            error("{photons | rows | name=plain & texels=5 | ms}"),
            "photons, table `rows`: no row name=plain and texels=5"
        );
        assert_eq!(error("2 * {photons | rows | name=none | flip}"), "photons, table `rows`, row 1: no number `flip`");
        assert_eq!(error("{photons | rows | name}"), "photons, table `rows`, row 1: no number `name`");
        assert_eq!(error("{photons | means | ms}"), "photons, table `means`: there is none");
        assert_eq!(error("{indirect | rows | ms}"), "indirect: the image is black");
        assert_eq!(error("{clustered | rows | ms} or {clustered | runs}"), "clustered was not run");
        assert!(error("2 * * 3").contains("not a number"));
        let scenes = ["forward-plus", "track", "indirect"].map(|part| reports.scene_of(part));
        assert_eq!(scenes, ["demo:atrium at 4 x 3", "walk.toml at 8 x 6", "nothing (not measured)"]);
    }
}
