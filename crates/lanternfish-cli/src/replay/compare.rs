//! Passes that became slower, beyond noise.
//!
//! A run is one value, its relative time: the mean over the middle half of its frames of the frame's time relative to its
//! average over both replays ([`Series::speeds`]). So each frame is compared with itself, and disturbances of a few frames of a
//! run do not count. Frames of one run are correlated, because a slow machine stays slow for a while; runs are assumed to be
//! independent.
//!
//! 1. A rank test compares the values of the new replay's runs with those of the old one ([`rank_sum`]). It assumes no
//!    distribution.
//! 2. Many passes are tested, so some would differ by chance. Their p values are judged together `[Holm1979]`, with a
//!    probability of 0.05 that any pass is reported although none is slower.
//! 3. A pass is slower if the test says so and its time grew by more than the least change that matters.
//!
//! Passes that take less than a hundredth of the frame are not tested.

use std::fmt::Write as _;

use super::{rank_sum, report::Report, series::Series};
use crate::error::CliError;

/// Probability of reporting any pass as slower although none is.
const LEVEL: f64 = 0.05;
/// Least fraction of the frame time of a tested pass.
const LEAST_FRACTION: f64 = 0.01;

/// The change of one pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub name: String,
    /// Milliseconds per frame: the sum over frames of the least time of all runs, divided by the number of frames.
    pub old_ms: f64,
    pub new_ms: f64,
    /// New time divided by old time of a frame, the median of the runs.
    pub ratio: f64,
    /// The p value: probability of values like these if the pass is not slower.
    pub chance: f64,
    pub is_slower: bool,
}

/// The changes of all passes and of the host, in the order of the report, and differences of images and counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    pub changes: Vec<Change>,
    /// Passes that only one replay has.
    pub unmatched: Vec<String>,
    /// Number of frames with a different image.
    pub other_images: usize,
    /// Number of frames with different counters or clusters.
    pub other_counts: usize,
}

impl Comparison {
    /// The passes that became slower.
    pub fn slower(&self) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(|change| change.is_slower)
    }

    /// The changes as a table, and a conclusion.
    pub fn to_table(&self) -> String {
        let width = self.changes.iter().map(|change| change.name.len()).max().unwrap_or(0).max(4);
        let mut text =
            format!("{:<width$}  {:>9}  {:>9}  {:>7}  {:>8}\n", "pass", "ms before", "ms now", "change", "chance");
        for Change { name, old_ms, new_ms, ratio, chance, is_slower } in &self.changes {
            let percent = 100.0 * (ratio - 1.0);
            let slower = if *is_slower { "  slower" } else { "" };
            writeln!(text, "{name:<width$}  {old_ms:>9.3}  {new_ms:>9.3}  {percent:>+6.1}%  {chance:>8.5}{slower}")
                .expect("String");
        }
        if !self.unmatched.is_empty() {
            writeln!(text, "in one replay only: {}", self.unmatched.join(", ")).expect("String");
        }
        for (count, what) in [(self.other_images, "images"), (self.other_counts, "counts")] {
            if count > 0 {
                writeln!(text, "{count} frames have different {what}").expect("String");
            }
        }
        text + &match self.slower().count() {
            0 => "nothing became slower beyond noise\n".to_owned(),
            1 => "1 pass became slower\n".to_owned(),
            count => format!("{count} passes became slower\n"),
        }
    }
}

