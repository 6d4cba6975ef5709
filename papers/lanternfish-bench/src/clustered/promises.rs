//! Bounds on ratios that clustered shading is expected to keep, and the measured ratios.

use lanternfish_cli::report::grouped;
use serde::Serialize;

use super::{cases::Views, measure::Measured};

/// A bound on a ratio of counts or times, and the measured ratio of each cluster shape.
#[derive(Debug, PartialEq, Serialize)]
pub struct Promise {
    pub what: &'static str,
    /// "at most" or "at least".
    pub bound: &'static str,
    pub limit: f64,
    /// Ratios in the order of the rows, each with a label of its cluster shape and number of lights.
    pub ratios: Vec<(String, f64)>,
    /// Number of ratios within the bound.
    pub held: usize,
}

impl Promise {
    fn new(what: &'static str, bound: &'static str, limit: f64, ratios: Vec<(String, f64)>) -> Self {
        let holds = |ratio: f64| if bound == "at most" { ratio <= limit } else { ratio >= limit };
        let held = ratios.iter().filter(|(_, ratio)| holds(*ratio)).count();
        Self { what, bound, limit, ratios, held }
    }

    /// One line with the bound, and the least and greatest ratio.
    pub fn line(&self) -> String {
        let Self { what, bound, limit, ratios, held } = self;
        let by = |a: &&(String, f64), b: &&(String, f64)| a.1.total_cmp(&b.1);
        let (Some(least), Some(most)) = (ratios.iter().min_by(by), ratios.iter().max_by(by)) else {
            return format!("{what}: not measured");
        };
        let end = |(name, ratio): &(String, f64)| format!("{} ({name})", figure(*ratio));
        let range = format!("{} to {}", end(least), end(most));
        format!("{what}: {range}; {bound} {limit} in {held} of {}", ratios.len())
    }
}

fn figure(ratio: f64) -> String {
    if ratio < 10.0 { format!("{ratio:.2}") } else { format!("{ratio:.0}") }
}

/// All bounds, with ratios between rows that differ in one parameter. Ratios that need a missing row are left out.
pub fn promises(rows: &[Measured]) -> Vec<Promise> {
    let hierarchy = |row: &&Measured| row.assignment == "hierarchy";
    // `of` of each row with these views, divided by `other` of that row.
    let ratios = |views: Views, other: &dyn Fn(&Measured) -> Option<f64>, of: &dyn Fn(&Measured) -> f64| {
        let rows = rows.iter().filter(hierarchy).filter(|row| row.views == views);
        let ratio = |row: &Measured| {
            Some((format!("{}, {} lights", row.clusters, grouped(row.lights as u64)), of(row) / other(row)?))
        };
        rows.filter_map(ratio).filter(|(_, ratio)| ratio.is_finite()).collect::<Vec<_>>()
    };
    let find = |like: &Measured, views: Views, lights: usize, assignment: &str| {
        let same = |row: &&Measured| row.clusters == like.clusters && row.views == views && row.lights == lights;
        rows.iter().filter(same).find(|row| row.assignment == assignment)
    };

    let enclosed = |of: fn(&Measured) -> f64| {
        let individual = |row: &Measured| find(row, Views::StereoIndividual, row.lights, "hierarchy").map(of);
        ratios(Views::StereoEnclosed, &individual, &of)
    };
    let grown = |of: fn(&Measured) -> f64| {
        let fewer =
            |row: &Measured| (row.lights == 100_000).then(|| find(row, Views::Mono, 10_000, "hierarchy").map(of))?;
        ratios(Views::Mono, &fewer, &of)
    };
    // The number of brute-force tests is computed, as brute force may not have run.
    let tree = ratios(Views::Mono, &|row| (row.lights == 100_000).then_some(row.counts.light_tests as f64), &|row| {
        row.counts.visible_clusters as f64 * row.lights as f64
    });
    let promise = Promise::new;
    let least = |what, ratios| promise(what, "at least", 10.0, ratios);
    let stereo = |what, of| promise(what, "at most", 0.6, enclosed(of));
    let most = |what, of| promise(what, "at most", 3.0, grown(of));
    vec![
        stereo("lights listed, stereo enclosed / individual", |r| r.counts.lights_listed as f64),
        stereo("light tests, stereo enclosed / individual", |r| r.counts.light_tests as f64),
        least("light tests at 100,000 lights, brute force / hierarchy", tree),
        most("light tests, 100,000 / 10,000 lights, as many per pixel", |r| r.counts.light_tests as f64),
        most("lights listed, 100,000 / 10,000 lights", |r| r.counts.lights_listed as f64),
        most("lighting operations, 100,000 / 10,000 lights", |r| r.counts.lighting_operations as f64),
        most("culling time in ms, 100,000 / 10,000 lights", |r| r.ms.culling()),
        most("frame time in ms, 100,000 / 10,000 lights", |r| r.ms.frame()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clustered::{measure::Counts, steps::Steps};

    fn row(views: Views, lights: usize, assignment: &str, listed: u64, tests: u64) -> Measured {
        Measured {
            clusters: "persp:32".to_owned(),
            lights,
            views,
            assignment: assignment.to_owned(),
            counts: Counts {
                visible_clusters: 50,
                lights_listed: listed,
                light_tests: tests,
                lighting_operations: 1,
                ..Counts::default()
            },
            ms: Steps([1.0; 8]),
            differing_pixels: 0,
            contents: Vec::new(),
        }
    }

    #[test]
    fn ratios_are_between_rows_that_differ_in_one_parameter() {
        let rows = [
            row(Views::Mono, 10_000, "hierarchy", 100, 1_000),
            row(Views::Mono, 100_000, "hierarchy", 400, 2_500),
            row(Views::Mono, 100_000, "brute_force", 400, 5_000_000),
            row(Views::StereoIndividual, 10_000, "hierarchy", 200, 2_000),
            row(Views::StereoEnclosed, 10_000, "hierarchy", 110, 1_300),
        ];
        let actual = promises(&rows);
        let first = |i: usize| actual[i].ratios.iter().map(|(_, ratio)| *ratio).collect::<Vec<_>>();
        assert_eq!((first(0), first(1)), (vec![0.55], vec![0.65]));
        assert_eq!((actual[0].held, actual[1].held), (1, 0));
        assert_eq!((first(2), actual[2].held), (vec![2000.0], 1));
        assert_eq!((first(3), first(4), actual[4].held), (vec![2.5], vec![4.0], 0));
        assert_eq!(
            actual[1].line(),
            "light tests, stereo enclosed / individual: 0.65 (persp:32, 10,000 lights) to 0.65 (persp:32, 10,000 lights); at most \
             0.6 in 0 of 1"
        );
        assert!(promises(&[])[0].line().ends_with("not measured"));
    }
}
