//! The times of one pass in every run and frame, and their statistics.

use serde::{Deserialize, Serialize};

use super::category::Category;

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

/// The expected result of another replay under equal conditions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Milliseconds per frame: the mean over frames of the geometric mean over runs.
    pub ms: f64,
    /// Interval that contains the `ms` of another replay, of as many runs, in 19 of 20 cases. `None` for a single run, which
    /// has no variance.
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
        self.by_frame(|of_runs| of_runs[0])
    }

    /// The median of all runs, by frame.
    pub fn median(&self) -> Vec<f64> {
        self.by_frame(|of_runs| {
            let last = of_runs.len() - 1;
            0.5 * (of_runs[last / 2] + of_runs[last.div_ceil(2)])
        })
    }

    /// The interval of [`median_ranks`], by frame.
    pub fn median_interval(&self) -> Vec<[f64; 2]> {
        let (low, high, _) = median_ranks(self.samples.len());
        self.by_frame(|of_runs| [of_runs[low], of_runs[high]])
    }

    /// Applies `of` to the ascending times of all runs, by frame.
    fn by_frame<T>(&self, of: impl Fn(&[f64]) -> T) -> Vec<T> {
        let column = |frame: usize| {
            let mut of_runs: Vec<f64> = self.samples.iter().map(|run| run[frame]).collect();
            of_runs.sort_by(f64::total_cmp);
            of(&of_runs)
        };
        (0..self.frames()).map(column).collect()
    }

    /// Logarithms of the frames' mean times over all these runs, and of every run's relative time: the ratio of its times to
    /// the frames' means, averaged over the middle half of all frames. Excludes frames in which the pass did not run in any of
    /// the runs.
    ///
    /// A disturbance of less than a quarter of a run's frames is not in the middle half. So a run is one robust value.
    pub fn speeds(of: &[&Self]) -> (Vec<Option<f64>>, Vec<f64>) {
        let runs: Vec<&Vec<f64>> = of.iter().flat_map(|series| &series.samples).collect();
        let frames = of.iter().map(|series| series.frames()).min().unwrap_or(0);
        let mean = |frame: usize| {
            let all_ran = runs.iter().all(|run| run[frame] > 0.0);
            all_ran.then(|| runs.iter().map(|run| run[frame].ln()).sum::<f64>() / runs.len() as f64)
        };
        let means: Vec<Option<f64>> = (0..frames).map(mean).collect();
        let speed = |run: &&Vec<f64>| {
            let mut ratios: Vec<f64> =
                means.iter().zip(run.iter()).filter_map(|(mean, ms)| Some(ms.ln() - (*mean)?)).collect();
            ratios.sort_by(f64::total_cmp);
            let middle = &ratios[ratios.len() / 4..ratios.len() - ratios.len() / 4];
            if middle.is_empty() { 0.0 } else { middle.iter().sum::<f64>() / middle.len() as f64 }
        };
        let speeds = runs.iter().map(speed).collect();
        (means, speeds)
    }

    /// The expected result of another replay. Assumes that the logarithms of the runs' relative times are normally distributed:
    /// Student's t for the difference of two means.
    pub fn estimate(&self) -> Estimate {
        let (means, speeds) = Self::speeds(&[self]);
        let frames = means.len().max(1) as f64;
        let runs = speeds.len() as f64;
        let middle = speeds.iter().sum::<f64>() / runs.max(1.0);
        // Frames in which the pass did not run count as 0.
        let ms = means.iter().flatten().map(|mean| mean.exp()).sum::<f64>() / frames * middle.exp();
        if speeds.len() < 2 {
            return Estimate { ms, interval: None };
        }
        let variance = speeds.iter().map(|speed| (speed - middle).powi(2)).sum::<f64>() / (runs - 1.0);
        let reach = student_95(speeds.len() - 1) * (2.0 * variance / runs).sqrt();
        Estimate { ms, interval: Some([-reach, reach].map(|reach| ms * reach.exp())) }
    }
}

