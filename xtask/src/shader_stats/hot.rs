//! The passes that take most of a frame's time, in the variants of usual settings: `cargo xtask check` compares them.

use std::sync::LazyLock;

/// The passes of `hot.txt`, by light path. All trace through the BVH, which every card can; a card with ray queries has them compiled
/// by hardware.
pub static HOT: LazyLock<Vec<Hot>> = LazyLock::new(|| include_str!("hot.txt").lines().map(Hot::read).collect());

/// One entry point of one variant.
#[derive(Clone, Copy, Debug)]
pub struct Hot {
    /// The pass's label in reports, and what tells this variant from others. It stays when features change.
    pub name: &'static str,
    /// The shader's file.
    pub file: &'static str,
    pub entry: &'static str,
    /// Separated by spaces.
    pub features: &'static str,
}

impl Hot {
    /// Reads `NAME = FILE ENTRY FEATURE…`.
    fn read(line: &'static str) -> Self {
        let (name, variant) = line.split_once(" = ").unwrap_or_else(|| panic!("hot.txt has no NAME = FILE: {line}"));
        let mut words = variant.splitn(3, ' ');
        let mut next = || words.next().unwrap_or_default();
        Self { name, file: next(), entry: next(), features: next() }
    }

    /// The file and its sorted features.
    pub fn shader(&self) -> String {
        let mut features: Vec<_> = self.features.split_whitespace().collect();
        features.sort();
        features.iter().fold(self.file.to_owned(), |name, feature| format!("{name}+{feature}"))
    }
}
