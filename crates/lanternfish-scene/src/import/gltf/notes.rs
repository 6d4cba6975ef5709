//! Warnings about ignored content, once per kind.

use std::collections::BTreeMap;

/// Counts of omitted content, by kind.
#[derive(Default)]
pub(super) struct Notes(BTreeMap<&'static str, usize>);

impl Notes {
    /// Counts one omission of `what`, a phrase in the plural.
    pub fn add(&mut self, what: &'static str) {
        *self.0.entry(what).or_default() += 1;
    }

    /// Logs one warning for each kind.
    pub fn log(&self, file: &std::path::Path) {
        for (what, count) in &self.0 {
            tracing::warn!("{}: left out: {what} ({count})", file.display());
        }
    }
}
