//! The times of one pass in every run and frame, and their statistics.

use serde::{Deserialize, Serialize};

use super::category::Category;
use crate::timed::Timed;

/// Times of one pass or of the host, ms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// The pass's label.
    pub name: String,
    /// The pass's category.
    pub category: Category,
    /// Milliseconds by run, then by frame; 0 if it did not run.
    pub samples: Vec<Vec<f64>>,
}

/// The time of a pass, ms a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The median over runs of the mean over frames.
    pub ms: f64,
    /// The interval of the median of all possible runs, [`Timed::interval`]. `None` for a single run.
    pub interval: Option<[f64; 2]>,
}

impl Series {
    /// A series without samples.
    pub fn new(name: &str, category: Category) -> Self {
        Self { name: name.to_owned(), category, samples: Vec::new() }
    }

    /// Adds to the pass's time in a frame of a run.
    pub fn add(&mut self, run: usize, frame: usize, frames: usize, ms: f64) {
        if self.samples.len() <= run {
            self.samples.resize(run + 1, vec![0.0; frames]);
        }
        self.samples[run][frame] += ms;
    }

    /// Appends missing runs at the end, in which the pass did not run.
    pub fn fill(&mut self, runs: usize, frames: usize) {
        self.samples.resize(runs, vec![0.0; frames]);
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.samples.first().map_or(0, Vec::len)
    }

    /// The least of all runs, by frame: the frame's time without disturbances [VanGelderen2020, §6.1.1].
    pub fn least(&self) -> Vec<f64> {
        self.by_frame(|of_runs| of_runs.least())
    }

    /// The median of all runs, by frame.
    pub fn median(&self) -> Vec<f64> {
        self.by_frame(|of_runs| of_runs.median())
    }

    /// The interval of the median, by frame.
    pub fn median_interval(&self) -> Vec<[f64; 2]> {
        self.by_frame(|of_runs| of_runs.interval())
    }

    /// Applies `of` to the times of all runs, by frame.
    fn by_frame<T>(&self, of: impl Fn(&Timed) -> T) -> Vec<T> {
        let of_runs = |frame: usize| Timed { runs: self.samples.iter().map(|run| run[frame]).collect() };
        (0..self.frames()).map(|frame| of(&of_runs(frame))).collect()
    }

    /// The time of a frame. Frames in which the pass did not run count as 0.
    pub fn estimate(&self) -> Estimate {
        let mean = |run: &Vec<f64>| run.iter().sum::<f64>() / run.len().max(1) as f64;
        let of_runs = Timed { runs: self.samples.iter().map(mean).collect() };
        Estimate { ms: of_runs.median(), interval: (self.samples.len() > 1).then(|| of_runs.interval()) }
    }

    /// The ratio of the times of `other` to these, by run: the median of the frames in which both ran.
    pub fn ratios_of(&self, other: &Self) -> Timed {
        let ratio = |(own, other): (&Vec<f64>, &Vec<f64>)| {
            let both = own.iter().zip(other).filter(|(own, other)| **own > 0.0 && **other > 0.0);
            Timed { runs: both.map(|(own, other)| other / own).collect() }.median()
        };
        Timed { runs: self.samples.iter().zip(&other.samples).map(ratio).collect() }
    }

    /// The sum of these series; `None` if there are none.
    pub fn sum(name: &str, all: &[Self]) -> Option<Self> {
        let mut sum = Self::new(name, Category::Miscellaneous);
        for series in all {
            for (run, samples) in series.samples.iter().enumerate() {
                samples.iter().enumerate().for_each(|(frame, ms)| sum.add(run, frame, samples.len(), *ms));
            }
        }
        (!sum.samples.is_empty()).then_some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(samples: &[&[f64]]) -> Series {
        Series { samples: samples.iter().map(|run| run.to_vec()).collect(), ..Series::new("a", Category::Shading) }
    }

    #[test]
    fn least_and_median_are_per_frame() {
        let series = series(&[&[3.0, 1.0], &[1.0, 8.0], &[2.0, 2.0], &[9.0, 4.0]]);
        assert_eq!(series.least(), [1.0, 1.0]);
        assert_eq!(series.median(), [2.5, 3.0]);
        assert_eq!(series.median_interval(), [[1.0, 9.0], [1.0, 8.0]]);
        assert_eq!(series.estimate(), Estimate { ms: 3.25, interval: Some([2.0, 6.5]) });
        assert_eq!(Series::sum("all", &[series.clone(), series]).unwrap().samples[0], [6.0, 2.0]);
    }

    #[test]
    fn one_run_has_no_interval_and_a_pass_may_not_run() {
        assert_eq!(series(&[&[0.0, 2.0]]).estimate(), Estimate { ms: 1.0, interval: None });
        assert_eq!(series(&[&[0.0], &[0.0]]).estimate().ms, 0.0);
        assert_eq!(Series::sum("all", &[]), None);
    }

    /// The machine becomes three times as slow, and one frame of the other is disturbed.
    #[test]
    fn ratios_are_of_pairs_of_frames() {
        let [own, other] =
            [series(&[&[1.0, 2.0, 4.0], &[3.0, 6.0, 0.0]]), series(&[&[2.0, 99.0, 8.0], &[6.0, 12.0, 1.0]])];
        assert_eq!(own.ratios_of(&other).runs, [2.0, 2.0]);
        assert_eq!(other.ratios_of(&own).median(), 0.5);
    }
}
