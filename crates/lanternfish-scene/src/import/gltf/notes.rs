//! Warnings about ignored content, once per kind.

use std::collections::BTreeMap;

/// Damaged images that are named; further ones are counted.
const MOST_NAMED: usize = 5;

/// Counts of omitted content, by kind.
#[derive(Default)]
pub(super) struct Notes {
    counts: BTreeMap<&'static str, usize>,
    /// Images without pixels, and why.
    images: Vec<String>,
}

impl Notes {
    /// Counts one omission of `what`, a phrase in the plural.
    pub fn add(&mut self, what: &'static str) {
        *self.counts.entry(what).or_default() += 1;
    }

    /// Notes an image that is missing or damaged.
    pub fn add_image(&mut self, what: String) {
        self.images.push(what);
    }

    /// Logs one warning for each kind.
    pub fn log(&self, file: &std::path::Path) {
        for image in self.images.iter().take(MOST_NAMED) {
            tracing::warn!("{}: surfaces lack a texture: {image}", file.display());
        }
        if let Some(more @ 1..) = self.images.len().checked_sub(MOST_NAMED) {
            tracing::warn!("{}: surfaces lack textures: {more} further images", file.display());
        }
        for (what, count) in &self.counts {
            tracing::warn!("{}: left out: {what} ({count})", file.display());
        }
    }
}
