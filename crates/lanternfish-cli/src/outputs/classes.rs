//! `--classes`: semantic classes by the names of instances.

use std::{collections::BTreeMap, path::Path};

use lanternfish_scene::read_text;

use crate::error::CliError;

/// Classes by patterns of names.
#[derive(Debug, Default)]
pub struct Classes(BTreeMap<String, u32>);

impl Classes {
    /// Reads a JSON object of patterns and classes.
    pub fn read(path: &Path) -> Result<Self, CliError> {
        let failed = |error: &dyn std::fmt::Display| {
            let hint = r#"write an object of patterns and whole numbers from 0 on, e.g. {"chair*": 3, "floor": 1}"#;
            CliError::new(format_args!("{}: {error}", path.display()), hint)
        };
        let text = read_text(path).map_err(|error| failed(&error))?;
        serde_json::from_str(&text).map(Self).map_err(|error| failed(&error))
    }

    /// The class of the longest pattern that matches a name.
    pub fn of(&self, name: &str) -> Option<u32> {
        let matching = self.0.iter().filter(|(pattern, _)| matches(pattern.as_bytes(), name.as_bytes()));
        matching.max_by_key(|(pattern, _)| pattern.len()).map(|(_, class)| *class)
    }
}

/// True if a name has the form of a pattern, in which `*` stands for any text.
fn matches(pattern: &[u8], name: &[u8]) -> bool {
    match pattern.split_first() {
        None => name.is_empty(),
        Some((b'*', rest)) => (0..=name.len()).any(|skipped| matches(rest, &name[skipped..])),
        Some((letter, rest)) => name.split_first().is_some_and(|(first, name)| first == letter && matches(rest, name)),
    }
}

#[cfg(test)]
#[test]
fn the_longest_matching_pattern_counts() {
    let classes = [("*", 9), ("chair*", 3), ("chair*leg", 4), ("floor", 1), ("*a*b*", 5)];
    let classes = Classes(classes.map(|(pattern, class)| (pattern.to_owned(), class)).into());
    for (name, class) in [
        ("chair", 3),
        ("chair.001", 3),
        ("chair leg", 4),
        ("floor", 1),
        ("floor2", 9),
        ("", 9),
        ("xaxxbx", 5),
        ("xbxax", 9),
    ] {
        assert_eq!(classes.of(name), Some(class), "{name}");
    }
    assert_eq!(Classes::default().of("chair"), None);
    assert!(!matches(b"ab*ba", b"aba") && matches(b"ab*ba", b"abba"));
}
