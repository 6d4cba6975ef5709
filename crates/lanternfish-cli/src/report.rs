//! Report of a run: a table for people, JSON for scripts.

use std::{collections::BTreeMap, fmt::Write, path::Path};

use lanternfish::{
    FrameMemory, Report,
    settings::{Settings, Shadows},
};
use lanternfish_gpu::AdapterDescription;
use lanternfish_papers::Deep;
use serde::Serialize;

use crate::{parse::Size, scene::SceneName};

/// The report of a run.
#[derive(Debug, Serialize)]
struct RunReport<'r> {
    /// Lanternfish's version.
    version: &'static str,
    scene: &'r SceneName,
    /// The image's path.
    output: String,
    adapter: &'r str,
    backend: &'r str,
    driver: &'r str,
    width: u32,
    height: u32,
    /// Number of images in a sequence, whose costs are summed; `None` for a single image.
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<u32>,
    /// Exposure of the image, EV; `None` for radiance.
    #[serde(skip_serializing_if = "Option::is_none")]
    exposure_ev: Option<f32>,
    /// Values of settings, by flag name.
    settings: BTreeMap<&'static str, String>,
    /// Passes in order of execution.
    passes: Vec<Pass<'r>>,
    /// Counters by name, exact on any machine.
    counters: BTreeMap<&'r str, u64>,
    memory: Memory,
    /// Seconds of each step, and `total` from the start of the process.
    seconds: BTreeMap<&'static str, f64>,
    /// Peak memory of the process; `None` if the system does not report it.
    peak_memory_bytes: Option<u64>,
}

#[derive(Debug, Serialize)]
struct Pass<'r> {
    name: &'r str,
    /// Milliseconds; `None` if the device has no timestamps.
    ms: Option<f64>,
    /// Number of dispatches; 0 for a render pass.
    dispatches: u32,
    /// Number of those whose number of workgroups the device reads.
    indirect: u32,
}

/// The passes of a run, in order.
fn passes(cost: &Report) -> impl Iterator<Item = Pass<'_>> {
    let ms_of = |name: &str| cost.passes.iter().find(|pass| pass.name == name).map(|pass| pass.ms);
    cost.commands.iter().map(move |pass| Pass {
        name: &pass.name,
        ms: ms_of(&pass.name),
        dispatches: pass.dispatches,
        indirect: pass.indirect,
    })
}

/// Memory of the device after the last image.
#[derive(Clone, Copy, Debug, Serialize)]
struct Memory {
    /// Buffers and textures that frames reuse, bytes.
    frame_bytes: u64,
    /// Everything, bytes; `None` if the API does not tell.
    device_bytes: Option<u64>,
}

impl Memory {
    fn of(memory: &FrameMemory) -> Self {
        Self { frame_bytes: memory.bytes, device_bytes: memory.device_bytes }
    }
}

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
    /// Seconds of each step, and `total` from the start of the process.
    pub seconds: &'r [(&'static str, f64)],
}

impl Run<'_> {
    /// The report as JSON, for scripts.
    pub fn to_json(&self) -> String {
        let report = RunReport {
            version: env!("CARGO_PKG_VERSION"),
            scene: self.scene,
            output: self.output.display().to_string(),
            adapter: &self.adapter.name,
            backend: &self.adapter.backend,
            driver: &self.adapter.driver,
            width: self.size.width,
            height: self.size.height,
            frames: self.frames,
            exposure_ev: self.exposure,
            settings: settings_by_name(self.settings, self.seed),
            passes: passes(self.cost).collect(),
            counters: self.cost.counters.iter().map(|(name, value)| (name.as_str(), *value)).collect(),
            memory: Memory::of(self.memory),
            seconds: self.seconds.iter().copied().collect(),
            peak_memory_bytes: peak_memory_bytes(),
        };
        let mut text = serde_json::to_string_pretty(&report).expect("plain numbers and strings");
        text.push('\n');
        text
    }

    /// The report as a table, for people.
    pub fn to_table(&self) -> String {
        let Size { width, height } = self.size;
        let exposure = self.exposure.map(|ev| format!("exposure {ev:+} EV\n")).unwrap_or_default();
        format!(
            "adapter  {}\ndriver   {}\nsize     {width}x{height}\n{exposure}\n{}",
            self.adapter.name,
            self.adapter.driver,
            table(self.cost, Memory::of(self.memory), self.seconds)
        )
    }
}

