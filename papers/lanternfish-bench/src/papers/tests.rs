//! The page and its claims, on rows that the benches write; and the parts' arguments.

mod written;

use std::path::Path;

use clap::Parser;
use serde_json::{Value, json};

use super::{claims::Verdict, *};
use crate::{Cli, table::to_json};

/// Number of claims of each paper: none may be lost.
const CLAIMS: [usize; 5] = [17, 13, 22, 11, 21];

fn machine() -> Machine {
    Machine { adapter: "A card".to_owned(), driver: "its driver".to_owned(), is_software: false }
}

#[test]
fn every_claim_is_on_the_page_once_with_a_verdict() {
    assert_eq!(PAPERS.map(|paper| paper.declared().claims.len()), CLAIMS);
    let mut reports = Reports::default();
    reports.add("attenuation", Ok(Value::from("<svg></svg>")));
    reports.add("clustered-track", Err("it took too long".to_owned()));
    let page = page::page(&PAPERS, &machine(), Form::Quick, &reports, &[]);
    let (html, json): (String, Value) = (page.to_html(), serde_json::from_str(&to_json(&page)).unwrap());
    let rows = json["claims"].as_array().unwrap();
    assert_eq!(rows.len(), CLAIMS.iter().sum::<usize>());
    for row in rows {
        let words = |key: &str| row[key].as_str().unwrap();
        let claim = lanternfish_cli::plot::escaped(words("claim"));
        assert_eq!(html.matches(&format!(">{claim}<")).count(), 1, "{claim}");
        assert!(Verdict::NAMES.iter().any(|(_, name)| *name == words("verdict")), "{row}");
        assert_eq!(row["verdict"] == "not testable here", row["reason"].is_string(), "{row}");
        assert!(words("rule").starts_with("confirmed if ") && words("source").starts_with('['), "{row}");
    }
    assert!(html.contains("<svg></svg>") && !html.contains("<script") && !html.contains("NaN"), "{html}");
    assert!(html.contains("Figures 6.2 to 6.10: not measured, because clustered-track: it took too long."), "{html}");
    assert!(html.contains("A card on its driver") && page.to_markdown().contains("## Archer 2019"));
}

#[test]
fn a_page_of_nothing_says_so_of_each_claim() {
    let mut reports = Reports::of(false);
    let mut ran = Vec::new();
    for part in &parts() {
        let outcome = Err("the device was lost".to_owned());
        ran.push(RanPart::of(
            part,
            &(Some(vec![part.name.clone()]), Ran { seconds: Some(1.5), ..Ran::left_out("the device was lost") }),
        ));
        reports.add(&part.name, outcome);
    }
    let page = page::page(&PAPERS, &machine(), Form::Full, &reports, &ran);
    let json: Value = serde_json::from_str(&to_json(&page)).unwrap();
    for row in json["claims"].as_array().unwrap() {
        assert_eq!(
            (&row["ours"], &row["value"], &row["verdict"]),
            (&json!("not measured"), &Value::Null, &json!("not testable here"))
        );
        assert!(row["reason"].as_str().unwrap().starts_with("not measured, because "), "{row}");
    }
    assert_eq!(json["parts"].as_array().unwrap().len(), parts().len());
    assert!(page.to_markdown().contains("not measured, because the device was lost"));
}

#[test]
fn every_part_is_a_command_in_both_forms() {
    let (nowhere, folder) = (Path::new("nowhere"), Path::new("out/part"));
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
    for part in &parts() {
        for (form, docs) in
            [(Form::Quick, nowhere), (Form::Card, nowhere), (Form::Full, nowhere), (Form::Full, Path::new(docs))]
        {
            let Some(words) = part.arguments(form, docs, folder, Some("cpu")) else {
                assert!(form != Form::Full, "{}: a full run has every part", part.name);
                continue;
            };
            let program = std::iter::once("lanternfish-bench".to_owned());
            let parsed = Cli::try_parse_from(program.chain(words.clone()));
            assert!(parsed.is_ok(), "{words:?}: {}", parsed.err().unwrap());
            assert!(words.iter().any(|word| word.starts_with("out/part")), "{words:?}");
        }
    }
    let all = parts();
    let track = all.iter().find(|part| part.name == "clustered-track").unwrap();
    let words = track.arguments(Form::Quick, nowhere, folder, None).unwrap();
    assert!(words.contains(&folder.join("atrium.toml").display().to_string()), "{words:?}");
    let mut names: Vec<_> = all.iter().map(|part| &part.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), parts().len());
    let of_card: f64 = all.iter().filter_map(|part| part.card_seconds).sum();
    assert!((480.0..=540.0).contains(&of_card), "{of_card} s are not nine minutes");
    for paper in &PAPERS {
        assert!(all.iter().any(|part| part.papers.contains(paper)), "{paper:?}");
    }
}
