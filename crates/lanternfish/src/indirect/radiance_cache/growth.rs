//! Capacity of the table, which grows.

use lanternfish_gpu::{Counted, Frame};

use super::{CacheOfFrame, RadianceCache};
use crate::{context::ViewContext, error::RenderError};

/// Least number of slots of a table: those that one lookup probes, and the size of a workgroup.
const LEAST_SLOTS: u32 = 64;
/// First capacity of a table, entries.
const FIRST_ENTRIES: u32 = 1 << 17;

#[cfg(any(test, feature = "testing"))]
thread_local! {
    /// Replaces [`FIRST_ENTRIES`] in tests.
    pub(crate) static FIRST_ENTRIES_IN_TESTS: std::cell::Cell<u32> = const { std::cell::Cell::new(FIRST_ENTRIES) };
}

/// First capacity of a table, entries.
pub(super) fn first_entries() -> u32 {
    #[cfg(any(test, feature = "testing"))]
    return FIRST_ENTRIES_IN_TESTS.get();
    #[cfg(not(any(test, feature = "testing")))]
    FIRST_ENTRIES
}

/// Counters: `bindings.wesl`. The first one is the list length that determines the table's capacity.
pub(super) const COUNTERS: &[&str] =
    &["radiance_cache/entries", "radiance_cache/samples", "radiance_cache/lost", "indirect/lost_entries"];
/// Name of that list in the capacity policy.
pub(super) const ENTRIES_LIST: &str = "entries of the radiance cache";

/// Slots of a table for so many entries. At least half of them stay empty: a table that is nearly full loses entries.
pub(super) fn slots_for(entries: u32) -> u32 {
    (2 * entries).next_power_of_two().max(LEAST_SLOTS)
}

/// Number of entries to expect at the end of an image's first frame, if there are so many after this sample index.
fn expected_entries(entries: u32, sample_index: u32) -> u32 {
    let done = u64::from(sample_index) + 1;
    (u64::from(entries) * (done + 2) / done).min(u32::MAX.into()) as u32
}

/// True if a table holds so many entries without losing any. Tables lose the first ones when two thirds of their slots
/// are taken.
fn has_room(slots: u32, entries: u32) -> bool {
    5 * u64::from(entries) <= 3 * u64::from(slots)
}

impl RadianceCache {
    /// Empties the table of an image's first frame, so that its entries do not depend on rays before.
    pub fn forget(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        cache: &mut CacheOfFrame,
    ) -> Result<(), RenderError> {
        self.table.get(frame).iter_mut().for_each(|table| table.used_in = u64::MAX);
        *cache = self.begin(frame, view)?;
        Ok(())
    }

    /// True if an image's first frame has to start over because the table was too small. It is then replaced by a
    /// larger, empty one, and the view's rays have to look up their entries again. `sample_index`: the last processed
    /// one of `sample_count`.
    ///
    /// The check blocks the frame. Before the last sample index it is skipped once a frame has been completed with this
    /// table. In the first quarter of the sample indices a table that is expected to become too small counts as such,
    /// since starting over later costs more.
    pub fn starts_over(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        cache: &mut CacheOfFrame,
        sample_index: u32,
        sample_count: u32,
    ) -> Result<bool, RenderError> {
        let is_last = sample_index + 1 == sample_count;
        let was_large_enough = self.table.get(frame).as_ref().is_some_and(|table| table.was_large_enough);
        if !is_last && (was_large_enough || !cache.may_start_over) {
            return Ok(false);
        }
        let counted = Counted {
            list: ENTRIES_LIST,
            words: cache.counters.buffer(),
            starts: (cache.counters.buffer(), 0),
            may_wrap: &|_| false,
            guess: 0,
            limit: slots_for(self.most_entries).into(),
        };
        // Hits without an entry are shaded, so that the frame is complete in any case.
        let [entries, _, lost, lost_of_pixels] = frame.counted_capacity(&counted, u64::MAX)?.words;
        let most = slots_for(self.most_entries);
        let is_early = 4 * (sample_index + 1) <= sample_count;
        let will_lose = is_early && !has_room(self.slots, expected_entries(entries, sample_index));
        let is_full = lost > 0 || lost_of_pixels > 0 || will_lose;
        if !cache.may_start_over || self.slots >= most || !is_full {
            self.table.get(frame).iter_mut().for_each(|table| table.was_large_enough |= is_last);
            return Ok(false);
        }
        // The number of entries will grow further.
        self.slots = (2 * self.slots).max(slots_for(2 * entries)).min(most);
        tracing::debug!(entries, slots = self.slots, "the radiance cache starts over with a larger table");
        *self.table.get(frame) = None;
        *cache = self.begin(frame, view)?;
        Ok(true)
    }
}

#[cfg(test)]
#[test]
fn tables_that_become_too_small_are_found_in_the_first_quarter_of_the_sample_indices() {
    // Entries after 1, 2, 4, and all 20 sample indices: the atrium at four widths, the street, the hall, and Sponza.
    for (width, counts, all) in [
        (1280, [102_340, 130_821, 160_701], 228_892),
        (640, [62_342, 92_052, 125_037], 191_769),
        (480, [47_033, 75_355, 110_366], 179_156),
        (320, [29_542, 54_148, 90_305], 157_519),
        (640, [18_591, 27_323, 39_754], 71_892),
        (640, [19_254, 21_396, 23_265], 36_171),
        (640, [30_490, 40_365, 50_786], 93_930),
    ] {
        let slots = slots_for(FIRST_ENTRIES);
        let is_found =
            counts.iter().zip([0, 1, 3]).any(|(&count, index)| !has_room(slots, expected_entries(count, index)));
        assert_eq!(is_found, all > slots / 8 * 5, "{width}: {all} of {slots}");
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
fn smallest_table_is_probed_completely() {
    let constant = |name| crate::shaders::constant("indirect/radiance_cache/table", name);
    assert_eq!(constant("BUCKET") * constant("PROBES"), f64::from(LEAST_SLOTS));
}
