//! A figure with the runs of the times that it is computed from, and the interval in which it lies.

use std::ops::{Add, Div};

use lanternfish_cli::timed::Timed;

/// Pairs of runs from which on the interval of their median has 95 %.
const PAIRS: usize = 6;

/// A number; with runs where it is a time, or computed from times.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    pub value: f64,
    times: Option<Times>,
}

/// Runs of a time.
#[derive(Clone, Debug, PartialEq)]
struct Times {
    each: Vec<f64>,
    /// Where the figure lies if each time may be off by the margin.
    range: [f64; 2],
    /// The row or the table whose times were measured in turn; none of times from different ones.
    together: Option<String>,
}

/// What an interval rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// So many runs of one row, or of rows that were measured in turn.
    Pairs(usize),
    /// Times of different moments, or few runs.
    Apart,
}

impl Measure {
    /// A count, an error, or another number that no run changes.
    pub fn exact(value: f64) -> Self {
        Self { value, times: None }
    }

    /// A time with its runs, which the row or table `together` measured in turn.
    pub fn time(value: f64, each: Vec<f64>, margin: f64, together: Option<String>) -> Self {
        let each = if each.is_empty() { vec![value] } else { each };
        let [least, most] = [f64::min, f64::max].map(|of| each.iter().copied().fold(value, of));
        let range = [least / margin.sqrt(), most * margin.sqrt()];
        Self { value, times: Some(Times { each, range, together }) }
    }

    /// A figure of both. Runs are paired by their number.
    fn with(self, other: Self, of: fn(f64, f64) -> f64) -> Self {
        let value = of(self.value, other.value);
        let (is_exact, others_is) = (self.times.is_none(), other.times.is_none());
        if is_exact && others_is {
            return Self::exact(value);
        }
        let runs = [&self, &other].map(|of| of.times.as_ref().map_or(usize::MAX, |times| times.each.len()));
        let count = runs[0].min(runs[1]);
        let (a, b) = (self.times_of(count), other.times_of(count));
        let each = a.each.iter().zip(&b.each).map(|(a, b)| of(*a, *b)).collect();
        let corners = a.range.iter().flat_map(|a| b.range.map(|b| of(*a, b)));
        let range = corners.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        let together = if is_exact || a.together == b.together { b.together } else { a.together.filter(|_| others_is) };
        Self { value, times: Some(Times { each, range, together }) }
    }

    /// The times, or an exact number as so many runs.
    fn times_of(self, count: usize) -> Times {
        let value = self.value;
        let exact = || Times { each: vec![value; count], range: [value; 2], together: None };
        self.times.unwrap_or_else(exact)
    }

    /// The interval of a figure of times, and what it rests on: 95 % of the median of pairs, or the range with the
    /// margin.
    pub fn interval(&self) -> Option<([f64; 2], Basis)> {
        let Times { each, range, together } = self.times.as_ref()?;
        if together.is_none() || each.len() < PAIRS {
            return Some((*range, Basis::Apart));
        }
        Some((Timed { runs: each.clone() }.interval(), Basis::Pairs(each.len())))
    }

    /// The median of pairs, or the number itself.
    pub fn decisive(&self) -> f64 {
        let is_paired = matches!(self.interval(), Some((_, Basis::Pairs(_))));
        self.times
            .as_ref()
            .filter(|_| is_paired)
            .map_or(self.value, |times| Timed { runs: times.each.clone() }.median())
    }
}

impl Add for Measure {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl Div for Measure {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(each: &[f64], together: &str) -> Measure {
        Measure::time(each[0], each.to_vec(), 1.44, Some(together.to_owned()))
    }

    #[test]
    fn pairs_cancel_what_disturbs_both() {
        // The machine becomes three times as slow meanwhile.
        let [a, b] = [[1.0, 1.1, 2.0, 2.1, 3.0, 3.1], [2.0, 2.2, 4.0, 4.3, 6.0, 6.1]];
        let ratio = time(&b, "rows") / time(&a, "rows");
        let ([low, high], basis) = ratio.interval().unwrap();
        assert_eq!(basis, Basis::Pairs(6));
        assert!(low > 1.9 && high < 2.1 && ratio.decisive() == 2.0, "{ratio:?}");
        let sum = Measure::exact(1.0) + ratio;
        assert!(matches!(sum.interval(), Some(([low, _], Basis::Pairs(6))) if low > 2.9), "{sum:?}");
    }

    #[test]
    fn few_runs_and_times_of_different_moments_have_a_margin() {
        let few = time(&[2.0], "rows") / time(&[1.0], "rows");
        let ([low, high], basis) = few.interval().unwrap();
        assert!((low - 2.0 / 1.44).abs() < 1e-12 && (high - 2.0 * 1.44).abs() < 1e-12);
        assert_eq!((basis, few.decisive()), (Basis::Apart, 2.0));
        let runs = [1.0; 7];
        let apart = time(&runs, "a") / time(&runs, "b");
        assert!(matches!(apart.interval(), Some(([low, high], Basis::Apart)) if low < 0.7 && high > 1.4));
        assert_eq!((Measure::exact(2.0) / Measure::exact(4.0)).interval(), None);
    }
}
