//! Tests that `docs/references.bib` lists every source that a comment or a page cites.

use std::{collections::BTreeSet, fs, path::Path};

use crate::command::workspace;

/// Keys such as `Elagabani2025` in `[Elagabani2025, §4.2; Harada2012]`.
fn cited(text: &str) -> impl Iterator<Item = &str> {
    let brackets = text.split('[').skip(1).filter_map(|rest| rest.split_once(']')).map(|(inside, _)| inside);
    brackets.flat_map(|inside| inside.split(';')).filter_map(|part| {
        let key = part.split(',').next()?.trim();
        let (name, year) = key.split_at_checked(key.len().checked_sub(4)?)?;
        let is_name = name.len() >= 3 && name.bytes().all(|b| b.is_ascii_alphabetic());
        let is_year = ["19", "20"].iter().any(|c| year.starts_with(c)) && year.bytes().all(|b| b.is_ascii_digit());
        (is_name && is_year).then_some(key)
    })
}

/// Collects keys cited below a folder, each with the file of one citation.
fn gather(folder: &Path, citations: &mut BTreeSet<(String, String)>) {
    for entry in fs::read_dir(folder).expect("the workspace can be read") {
        let path = entry.expect("the workspace can be read").path();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        if path.is_dir() {
            gather(&path, citations);
        } else if ["rs", "wesl", "md"].contains(&ending) {
            let text = fs::read_to_string(&path).expect("sources are UTF-8");
            citations.extend(cited(&text).map(|key| (key.to_owned(), path.display().to_string())));
        }
    }
}

#[test]
fn every_cited_source_is_listed() {
    let list = fs::read_to_string(workspace().join("docs/references.bib")).expect("the list is there");
    let entries = list.lines().filter_map(|line| line.strip_prefix('@')?.split_once('{')?.1.strip_suffix(','));
    let listed: BTreeSet<&str> = entries.collect();
    let mut citations = BTreeSet::new();
    for folder in ["crates", "papers"] {
        gather(&workspace().join(folder), &mut citations);
    }
    assert!(citations.len() > 30, "{} citations", citations.len());
    let missing: Vec<_> = citations.iter().filter(|(key, _)| !listed.contains(key.as_str())).collect();
    assert!(missing.is_empty(), "not in docs/references.bib: {missing:?}");
}

#[test]
fn citations_are_distinguished_from_other_brackets() {
    let text = "[Elagabani2025, §4.2; Harada2012] a[0] [`Culling`] [IEC 61966-2-1] [2020] [Schlick1994].";
    assert_eq!(cited(text).collect::<Vec<_>>(), ["Elagabani2025", "Harada2012", "Schlick1994"]);
}
