//! Report of a run: a table for people, JSON for scripts.

use std::{collections::BTreeMap, path::Path};

use lanternfish::{
    FrameMemory, Report,
    settings::{Settings, Shadows},
};
use lanternfish_gpu::AdapterDescription;
use serde_json::json;

pub use crate::table::grouped;
use crate::{
    parse::Size,
    scene::SceneName,
    table::{Row, decimal, to_json, to_text},
};

/// The input of a report.
#[derive(Debug)]
pub(crate) struct Run<'r> {
    /// The scene.
    pub scene: &'r SceneName,
    /// The image's path.
    pub output: &'r Path,
    /// The adapter.
    pub adapter: &'r AdapterDescription,
    /// Size of the image.
    pub size: Size,
    /// Number of images in a sequence; `None` for a single image.
    pub frames: Option<u32>,
    /// Exposure of the image, EV; `None` for radiance.
    pub exposure: Option<f32>,
    /// The settings.
    pub settings: &'r Settings,
    /// Seed of the light rain.
    pub seed: u32,
    /// Passes and counters.
    pub cost: &'r Report,
    /// Memory of the device after the last image.
    pub memory: &'r FrameMemory,
    /// Stages that have no effect in this scene, and why.
    pub without_effect: &'r [String],
    /// Seconds of each step, and `total` from the start of the process.
    pub seconds: &'r [(&'static str, f64)],
}

impl Run<'_> {
    /// The report as JSON, for scripts.
    pub fn to_json(&self) -> String {
        let Self { adapter, cost, memory, .. } = self;
        let mut report = Row::default()
            .data("version", env!("CARGO_PKG_VERSION"))
            .data("scene", self.scene)
            .data("output", self.output.display().to_string())
            .data("adapter", &adapter.name)
            .data("backend", &adapter.backend)
            .data("driver", &adapter.driver)
            .data("width", self.size.width)
            .data("height", self.size.height);
        // Costs of a sequence are summed.
        if let Some(frames) = self.frames {
            report = report.data("frames", frames);
        }
        if let Some(ev) = self.exposure {
            report = report.data("exposure_ev", decimal(ev));
        }
        let report = report
            .data("settings", settings_by_name(self.settings, self.seed))
            .data("passes", passes(cost))
            // Exact on any machine.
            .data("counters", cost.counters.iter().cloned().collect::<BTreeMap<_, _>>())
            .data("without_effect", self.without_effect)
            .data("memory", json!({ "frame_bytes": memory.bytes, "device_bytes": memory.device_bytes }))
            .data("seconds", self.seconds.iter().copied().collect::<BTreeMap<_, _>>());
        to_json(&report.data("peak_memory_bytes", peak_memory_bytes()))
    }

    /// The report as a table, for people.
    pub fn to_table(&self) -> String {
        let Size { width, height } = self.size;
        let exposure = self.exposure.map(|ev| format!("exposure {ev:+} EV\n")).unwrap_or_default();
        let without_effect = self.without_effect.iter().map(|stage| format!("without effect  {stage}\n"));
        let without_effect: String = without_effect.collect();
        format!(
            "adapter  {}\ndriver   {}\nsize     {width}x{height}\n{exposure}{without_effect}\n{}",
            self.adapter.name,
            self.adapter.driver,
            table(self.cost, self.memory, self.seconds)
        )
    }
}

/// The stages of settings that have no effect: "stage: why". `has_sky`: the scene has an environment.
pub(crate) fn without_effect(settings: &Settings, has_sky: bool, counters: &[(String, u64)]) -> Vec<String> {
    let count = |name: &str| counters.iter().find(|(counter, _)| counter == name).map(|(_, count)| *count);
    let has_ambient = settings.get("occlusion-ambient").is_some_and(|ambient| ambient != "0");
    let is_occluded = settings.occlusion.is_some() && settings.image.debug_view.is_none();
    let has_caustics = settings.caustics.is_some();
    let none = [
        (is_occluded && settings.indirect.sees_environment(), "occlusion: rays of indirect light see the environment"),
        (is_occluded && !has_sky && !has_ambient, "occlusion: no sky"),
        (has_caustics && !settings.finds_caustics(), "caustics: indirect light has them"),
        (has_caustics && count("photons/landed") == Some(0), "caustics: no mirror"),
    ];
    none.into_iter().filter(|(is_without, _)| *is_without).map(|(_, why)| why.to_owned()).collect()
}

/// A pass: milliseconds, `None` if the device has no timestamps; its dispatches, 0 for a render pass; and those of them
/// whose number of workgroups the device reads.
fn pass(name: &str, ms: Option<f64>, [dispatches, indirect]: [u32; 2]) -> Row {
    let shown = |count: u32| if count > 0 { count.to_string() } else { String::new() };
    let row = Row::default().text("name", "pass", name).maybe("ms", "ms", 3, ms);
    let row = row.number("dispatches", "dispatches", dispatches).said_as(shown(dispatches));
    row.number("indirect", "indirect", indirect).said_as(shown(indirect))
}

