//! The clock of commands and benches: repeated runs after a warm-up, and their statistics.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

/// The figure of each of several equal runs: a time, a rate, or the ratio of a pair of times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Timed {
    /// In the order of the runs, without a warm-up.
    pub runs: Vec<f64>,
}

impl Timed {
    /// At most `most` runs, of which none but the first begins after this time.
    pub fn within<E>(most: u32, time: Duration, mut run: impl FnMut() -> Result<f64, E>) -> Result<Self, E> {
        let (started, mut runs) = (Instant::now(), Vec::new());
        while runs.is_empty() || (runs.len() < most as usize && started.elapsed() < time) {
            runs.push(run()?);
        }
        Ok(Self { runs })
    }

    /// Several figures of each of `count` runs.
    pub fn each<const N: usize, E>(count: u32, mut run: impl FnMut() -> Result<[f64; N], E>) -> Result<[Self; N], E> {
        let mut each = [const { Self { runs: Vec::new() } }; N];
        for _ in 0..count {
            each.iter_mut().zip(run()?).for_each(|(timed, figure)| timed.runs.push(figure));
        }
        Ok(each)
    }

    /// Of `count` runs and at least one, which give a time and a result, the times and the result of the fastest.
    pub fn fastest<T, E>(count: u32, mut run: impl FnMut() -> Result<(f64, T), E>) -> Result<(Self, T), E> {
        let (mut least, mut best) = run()?;
        let mut runs = vec![least];
        for _ in 1..count {
            let (ms, next) = run()?;
            runs.push(ms);
            if ms < least {
                (least, best) = (ms, next);
            }
        }
        Ok((Self { runs }, best))
    }

    /// The least figure; 0 without runs.
    pub fn least(&self) -> f64 {
        self.ascending().first().copied().unwrap_or(0.0)
    }

    /// The greatest figure; 0 without runs.
    pub fn most(&self) -> f64 {
        self.ascending().last().copied().unwrap_or(0.0)
    }

    /// The middle figure, or the mean of the two middle ones; 0 without runs.
    pub fn median(&self) -> f64 {
        let sorted = self.ascending();
        let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
        0.5 * (sorted[last / 2] + sorted[last.div_ceil(2)])
    }

    /// The figures between which the median of all possible runs lies with the probability of [`median_ranks`].
    pub fn interval(&self) -> [f64; 2] {
        let (low, high, _) = median_ranks(self.runs.len());
        let sorted = self.ascending();
        [low, high].map(|rank| sorted.get(rank).copied().unwrap_or(0.0))
    }

    fn ascending(&self) -> Vec<f64> {
        let mut sorted = self.runs.clone();
        sorted.sort_by(f64::total_cmp);
        sorted
    }
}

/// Indices of two of `runs` ascending values between which the median of all possible runs lies, and the probability of
/// that. It is at least 0.95 from 6 runs on; with fewer, the interval spans all values, at the returned probability.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(runs: &[f64]) -> Timed {
        Timed { runs: runs.to_vec() }
    }

    #[test]
    fn figures_are_those_of_the_ascending_runs() {
        let of = |runs: &[f64]| [timed(runs).least(), timed(runs).median(), timed(runs).most()];
        assert_eq!(of(&[3.0, 1.0, 2.0]), [1.0, 2.0, 3.0]);
        assert_eq!(of(&[3.0, 1.0, 2.0, 9.0]), [1.0, 2.5, 9.0]);
        assert_eq!((of(&[]), timed(&[]).interval()), ([0.0; 3], [0.0; 2]));
        // With four runs the interval spans all values, with probability 1 − 2/16.
        assert_eq!((timed(&[2.0, 4.0, 1.0, 3.0]).interval(), median_ranks(4)), ([1.0, 4.0], (0, 3, 0.875)));
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
    fn every_run_is_kept_and_the_fastest_gives_the_result() {
        let mut times = [4.0, 2.0, 3.0].into_iter().zip(["a", "b", "c"]);
        let fastest = Timed::fastest(3, || times.next().ok_or("more than three"));
        assert_eq!(fastest, Ok((timed(&[4.0, 2.0, 3.0]), "b")));
        let mut count = 0.0;
        let mut next = || {
            count += 1.0;
            Ok::<_, ()>(count)
        };
        assert_eq!(Timed::within(5, Duration::ZERO, &mut next), Ok(timed(&[1.0])), "the first run has no limit");
        assert_eq!(Timed::within(3, Duration::MAX, &mut next), Ok(timed(&[2.0, 3.0, 4.0])));
        assert_eq!(Timed::each(2, || next().map(|n| [n, -n])), Ok([timed(&[5.0, 6.0]), timed(&[-5.0, -6.0])]));
        assert_eq!(Timed::each(1, || Err::<[f64; 1], _>("no")), Err("no"));
    }
}
