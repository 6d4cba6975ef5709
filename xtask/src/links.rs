//! Every relative link of every page leads to a file, and to a heading of it where it names one. Files that the pages
//! about the sources name exist.

use std::{fs, path::Path};

use crate::{
    command::workspace,
    files::{below, read, texts},
};

/// Pages that name files of the sources by their paths, or by the ends of these.
const OF_SOURCES: [&str; 3] = ["ARCHITECTURE.md", "CONVENTIONS.md", "CONTRIBUTING.md"];

/// Targets of the links and images of a page: what stands between `](` and `)`.
fn targets(page: &str) -> impl Iterator<Item = &str> {
    page.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target)
}

/// Paths of files that a page names in backticks: with a folder and an ending.
fn named_files(page: &str) -> impl Iterator<Item = &str> {
    let is_word = |text: &str| text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-./*".contains(&byte));
    let has_ending = |path: &str| path.rsplit_once('/').is_some_and(|(_, file)| file.contains('.'));
    page.split('`').skip(1).step_by(2).filter(move |code| is_word(code) && has_ending(code))
}

/// The anchor that Git hosts give a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

/// Whether a page has this anchor: that of a heading, or one that HTML names. Text between fences is code.
fn has_anchor(page: &str, wanted: &str) -> bool {
    let mut is_code = false;
    page.lines().any(|line| {
        is_code ^= line.trim_start().starts_with("```");
        let is_heading = line.starts_with('#') && anchor(line.trim_start_matches('#')) == wanted;
        !is_code && (is_heading || line.contains(&format!("<a id=\"{wanted}\">")))
    })
}

/// Why a link of this page leads nowhere.
fn fault(page: &Path, text: &str, target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, heading) = target.split_once('#').unwrap_or((target, ""));
    let path =
        if file.is_empty() { page.to_owned() } else { page.parent().expect("a page lies in a folder").join(file) };
    let is_page = path.extension().is_some_and(|ending| ending == "md");
    if !path.exists() {
        return Some(format!("{}: {target}", page.display()));
    }
    let other = if file.is_empty() || !is_page { text.to_owned() } else { fs::read_to_string(&path).ok()? };
    (!heading.is_empty() && is_page && !has_anchor(&other, heading))
        .then(|| format!("{}: {target}: no such heading", page.display()))
}

#[test]
fn every_link_of_every_page_leads_somewhere() {
    let (mut count, mut faults) = (0, Vec::new());
    for (page, text) in texts("", &["md"]) {
        for target in targets(&text) {
            count += 1;
            faults.extend(fault(&workspace().join(&page), &text, target));
        }
    }
    assert!(count > 100, "{count} links");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn files_that_pages_name_exist() {
    let files = below(workspace()).expect("the workspace can be read");
    for page in OF_SOURCES {
        let text = read(&workspace().join(page)).expect("the page is there");
        let is_there = |path: &str| workspace().join(path).exists() || files.iter().any(|file| file.ends_with(path));
        let missing: Vec<_> = named_files(&text).filter(|path| !is_there(path)).collect();
        assert!(missing.is_empty(), "{page} names files that do not exist: {missing:?}");
    }
    let text = "`a/b.rs` `` `a b/c.rs` `` a/d.rs\n```sh\nrun a/e.rs\n```\n`a/f/`, `g.rs` and `.h/i.toml`";
    assert_eq!(named_files(text).collect::<Vec<_>>(), ["a/b.rs", ".h/i.toml"]);
}

#[test]
fn broken_links_are_told() {
    let page = workspace().join("README.md");
    let text = "# One Thing, `two`\n```\n# code\n```\n";
    let is_broken = |target| fault(&page, text, target).is_some();
    assert_eq!(targets("[a](b.md) ![c](d.png#e)").collect::<Vec<_>>(), ["b.md", "d.png#e"]);
    assert!(!is_broken("#one-thing-two") && !is_broken("CONVENTIONS.md") && !is_broken("https://example.org/none"));
    assert!(is_broken("#code") && is_broken("none.md") && is_broken("CONVENTIONS.md#none"));
}
