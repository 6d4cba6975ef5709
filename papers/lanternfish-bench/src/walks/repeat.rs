//! The first row of a table, measured again: do its rows compare?

use serde::Serialize;

/// The first row of a table, measured again after all others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Repeat {
    /// Name of the row.
    pub name: String,
    /// The first measurement.
    pub first: f64,
    /// The last one, in the same unit.
    pub last: f64,
    /// False if they differ by more than `MOST_APART`: clocks or other work changed during the run, and rows do not
    /// compare.
    pub is_steady: bool,
}

/// Greatest fraction by which a repeated measurement may differ from the first.
const MOST_APART: f64 = 0.05;

impl Repeat {
    /// Compares two measurements.
    pub fn new(name: String, first: f64, last: f64) -> Self {
        Self { name, first, last, is_steady: (last / first - 1.0).abs() <= MOST_APART }
    }

    /// Describes it.
    pub fn text(&self) -> String {
        let Self { name, first, last, is_steady } = self;
        let mark = if *is_steady { "" } else { " NOT STEADY: rows of this table do not compare" };
        format!("{name}: {first:.2} first, {last:.2} last, {:+.1} %{mark}", 100.0 * (last / first - 1.0))
    }
}

#[cfg(test)]
#[test]
fn a_repetition_that_is_too_far_off_is_not_steady() {
    let is_steady = |first, last| Repeat::new("row".to_owned(), first, last).is_steady;
    assert!(is_steady(100.0, 104.9) && is_steady(100.0, 95.1) && !is_steady(100.0, 105.1) && !is_steady(100.0, 94.9));
    assert!(!is_steady(0.0, 0.0) && !is_steady(100.0, f64::NAN), "no number is not steady");
}
