//! The report of `lanternfish doctor`, as JSON and as a table.

mod rows;

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

pub use self::rows::{Rate, Timed};
use super::ab::WalkCount;
use crate::{repeat::Repeat, warm::NO_CLOCKS};

/// Version of the JSON format, increased when a field changes its meaning.
pub const FORMAT: u32 = 1;

/// The complete report. It names hardware, driver and system, but neither the user nor the host name.
#[derive(Debug, Serialize, Deserialize)]
pub struct Report {
    pub format: u32,
    /// Version of this program.
    pub version: String,
    /// Version of the sources, from --commit.
    pub commit: Option<String>,
    /// Date of the run, UTC, as 2026-01-31.
    pub date: String,
    /// The command line of the run.
    pub command: String,
    /// Operating system and processor architecture.
    pub system: String,
    /// Hardware threads of the CPU.
    pub threads: usize,
    /// False while the run continues. In a finished file: a driver or a signal ended the process.
    pub complete: bool,
    /// The step in progress when the file was written, unless the report is complete.
    pub doing: Option<String>,
    /// Number of steps begun.
    pub begun: usize,
    /// Duration of the run, seconds.
    pub seconds: f64,
    pub adapters: Vec<Adapter>,
    /// Index into `adapters` of the adapter that was checked.
    pub chosen: usize,
    pub checks: Vec<Check>,
    pub rates: Vec<Rate>,
    pub frames: Vec<Timed>,
    /// Steps that could not be timed: name and reason.
    pub not_timed: Vec<(String, String)>,
    /// The first rows of tables, measured again at the end.
    #[serde(default)]
    pub repeats: Vec<Repeat>,
    /// Nodes, triangles and active lanes of rays, by list.
    #[serde(default)]
    pub walk_counts: Vec<WalkCount>,
}

/// An adapter of the machine.
#[derive(Debug, Serialize, Deserialize)]
pub struct Adapter {
    pub name: String,
    /// `DiscreteGpu`, `IntegratedGpu`, `VirtualGpu`, `Cpu` or `Other`.
    pub kind: String,
    pub backend: String,
    pub driver: String,
    /// Known faults of the driver, and the remedy.
    pub faults: Option<String>,
    /// The tracer that `auto` selects for shadows and indirect light.
    pub automatic_tracer: String,
    /// Optional features that some technique uses: name, and true if the adapter has it.
    pub features: Vec<(String, bool)>,
    /// Limits on scenes and images, in bytes or as counts.
    pub limits: Vec<(String, u64)>,
    /// The rasterizer snaps vertices to 2ⁿ points a pixel along each axis. None in reports of older versions.
    #[serde(default)]
    pub subpixel_bits: Option<u32>,
    /// All techniques and tracers, each with the reason why it cannot run, if any.
    pub techniques: Vec<Technique>,
}

/// A technique on an adapter.
#[derive(Debug, Serialize, Deserialize)]
pub struct Technique {
    /// Its flag and name.
    pub name: String,
    /// Why it cannot run; `None` if it can.
    pub reason: Option<String>,
}

/// The subject of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    Primitives,
    Materials,
    LightCulling,
    Shadows,
    DirectLight,
    Occlusion,
    Environment,
    IndirectLight,
    Updates,
    Reproducibility,
}

impl Group {
    pub fn name(self) -> &'static str {
        match self {
            Self::Primitives => "primitives",
            Self::Materials => "materials",
            Self::LightCulling => "light culling",
            Self::Shadows => "shadows",
            Self::DirectLight => "direct light",
            Self::Occlusion => "occlusion",
            Self::Environment => "environment",
            Self::IndirectLight => "indirect light",
            Self::Updates => "updates",
            Self::Reproducibility => "reproducibility",
        }
    }
}

/// A check and its result.
#[derive(Debug, Serialize, Deserialize)]
pub struct Check {
    pub group: Group,
    pub name: String,
    pub scene: String,
    pub verdict: Verdict,
    /// The measured values and their limits.
    pub figures: Vec<Figure>,
    /// Why it was skipped, or the error that stopped it.
    pub reason: Option<String>,
    /// Duration, seconds, including shader compilation and the reference image.
    pub seconds: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Passed,
    Failed,
    LeftOut,
}

