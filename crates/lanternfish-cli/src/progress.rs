//! Progress on the terminal, and the duration of each step.

use std::{
    io::{self, Write},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lanternfish_scene::printable;
use tracing_subscriber::{EnvFilter, fmt::MakeWriter};

use crate::error::say;

/// Duration of a step from which on it is mentioned without a terminal.
const LONG: Duration = Duration::from_secs(10);

/// The steps of a run. Silent with --quiet; without a terminal only long steps are mentioned.
pub struct Progress {
    line: ProgressBar,
    quiet: bool,
    seconds: Vec<(&'static str, f64)>,
}

impl Progress {
    /// Starts the progress line and sends the libraries' log above it. `RUST_LOG` chooses the log level.
    pub fn start(quiet: bool) -> Self {
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let line = ProgressBar::with_draw_target(None, target);
        line.set_style(steps());
        // A display without physical size is no concern of the user's.
        let default = if quiet { "error" } else { "warn,winit=error" };
        let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(default));
        // A second one in a process, as tests have it, leaves the messages to the first.
        let _ = tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_writer(Above(line.clone()))
            .with_ansi(false)
            .without_time()
            .with_target(false)
            .try_init();
        Self { line, quiet, seconds: Vec::new() }
    }

    /// Shows nothing and leaves the log unchanged, for steps while another line may be shown.
    pub fn hidden() -> Self {
        Self { line: ProgressBar::hidden(), quiet: true, seconds: Vec::new() }
    }

    /// Runs a step and records its duration. A repeated step adds to its seconds. `name` is for the report, `doing` for the
    /// terminal.
    pub fn step<T, E>(&mut self, name: &'static str, doing: &str, work: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        self.line.reset_elapsed();
        self.line.set_message(doing.to_owned());
        self.line.enable_steady_tick(Duration::from_millis(100));
        let started = Instant::now();
        let result = work();
        let seconds = started.elapsed().as_secs_f64();
        match self.seconds.iter_mut().find(|(other, _)| *other == name) {
            Some((_, sum)) => *sum += seconds,
            None => self.seconds.push((name, seconds)),
        }
        self.line.disable_steady_tick();
        if result.is_ok() {
            let line = format!("  {doing:<32}{seconds:>8.2} s");
            // Without a terminal only the long steps are listed.
            match self.line.is_hidden() {
                true if seconds >= LONG.as_secs_f64() => self.result(&line),
                true => {}
                false => self.line.println(line),
            }
        }
        result
    }

    /// Prints a note, also without a terminal, unless quiet.
    pub fn note(&self, text: &str) {
        self.bar().note(text);
    }

    /// Prints the result in one line, also without a terminal, unless quiet.
    pub(crate) fn result(&self, text: &str) {
        if !self.quiet {
            self.line.suspend(|| say(&text));
        }
    }

    /// Prints a warning about the result, if any, as [`Progress::note`] does.
    pub(crate) fn warn(&self, text: Option<String>) {
        if let Some(text) = text.filter(|_| !self.quiet) {
            self.line.suspend(|| say(&format_args!("warning: {text}")));
        }
    }

    /// Shows the line as a bar, for a step with known progress.
    pub(crate) fn bar(&self) -> Bar {
        let started = Instant::now();
        Bar { line: self.line.clone(), quiet: self.quiet, started, lines: Mutex::new(Lines::from(started)) }
    }

    /// Removes the line, so that results can be printed, and returns the seconds of each step.
    pub fn finish(mut self) -> Vec<(&'static str, f64)> {
        std::mem::take(&mut self.seconds)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        // The log keeps a handle to the line, so dropping this one does not remove it.
        self.line.finish_and_clear();
    }
}

/// The progress line as a bar. When dropped, the line shows the step's name again.
pub(crate) struct Bar {
    line: ProgressBar,
    quiet: bool,
    started: Instant,
    /// Lines in place of a terminal's.
    lines: Mutex<Lines>,
}

/// When lines are printed without a terminal: after [`LONG`], and then each time after twice as long.
struct Lines {
    next: Instant,
    pause: Duration,
}

impl Lines {
    fn from(start: Instant) -> Self {
        Self { next: start + LONG, pause: LONG }
    }

    /// True if a line is due, which is then printed.
    fn take(&mut self, now: Instant) -> bool {
        let is_due = now >= self.next;
        if is_due {
            (self.next, self.pause) = (now + self.pause, 2 * self.pause);
        }
        is_due
    }
}

impl Bar {
    /// True if the bar is visible.
    pub fn is_seen(&self) -> bool {
        !self.line.is_hidden()
    }

    /// As [`Progress::note`].
    pub fn note(&self, text: &str) {
        if !self.quiet {
            self.line.suspend(|| say(&format_args!("note: {text}")));
        }
    }

    /// Shows that `fraction` of the work is done, 0 to 1. Without a terminal it prints a line now and then.
    pub fn show(&self, fraction: f64, text: String) {
        const LENGTH: u64 = 1000;
        if self.line.is_hidden() {
            return self.print(&format!("{:.0} %, {text}", 100.0 * fraction));
        }
        let template = "{spinner:.cyan} [{bar:20}] {msg}";
        self.line.set_style(ProgressStyle::with_template(template).expect("a valid template").progress_chars("=> "));
        self.line.set_length(LENGTH);
        self.line.set_position((fraction * LENGTH as f64) as u64);
        self.line.set_message(text);
    }

    /// As [`Self::show`], with an estimate of the time that is left.
    pub fn show_left(&self, fraction: f64, text: String) {
        let left = left(fraction, self.started.elapsed().as_secs_f64());
        self.show(fraction, left.map_or(text.clone(), |left| format!("{text}, about {} left", duration(left))));
    }

    /// A spinner for an unknown total: shows what is done. Without a terminal it prints a line now and then.
    pub fn tell(&self, text: String) {
        match self.line.is_hidden() {
            true => self.print(&text),
            false => self.line.set_message(text),
        }
    }

    /// Prints a line, if one is due.
    fn print(&self, text: &str) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.quiet && lines.take(Instant::now()) {
            say(&format_args!("  {text}"));
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.line.set_style(steps());
    }
}

/// Estimate of the time that is left after this fraction of the work, seconds; `None`: it is too early to tell.
fn left(fraction: f64, seconds: f64) -> Option<f64> {
    (fraction > 0.0 && seconds >= LONG.as_secs_f64()).then(|| seconds * (1.0 - fraction) / fraction)
}

/// Formats seconds as hours, minutes and seconds.
pub(crate) fn duration(seconds: f64) -> String {
    let total = seconds.ceil() as u64;
    match (total / 3600, total / 60 % 60, total % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

fn steps() -> ProgressStyle {
    ProgressStyle::with_template("{spinner:.cyan} {msg} {elapsed:.dim}").expect("a valid template")
}

/// Writes to standard error above the progress line.
struct Above(ProgressBar);

impl<'w> MakeWriter<'w> for Above {
    type Writer = AboveWriter<'w>;

    fn make_writer(&'w self) -> AboveWriter<'w> {
        AboveWriter(&self.0)
    }
}

struct AboveWriter<'w>(&'w ProgressBar);

impl Write for AboveWriter<'_> {
    /// Writes one line of the log, which may hold names from files.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let line = logged(&String::from_utf8_lossy(bytes));
        self.0.suspend(|| io::stderr().write_all(line.as_bytes()))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// A line of the log as it can be printed: only its end breaks the line.
fn logged(line: &str) -> String {
    let (text, end) = line.strip_suffix('\n').map_or((line, ""), |text| (text, "\n"));
    printable(&text.replace('\n', "\\n")) + end
}

#[cfg(test)]
#[test]
fn lines_become_rarer() {
    let start = Instant::now();
    let mut lines = Lines::from(start);
    let printed: Vec<u64> = (0..200).filter(|s| lines.take(start + Duration::from_secs(*s))).collect();
    assert_eq!(printed, [10, 20, 40, 80, 160]);
}

#[cfg(test)]
#[test]
fn what_is_left_follows_from_what_is_done() {
    assert_eq!(left(0.25, 60.0).map(duration).as_deref(), Some("3 min 0 s"));
    assert_eq!((left(0.25, 9.0), left(0.0, 60.0)), (None, None));
}

#[cfg(test)]
#[test]
fn names_from_files_cannot_fake_lines_of_the_log() {
    assert_eq!(
        logged(" WARN a.glb: images[0] (x\nerror: none\u{1b}[2J)\n"),
        " WARN a.glb: images[0] (x\\nerror: none\\u{1b}[2J)\n"
    );
    assert!(logged(&"a".repeat(1 << 20)).len() < 1100);
}
