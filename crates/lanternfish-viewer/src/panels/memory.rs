//! Device memory: amounts by use, and capacities of lists.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use egui::Ui;
use lanternfish::FrameMemory;

use super::Facts;
use crate::viewport::Viewport;

/// How often it is asked, at most.
const PERIOD: Duration = Duration::from_secs(1);

/// What is on the device.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    requested: Option<Instant>,
    /// What frames keep.
    pub frames: FrameMemory,
    /// Bytes of everything, by what it is for: the first word of its label. Empty where the driver is not wgpu's to ask.
    pub by_use: Vec<(String, u64)>,
    /// Bytes that were taken of the device for all of it; 0 where that is not known.
    pub reserved: u64,
}

impl Memory {
    /// Asks again, unless it has just been asked.
    pub fn ask_again(&mut self, viewport: &Viewport) {
        if self.requested.is_some_and(|requested| requested.elapsed() < PERIOD) {
            return;
        }
        (self.requested, self.frames) = (Some(Instant::now()), viewport.memory());
        if let Some(report) = viewport.gpu.device.generate_allocator_report() {
            let all = report.allocations.iter().map(|one| (one.name.as_str(), one.size));
            (self.by_use, self.reserved) = (by_use(all), report.total_reserved_bytes);
        }
    }
}

/// Sums by the first word of each label, the largest first.
fn by_use<'a>(all: impl Iterator<Item = (&'a str, u64)>) -> Vec<(String, u64)> {
    let mut sums = BTreeMap::new();
    for (label, bytes) in all {
        let word = label.split('/').next().filter(|word| !word.is_empty()).unwrap_or("without a name");
        *sums.entry(word).or_insert(0) += bytes;
    }
    let mut sums: Vec<_> = sums.into_iter().map(|(word, bytes)| (word.to_owned(), bytes)).collect();
    sums.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    sums
}

pub fn show(ui: &mut Ui, facts: &Facts<'_>) {
    let Memory { frames, by_use, reserved, .. } = facts.memory;
    ui.label(format!("{} kept for the next frame", mib(frames.bytes)))
        .on_hover_text("Buffers and textures of frames, which the next one uses again");
    if !by_use.is_empty() {
        let all = by_use.iter().map(|(_, bytes)| bytes).sum();
        ui.label(format!("{} on the device in all, of {} reserved", mib(all), mib(*reserved)));
        table(ui, "memory", by_use.iter().map(|(word, bytes)| (word.as_str(), mib(*bytes))));
    }
    if !frames.lists.is_empty() {
        ui.strong("List capacities, elements");
        table(ui, "rooms", frames.lists.iter().map(|(name, room)| (*name, room.to_string())));
    }
}

fn table<'a>(ui: &mut Ui, id: &str, rows: impl Iterator<Item = (&'a str, String)>) {
    egui::Grid::new(id).striped(true).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        }
    });
}

fn mib(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_summed_by_what_it_is_for() {
        let all = [("scene/positions", 10), ("indirect/layers", 3), ("scene/lights", 1), ("", 2)];
        let expected =
            [("scene", 11), ("indirect", 3), ("without a name", 2)].map(|(word, bytes)| (word.to_owned(), bytes));
        assert_eq!(by_use(all.into_iter()), expected);
        assert_eq!(mib(3 << 19), "1.5 MiB");
    }
}
