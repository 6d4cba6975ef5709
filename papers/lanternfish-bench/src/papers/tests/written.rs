//! Claims and tables read what the benches write: a tiny run of each bench has every table, name and key that a query asks for.

use std::{collections::BTreeSet, fs};

use clap::Parser;
use serde_json::Value;

use super::super::{PAPERS, parts::TRACK, query::Reports, special};
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

/// The queries of all papers to these parts, of those `asked`, that a run of their bench does not answer.
fn unanswered(parts: &[&str], words: &str, asked: fn(&str) -> bool) -> Vec<String> {
    let (report, mut reports) = (report(words), Reports::of(true));
    parts.iter().for_each(|part| reports.add(part, Ok(report.clone())));
    let is_of_these = |query: &String| query.split('|').next().is_some_and(|part| parts.contains(&part.trim()));
    let queries: BTreeSet<String> =
        PAPERS.iter().flat_map(|paper| paper.declared().queries()).filter(is_of_these).collect();
    assert!(queries.iter().any(|query| asked(query)));
    let mut wrong: Vec<String> =
        queries.iter().filter(|query| asked(query)).filter_map(|query| reports.is_written(query).err()).collect();
    // Other figures of the parts.
    for claim in PAPERS
        .iter()
        .flat_map(|paper| paper.declared().claims)
        .filter(|claim| !claim.special.is_empty() && asked(&claim.special))
    {
        let why = special::figure(&claim.special, &reports).err();
        wrong.extend(why.filter(|why| parts.iter().any(|part| why.starts_with(&format!("{part}, ")))));
    }
    wrong
}

fn all(_: &str) -> bool {
    true
}

#[test]
#[ignore = "full"]
fn gpu_forward_plus_writes_what_is_read() {
    let words = "forward-plus demo:cornell --lights rain:3 --range-threshold 0.5 --size 32x18";
    assert_eq!(unanswered(&["forward-plus"], words, all), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_clustered_writes_what_is_read() {
    assert_eq!(unanswered(&["clustered"], "clustered demo:cornell --quick --size 32x18", all), [""; 0]);
}

/// No expression asks for it.
#[test]
#[ignore = "full"]
fn gpu_a_track_writes_what_is_read() {
    let mut reports = Reports::of(true);
    reports.add("clustered-track", Ok(report(&format!("clustered {} --quick --frames 2 --size 32x18", TRACK.0))));
    let whys = ["steadiest", "best_size persp:4"].map(|name| special::figure(name, &reports).err());
    assert_eq!(whys, [None, Some("clustered-track: no times of several sizes".to_owned())], "the quick run has one");
}

#[test]
#[ignore = "full"]
fn gpu_deep_images_write_what_is_read() {
    let parts = ["deep-images", "deep-images-many-triangles", "crossings"];
    assert_eq!(unanswered(&parts, "deep-images demo:cornell --quick --rays 1024", all), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_indirect_light_writes_what_is_read() {
    let words = "indirect demo:cornell --quick --resolution 8,16 --size 24x18";
    assert_eq!(unanswered(&["indirect"], words, all), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_virtual_lights_write_what_is_read() {
    let parts = ["virtual-lights", "virtual-lights-many-triangles"];
    let words = "virtual-lights demo:cornell --size 24x18 --spp 2 --quick";
    assert_eq!(unanswered(&parts, words, |query| !query.contains("app. B")), [""; 0]);
}

#[test]
fn gpu_virtual_lights_of_the_thesis_write_what_is_read() {
    let words = "virtual-lights demo:cornell --size 24x18 --spp 2 --only app.";
    assert_eq!(unanswered(&["virtual-lights"], words, |query| query.contains("app. B")), [""; 0]);
}

#[test]
#[ignore = "full"]
fn gpu_photons_write_what_is_read() {
    let words = "photons demo:cornell --size 24x18 --spp 2 --only paper --only occlusion";
    assert_eq!(unanswered(&["photons"], words, all), [""; 0]);
}
