//! The page from small fixed reports, without an adapter; and the parts' arguments.

use clap::Parser;
use serde_json::{Value, json};

use super::{claims::Judged, *};
use crate::Cli;

/// Number of claims of each paper: none may be lost.
const CLAIMS: [usize; 5] = [12, 10, 18, 8, 13];

fn machine() -> Machine {
    Machine { adapter: "A card".to_owned(), driver: "its driver".to_owned(), is_software: false }
}

/// Verdict of the claim that has these words.
fn verdict(judged: &[Judged], words: &str) -> &'static str {
    let found: Vec<_> = judged.iter().filter(|judged| judged.claim.what.contains(words)).collect();
    assert_eq!(found.len(), 1, "{words}: {found:?}");
    found[0].verdict.name()
}

/// Small reports of all parts, in which most claims hold, and the verdicts on claims.
fn stored() -> Value {
    serde_json::from_str(include_str!("tests.json")).unwrap()
}

/// The stored reports. Words in place of one are the reason why it is missing.
fn reports(is_software: bool) -> Reports {
    let mut reports = Reports::of(is_software);
    for (part, report) in stored()["reports"].as_object().unwrap() {
        let outcome = match report {
            Value::String(reason) => Err(reason.clone()),
            _ if part == "attenuation" => Ok(Value::from("<svg></svg>")),
            report => Ok(report.clone()),
        };
        reports.add(part, outcome);
    }
    reports
}

#[test]
fn every_claim_is_on_the_page_once_with_a_verdict() {
    assert_eq!(PAPERS.map(|paper| paper.declared().claims.len()), CLAIMS);
    let page = page::page(&PAPERS, &machine(), true, &reports(false), &[]);
    let (html, json): (String, Value) = (page.to_html(""), serde_json::from_str(&page.to_json()).unwrap());
    let rows = json["claims"].as_array().unwrap();
    assert_eq!(rows.len(), CLAIMS.iter().sum::<usize>());
    for row in rows {
        let words = |key: &str| row[key].as_str().unwrap();
        let claim = lanternfish_cli::plot::escaped(words("claim"));
        assert_eq!(html.matches(&format!(">{claim}<")).count(), 1, "{claim}");
        assert!(["confirmed", "not confirmed", "not testable here"].contains(&words("verdict")), "{row}");
        assert_eq!(row["verdict"] == "not testable here", row["reason"].is_string(), "{row}");
        assert!(words("rule").starts_with("confirmed if ") && words("source").starts_with('['), "{row}");
    }
    assert!(html.contains("<svg></svg>") && !html.contains("<script") && !html.contains("NaN"), "{html}");
    assert!(html.contains("Figures 6.2 to 6.10: not measured, because clustered-track: it took too long."), "{html}");
    assert!(html.contains("A card on its driver") && page.to_markdown().contains("## Archer 2019"));
}

#[test]
fn verdicts_follow_the_figures() {
    let (stored, reports) = (stored(), reports(false));
    for paper in PAPERS {
        let name = paper.to_possible_value().unwrap().get_name().to_owned();
        let judged = paper.declared().judged(&reports);
        let expected: Vec<(String, String)> = serde_json::from_value(stored["verdicts"][&name].clone()).unwrap();
        for (words, expected) in &expected {
            assert_eq!(verdict(&judged, words), expected, "{words}");
        }
    }
}

#[test]
fn a_software_adapter_judges_ratios_but_no_speed() {
    let reports = reports(true);
    let [archer, niessner] = [Paper::Archer, Paper::Niessner].map(|paper| paper.declared().judged(&reports));
    assert_eq!(
        (verdict(&archer, "thousand million"), verdict(&archer, "22 to 104")),
        ("not testable here", "confirmed")
    );
    let words = ["diffuse rays through images of 128²", "diffuse: images of 128²"];
    assert_eq!(words.map(|words| verdict(&niessner, words)), ["not testable here", "confirmed"]);
}

#[test]
fn rows_that_cull_by_range_too_are_not_the_thesis() {
    let mut reports = Reports::of(false);
    let row = |name: &str| json!({ "name": name, "frame_ms": 1, "rays": 1 });
    let rows = ["no optimisations", "light culling", "improved normals"].map(row);
    reports.add("forward-plus", Ok(json!({ "configurations": rows })));
    let section = Paper::Elagabani.declared().judged(&reports);
    let names = ["light culling alone", "facing alone"].map(|words| verdict(&section, words));
    assert_eq!(names, ["not confirmed", "not testable here"]);
}

#[test]
fn a_page_of_nothing_says_so_of_each_claim() {
    let mut reports = Reports::of(false);
    let mut ran = Vec::new();
    for part in &parts() {
        let outcome = Err("the device was lost".to_owned());
        ran.push(RanPart::of(
            part,
            &(Some(vec![part.name.clone()]), Ran { outcome: outcome.clone(), seconds: Some(1.5) }),
        ));
        reports.add(&part.name, outcome);
    }
    let page = page::page(&PAPERS, &machine(), false, &reports, &ran);
    let json: Value = serde_json::from_str(&page.to_json()).unwrap();
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
        for (quick, docs) in [(true, nowhere), (false, nowhere), (false, Path::new(docs))] {
            let Some(words) = part.arguments(quick, docs, folder, Some("cpu")) else {
                assert!(quick, "{}: a full run has every part", part.name);
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
    let words = track.arguments(true, nowhere, folder, None).unwrap();
    assert!(words.contains(&folder.join("atrium.toml").display().to_string()), "{words:?}");
    let mut names: Vec<_> = all.iter().map(|part| &part.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), parts().len());
    for paper in &PAPERS {
        assert!(all.iter().any(|part| part.papers.contains(paper)), "{paper:?}");
    }
}
