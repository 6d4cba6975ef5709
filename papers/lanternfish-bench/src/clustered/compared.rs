//! Comparisons of rows that differ in one thing: the shape of clusters, or one grid around several views [VanGelderen2020, ch. 4, 6 and 7].

use super::{
    cases::Views,
    measure::{Counts, Measured},
};
use crate::table::Row;

/// What the tables mean.
pub const SHAPES: &str = "One view; each figure over that of perspective clusters by the same assignment: below 1, the shape is better. The thesis \
                          has brute force only, and expects that orthographic clusters gain most from a tree (fig. 6.6).";
pub const GRIDS: &str = "One grid around two views over a grid each. *Unaligned*: a view and one back at it (fig. 4.7), which only orthographic \
                         clusters can enclose. The gain in time is for brute force \"and lack of acceleration structure\" (§6.3).";

/// Figures of a row over those of another; a dash where that is 0.
fn ratios(row: Row, of: &Measured, over: &Measured) -> Row {
    let counts = |counts: &Counts| [counts.visible_clusters, counts.light_tests, counts.lighting_operations];
    let names = [
        ("visible_clusters", "visible clusters"),
        ("light_tests", "light tests"),
        ("lighting_operations", "lighting operations"),
    ];
    let ratio = |a: f64, b: f64| (b > 0.0).then(|| a / b);
    let pairs = names.into_iter().zip(counts(&of.counts).into_iter().zip(counts(&over.counts)));
    let row = pairs.fold(row, |row, ((key, heading), (a, b))| row.maybe(key, heading, 2, ratio(a as f64, b as f64)));
    let times = [("culling", of.ms.culling(), over.ms.culling()), ("frame", of.ms.frame(), over.ms.frame())];
    times.into_iter().fold(row, |row, (key, a, b)| row.maybe(key, &format!("{key} time"), 2, ratio(a, b)))
}

fn named(row: &Measured) -> Row {
    let named = Row::default().text("clusters", "clusters", &row.clusters);
    named.count("lights", "lights", row.lights as u64).text("assignment", "assignment", &row.assignment)
}

/// Rows of one view over those of clusters `base`.
pub fn shapes(rows: &[Measured], base: &str) -> Vec<Row> {
    let mono = || rows.iter().filter(|row| row.views == Views::Mono);
    let of = |row: &Measured| {
        let is_base = |other: &&Measured| (other.lights, &other.assignment) == (row.lights, &row.assignment);
        Some(ratios(named(row), row, mono().filter(is_base).find(|other| other.clusters == base)?))
    };
    mono().filter(|row| row.clusters != base).filter_map(of).collect()
}

/// Rows of one grid around two views over those of a grid each.
pub fn grids<'r>(rows: impl Iterator<Item = &'r Measured> + Clone) -> Vec<Row> {
    let of = |row: &Measured| {
        let individual = row.views.individual()?;
        let is_its = |other: &&Measured| {
            (other.views, other.lights) == (individual, row.lights)
                && (&other.clusters, &other.assignment) == (&row.clusters, &row.assignment)
        };
        Some(ratios(named(row).text("views", "views", row.views), row, rows.clone().find(is_its)?))
    };
    rows.clone().filter_map(of).collect()
}