/// The passes of a run, in order.
fn passes(cost: &Report) -> Vec<Row> {
    let ms_of = |name: &str| cost.passes.iter().find(|pass| pass.name == name).map(|pass| pass.ms);
    cost.commands.iter().map(|of| pass(&of.name, ms_of(&of.name), [of.dispatches, of.indirect])).collect()
}

/// Settings by flag name: those of deep images only if something traces them.
pub(crate) fn settings_by_name(settings: &Settings, seed: u32) -> BTreeMap<&'static str, String> {
    let has_structure = settings.get("occlusion-images").is_some()
        || settings.indirect.is_some()
        || matches!(settings.shadows.technique, Shadows::Traced(tracer) if !tracer.is_exact());
    let shown = Settings::parameters().into_iter().filter(|entry| has_structure || entry.kind != "structure");
    let mut names: BTreeMap<_, _> =
        shown.filter_map(|entry| Some((entry.info.name, settings.get(entry.info.name)?))).collect();
    names.insert("seed", seed.to_string());
    names
}

/// Passes, counters, memory and steps as tables.
fn table(cost: &Report, memory: &FrameMemory, seconds: &[(&'static str, f64)]) -> String {
    let mut passes = passes(cost);
    if !passes.is_empty() {
        let ms = cost.passes.iter().map(|pass| pass.ms).reduce(|sum, ms| sum + ms);
        let total = cost.commands.iter().map(|pass| [pass.dispatches, pass.indirect]);
        passes.push(pass("all passes", ms, total.fold([0; 2], |[a, b], [c, d]| [a + c, b + d])));
    }
    let counter = |(name, count): &(String, u64)| Row::default().text("", "counter", name).count("", "value", *count);
    let mib = |bytes: u64| format!("{:.1}", bytes as f64 / f64::from(1 << 20));
    let device = memory.device_bytes.map_or_else(|| "unknown".to_owned(), mib);
    let memory = [("frame", mib(memory.bytes)), ("device", device)];
    let memory = memory.map(|(name, mib)| Row::default().text("", "memory", name).shown("MiB", mib));
    let counters: Vec<_> = cost.counters.iter().map(counter).collect();
    let tables = [passes, counters, memory.into(), steps(seconds)].map(|rows| to_text(&rows));
    tables.into_iter().filter(|table| !table.is_empty()).collect::<Vec<_>>().join("\n")
}

/// Seconds of each step.
pub(crate) fn steps(seconds: &[(&'static str, f64)]) -> Vec<Row> {
    let step = |(name, seconds): &(&str, f64)| Row::default().text("", "step", name).fixed("", "s", 2, *seconds);
    seconds.iter().map(step).collect()
}

/// Peak memory of this process, bytes: `VmHWM` on Linux; `None` elsewhere.
fn peak_memory_bytes() -> Option<u64> {
    peak_in_status(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn peak_in_status(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kibibytes| 1024 * kibibytes)
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::PassCommands;

    use super::*;

    #[test]
    fn peak_memory_is_read() {
        assert_eq!(peak_in_status("Name:\tx\nVmHWM:\t    2048 kB\nVmRSS:\t 1 kB\n"), Some(2 << 20));
        assert_eq!(peak_in_status("Name:\tx\n"), None);
        #[cfg(target_os = "linux")]
        assert!(peak_memory_bytes().unwrap() > 100_000);
    }

    #[test]
    fn the_table_lists_passes_counters_and_steps() {
        let pass = |name: &str, ms| lanternfish_gpu::PassTime { name: name.to_owned(), ms };
        let commands = |name: &str, dispatches, indirect| PassCommands { name: name.to_owned(), dispatches, indirect };
        let cost = Report {
            passes: vec![pass("prepass", 1.5), pass("shading/forward", 2.25)],
            commands: vec![commands("prepass", 0, 0), commands("sort", 12, 3), commands("shading/forward", 0, 0)],
            counters: vec![("rays".to_owned(), 12345)],
        };
        let memory = FrameMemory { bytes: 3 << 19, device_bytes: None, ..FrameMemory::default() };
        let table = table(&cost, &memory, &[("load", 0.5)]);
        for words in [
            "pass ms dispatches indirect",
            "prepass 1.500",
            "sort – 12 3",
            "all passes 3.750 12 3",
            "rays 12,345",
            "frame 1.5",
            "device unknown",
            "load 0.50",
        ] {
            let is_there = |line: &str| line.split_whitespace().eq(words.split_whitespace());
            assert!(table.lines().any(is_there), "{words:?} is not in\n{table}");
        }
        assert!(table.lines().all(|line| line == line.trim_end()));
    }
}
