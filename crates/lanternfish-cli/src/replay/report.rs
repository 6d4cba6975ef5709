//! The results of a replay in `report.json`: every sample of every run.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::{counted::Counted, series::Estimate, series::Series};
use crate::pass_costs::PassCost;

/// The results of a replay.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Lanternfish's version.
    pub version: String,
    /// The source: a shot, a recording or a scene.
    pub source: String,
    /// The scene's name.
    pub scene: String,
    /// The adapter's name.
    pub adapter: String,
    /// The adapter's driver.
    pub driver: String,
    /// Width of one eye's image, pixels.
    pub width: u32,
    /// Height of one eye's image, pixels.
    pub height: u32,
    /// Images per frame: 1, or 2 in stereo.
    pub eyes: usize,
    /// Lights of the scene.
    pub lights: usize,
    /// Settings by flag name.
    pub settings: BTreeMap<String, String>,
    /// Number of timed runs.
    pub runs: usize,
    /// Time of each frame, seconds; 0 if nothing moves.
    pub moments: Vec<f32>,
    /// Device times by pass, in order of execution. Empty if the adapter has no timestamps.
    pub passes: Vec<Series>,
    /// Host times: `host/update` (updating moved objects), `host/record` (recording a frame) and `host/frame` (from
    /// then until the device has finished).
    pub host: Vec<Series>,
    /// The device's clocks before each run, if a program tells them.
    pub clocks: Vec<String>,
    /// Dispatches of each pass in the last frame, in order, and mean numbers of rays.
    pub costs: Vec<PassCost>,
    /// Memory after the last frame, bytes: of the buffers and textures that frames reuse, and of everything on the
    /// device, if the API tells it.
    pub memory: Option<(u64, Option<u64>)>,
    /// Times of a frame, by the names of [`Self::passes`] and [`Self::host`], and `all passes`.
    pub estimates: BTreeMap<String, Estimate>,
    /// Counters by frame, from a run that was not timed.
    pub frames: Vec<Counted>,
}

/// Name of the sum of all passes.
pub const ALL_PASSES: &str = "all passes";

impl Report {
    /// The sum of all passes; `None` if no passes were timed.
    pub fn all_passes(&self) -> Option<Series> {
        Series::sum(ALL_PASSES, &self.passes)
    }

    /// The mean of a counter over all frames; `None` if no frame has it.
    pub fn mean_count(&self, name: &str) -> Option<u64> {
        let counts: Vec<_> = self.frames.iter().filter_map(|frame| frame.counters.get(name)).collect();
        (!counts.is_empty()).then(|| counts.iter().copied().sum::<u64>() / self.frames.len() as u64)
    }

    /// Time of the host's frame in which no pass runs, ms a frame; `None` without timestamps.
    pub fn idle_ms(&self) -> Option<f64> {
        Some(self.estimates.get("host/frame")?.ms - self.estimates.get(ALL_PASSES)?.ms)
    }

    /// Computes the estimates.
    pub fn estimate(&mut self) {
        let all = self.all_passes();
        let series = self.passes.iter().chain(&self.host).chain(&all);
        self.estimates = series.map(|series| (series.name.clone(), series.estimate())).collect();
    }

    /// The report as JSON; times are rounded to a tenth of a microsecond.
    pub fn to_json(&self) -> String {
        let mut rounded = self.clone();
        let round = |ms: &mut f64| *ms = (*ms * 1e4).round() / 1e4;
        let series = rounded.passes.iter_mut().chain(&mut rounded.host);
        series.flat_map(|series| &mut series.samples).flatten().for_each(round);
        for estimate in rounded.estimates.values_mut() {
            round(&mut estimate.ms);
            estimate.interval.iter_mut().flatten().for_each(round);
        }
        serde_json::to_string(&rounded).expect("plain numbers and strings") + "\n"
    }

    /// Times as CSV: one line per frame and pass. `ms` is the least of all runs; the median of all possible runs lies
    /// between `low` and `high`.
    pub fn passes_csv(&self) -> String {
        let mut text = "frame,pass,category,ms,median,low,high\n".to_owned();
        let series: Vec<_> = self.passes.iter().chain(&self.host).collect();
        let columns: Vec<_> = series.iter().map(|s| (s.least(), s.median(), s.median_interval())).collect();
        for frame in 0..self.moments.len() {
            for (series, (least, median, interval)) in series.iter().zip(&columns) {
                let ([low, high], category) = (interval[frame], series.category.name());
                let (name, least, median) = (&series.name, least[frame], median[frame]);
                text += &format!("{frame},{name},{category},{least:.4},{median:.4},{low:.4},{high:.4}\n");
            }
        }
        text
    }

