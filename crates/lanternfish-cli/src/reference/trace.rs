//! Adds samples pass by pass until the goal is reached.

use std::time::{Duration, Instant};

use lanternfish_reference::{Film, Tracer};
use lanternfish_scene::Camera;

use crate::{
    error::CliError,
    progress::{Bar, duration},
    signals,
};

/// Target duration of a pass, s, so that the progress line stays responsive.
const PASS_SECONDS: f64 = 1.0;
/// A pass of one sample per pixel may be split after this time, s, to update the progress line.
const LONG_PASS_SECONDS: f64 = 2.0;
/// Most samples per pass.
const MOST_A_PASS: u64 = 64;
/// Interval between checkpoints, s.
const CHECKPOINT_SECONDS: f64 = 60.0;
/// Largest fraction of the time for checkpoints; beyond it they are less frequent.
const MOST_SAVING: f64 = 0.1;
/// Time before the remaining duration is estimated, s.
const ESTIMATE_SECONDS: f64 = 1.0;
/// With fewer samples the estimated error is unreliable.
const FIRST_CHECK: u64 = 16;

/// Goals that end a run. Without any, it never ends.
#[derive(Clone, Debug, Default)]
pub struct Goal {
    /// Samples per pixel.
    pub spp: Option<u64>,
    /// [`lanternfish_reference::Noise::relative`]. Checked at fixed sample counts only, so that the image does not depend on
    /// timing.
    pub until_error: Option<f64>,
    /// Duration of this run, s; may stop within a row.
    pub time_limit: Option<f64>,
}

/// The result of a run.
#[derive(Debug)]
pub struct Run {
    /// Exit code if the user interrupted the run.
    pub interrupted: Option<u8>,
    /// Samples of all pixels that this run added.
    pub added: u64,
    pub seconds: f64,
}

impl Goal {
    fn is_reached(&self, film: &Film, seconds: f64) -> bool {
        let samples = film.samples();
        self.spp.is_some_and(|spp| samples >= spp)
            || self.time_limit.is_some_and(|limit| seconds >= limit)
            || self
                .until_error
                .is_some_and(|error| is_check(samples) && film.is_even() && film.noise().relative <= error)
    }

    /// Most samples of the next pass before a goal may be reached.
    fn most(&self, samples: u64) -> u64 {
        let spp = self.spp.map_or(u64::MAX, |spp| spp.saturating_sub(samples));
        let check = self.until_error.map_or(u64::MAX, |_| next_check(samples) - samples);
        spp.min(check).max(1)
    }

    /// Estimated seconds until the first goal is reached, at the present speed.
    fn seconds_left(&self, samples: f64, noise: f64, seconds: f64, each: f64) -> Option<f64> {
        let of_samples = |wanted: f64| ((wanted - samples) * each).max(0.0);
        let left = [
            self.spp.map(|spp| of_samples(spp as f64)),
            // The error falls with the square root of the sample count.
            self.until_error.map(|error| of_samples(samples * (noise / error).powi(2))),
            self.time_limit.map(|limit| limit - seconds),
        ];
        left.into_iter().flatten().filter(|left| left.is_finite()).min_by(f64::total_cmp)
    }
}

/// The next sample count above `samples` at which the error is checked: 16, then an eighth more each time.
fn next_check(samples: u64) -> u64 {
    let mut check = FIRST_CHECK;
    while check <= samples {
        check += check / 8;
    }
    check
}

fn is_check(samples: u64) -> bool {
    samples > 0 && next_check(samples - 1) == samples
}

/// Adds samples until a goal is reached or the user interrupts. Calls `save` at checkpoints.
pub fn trace(
    tracer: &Tracer<'_>,
    camera: &Camera,
    film: &mut Film,
    goal: &Goal,
    bar: &Bar,
    mut save: impl FnMut(&Film) -> Result<(), CliError>,
) -> Result<Run, CliError> {
    let (started, first) = (Instant::now(), film.sample_count());
    let is_over = || {
        signals::requested().is_some() || goal.time_limit.is_some_and(|limit| started.elapsed().as_secs_f64() >= limit)
    };
    let pixels = pixel_count(film);
    let (mut saved, mut between_saves) = (started, CHECKPOINT_SECONDS);
    let mut is_estimated = bar.is_seen();
    let mut pass = 1;
    loop {
        let (seconds, added) = (started.elapsed().as_secs_f64(), film.sample_count() - first);
        let end = |interrupted| Run { interrupted, added, seconds };
        if goal.is_reached(film, seconds) {
            return Ok(end(None));
        }
        if let Some(code) = signals::requested() {
            return Ok(end(Some(code)));
        }
        let pass_started = Instant::now();
        // Complete an interrupted pass one sample at a time, so that no row exceeds the goal's check.
        let samples = if film.is_even() { pass.min(goal.most(film.samples())) } else { 1 };
        let is_long = || samples == 1 && pass_started.elapsed().as_secs_f64() >= LONG_PASS_SECONDS;
        tracer.render_unless(camera, film, samples, is_long, is_over);
        let pass_seconds = pass_started.elapsed().as_secs_f64();
        let pass_added = film.sample_count() - first - added;
        let each = pass_seconds.max(1e-6) * pixels / pass_added.max(1) as f64;
        let seconds = started.elapsed().as_secs_f64();
        let time = goal.time_limit.map_or(PASS_SECONDS, |limit| PASS_SECONDS.min(limit - seconds));
        pass = ((time / each) as u64).clamp(1, MOST_A_PASS);
        if bar.is_seen() {
            show(bar, film, goal, film.sample_count() - first, seconds);
        } else if !is_estimated && seconds >= ESTIMATE_SECONDS {
            is_estimated = estimate(bar, film, goal, film.sample_count() - first, seconds);
        }
        if (saved.elapsed() + Duration::from_secs_f64(pass_seconds)).as_secs_f64() > between_saves {
            let saving = Instant::now();
            save(film)?;
            saved = Instant::now();
            between_saves = CHECKPOINT_SECONDS.max(saving.elapsed().as_secs_f64() / MOST_SAVING);
        }
    }
}

