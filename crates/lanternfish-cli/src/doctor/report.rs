//! The report of `lanternfish doctor`, as JSON and as a table.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::timed::Timed;

/// Version of the JSON format, increased when a field changes its meaning.
pub const FORMAT: u32 = 2;

/// The complete report. It names hardware, driver and system, but neither the user nor the host name.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Report {
    pub format: u32,
    /// Version of this program.
    pub version: String,
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
    /// Tracers that could not be timed: name and reason.
    pub not_timed: Vec<(String, String)>,
}

/// An adapter of the machine.
#[derive(Debug, Default, Serialize, Deserialize)]
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
    /// The rasterizer snaps vertices to 2ⁿ points a pixel along each axis. None of adapters that were not opened.
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
    /// Its name in tables: that of the JSON, in words.
    pub fn name(self) -> String {
        let name = serde_json::to_value(self).expect("a name");
        name.as_str().unwrap_or_default().replace('-', " ")
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

/// Rays per second of a tracer.
#[derive(Debug, Serialize, Deserialize)]
pub struct Rate {
    /// The tracer, and the order of the rays.
    pub name: String,
    /// Million closest hits a second, by run.
    pub mrays_per_second: Timed,
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

    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain numbers and strings") + "\n"
    }

    /// The report as a table: machine, checks, rays per second.
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
            for (name, wanted) in [("  has", true), ("  lacks", false)] {
                let features = adapter.features.iter().filter(|(_, has)| *has == wanted);
                line(&mut text, name, listed(features.map(|(name, _)| name.as_str())));
            }
            for (name, value) in &adapter.limits {
                line(&mut text, &format!("  {name}"), value);
            }
            if let Some(bits) = adapter.subpixel_bits {
                line(&mut text, "  vertex grid", format_args!("{bits} bits: {} points a pixel", 1u64 << bits));
            }
            line(&mut text, "  tracer auto", &adapter.automatic_tracer);
            let can = adapter.techniques.iter().filter(|technique| technique.reason.is_none());
            line(&mut text, "  can run", listed(can.map(|technique| technique.name.as_str())));
            for Technique { name, reason } in &adapter.techniques {
                reason.iter().for_each(|reason| line(&mut text, "  cannot run", format_args!("{name}: {reason}")));
            }
        }
        if !self.checks.is_empty() {
            text += "\nCorrectness: images compared with a path tracer on the CPU, unless stated otherwise.\n";
            for check in &self.checks {
                let verdict = match check.verdict {
                    Verdict::Passed => "ok",
                    Verdict::Failed => "FAILED",
                    Verdict::LeftOut => "left out",
                };
                let figures = || check.figures.iter().map(figure).collect::<Vec<_>>().join(", ");
                let (what, group) = (check.reason.clone().unwrap_or_else(figures), check.group.name());
                let _ = writeln!(text, "  {verdict:<9}{group:<16}{:<26}{:<26}{what}", check.name, check.scene);
            }
        }
        if !self.rates.is_empty() || !self.not_timed.is_empty() {
            text += "\nClosest hits in the atrium, million rays a second: median, least and most of the runs.\n";
            for Rate { name, mrays_per_second: rate } in &self.rates {
                let (median, least, most, runs) = (rate.median(), rate.least(), rate.most(), rate.runs.len());
                let _ = writeln!(text, "  {name:<32}{median:>10.3} ({least:.3} to {most:.3}, {runs} runs)");
            }
            for (what, why) in &self.not_timed {
                let _ = writeln!(text, "  {what:<32}left out: {why}");
            }
        }
        let count = |verdict| self.checks.iter().filter(|check| check.verdict == verdict).count();
        let [passed, failed, left_out] = [Verdict::Passed, Verdict::Failed, Verdict::LeftOut].map(count);
        let counts = format!("{passed} checks passed, {failed} failed, {left_out} left out");
        let _ = writeln!(text, "\n{counts}, in {:.0} s", self.seconds);
        if let Some(Check { group, name, scene, .. }) = self.failures().next() {
            let which = format!("{}, {name} ({scene})", group.name());
            let _ = writeln!(text, "first failure: {which}. Later checks depend on earlier ones: begin there.");
        }
        if !self.complete {
            let doing = self.doing.as_deref().unwrap_or("nothing");
            let _ = writeln!(text, "INCOMPLETE: the process ended while it did this: {doing}");
        }
        text
    }
}

fn line(text: &mut String, name: &str, value: impl std::fmt::Display) {
    let _ = writeln!(text, "{name:<16}{value}");
}

fn listed<'n>(names: impl Iterator<Item = &'n str>) -> String {
    let names: Vec<_> = names.collect();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// Formats a value and its limits: `energy 1.002 (0.98 to 1.02)`.
fn figure(figure: &Figure) -> String {
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
