//! Comparisons of rows that differ in one thing: the shape of clusters, or one grid around several views [VanGelderen2020, ch. 4, 6 and 7].

use lanternfish::light_culling::clustered::grid::GridGeometry;

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
pub const WASTE: &str = "Clusters of the box around the view's frustum that do not touch the frustum. The thesis says two thirds (§4.2), which is \
                         the volume outside of a pyramid in its box: smaller cubes come nearer to it.";

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

/// A row for each grid of cubes in one view.
pub fn waste(rows: &[Measured]) -> Vec<Row> {
    let mut wasted = Vec::new();
    let boxes = rows.iter().filter(|row| row.views == Views::Mono).flat_map(|row| Some((row, row.contents.first()?)));
    for (row, contents) in boxes.filter(|(_, contents)| contents.geometry.parallel) {
        let row = Row::default()
            .text("clusters", "clusters", &row.clusters)
            .count("all", "clusters of the grid", contents.clusters.into())
            .percent("wasted_clusters", "wasted clusters", 2, outside(&contents.geometry))
            .percent("paper_wasted", "thesis", 1, 2.0 / 3.0);
        if !wasted.contains(&row) {
            wasted.push(row);
        }
    }
    wasted
}

/// The part of a box's clusters that is outside of the frustum which it bounds. The eye is the origin, and the farthest rectangle of the
/// box is that of the frustum.
fn outside(grid: &GridGeometry) -> f64 {
    let [low, cell] = [grid.low, grid.cell].map(|v| v.as_dvec3());
    let high = low + cell * grid.dimensions.as_dvec3();
    // A frustum widens away from the eye: a cluster touches it if its farthest face does.
    let touches = |axis: usize, i: u32, far: f64| {
        let from = low[axis] + f64::from(i) * cell[axis];
        from * high.z <= high[axis] * far && (from + cell[axis]) * high.z >= low[axis] * far
    };
    let inside = (0..grid.dimensions.z).map(|layer| {
        let far = low.z + f64::from(layer + 1) * cell.z;
        let along = |axis: usize| (0..grid.dimensions[axis]).filter(|i| touches(axis, *i, far)).count() as f64;
        along(0) * along(1)
    });
    let touched: f64 = inside.sum();
    1.0 - touched / grid.cluster_count() as f64
}

#[test]
fn two_thirds_of_the_box_around_a_pyramid_are_outside() {
    use glam::{UVec3, Vec3};
    let grid = |n: u32| GridGeometry {
        low: Vec3::new(-1.0, -1.0, 0.0),
        cell: Vec3::new(2.0, 2.0, 1.0) / n as f32,
        dimensions: UVec3::splat(n),
        parallel: true,
        ..GridGeometry::default()
    };
    // Of 2 x 2 x 2 clusters all touch the pyramid; smaller ones approach its volume from below.
    let clusters = [1, 2, 8, 64, 256].map(|n| outside(&grid(n)));
    assert!(
        clusters[..2] == [0.0; 2] && clusters.is_sorted() && (clusters[4] - 2.0 / 3.0).abs() < 0.01,
        "{clusters:?}"
    );
}