/// Compares replays. Changes of at most `matters`, such as 0.05, are ignored.
pub fn compare(old: &Report, new: &Report, matters: f64) -> Result<Comparison, CliError> {
    comparable(old, new)?;
    let (all_old, all_new) = (old.all_passes(), new.all_passes());
    let series = |report: &'_ Report, all: &Option<Series>| -> Vec<Series> {
        report.passes.iter().chain(all).chain(&report.host).cloned().collect()
    };
    let (olds, news) = (series(old, &all_old), series(new, &all_new));
    let matching = |series: &Series, others: &[Series]| {
        others.iter().find(|other| other.name == series.name && other.category == series.category).cloned()
    };
    let ms = |series: &Series| series.least().iter().sum::<f64>() / series.frames().max(1) as f64;
    let frame = all_new.as_ref().or(new.host.iter().find(|host| host.name == "host/frame")).map_or(0.0, ms);
    let mut changes = Vec::new();
    let mut unmatched: Vec<String> =
        olds.iter().filter(|old| matching(old, &news).is_none()).map(|old| old.name.clone()).collect();
    for new in news {
        let Some(old) = matching(&new, &olds) else {
            unmatched.push(new.name.clone());
            continue;
        };
        if ms(&new).max(ms(&old)) < LEAST_FRACTION * frame {
            continue;
        }
        changes.push(change(&old, &new));
    }
    let needed = LEVEL / changes.len().max(1) as f64;
    if rank_sum::least_chance(old.runs, new.runs) > needed {
        return Err(CliError::new(
            format_args!(
                "{} and {} runs are too few to tell {} passes from noise: any difference could be chance",
                old.runs,
                new.runs,
                changes.len()
            ),
            format!("replay both with --runs {} or more", enough_runs(needed)),
        ));
    }
    judge(&mut changes, matters);
    let frames = || old.frames.iter().zip(&new.frames);
    Ok(Comparison {
        changes,
        unmatched,
        other_images: frames().filter(|(old, new)| old.rendering != new.rendering).count(),
        other_counts: frames()
            .filter(|(old, new)| old.counters != new.counters || old.clusters != new.clusters)
            .count(),
    })
}

/// Returns an error unless times of the two replays can be compared.
fn comparable(old: &Report, new: &Report) -> Result<(), CliError> {
    let size = |report: &Report| format!("{} x {} pixels for {} eyes", report.width, report.height, report.eyes);
    let frames = |report: &Report| {
        let [first, last] = [report.moments.first(), report.moments.last()].map(|at| at.copied().unwrap_or_default());
        format!("{} frames from {first} s to {last} s", report.moments.len())
    };
    for (what, old, new) in [
        ("adapter", old.adapter.clone(), new.adapter.clone()),
        ("size", size(old), size(new)),
        ("choice of frames", frames(old), frames(new)),
        ("scene", old.scene.clone(), new.scene.clone()),
        ("number of lights", old.lights.to_string(), new.lights.to_string()),
    ] {
        if old != new {
            return Err(CliError::new(
                format_args!("--compare: another {what}: {old} before, {new} now"),
                "compare replays of the same frames on the same machine",
            ));
        }
    }
    Ok(())
}

/// The change of a pass, not judged yet.
fn change(old: &Series, new: &Series) -> Change {
    let (_, speeds) = Series::speeds(&[old, new]);
    let (before, now) = speeds.split_at(old.samples.len());
    let ms = |series: &Series| series.least().iter().sum::<f64>() / series.frames().max(1) as f64;
    Change {
        name: new.name.clone(),
        old_ms: ms(old),
        new_ms: ms(new),
        ratio: (middle(now) - middle(before)).exp(),
        chance: rank_sum::chance(before, now),
        is_slower: false,
    }
}

/// Marks the slower passes, all judged together.
fn judge(changes: &mut [Change], matters: f64) {
    let mut order: Vec<usize> = (0..changes.len()).collect();
    order.sort_by(|a, b| changes[*a].chance.total_cmp(&changes[*b].chance));
    for (rank, index) in order.iter().enumerate() {
        let left = changes.len() - rank;
        if changes[*index].chance > LEVEL / left as f64 {
            break;
        }
        changes[*index].is_slower = changes[*index].ratio > 1.0 + matters;
    }
}

/// Runs that each replay needs so that a p value of `needed` is possible.
fn enough_runs(needed: f64) -> usize {
    (1..).find(|runs| rank_sum::least_chance(*runs, *runs) <= needed).expect("p values fall with every run")
}

fn middle(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    0.5 * (values[last / 2] + values[last.div_ceil(2)])
}

#[cfg(test)]
mod tests;