/// Settings by flag name: those of deep images only if something traces them.
pub(crate) fn settings_by_name(settings: &Settings, seed: u32) -> BTreeMap<&'static str, String> {
    let has_structure = settings.occlusion.is::<Deep>()
        || settings.indirect.is_some()
        || matches!(settings.shadows.technique, Shadows::Traced(tracer) if !tracer.is_exact());
    let shown = Settings::parameters().into_iter().filter(|entry| has_structure || entry.kind != "structure");
    let mut names: BTreeMap<_, _> =
        shown.filter_map(|entry| Some((entry.info.name, settings.get(entry.info.name)?))).collect();
    names.insert("seed", seed.to_string());
    names
}

/// Passes, counters, memory and steps as a table.
fn table(cost: &Report, memory: Memory, seconds: &[(&'static str, f64)]) -> String {
    let counters = &cost.counters;
    let names = cost.commands.iter().map(|p| p.name.as_str()).chain(counters.iter().map(|(name, _)| name.as_str()));
    let width = names.map(|name| name.chars().count()).max().unwrap_or(0).max("counter".len());
    let mut text = String::new();
    // Writing to a String cannot fail.
    let mut line = |name: &str, value: String| writeln!(text, "{name:<width$}  {value:>14}").expect("String");
    if !cost.commands.is_empty() {
        let row = |ms: Option<f64>, dispatches: u32, indirect: u32| {
            let ms = ms.map(|ms| format!("{ms:.3}")).unwrap_or_default();
            let shown = |count: u32| if count > 0 { count.to_string() } else { String::new() };
            format!("{ms:>14}  {:>10}  {:>8}", shown(dispatches), shown(indirect))
        };
        line("pass", format!("{:>14}  {:>10}  {:>8}", "ms", "dispatches", "indirect"));
        passes(cost).for_each(|pass| line(pass.name, row(pass.ms, pass.dispatches, pass.indirect)));
        let ms = passes(cost).filter_map(|pass| pass.ms).reduce(|sum, ms| sum + ms);
        let total = |of: fn(&Pass<'_>) -> u32| passes(cost).map(|pass| of(&pass)).sum();
        line("all passes", row(ms, total(|pass| pass.dispatches), total(|pass| pass.indirect)));
        line("", String::new());
    }
    if !counters.is_empty() {
        line("counter", "value".to_owned());
        for (name, value) in counters {
            line(name, grouped(*value));
        }
        line("", String::new());
    }
    line("memory", "MiB".to_owned());
    let mib = |bytes: u64| format!("{:.1}", bytes as f64 / f64::from(1 << 20));
    line("frame", mib(memory.frame_bytes));
    line("device", memory.device_bytes.map_or_else(|| "unknown".to_owned(), mib));
    line("", String::new());
    line("step", "s".to_owned());
    for (name, seconds) in seconds {
        line(name, format!("{seconds:.2}"));
    }
    text.lines().flat_map(|line| [line.trim_end(), "\n"]).collect()
}

/// Formats a count with commas between thousands.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
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
    fn thousands_are_grouped() {
        for (count, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (262_267, "262,267"), (1_000_000, "1,000,000")] {
            assert_eq!(grouped(count), text);
        }
    }

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
        let memory = Memory { frame_bytes: 3 << 19, device_bytes: None };
        let table = table(&cost, memory, &[("load", 0.5)]);
        for line in [
            "prepass                   1.500",
            "sort                                     12         3",
            "all passes                3.750          12         3",
            "rays                     12,345",
            "frame                       1.5",
            "device                  unknown",
            "load                       0.50",
        ] {
            assert!(table.lines().any(|l| l == line), "{line:?} is not in\n{table}");
        }
        assert!(table.lines().all(|line| line == line.trim_end()));
    }
}
