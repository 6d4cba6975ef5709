//! The cost of an image: times, dispatches, counters, memory.

use lanternfish_gpu::{PassCommands, PassTime};

/// Time and counters of an image.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Device time of each pass, in order, summed over all frames; empty if the device has no timestamp queries.
    pub passes: Vec<PassTime>,
    /// Dispatches of each pass, by label, in order, summed over all frames. They are counted on any device.
    pub commands: Vec<PassCommands>,
    /// Exact counters by name; for averaged frames those of the last one.
    pub counters: Vec<(String, u64)>,
}

impl Report {
    /// Adds the cost of another image. Passes and counters of one name become one.
    #[doc(hidden)]
    pub fn add(&mut self, other: Self) {
        for pass in other.passes {
            match self.passes.iter_mut().find(|sum| sum.name == pass.name) {
                Some(sum) => sum.ms += pass.ms,
                None => self.passes.push(pass),
            }
        }
        for pass in other.commands {
            match self.commands.iter_mut().find(|sum| sum.name == pass.name) {
                Some(sum) => {
                    sum.dispatches += pass.dispatches;
                    sum.indirect += pass.indirect;
                }
                None => self.commands.push(pass),
            }
        }
        for (name, count) in other.counters {
            match self.counters.iter_mut().find(|(sum, _)| *sum == name) {
                Some((_, sum)) => *sum += count,
                None => self.counters.push((name, count)),
            }
        }
    }
}

/// Device memory that successive frames reuse.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameMemory {
    /// Size of the buffers and textures that its frames reuse, bytes: what one frame needs, and what the last four frames needed
    /// besides.
    pub bytes: u64,
    /// Size of everything on the device, bytes: these buffers and textures, scenes, deep images, means, histories, and what other users
    /// of the device have. `None` if the API does not tell.
    pub device_bytes: Option<u64>,
    /// Name and capacity, in elements, of every counted list.
    pub lists: Vec<(&'static str, u64)>,
}
