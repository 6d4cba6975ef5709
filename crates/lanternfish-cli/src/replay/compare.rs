//! Passes that became slower, beyond noise.
//!
//! A run is one value: how fast it was, as the mean over the middle half of its frames of what the frame took to what it took on average in
//! both replays ([`Series::speeds`]). So frames are compared with themselves, and what disturbs a few frames of a run does not count. Frames of one run
//! are not independent of each other, for a machine that is slow is slow for a while; runs are taken to be.
//!
//! 1. The values of the runs of the new replay are tested against those of the old one by ranks ([`rank_sum`]): no distribution is assumed.
//! 2. Many passes are tested, so chance alone would find some: probabilities are judged together `[Holm1979]`, at 0.05 that one or more of
//!    all passes is found where none is slower.
//! 3. A pass is slower where it is found so, and takes longer by more than the least change that matters.
//!
//! Left out are passes that take less than a hundredth of the frame.

use std::fmt::Write as _;

use super::{rank_sum, report::Report, series::Series};
use crate::error::CliError;

/// How probable it may be that a pass is called slower where none is.
const LEVEL: f64 = 0.05;
/// Share of the frame that a pass takes at least, if it is tested.
const LEAST_FRACTION: f64 = 0.01;

/// What has become of one pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub name: String,
    /// Milliseconds a frame: sums over frames of the least of all runs, divided by the frames.
    pub old_ms: f64,
    pub new_ms: f64,
    /// What a frame takes now to what it took, the middle of the runs.
    pub ratio: f64,
    /// How probable values like these are where the pass is not slower.
    pub chance: f64,
    pub is_slower: bool,
}

/// What has become of all that takes time, in the order of the report, and whether images and counts are what they were.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    pub changes: Vec<Change>,
    /// Passes that only one of the two has.
    pub unmatched: Vec<String>,
    /// Frames whose image is another.
    pub other_images: usize,
    /// Frames whose counters or clusters are others.
    pub other_counts: usize,
}

impl Comparison {
    /// Those that became slower.
    pub fn slower(&self) -> impl Iterator<Item = &Change> {
        self.changes.iter().filter(|change| change.is_slower)
    }

    /// As a table, and a line of what came of it.
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
            writeln!(text, "in one of the two alone: {}", self.unmatched.join(", ")).expect("String");
        }
        for (count, what) in [(self.other_images, "renderings"), (self.other_counts, "counts")] {
            if count > 0 {
                writeln!(text, "{count} frames have other {what} than before").expect("String");
            }
        }
        text + &match self.slower().count() {
            0 => "nothing became slower beyond noise\n".to_owned(),
            1 => "1 pass became slower\n".to_owned(),
            count => format!("{count} passes became slower\n"),
        }
    }
}

/// Compares replays. A change of `matters`, such as 0.05, or less is none.
pub fn compare(old: &Report, new: &Report, matters: f64) -> Result<Comparison, CliError> {
    comparable(old, new)?;
    let (all_old, all_new) = (old.all_passes(), new.all_passes());
    let series = |report: &'_ Report, all: &Option<Series>| -> Vec<Series> {
        report.passes.iter().chain(all).chain(&report.host).cloned().collect()
    };
    let (olds, news) = (series(old, &all_old), series(new, &all_new));
    let matching = |known: &Series, others: &[Series]| {
        others.iter().find(|other| other.name == known.name && other.category == known.category).cloned()
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
                "{} and {} runs are too few to tell {} passes from noise: whatever they took, chance could have done it",
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

/// An error unless times of the two can be compared at all.
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

/// What has become of a pass, not judged yet.
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

/// Calls those slower that are, all judged together.
fn judge(changes: &mut [Change], matters: f64) {
    let mut order: Vec<usize> = (0..changes.len()).collect();
    order.sort_by(|a, b| changes[*a].chance.total_cmp(&changes[*b].chance));
    for (found, index) in order.iter().enumerate() {
        let left = changes.len() - found;
        if changes[*index].chance > LEVEL / left as f64 {
            break;
        }
        changes[*index].is_slower = changes[*index].ratio > 1.0 + matters;
    }
}

/// Number of runs each replay needs so that a chance of `needed` can be found.
fn enough_runs(needed: f64) -> usize {
    (1..).find(|runs| rank_sum::least_chance(*runs, *runs) <= needed).expect("chances fall with every run")
}

fn middle(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    0.5 * (values[last / 2] + values[last.div_ceil(2)])
}

#[cfg(test)]
mod tests;
