//! Device memory by use, and capacities of lists.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use egui::Ui;
use lanternfish::FrameMemory;

use super::Facts;
use crate::viewport::Viewport;

/// Shortest time between two queries.
const PERIOD: Duration = Duration::from_secs(1);

/// Device memory.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    queried: Option<Instant>,
    /// Memory that is kept between frames.
    pub frames: FrameMemory,
    /// Bytes of all allocations by use: the first part of each label. Empty if the backend reports no allocations.
    pub by_use: Vec<(String, u64)>,
    /// Bytes that the allocator has reserved on the device; 0 if unknown.
    pub reserved: u64,
}

impl Memory {
    /// Queries the memory, at most once per [`PERIOD`].
    pub fn refresh(&mut self, viewport: &Viewport) {
        if self.queried.is_some_and(|queried| queried.elapsed() < PERIOD) {
            return;
        }
        (self.queried, self.frames) = (Some(Instant::now()), viewport.memory());
        if let Some(report) = viewport.gpu.device.generate_allocator_report() {
            let all = report.allocations.iter().map(|one| (one.name.as_str(), one.size));
            (self.by_use, self.reserved) = (by_use(all), report.total_reserved_bytes);
        }
    }
}

/// Sums by the first part of each label, largest first.
fn by_use<'a>(all: impl Iterator<Item = (&'a str, u64)>) -> Vec<(String, u64)> {
    let mut sums = BTreeMap::new();
    for (label, bytes) in all {
        let word = label.split('/').next().filter(|word| !word.is_empty()).unwrap_or("unnamed");
        *sums.entry(word).or_insert(0) += bytes;
    }
    let mut sums: Vec<_> = sums.into_iter().map(|(word, bytes)| (word.to_owned(), bytes)).collect();
    sums.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    sums
}

pub fn show(ui: &mut Ui, facts: &Facts<'_>) {
    let Memory { frames, by_use, reserved, .. } = facts.memory;
    ui.label(format!("{} kept for the next frame", mib(frames.bytes)))
        .on_hover_text("Buffers and textures of a frame that the next one reuses");
    if !by_use.is_empty() {
        let all = by_use.iter().map(|(_, bytes)| bytes).sum();
        ui.label(format!("{} on the device in total, of {} reserved", mib(all), mib(*reserved)));
        table(ui, "memory", by_use.iter().map(|(word, bytes)| (word.as_str(), mib(*bytes))));
    }
    if !frames.lists.is_empty() {
        ui.strong("List capacities, elements");
        table(ui, "capacities", frames.lists.iter().map(|(name, capacity)| (*name, capacity.to_string())));
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
    fn memory_is_demodulated_by_use() {
        let all = [("scene/positions", 10), ("indirect/layers", 3), ("scene/lights", 1), ("", 2)];
        let expected = [("scene", 11), ("indirect", 3), ("unnamed", 2)].map(|(word, bytes)| (word.to_owned(), bytes));
        assert_eq!(by_use(all.into_iter()), expected);
        assert_eq!(mib(3 << 19), "1.5 MiB");
    }
}
