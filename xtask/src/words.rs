//! Words that `docs/glossary.md` has a better one for stay out of code, comments, texts and pages.

use crate::files::texts;

/// Words, or groups of words, that are not used: alone, and as a part of an identifier.
const AVOIDED: &str = "picture, pictures, surroundings, openness, yardstick, yardsticks, knob, knobs, twin, twins, \
                       ledger, anew, doubt, doubted, doubtful, asker, askers, lacks room, keep link, put back, \
                       once more, end of a ray, ends of rays, all as they were";

/// Files that name these words, or quote texts of others.
const LEFT_OUT: [&str; 4] = ["xtask/src/words.rs", "docs/glossary.md", "CHANGELOG.md", "docs/notebook/"];

/// Text as words in lower case with one space around each: `NearestBlended` and `nearest_blended` are two each.
fn words(text: &str) -> String {
    let mut words = String::from(" ");
    let mut last = ' ';
    for c in text.chars() {
        let starts = c.is_uppercase() && last.is_lowercase();
        if (starts || !c.is_alphanumeric()) && !words.ends_with(' ') {
            words.push(' ');
        }
        if c.is_alphanumeric() {
            words.extend(c.to_lowercase());
        }
        last = c;
    }
    words.push(' ');
    words
}

/// Which of the words a text has.
fn avoided(text: &str) -> impl Iterator<Item = &'static str> {
    let words = words(text);
    AVOIDED.split(", ").filter(move |avoided| words.contains(&format!(" {avoided} ")))
}

#[test]
fn words_are_those_of_the_glossary() {
    let mut found = Vec::new();
    for (name, text) in texts("", &["rs", "wesl", "md", "toml", "sh", "py"]) {
        if LEFT_OUT.iter().any(|left_out| name.starts_with(left_out)) {
            continue;
        }
        // Old names that are still understood.
        for (i, line) in text.lines().enumerate().filter(|(_, line)| !line.contains("alias = ")) {
            found.extend(avoided(line).map(|word| format!("{name}:{}: {word}", i + 1)));
        }
    }
    assert!(found.is_empty(), "{} lines, docs/glossary.md has better words:\n{}", found.len(), found.join("\n"));
}

#[test]
fn words_are_told_from_parts_of_others() {
    let of = |text: &str| avoided(text).collect::<Vec<_>>();
    assert_eq!(of("fn is_picture(twin: NearestYardstick)"), ["picture", "yardstick", "twin"]);
    assert_eq!(of("let asker = PICTURES; // found anew"), ["pictures", "anew", "asker"]);
    assert_eq!(of("twinkle, pictured, undoubted"), [""; 0]);
}
