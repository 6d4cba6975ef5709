//! CPU reference of the radiance cache, for tests: the algorithms of the shaders of this folder, one entry after the other.
//!
//! | here | shaders |
//! |---|---|
//! | `hashing` | `hashing.wesl` |
//! | `table` | `table.wesl`, `rehash.wesl` |
//! | `vote` | `vote.wesl`, `planes.wesl`, `intersect.wesl`, `sampled/hit_point.wesl` |
//! | `schedule` | `schedule.wesl` |
//! | `accumulate` | `accumulate.wesl` |
//! | `propagate` | `propagate.wesl` |
//! | `rgbe` | `rgbe.wesl` |

pub(super) mod accumulate;
pub(super) mod hashing;
pub(super) mod propagate;
pub(super) mod rgbe;
pub(super) mod schedule;
mod table;
pub(super) mod vote;

use glam::Vec4;

pub(super) use self::hashing::Entry;
use super::parameters::{EntrySample, Link};

/// Capacity of an entry's hit list.
pub(super) const LISTED: usize = 16;

/// A table of entries, one element per slot.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    /// 0: the slot is empty.
    pub keys: Vec<u32>,
    pub hashes: Vec<u32>,
    /// Outgoing radiance, with a shared exponent; 0: unknown.
    pub rgbe: Vec<u32>,
    /// The largest priority of the votes since the entry was last scheduled; 0: none.
    pub votes: Vec<u32>,
    /// The frame in which the entry was last requested.
    pub requested: Vec<u32>,
    /// The sample position of the entry, and its rank.
    pub samples: Vec<EntrySample>,
    /// Outgoing radiance of each level, and its number of samples: `level_at` of `table.wesl`.
    pub light: Vec<Vec<Vec4>>,
    /// Its last hits, the newest first.
    pub hits: Vec<[Link; LISTED]>,
    /// Mean of what earlier hits brought when they left the list, for each step of propagation.
    pub earlier: Vec<Vec<Vec4>>,
}

impl Table {
    /// Creates an empty table with so many slots, radiance levels and means of earlier hits.
    pub fn new(slots: u32, levels: usize, steps: usize) -> Self {
        let slots = slots as usize;
        let [keys, hashes, rgbe, votes, requested] = [(); 5].map(|()| vec![0; slots]);
        let lights = |count| vec![vec![Vec4::ZERO; slots]; count];
        let (samples, hits) = (vec![EntrySample::default(); slots], vec![[Link::default(); LISTED]; slots]);
        Self { keys, hashes, rgbe, votes, requested, samples, light: lights(levels), hits, earlier: lights(steps) }
    }

    pub fn slots(&self) -> u32 {
        self.keys.len() as u32
    }

    /// Slots that are taken, in order.
    pub fn taken(&self) -> impl Iterator<Item = usize> {
        (0..self.keys.len()).filter(|slot| self.keys[*slot] != 0)
    }
}
