//! Rows of the tables of speed.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::pass_costs::{PassCost, dispatches};

/// A measured rate.
#[derive(Debug, Serialize, Deserialize)]
pub struct Rate {
    pub name: String,
    /// Unit: `Mrays/s`, `Mkeys/s`.
    pub unit: String,
    pub median: f64,
    pub least: f64,
    pub most: f64,
    pub runs: usize,
    /// Clocks while it was measured, if a program tells them.
    #[serde(default)]
    pub clocks: Option<String>,
    /// A hash of its results; rates of one list with different results do not compare.
    #[serde(default)]
    pub result: Option<String>,
}

impl Rate {
    /// True if it has other results than the first of these rates with the same list, the text before the last colon.
    pub fn differs_from(&self, all: &[Self]) -> bool {
        let list = |rate: &Self| rate.name.rsplit_once(':').map(|(list, _)| list.to_owned());
        let first = all.iter().find(|rate| list(rate) == list(self));
        self.result.is_some() && first.is_some_and(|first| first.result != self.result)
    }
}

/// Times of a frame.
#[derive(Debug, Serialize, Deserialize)]
pub struct Timed {
    pub name: String,
    pub width: u32,
    pub height: u32,
    pub lights: usize,
    pub runs: usize,
    /// Milliseconds on the device, all passes: median, least and most of the runs. Host time if `is_wall`.
    pub median_ms: f64,
    pub least_ms: f64,
    pub most_ms: f64,
    /// True if the device has no timestamps and the host's clock was read.
    pub is_wall: bool,
    /// Median of each pass, ms, in order.
    pub passes: Vec<(String, f64)>,
    /// Single commands of all runs that took longer than [`super::WATCHDOG_MS`], the longest of each pass: pass, ms.
    pub over_watchdog: Vec<(String, f64)>,
    /// Host time of the frame, reading the image back included: median of the runs, ms. 0 in old reports.
    #[serde(default)]
    pub wall_ms: f64,
    /// Dispatches and rays of each pass, in order.
    #[serde(default)]
    pub costs: Vec<PassCost>,
    /// Memory of the device after the last run: of the buffers and textures that frames reuse, and of everything if the API tells it.
    #[serde(default)]
    pub memory: Option<(u64, Option<u64>)>,
    /// Clocks while it was measured, if a program tells them.
    #[serde(default)]
    pub clocks: Option<String>,
    /// Counters of the last run, such as rays.
    pub counters: Vec<(String, u64)>,
    /// Why there are no times.
    pub reason: Option<String>,
}

impl Timed {
    /// Time of the host's frame in which no pass ran, ms.
    pub fn idle_ms(&self) -> f64 {
        self.wall_ms - self.passes.iter().map(|(_, ms)| ms).sum::<f64>()
    }

    /// Dispatches and memory.
    pub fn extent(&self) -> String {
        let mut text = format!("{} dispatches", dispatches(self.costs.iter()));
        if let Some((frame, device)) = self.memory {
            let mib = |bytes: u64| format!("{:.0} MiB", bytes as f64 / f64::from(1 << 20));
            let device = device.map_or_else(|| "unknown".to_owned(), mib);
            let _ = write!(text, ", memory of frames {}, of the device {device}", mib(frame));
        }
        text
    }
}
