//! Tests that `docs/references.bib` lists every source that a comment or a page cites.

use std::collections::BTreeSet;

use crate::{
    command::workspace,
    files::{read, texts},
};

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

#[test]
fn every_cited_source_is_listed() {
    let list = read(&workspace().join("docs/references.bib")).expect("the list is there");
    let entries = list.lines().filter_map(|line| line.strip_prefix('@')?.split_once('{')?.1.strip_suffix(','));
    let listed: BTreeSet<&str> = entries.collect();
    let texts = ["crates", "papers"].map(|folder| texts(folder, &["rs", "wesl", "md"])).concat();
    let citations: BTreeSet<_> =
        texts.iter().flat_map(|(file, text)| cited(text).map(move |key| (key, file))).collect();
    assert!(citations.len() > 30, "{} citations", citations.len());
    let missing: Vec<_> = citations.iter().filter(|(key, _)| !listed.contains(key)).collect();
    assert!(missing.is_empty(), "not in docs/references.bib: {missing:?}");
}

#[test]
fn citations_are_distinguished_from_other_brackets() {
    let text = "[Elagabani2025, §4.2; Harada2012] a[0] [`Culling`] [IEC 61966-2-1] [2020] [Schlick1994].";
    assert_eq!(cited(text).collect::<Vec<_>>(), ["Elagabani2025", "Harada2012", "Schlick1994"]);
}
