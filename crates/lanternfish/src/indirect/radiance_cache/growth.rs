//! Capacity of the table, which grows.

use lanternfish_gpu::{Counted, Frame};

use super::{CacheOfFrame, RadianceCache};
use crate::{context::ViewContext, error::RenderError};

/// Slots of a table at least: those that an entry may be in, and that one workgroup looks at.
const LEAST_SLOTS: u32 = 64;
/// Entries that a table has room for at first.
const FIRST_ENTRIES: u32 = 1 << 17;

#[cfg(any(test, feature = "testing"))]
thread_local! {
    /// What stands for [`FIRST_ENTRIES`] in tests.
    pub(crate) static FIRST_ENTRIES_IN_TESTS: std::cell::Cell<u32> = const { std::cell::Cell::new(FIRST_ENTRIES) };
}

/// Entries that a table has room for at first.
pub(super) fn first_entries() -> u32 {
    #[cfg(any(test, feature = "testing"))]
    return FIRST_ENTRIES_IN_TESTS.get();
    #[cfg(not(any(test, feature = "testing")))]
    FIRST_ENTRIES
}

/// What is counted: `bindings.wesl`. The first one is the length of the list that the table's room goes by.
pub(super) const COUNTERS: &[&str] =
    &["radiance_cache/entries", "radiance_cache/samples", "radiance_cache/lost", "indirect/lost_entries"];
/// Name of that list.
pub(super) const CELLS: &str = "entries of the radiance cache";

/// Slots of a table for so many entries. Half of them stay empty: a table that is nearly full loses entries.
pub(super) fn slots_for(entries: u32) -> u32 {
    (2 * entries).next_power_of_two().max(LEAST_SLOTS)
}

impl RadianceCache {
    /// Whether in an image's first frame there was no room for an entry so far, and may be: the table is another one then, larger and without entries,
    /// and the view's rays have to look up their entries again. `round`: the one behind which it is asked, of so many rounds. Before the last one it is
    /// asked as long as no frame has ended with this table, since each time the frame waits; and in the first quarter of them a table that is half
    /// full already is too small: later is dearer.
    pub fn starts_over(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        cache: &mut CacheOfFrame,
        round: u32,
        rounds: u32,
    ) -> Result<bool, RenderError> {
        let is_last = round + 1 == rounds;
        if !is_last && (self.was_large_enough || !cache.may_start_over) {
            return Ok(false);
        }
        let counted = Counted {
            list: CELLS,
            words: cache.counters.buffer(),
            starts: (cache.counters.buffer(), 0),
            may_wrap: &|_| false,
            guess: 0,
            limit: slots_for(self.most_entries).into(),
        };
        // What has no room is shaded: the frame is whole.
        let [entries, _, lost, lost_of_pixels] = frame.counted_capacity(&counted, u64::MAX)?.words;
        let most = slots_for(self.most_entries);
        let will_lose = 4 * (round + 1) <= rounds && 2 * entries > self.slots;
        let is_full = lost > 0 || lost_of_pixels > 0 || will_lose;
        if !cache.may_start_over || self.slots >= most || !is_full {
            self.was_large_enough |= is_last;
            return Ok(false);
        }
        self.was_large_enough = false;
        // There will be more.
        self.slots = (2 * self.slots).max(slots_for(2 * entries)).min(most);
        tracing::debug!(entries, slots = self.slots, "the radiance cache starts over with a larger table");
        self.table = None;
        *cache = self.begin(frame, view)?;
        Ok(true)
    }
}

#[cfg(test)]
#[test]
fn counters_are_the_shaders() {
    let constant = |name| crate::shaders::constant("indirect/radiance_cache/bindings", name);
    assert_eq!(constant("ENTRY_COUNTERS"), COUNTERS.len() as f64);
    assert_eq!(["CELLS", "SAMPLES", "LOST", "LOST_OF_PIXELS"].map(constant), [0.0, 1.0, 2.0, 3.0]);
}

#[cfg(test)]
#[test]
fn the_smallest_table_is_looked_through() {
    let constant = |name| crate::shaders::constant("indirect/radiance_cache/table", name);
    assert_eq!(constant("BUCKET") * constant("PROBES"), f64::from(LEAST_SLOTS));
}
