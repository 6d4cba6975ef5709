//! The page and its claims, on rows that the benches write; and the parts' arguments.

mod written;

use std::{collections::BTreeMap, fs, path::Path};

use clap::Parser;
use serde_json::{Value, json};

use lanternfish::settings::Settings;

use super::{
    claims::Verdict,
    faults::{Fault, How},
    rows::OF_CARDS,
    *,
};
use crate::{Cli, table::to_json};

/// Number of claims of each paper: none may be lost.
const CLAIMS: [usize; 5] = [15, 11, 22, 7, 20];
const STORED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/measured/papers-quick");

fn machine() -> Machine {
    Machine { adapter: "A card".to_owned(), driver: "its driver".to_owned(), is_software: false }
}

#[test]
fn every_claim_is_on_the_page_once_with_a_verdict() {
    assert_eq!(PAPERS.map(|paper| paper.claims().len()), CLAIMS);
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
    let mut reports = Reports::default();
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

#[test]
fn every_claim_that_can_be_confirmed_names_a_fault() {
    let all = || PAPERS.into_iter().flat_map(Paper::claims);
    let without: Vec<String> =
        all().filter(|claim| claim.can_be_confirmed() && claim.fault.is_none()).map(|claim| claim.what).collect();
    assert_eq!(without, [""; 0]);
    lanternfish_papers::register();
    let (parts, mut known) = (parts(), BTreeMap::<&str, Fault>::new());
    for (claim, fault) in faults::all() {
        assert_eq!(*known.entry(fault.name).or_insert(fault), fault, "{}: two faults of one name", claim.what);
        let part = parts.iter().find(|part| part.name == fault.part);
        let is_stored = matches!(fault.how, How::Swapped(..)) && OF_CARDS.iter().any(|(name, _)| *name == fault.part);
        assert!(part.is_some() || is_stored, "{fault:?}");
        let Some(words) = part.and_then(|part| part.arguments(Form::Quick, Path::new("docs"), Path::new("out"), None))
        else {
            continue;
        };
        let Some(words) = fault.arguments(words) else { continue };
        let parsed = Cli::try_parse_from(std::iter::once("lanternfish-bench".to_owned()).chain(words.clone()));
        assert!(parsed.is_ok(), "{words:?}: {}", parsed.err().unwrap());
        if let How::Made(_, changes) = fault.how {
            let is_setting = |change: &str| {
                let (name, value) = change.split_once(' ').unwrap_or_default();
                Settings::parameters().iter().any(|known| known.info.name == name && known.read(value).is_ok())
            };
            assert!(changes.split(", ").all(is_setting), "{changes}");
        }
    }
}

/// On the rows of the stored run and of its faults.
#[test]
fn every_confirmed_claim_was_lost_once() {
    let stored = || runner::stored(Path::new(STORED)).unwrap().0;
    let (reports, mut lost) = (stored(), 0);
    for claim in PAPERS.into_iter().flat_map(Paper::claims) {
        if !matches!(claim.judged(&reports).verdict, Verdict::Confirmed(_)) {
            continue;
        }
        let (fault, mut with_fault) = (claim.fault.unwrap(), stored());
        match fault.how {
            How::Swapped(key, values) => with_fault.swap(fault.part, key, values),
            _ => {
                let file = format!("{STORED}/faults/{}.json", fault.name);
                let rows = fs::read(&file).unwrap_or_else(|error| panic!("{}: {file}: {error}", claim.what));
                with_fault.add(fault.part, Ok(serde_json::from_slice(&rows).unwrap()));
            }
        }
        let judged = claim.judged(&with_fault);
        assert!(
            !matches!(judged.verdict, Verdict::Confirmed(_)),
            "{}: {} with {}",
            claim.what,
            judged.ours,
            fault.name
        );
        assert!(!judged.ours.starts_with("not measured"), "{}: {}", claim.what, judged.words());
        lost += 1;
    }
    assert!(lost > 10, "{lost}");
}

/// `papers --from` makes the stored page.
#[test]
fn the_stored_page_is_that_of_its_parts() {
    let (reports, machine, ran) = runner::stored(Path::new(STORED)).unwrap();
    let page = page::page(&PAPERS, &machine, Form::Quick, &reports, &ran);
    let stored: Value = serde_json::from_slice(&fs::read(Path::new(STORED).with_extension("json")).unwrap()).unwrap();
    let made: Value = serde_json::from_str(&to_json(&page)).unwrap();
    for (key, rows) in stored.as_object().unwrap() {
        assert_eq!(*rows, made[key], "{key}: lanternfish-bench papers --quick --from docs/measured/papers-quick");
    }
}