/// Estimated seconds left, and the noise, after `seconds` in which `added` samples of all pixels were traced.
fn left(film: &Film, goal: &Goal, added: u64, seconds: f64) -> (Option<f64>, f64) {
    let (pixels, noise) = (pixel_count(film), film.noise().relative);
    let each = seconds * pixels / added.max(1) as f64;
    (goal.seconds_left(film.sample_count() as f64 / pixels, noise, seconds, each), noise)
}

fn pixel_count(film: &Film) -> f64 {
    let [width, height] = film.size().map(f64::from);
    width * height
}

/// Prints the estimated duration if no bar is visible. Returns true if the estimate is known.
fn estimate(bar: &Bar, film: &Film, goal: &Goal, added: u64, seconds: f64) -> bool {
    let (left, _) = left(film, goal, added, seconds);
    let Some(left) = left else { return false };
    let of = goal.spp.map(|spp| format!(" of {spp}")).unwrap_or_default();
    let (samples, so_far) = (film.samples(), duration(seconds));
    bar.note(&format!("about {} left, after {so_far} with {samples}{of} samples per pixel", duration(left)));
    true
}

fn show(bar: &Bar, film: &Film, goal: &Goal, added: u64, seconds: f64) {
    let (left, noise) = left(film, goal, added, seconds);
    let of = goal.spp.map(|spp| format!(" of {spp}")).unwrap_or_default();
    let mut text = format!("{}{of} samples per pixel, {} samples/s", film.samples(), metric(added as f64 / seconds));
    if noise.is_finite() {
        text += &format!(", error {:.2} %", 100.0 * noise);
    }
    if let Some(left) = left {
        text += &format!(", {} left", duration(left));
    }
    let fraction = left.map_or(0.0, |left| seconds / (seconds + left));
    bar.show(fraction, text);
}

/// Formats a number with three digits and k, M or G.
pub fn metric(number: f64) -> String {
    let (unit, name) = [(1e9, " G"), (1e6, " M"), (1e3, " k")]
        .into_iter()
        .find(|(unit, _)| number >= 0.9995 * unit)
        .unwrap_or((1.0, ""));
    let scaled = number / unit;
    let digits = if scaled >= 99.95 {
        0
    } else if scaled >= 9.995 {
        1
    } else {
        2
    };
    format!("{scaled:.digits$}{name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_are_at_fixed_sample_counts() {
        let mut row = vec![next_check(0)];
        while row.len() < 6 {
            row.push(next_check(row[row.len() - 1]));
        }
        assert_eq!(row, [16, 18, 20, 22, 24, 27]);
        assert!(is_check(27) && !is_check(26) && !is_check(0) && !is_check(1));
    }

    #[test]
    fn a_pass_stops_where_the_goal_may_be_reached() {
        let goal = Goal { spp: Some(25), until_error: Some(0.1), time_limit: None };
        assert_eq!((goal.most(0), goal.most(16), goal.most(24)), (16, 2, 1));
        assert_eq!(Goal::default().most(5), u64::MAX);
        let left = goal.seconds_left(20.0, 0.2, 7.0, 1.0);
        assert_eq!(left, Some(5.0), "the samples run out before the error is reached");
        assert_eq!(Goal { spp: None, ..goal }.seconds_left(20.0, 0.2, 7.0, 1.0), Some(60.0));
        assert_eq!(Goal::default().seconds_left(20.0, f64::INFINITY, 7.0, 1.0), None);
    }

    #[test]
    fn numbers_are_formatted_with_units() {
        for (number, text) in
            [(0.0, "0.00"), (999.9, "1.00 k"), (12_345.0, "12.3 k"), (1.5e6, "1.50 M"), (2e11, "200 G")]
        {
            assert_eq!(metric(number), text);
        }
        for (seconds, text) in [(0.2, "1 s"), (61.0, "1 min 1 s"), (7200.0, "2 h 0 min")] {
            assert_eq!(duration(seconds), text);
        }
    }
}
