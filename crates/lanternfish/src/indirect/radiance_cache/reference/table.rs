//! Open addressing with buckets of four slots.

use std::collections::BTreeMap;

use glam::UVec4;

use super::{Entry, Table};
use crate::{common::random::random_words, indirect::radiance_cache::RadianceCacheParameters};

const BUCKET: u32 = 4;
const PROBES: u32 = 16;

/// The buckets that a lookup probes, in order: the first, and those at a distance of 1, 3, 6, 10 … from it.
fn buckets(hash: u32, slots: u32) -> impl Iterator<Item = u32> {
    let first = (hash % slots) / BUCKET;
    (0..PROBES).map(move |probe| (first + probe * (probe + 1) / 2) % (slots / BUCKET))
}

impl Table {
    /// The slots that a lookup probes, in order.
    fn probed(&self, entry: Entry) -> impl Iterator<Item = usize> + use<> {
        buckets(entry.hash, self.slots())
            .flat_map(|bucket| BUCKET * bucket..BUCKET * (bucket + 1))
            .map(|slot| slot as usize)
    }

    /// The slot of an entry, which is inserted if it is missing; `None`: all its buckets are full.
    pub fn insert(&mut self, entry: Entry) -> Option<u32> {
        let slot = self.probed(entry).find(|slot| [0, entry.key].contains(&self.keys[*slot]))?;
        if self.keys[slot] == 0 {
            self.keys[slot] = entry.key;
            self.hashes[slot] = entry.hash;
        }
        Some(slot as u32)
    }

    /// The slot of an existing entry.
    pub fn find(&self, entry: Entry) -> Option<u32> {
        // Slots are filled in order: an empty one ends the search.
        let slot = self.probed(entry).find(|slot| [0, entry.key].contains(&self.keys[*slot]))?;
        (self.keys[slot] != 0).then_some(slot as u32)
    }

    /// True if all buckets of an entry are full.
    pub fn is_full_for(&self, entry: Entry) -> bool {
        self.probed(entry).all(|slot| self.keys[slot] != 0)
    }

    /// True if an entry migrates to another table: it was requested within `kept` frames.
    pub fn is_kept(&self, slot: usize, parameters: &RadianceCacheParameters) -> bool {
        self.keys[slot] != 0 && parameters.frame.wrapping_sub(self.requested[slot]) <= parameters.kept
    }

    /// A table of so many slots with the migrated entries, and their new slots by old slot. Except for the slots in hit lists, their data does not change;
    /// there are no votes.
    pub fn migrate(&self, slots: u32, parameters: &RadianceCacheParameters) -> (Self, BTreeMap<u32, u32>) {
        let mut new = Self::new(slots, self.light.len(), self.earlier.len());
        let mut moved = BTreeMap::new();
        for old in self.taken().filter(|old| self.is_kept(*old, parameters)) {
            let slot = new.insert(Entry { key: self.keys[old], hash: self.hashes[old] });
            moved.extend(slot.map(|slot| (old as u32, slot)));
        }
        for (old, slot) in &moved {
            let [old, to] = [*old as usize, *slot as usize];
            new.requested[to] = self.requested[old];
            new.samples[to] = self.samples[old];
            for (new, light) in new.light.iter_mut().zip(&self.light) {
                new[to] = light[old];
            }
            if parameters.bounce_levels == 0 {
                continue;
            }
            // A hit of an evicted entry refers to the entry itself.
            new.hits[to] = self.hits[old];
            new.hits[to].iter_mut().for_each(|hit| hit.slot = *moved.get(&hit.slot).unwrap_or(slot));
            for (new, earlier) in new.earlier.iter_mut().zip(&self.earlier) {
                new[to] = earlier[old];
            }
        }
        (new, moved)
    }
}

/// Three quarters of the slots can be filled without losing an entry; not all of them.
#[test]
fn tables_hold_three_quarters_of_their_slots() {
    let words = |i| random_words(UVec4::new(i, 0, 0, 0));
    let entry = |i| Entry { key: words(i).x.max(1), hash: words(i).y };
    let mut table = Table::new(4096, 1, 0);
    assert!((0..3072).all(|i| table.insert(entry(i)).is_some()));
    assert!(!(3072..4160).all(|i| table.insert(entry(i)).is_some()));
}