/// A measured value and its limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    pub name: String,
    /// JSON has no NaN; null represents it.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    pub least: f64,
    pub most: f64,
}

fn number_or_nan<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

impl Figure {
    pub fn new(name: &str, value: f64, least: f64, most: f64) -> Self {
        Self { name: name.to_owned(), value, least, most }
    }

    /// True if the value is within its limits. NaN never is.
    pub fn passes(&self) -> bool {
        (self.least..=self.most).contains(&self.value)
    }
}

impl Report {
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.verdict == Verdict::Failed)
    }

    /// Passes with a single command over [`WATCHDOG_MS`]: frame, pass, milliseconds.
    pub fn slow_passes(&self) -> Vec<(&str, &str, f64)> {
        let slow = self.frames.iter().flat_map(|frame| frame.over_watchdog.iter().map(move |pass| (frame, pass)));
        slow.map(|(frame, (pass, ms))| (frame.name.as_str(), pass.as_str(), *ms)).collect()
    }

    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain numbers and strings") + "\n"
    }

    /// The report as a table: machine, failed checks, speed.
    pub fn to_table(&self) -> String {
        let mut text = String::new();
        for (i, adapter) in self.adapters.iter().enumerate() {
            let chosen = if i == self.chosen { "  (checked)" } else { "" };
            line(&mut text, "adapter", format_args!("{}{chosen}", adapter.name));
            line(&mut text, "  kind", format_args!("{}, through {}", adapter.kind, adapter.backend));
            line(&mut text, "  driver", &adapter.driver);
            if let Some(faults) = &adapter.faults {
                line(&mut text, "  KNOWN FAULTS", faults);
            }
            let has: Vec<_> = adapter.features.iter().filter(|(_, has)| *has).map(|(name, _)| name.as_str()).collect();
            let lacks: Vec<_> =
                adapter.features.iter().filter(|(_, has)| !*has).map(|(name, _)| name.as_str()).collect();
            line(&mut text, "  has", listed(&has));
            line(&mut text, "  lacks", listed(&lacks));
            for (name, value) in &adapter.limits {
                line(&mut text, &format!("  {name}"), value);
            }
            if let Some(bits) = adapter.subpixel_bits {
                line(&mut text, "  vertex grid", format_args!("{bits} bits: {} points a pixel", 1u64 << bits));
            }
            line(&mut text, "  tracer auto", &adapter.automatic_tracer);
            let (can, cannot): (Vec<_>, Vec<_>) = adapter.techniques.iter().partition(|t| t.reason.is_none());
            line(&mut text, "  can run", listed(&can.iter().map(|t| t.name.as_str()).collect::<Vec<_>>()));
            for technique in cannot {
                let reason = technique.reason.as_deref().unwrap_or_default();
                line(&mut text, "  cannot run", format_args!("{}: {reason}", technique.name));
            }
        }
        if !self.checks.is_empty() {
            text += "\nCorrectness: images compared with a path tracer on the CPU, unless stated otherwise.\n";
            self.write_checks(&mut text);
        }
        if !self.rates.is_empty() || !self.frames.is_empty() {
            text += "\nSpeed: medians, with least and most of the runs.\n";
            self.write_speed(&mut text);
        }
        let (failed, left_out) = (self.failures().count(), self.count(Verdict::LeftOut));
        let passed = self.count(Verdict::Passed);
        let _ =
            writeln!(text, "\n{passed} checks passed, {failed} failed, {left_out} left out, in {:.0} s", self.seconds);
        if let Some(first) = self.failures().next() {
            let _ = writeln!(
                text,
                "first failure: {}, {} ({}). Later checks depend on earlier ones: begin there.",
                first.group.name(),
                first.name,
                first.scene
            );
        }
        if !self.complete {
            let doing = self.doing.as_deref().unwrap_or("nothing");
            let _ = writeln!(text, "INCOMPLETE: the process ended while it did this: {doing}");
        }
        text
    }

    /// The clocks of all rows, without repetitions.
    pub fn clocks(&self) -> impl Iterator<Item = &str> {
        let all = self.rates.iter().map(|rate| &rate.clocks).chain(self.frames.iter().map(|frame| &frame.clocks));
        let mut last = "";
        all.flatten().map(String::as_str).filter(move |clocks| std::mem::replace(&mut last, clocks) != *clocks)
    }

    fn count(&self, verdict: Verdict) -> usize {
        self.checks.iter().filter(|check| check.verdict == verdict).count()
    }

    fn write_checks(&self, text: &mut String) {
        for check in &self.checks {
            let verdict = match check.verdict {
                Verdict::Passed => "ok",
                Verdict::Failed => "FAILED",
                Verdict::LeftOut => "left out",
            };
            let figures: Vec<_> = check.figures.iter().map(figure).collect();
            let what = check.reason.clone().unwrap_or_else(|| figures.join(", "));
            let _ =
                writeln!(text, "  {verdict:<9}{:<16}{:<26}{:<26}{what}", check.group.name(), check.name, check.scene);
        }
    }

    fn write_speed(&self, text: &mut String) {
        for rate in &self.rates {
            let _ = writeln!(
                text,
                "  {:<48}{:>10.3} {} ({:.3} to {:.3}, {} runs){}",
                rate.name,
                rate.median,
                rate.unit,
                rate.least,
                rate.most,
                rate.runs,
                if rate.differs_from(&self.rates) { " OTHER RESULTS" } else { "" }
            );
        }
        for frame in &self.frames {
            let name = format!("{}, {} lights, {} x {}", frame.name, frame.lights, frame.width, frame.height);
            if let Some(reason) = &frame.reason {
                let _ = writeln!(text, "  {name:<48}left out: {reason}");
                continue;
            }
            let mut slowest: Vec<_> = frame.passes.iter().collect();
            slowest.sort_by(|a, b| b.1.total_cmp(&a.1));
            let slowest: Vec<_> = slowest.iter().take(3).map(|(name, ms)| format!("{name} {ms:.1}")).collect();
            let clock = if frame.is_wall { " (host clock)" } else { "" };
            let _ = writeln!(
                text,
                "  {name:<48}{:>10.2} ms{clock} ({:.2} to {:.2}, {} runs); most: {}",
                frame.median_ms,
                frame.least_ms,
                frame.most_ms,
                frame.runs,
                slowest.join(", ")
            );
            if !frame.costs.is_empty() {
                let _ = writeln!(text, "  {:<48}{}", "", frame.extent());
            }
        }
        for (what, why) in &self.not_timed {
            let _ = writeln!(text, "  {what:<48}left out: {why}");
        }
        for count in &self.walk_counts {
            let _ = writeln!(text, "  {}", count.text());
        }
        for repeat in &self.repeats {
            let _ = writeln!(text, "  measured again: {}", repeat.text());
        }
        let clocks: Vec<_> = self.clocks().collect();
        let clocks = if clocks.is_empty() { NO_CLOCKS.to_owned() } else { clocks.join(" | ") };
        let _ = writeln!(text, "  clocks: {clocks}");
        for (frame, pass, ms) in self.slow_passes() {
            let _ = writeln!(
                text,
                "  over {:.0} s, a display driver may stop it: {pass}, {ms:.0} ms ({frame})",
                WATCHDOG_MS / 1e3
            );
        }
    }
}

/// A display driver stops a command that takes longer, with usual settings, ms.
pub const WATCHDOG_MS: f64 = 2000.0;

fn line(text: &mut String, name: &str, value: impl std::fmt::Display) {
    let _ = writeln!(text, "{name:<16}{value}");
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// Formats a value and its limits: `energy 1.002 (0.98 to 1.02)`.
pub fn figure(figure: &Figure) -> String {
    let Figure { name, value, least, most } = figure;
    let mark = if figure.passes() { "" } else { " OUT OF LIMITS" };
    match (*least, *most) {
        (least, most) if least == most => format!("{name} {value} (must be {most}){mark}"),
        (least, most) if least <= 0.0 => format!("{name} {value:.4} (at most {most}){mark}"),
        _ => format!("{name} {value:.4} ({least} to {most}){mark}"),
    }
}

#[cfg(test)]
pub mod tests;
