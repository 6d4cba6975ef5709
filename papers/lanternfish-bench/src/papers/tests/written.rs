//! A tiny run of each bench writes what the stored run has, which claims and tables read: every table, every key and every name.

use std::{collections::BTreeSet, fs};

use clap::Parser;
use serde_json::Value;

use super::{super::parts::TRACK, STORED};
use crate::Cli;

/// The report of a bench on the software adapter.
fn report(words: &str) -> Value {
    lanternfish_papers::register();
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().display().to_string();
    fs::write(folder.path().join(TRACK.0), TRACK.1).unwrap();
    let words = words.replace(TRACK.0, &format!("{output}/{}", TRACK.0));
    let words = words.split(' ').chain(["--runs", "1", "--adapter", "cpu", "-o", &output]);
    let cli = Cli::try_parse_from(["lanternfish-bench"].into_iter().chain(words)).unwrap();
    crate::run(&cli.bench).unwrap_or_else(|error| panic!("{error}"));
    serde_json::from_slice(&fs::read(folder.path().join("report.json")).unwrap()).unwrap()
}

/// Keys of the rows of a table, and the values of `name`, but for those of the exact words.
fn keys(report: &Value, table: &str) -> BTreeSet<String> {
    let rows = report[table].as_array().into_iter().flatten().filter_map(Value::as_object);
    let key = |(key, value): (&String, &Value)| if key == "name" { format!("name {value}") } else { key.clone() };
    rows.flat_map(|row| row.iter().map(key).collect::<Vec<_>>()).collect()
}

/// What of the stored reports of a part is not written by such a run.
fn unwritten(part: &str, words: &str) -> Vec<String> {
    let stored: Value = serde_json::from_slice(&fs::read(format!("{STORED}/{part}.json")).unwrap()).unwrap();
    let (stored, fresh) = (stored.as_object().unwrap(), report(words));
    let tables = stored
        .iter()
        .filter(|(key, value)| value.is_array() && !["left_out", "seconds", "promises"].contains(&key.as_str()));
    let missing = |table: &String| {
        let written = keys(&fresh, table);
        keys(&Value::Object(stored.clone()), table)
            .into_iter()
            .filter(move |key| !written.contains(key))
            .map(move |key| format!("{table}: {key}"))
            .collect::<Vec<_>>()
    };
    tables.flat_map(|(table, _)| missing(table)).collect()
}

#[test]
#[ignore = "full"]
fn gpu_forward_plus_writes_what_is_read() {
    let words = "forward-plus demo:cornell --lights rain:3 --range-threshold 0.5 --size 32x18";
    assert_eq!(unwritten("forward-plus", words), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_clustered_writes_what_is_read() {
    assert_eq!(unwritten("clustered", "clustered demo:cornell --quick --size 32x18"), [""; 0]);
    let words = format!("clustered {} --quick --counts --frames 2 --size 32x18", TRACK.0);
    assert_eq!(unwritten("clustered-track", &words), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_deep_images_write_what_is_read() {
    assert_eq!(unwritten("deep-images", "deep-images demo:cornell --quick --rays 1024"), [""; 0]);
    assert_eq!(unwritten("crossings", "deep-images demo:cornell --quick --rays 1024 --tables crossings"), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_indirect_light_writes_what_is_read() {
    assert_eq!(unwritten("indirect", "indirect demo:cornell --quick --resolution 8,16 --size 24x18"), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_virtual_lights_write_what_is_read() {
    let words = "virtual-lights demo:cornell --size 24x18 --spp 2 --only paper --only table-3";
    assert_eq!(unwritten("virtual-lights", words), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_photons_write_what_is_read() {
    let words = "photons demo:cornell --size 24x18 --spp 2 --only paper --only occlusion";
    assert_eq!(unwritten("photons", words), [""; 0]);
}