    /// Counters as CSV: one line per frame, one column per counter; empty if a frame lacks the counter.
    pub fn counts_csv(&self) -> String {
        let names: BTreeSet<&str> =
            self.frames.iter().flat_map(|frame| frame.counters.keys().map(String::as_str)).collect();
        let of_clusters = "visible_clusters,fragments,lighting_operations";
        let mut text = format!("frame,seconds,image,{of_clusters}");
        names.iter().for_each(|name| text += &format!(",{name}"));
        for (index, (frame, moment)) in self.frames.iter().zip(&self.moments).enumerate() {
            text += &format!("\n{index},{moment},{}", frame.rendering);
            let of_clusters = frame.clusters.as_ref().map(|c| [c.visible, c.fragments, c.lighting_operations]);
            let counts = of_clusters.map_or([None; 3], |counts| counts.map(Some));
            let counts = counts.into_iter().chain(names.iter().map(|name| frame.counters.get(*name).copied()));
            counts.for_each(|count| text += &count.map_or(",".to_owned(), |count| format!(",{count}")));
        }
        text + "\n"
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::replay::{category::Category, counted::Clusters};

    /// A report of two passes, by run and frame.
    pub fn report(prepass: Vec<Vec<f64>>, shading: Vec<Vec<f64>>) -> Report {
        let (runs, frames) = (prepass.len(), prepass[0].len());
        let series = |name: &str, samples| Series { samples, ..Series::new(name, Category::of(name)) };
        let clusters = |i: u64| Clusters {
            visible: 10 + i,
            by_lights: vec![1, 0, i],
            lighting_operations: 100,
            ..Clusters::default()
        };
        let counted = |i| Counted {
            rendering: format!("{i:016x}"),
            counters: BTreeMap::from([("light_culling/light_tests".to_owned(), 7 * i)]),
            clusters: Some(clusters(i)),
        };
        let mut report = Report {
            source: "shot.toml".to_owned(),
            settings: BTreeMap::from([("culling".to_owned(), "clustered".to_owned())]),
            runs,
            moments: (0..frames).map(|i| i as f32 / 24.0).collect(),
            passes: vec![series("prepass", prepass), series("shading/forward", shading)],
            clocks: vec!["1980 MHz".to_owned()],
            costs: vec![PassCost { name: "prepass".to_owned(), dispatches: 3, indirect: 1, rays: Some(2000) }],
            memory: Some((3 << 20, Some(5 << 20))),
            frames: (0..frames as u64).map(counted).collect(),
            ..Report::default()
        };
        report.estimate();
        report
    }

    #[test]
    fn all_passes_are_added_and_times_rounded() {
        let report = report(vec![vec![1.0, 2.0], vec![1.5, 2.500_01]], vec![vec![3.0, 4.0], vec![3.0, 5.0]]);
        assert_eq!(report.all_passes().unwrap().samples, [[4.0, 6.0], [4.5, 7.500_01]]);
        assert!((report.estimates[ALL_PASSES].ms - 5.5).abs() < 1e-4, "{:?}", report.estimates);
        let json: serde_json::Value = serde_json::from_str(&report.to_json()).unwrap();
        assert_eq!(json["passes"][0]["samples"], serde_json::json!([[1.0, 2.0], [1.5, 2.5]]));
    }

    #[test]
    fn counts_are_means_and_idle_time_is_the_rest() {
        let mut report = report(vec![vec![1.0, 2.0]; 2], vec![vec![3.0, 4.0]; 2]);
        assert_eq!((report.mean_count("light_culling/light_tests"), report.mean_count("no")), (Some(3), None));
        assert_eq!(report.idle_ms(), None);
        report.host = vec![Series { samples: vec![vec![6.0, 7.0]; 2], ..Series::new("host/frame", Category::Host) }];
        report.estimate();
        assert!((report.idle_ms().unwrap() - 1.5).abs() < 1e-9, "{:?}", report.idle_ms());
    }

    #[test]
    fn tables_have_one_line_per_frame() {
        let report = report(vec![vec![1.0, 2.0], vec![1.5, 2.5]], vec![vec![3.0, 4.0], vec![3.0, 5.0]]);
        let passes = report.passes_csv();
        assert_eq!(passes.lines().count(), 1 + 2 * 2);
        assert!(passes.contains("\n1,shading/forward,shading,4.0000,4.5000,4.0000,5.0000\n"), "{passes}");
        let counts = report.counts_csv();
        assert_eq!(counts.lines().count(), 1 + 2);
        let columns: Vec<_> = counts.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(columns, [7, 7, 7], "{counts}");
        assert!(counts.ends_with("11,0,100,7\n"), "{counts}");
    }
}
