//! `--as PAPER`: the flags that it stands for, and a table of them.

use std::{ffi::OsString, fmt::Write as _};

use lanternfish::settings::Settings;
use lanternfish_papers::Paper;
use lanternfish_scene::Named as _;

/// The id of the flag.
pub(crate) const ID: &str = "paper";

/// Flags with those that a paper stands for before all others, which override them.
pub(crate) fn expanded(flags: Vec<(String, OsString)>) -> Vec<(String, OsString)> {
    let named = flags.iter().rev().find(|(id, _)| id == ID).map(|(_, name)| name.clone());
    let paper = named.and_then(|name| Paper::all().into_iter().find(|paper| *paper.name() == *name));
    let rows = paper.map(Paper::rows).unwrap_or_default().into_iter();
    rows.map(|row| (row.name.to_owned(), row.value.into())).chain(flags).collect()
}

/// Every setting of a paper, its value in these settings, and the section that says so.
pub(crate) fn table(paper: Paper, settings: &Settings) -> String {
    let rows = paper.rows();
    let value = |name: &str| settings.get(name).unwrap_or_else(|| "-".to_owned());
    let [names, values] = [
        rows.iter().map(|row| row.name.len()).max().unwrap_or(0),
        rows.iter().map(|row| value(row.name).len()).max().unwrap_or(0),
    ];
    let mut text = format!("as {paper}\n");
    for row in rows {
        let now = value(row.name);
        let changed = if now == row.value { String::new() } else { format!("changed; {} is ", row.value) };
        // Writing to a String cannot fail.
        writeln!(text, "{:<names$}  {now:<values$}  {changed}{}", row.name, row.source).expect("String");
    }
    text
}