/// Indices of two of `runs` ascending values between which the median of all possible runs lies, and the probability of that.
/// It is at least 0.95 from 6 runs on; with fewer, the interval spans all values, at the returned probability.
///
/// Each run is above the median with probability ½, whatever the distribution, so the number of runs above is binomial.
pub fn median_ranks(runs: usize) -> (usize, usize, f64) {
    let mut chances = vec![1.0];
    for _ in 0..runs {
        let below = chances.iter().chain([&0.0]);
        chances = below.zip([&0.0].into_iter().chain(&chances)).map(|(a, b)| 0.5 * (a + b)).collect();
    }
    let level = |low: usize| 1.0 - 2.0 * chances[..=low].iter().sum::<f64>();
    let low = (0..runs / 2).rev().find(|low| level(*low) >= 0.95).unwrap_or(0);
    (low, runs.saturating_sub(1 + low), if runs == 0 { 0.0 } else { level(low).max(0.0) })
}

/// Standard errors either way that contain 95 % of Student's t, by degrees of freedom. Above 30, the first terms of its
/// expansion at the normal's 1.96 [AbramowitzStegun1964, 26.7.5], accurate to four digits.
fn student_95(freedom: usize) -> f64 {
    const TABLE: [f64; 30] = [
        12.7062, 4.3027, 3.1824, 2.7764, 2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281, 2.2010, 2.1788, 2.1604,
        2.1448, 2.1314, 2.1199, 2.1098, 2.1009, 2.0930, 2.0860, 2.0796, 2.0739, 2.0687, 2.0639, 2.0595, 2.0555, 2.0518,
        2.0484, 2.0452, 2.0423,
    ];
    let z: f64 = 1.959_964;
    let n = freedom as f64;
    let expanded = || z + (z.powi(3) + z) / (4.0 * n) + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n);
    freedom.checked_sub(1).and_then(|i| TABLE.get(i).copied()).unwrap_or_else(expanded)
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
        // With four runs the interval spans all values, with probability 1 − 2/16.
        assert_eq!(series.median_interval(), [[1.0, 9.0], [1.0, 8.0]]);
        assert_eq!(median_ranks(4), (0, 3, 0.875));
    }

    #[test]
    fn median_intervals_have_the_stated_probability() {
        // From tables of the sign test.
        assert_eq!(median_ranks(6), (0, 5, 0.96875));
        assert_eq!(median_ranks(10).0, 1);
        assert!((median_ranks(10).2 - 0.978_515_625).abs() < 1e-12);
        assert_eq!((median_ranks(20).0, median_ranks(20).1), (5, 14));
        assert_eq!(median_ranks(1), (0, 0, 0.0));
        assert_eq!(median_ranks(0), (0, 0, 0.0));
    }

    #[test]
    fn slow_runs_are_distinguished_from_disturbed_frames() {
        let quiet = [1.0, 2.0, 4.0, 8.0, 4.0, 2.0, 1.0];
        let mut disturbed = quiet;
        disturbed[3] = 80.0;
        let slower = quiet.map(|ms| 1.1 * ms);
        let (_, speeds) = Series::speeds(&[&series(&[&quiet, &disturbed, &slower])]);
        assert!((speeds[0] - speeds[1]).abs() < 1e-9, "{speeds:?}");
        assert!((speeds[2] - speeds[0] - 1.1f64.ln()).abs() < 1e-9, "{speeds:?}");
    }

    #[test]
    fn frames_without_the_pass_are_excluded() {
        let estimate = series(&[&[0.0, 2.0], &[0.0, 2.0]]).estimate();
        assert!((estimate.ms - 1.0).abs() < 1e-12 && estimate.interval == Some([estimate.ms; 2]), "{estimate:?}");
        assert_eq!(series(&[&[0.0], &[0.0]]).estimate().ms, 0.0);
        assert_eq!(series(&[&[1.0]]).estimate().interval, None, "one run has no variance");
    }

    #[test]
    fn students_t_extends_beyond_its_table() {
        assert!((student_95(31) - 2.0395).abs() < 2e-4 && (student_95(120) - 1.9799).abs() < 1e-4);
        assert!(student_95(30) > student_95(31));
    }
}
