//! What the parts measured: figures by part, table, row and key, with an error that names the one that is missing.

use serde_json::Value;

/// A figure, or why there is none.
pub type Found<T> = Result<T, String>;

/// The reports of all parts that were requested; of one that failed, its reason.
#[derive(Debug, Default)]
pub struct Reports {
    parts: Vec<(&'static str, Found<Value>)>,
    /// Whether the adapter is a processor, whose times say nothing of a graphics card's.
    pub is_software: bool,
}

impl Reports {
    /// None yet.
    pub fn of(is_software: bool) -> Self {
        Self { is_software, parts: Vec::new() }
    }

    pub fn add(&mut self, part: &'static str, outcome: Found<Value>) {
        self.parts.push((part, outcome));
    }

    /// The report of a part.
    pub fn part(&self, name: &str) -> Found<Node<'_>> {
        let (_, outcome) =
            self.parts.iter().find(|(known, _)| *known == name).ok_or_else(|| format!("{name} was not run"))?;
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
}

/// A report, or a row of one of its tables.
#[derive(Clone, Debug)]
pub struct Node<'a> {
    /// Where it stands, for errors.
    place: String,
    pub json: &'a Value,
}

impl<'a> Node<'a> {
    /// A number by its key, or by keys between slashes.
    pub fn f64(&self, key: &str) -> Found<f64> {
        let value = self.json.pointer(&format!("/{key}")).and_then(Value::as_f64);
        value.ok_or_else(|| format!("{}: no number `{key}`", self.place))
    }

    /// Words by their key; none where there are none.
    pub fn words(&self, key: &str) -> &'a str {
        self.json.get(key).and_then(Value::as_str).unwrap_or_default()
    }

    /// Whether a number by its key is this.
    pub fn is(&self, key: &str, number: u32) -> bool {
        self.f64(key) == Ok(number.into())
    }

    /// The rows of a table, or the values of a list.
    pub fn rows(&self, table: &str) -> Found<Vec<Node<'a>>> {
        let place = format!("{}, table `{table}`", self.place);
        let rows = self.json.get(table).and_then(Value::as_array).ok_or_else(|| format!("{place}: there is none"))?;
        let node = |(i, json)| Node { place: format!("{place}, row {}", i + 1), json };
        Ok(rows.iter().enumerate().map(node).collect())
    }

    /// The first row of a table that is the one wanted. `what` names it where it is missing.
    pub fn find(&self, table: &str, what: &str, is: impl Fn(&Node<'_>) -> bool) -> Found<Node<'a>> {
        let row = self.rows(table)?.into_iter().find(is);
        row.ok_or_else(|| format!("{}, table `{table}`: no row {what}", self.place))
    }

    /// The row of this name.
    pub fn row(&self, table: &str, name: &str) -> Found<Node<'a>> {
        self.find(table, name, |row| row.words("name") == name)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn figures_are_found_and_what_is_missing_is_named() {
        let mut reports = Reports::default();
        reports.add("photons", Ok(json!({ "rows": [{ "name": "none", "ms": 2, "times": { "trace": 1.5 } }] })));
        reports.add("indirect", Err("the image is black".to_owned()));
        let shown = json!({ "scene": "demo:atrium", "width": 4, "height": 3 });
        reports.add("forward-plus", Ok(shown));
        reports.add("track", Ok(json!({ "source": "walk.toml", "size": [8, 6] })));
        let part = reports.part("photons").unwrap();
        let row = part.row("rows", "none").unwrap();
        assert_eq!((row.f64("ms"), row.f64("times/trace"), row.words("name")), (Ok(2.0), Ok(1.5), "none"));
        assert!(row.is("ms", 2) && !row.is("ms", 3) && !row.is("rays", 3));
        let scenes = ["forward-plus", "track", "indirect"].map(|part| reports.scene_of(part));
        assert_eq!(scenes, ["demo:atrium at 4 x 3", "walk.toml at 8 x 6", "nothing (not measured)"]);
        let error = |found: Found<Node<'_>>| found.map(|_| ()).unwrap_err();
        assert_eq!(error(part.row("rows", "deep")), "photons, table `rows`: no row deep");
        assert_eq!(row.f64("flip").unwrap_err(), "photons, table `rows`, row 1: no number `flip`");
        assert_eq!(row.f64("name").unwrap_err(), "photons, table `rows`, row 1: no number `name`");
        assert_eq!(part.rows("means").unwrap_err(), "photons, table `means`: there is none");
        assert_eq!(error(reports.part("indirect")), "indirect: the image is black");
        assert_eq!(error(reports.part("clustered")), "clustered was not run");
    }
}
