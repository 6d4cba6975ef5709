//! Deliberate faults: a run of a part that is made wrongly, with which claims must lose their verdict.

use lanternfish_cli::{
    error::CliError,
    output::{print, write_text},
};

use super::{
    PAPERS, Paper, PapersArgs,
    claims::{Claim, Verdict},
    parts::parts,
    rows::Reports,
    runner,
};
use crate::table::{Row, to_json, to_markdown};

/// A fault by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    pub name: &'static str,
    /// The part that is run with it, or the stored report in which rows are swapped.
    pub part: &'static str,
    pub how: How,
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// Rows whose names contain these words are made with other settings, as `--fault` takes both.
    Made(&'static str, &'static str),
    /// The rows with two values of a key are exchanged, as if the wrong ones were measured.
    Swapped(&'static str, [&'static str; 2]),
}

impl Fault {
    /// Rows whose names contain `row` are made with `changes` of settings.
    pub const fn made(name: &'static str, part: &'static str, row: &'static str, changes: &'static str) -> Self {
        Self { name, part, how: How::Made(row, changes) }
    }

    pub const fn swapped(name: &'static str, part: &'static str, key: &'static str, values: [&'static str; 2]) -> Self {
        Self { name, part, how: How::Swapped(key, values) }
    }

    /// The part's arguments with the fault; none where rows are swapped.
    pub fn arguments(self, mut arguments: Vec<String>) -> Option<Vec<String>> {
        let How::Made(row, changes) = self.how else { return None };
        // Of the tables of deep images the one with the row is enough.
        let table = arguments.iter().position(|word| word == "--tables").filter(|_| row.contains(": "));
        if let (Some(i), Some((group, _))) = (table, row.split_once(": ")) {
            arguments[i + 1] = group.to_lowercase();
        }
        arguments.extend(["--fault".to_owned(), format!("{row} = {changes}")]);
        // Pairs are timed several times all the same.
        if let Some(i) = arguments.iter().position(|word| word == "--runs") {
            arguments[i + 1] = "1".to_owned();
        }
        Some(arguments)
    }
}

/// Each claim that names a fault, with it.
pub fn all() -> impl Iterator<Item = (Claim, Fault)> {
    PAPERS
        .into_iter()
        .flat_map(Paper::claims)
        .filter_map(|claim| Some((claim.fault?, claim)))
        .map(|(fault, claim)| (claim, fault))
}

/// Runs the part of a fault with it, and judges its claims beside the stored run. What they read stands in NAME.json.
pub fn repeat(args: &PapersArgs, name: &str) -> Result<(), CliError> {
    let (mut reports, ..) = runner::stored(&args.stored())?;
    let claims: Vec<(Claim, Fault)> = all().filter(|(_, fault)| fault.name == name).collect();
    let fault = claims[0].1;
    let judged = |reports: &Reports| -> Vec<(String, String, Verdict)> {
        let judged = claims.iter().map(|(claim, _)| claim.judged(reports));
        judged.map(|judged| (judged.ours.clone(), judged.words(), judged.verdict)).collect()
    };
    let before = judged(&reports);
    match fault.how {
        How::Swapped(key, values) => reports.swap(fault.part, key, values),
        _ => {
            let part = parts().into_iter().find(|part| part.name == fault.part).expect("a test finds it");
            let folder = args.output.join("faults").join(name);
            let arguments = part.arguments(args.form(), &args.docs, &folder, args.adapter.as_deref());
            let arguments = arguments.and_then(|arguments| fault.arguments(arguments));
            let Some(words) = arguments else {
                return Err(CliError::new(
                    format_args!("{name}: {} is left out of this run", part.name),
                    "leave out --quick",
                ));
            };
            eprintln!("{name}: lanternfish-bench {}", words.join(" "));
            let with = runner::made_with(&words, "", &args.commit());
            let ran = match runner::kept(&part, &folder, &with).filter(|_| args.resume) {
                Some(ran) => ran,
                None => runner::run(&part, &words, &folder, &with, None)?,
            };
            reports.add(fault.part, ran.outcome);
        }
    }
    reports.forget();
    let after = judged(&reports);
    write_text(&args.output.join(format!("{name}.json")), &to_json(&reports.read_of(fault.part)))?;
    let rows = claims.iter().zip(before.iter().zip(&after)).map(|((claim, _), (before, after))| {
        let row = Row::default().text("claim", "claim", &claim.what).text("stored", "stored", &before.0);
        let row = row.text("verdict", "verdict", &before.1).text("ours", "with the fault", &after.0);
        row.text("with_fault", "verdict", &after.1)
    });
    print(&to_markdown(&rows.collect::<Vec<_>>()))?;
    let is_kept = claims.iter().zip(&after).find(|(_, (.., verdict))| matches!(verdict, Verdict::Confirmed(_)));
    match is_kept {
        Some(((claim, _), _)) => {
            Err(CliError::new(format_args!("{}: still confirmed", claim.what), "mend its rule, or the fault"))
        }
        None => Ok(()),
    }
}

#[test]
fn faults_change_arguments() {
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let changed = |fault: Fault| fault.arguments(words("bench --size 8x8 --runs 7"));
    let made = changed(Fault::made("a", "bench", "deep", "deep-sort selection")).unwrap();
    assert_eq!(made[5..], ["--fault", "deep = deep-sort selection"]);
    assert_eq!(changed(Fault::swapped("a", "bench", "name", ["b", "c"])), None);
}
