//! Capacity of a list, from its lengths in recent frames.

use std::collections::VecDeque;

use super::LIST_WORDS;

/// Number of recent frames that determine the capacity. A larger number delays shrinking.
const RECENT_FRAMES: usize = 64;
/// Minimum capacity with deferred readback, elements.
const LEAST: u64 = 1 << 12;

#[derive(Debug, Default)]
pub(super) struct Capacity {
    capacity: u64,
    limit: u64,
    /// The words of the longest list of the last frame that has arrived.
    pub last: [u32; LIST_WORDS],
    /// Length of the longest list of the frame that is arriving, elements.
    arriving: Option<u64>,
    /// Lengths in recent frames, newest first, elements.
    recent: VecDeque<u64>,
}

impl Capacity {
    /// With blocking readback, after counting: capacity for all elements. It never shrinks.
    pub fn grow_for(&mut self, list: &str, guess: u64, limit: u64, elements: u64) -> u64 {
        if elements > self.capacity && self.capacity > 0 {
            tracing::debug!(elements, capacity = self.capacity, "{list} grows");
        }
        // A list above the limit is refused and does not change the capacity.
        let wanted = if elements > limit { 0 } else { elements };
        self.capacity = self.capacity.max(guess).max(wanted).min(limit);
        self.capacity
    }

    /// Capacity, elements.
    pub fn capacity(&self) -> u64 {
        self.capacity
    }

    /// With blocking readback, before counting: the capacity of earlier frames.
    pub fn before_counting(&self, guess: u64, limit: u64) -> u64 {
        self.capacity.max(guess).min(limit)
    }

    /// With deferred readback: the capacity from earlier frames.
    pub fn planned(&mut self, guess: u64, limit: u64) -> u64 {
        self.limit = limit;
        self.capacity = self.capacity.max(guess).max(LEAST).min(limit);
        self.capacity
    }

    /// Notes the words of one list of a frame that has run.
    pub fn arrives(&mut self, words: [u32; LIST_WORDS]) {
        let elements = u64::from(words[0]);
        if self.arriving.is_none_or(|most| elements > most) {
            self.last = words;
        }
        self.arriving = Some(self.arriving.unwrap_or(0).max(elements));
    }

    /// Adapts the capacity after all lists of a frame have arrived. The target is 3/2 of the largest recent length. The capacity is set to
    /// it if more than 4/5 is used, or if the target is less than half of it. Returns true if the capacity changes.
    pub fn adapt(&mut self) -> bool {
        let Some(needed) = self.arriving.take() else { return false };
        self.recent.truncate(RECENT_FRAMES - 1);
        self.recent.push_front(needed);
        let most = self.recent.iter().copied().max().unwrap_or(0);
        let wanted = (most + most / 2).clamp(LEAST.min(self.limit), self.limit);
        let before = self.capacity;
        if 5 * most > 4 * before || 2 * wanted < before {
            tracing::debug!(most, capacity = before, wanted, "a list's capacity changes");
            self.capacity = wanted;
        }
        self.capacity != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The capacity of a list after frames with these lengths.
    fn after(needs: impl IntoIterator<Item = u32>, limit: u64) -> Capacity {
        let mut capacity = Capacity { limit, capacity: LEAST.min(limit), ..Capacity::default() };
        for needed in needs {
            capacity.arrives([needed, 0, 0, 0]);
            capacity.adapt();
        }
        capacity
    }

    #[test]
    fn a_refused_list_does_not_change_the_capacity() {
        let mut capacity = Capacity::default();
        assert_eq!(capacity.grow_for("a list", 0, 1000, 100), 100);
        assert_eq!(capacity.grow_for("a list", 0, 1000, 1001), 100);
        assert_eq!(capacity.grow_for("a list", 0, 1000, 1000), 1000);
    }

    #[test]
    fn the_capacity_is_three_halves_of_the_length_and_shrinks_late() {
        let plenty = 1 << 40;
        assert_eq!(after([10_000], plenty).capacity, 15_000);
        // A fluctuation by less than a quarter changes nothing.
        assert_eq!(after((0..1000).map(|i| 10_000 - 17 * (i % 100)), plenty).capacity, 15_000);
        let long_ago = RECENT_FRAMES - 1;
        assert_eq!(after([10_000].into_iter().chain(vec![5; long_ago]), plenty).capacity, 15_000);
        assert_eq!(after([10_000].into_iter().chain(vec![5; long_ago + 1]), plenty).capacity, LEAST);
        // The capacity never exceeds the limit. A total of 2³² or more arrives as `u32::MAX`.
        assert_eq!(after([u32::MAX], 100_000).capacity, 100_000);
        assert_eq!(after([], 100).capacity, 100);
    }

    #[test]
    fn the_words_are_those_of_the_longest_list() {
        let mut capacity = Capacity::default();
        for (frame, expected) in [([9, 70, 3], 70), ([5, 4, 6], 6), ([0, 0, 0], 0)] {
            frame.iter().for_each(|needed| capacity.arrives([*needed, 1, 2, 3]));
            capacity.adapt();
            assert_eq!(capacity.last, [expected, 1, 2, 3], "{frame:?}");
        }
    }

    #[test]
    fn a_slowly_growing_list_never_overflows() {
        // Growth of 5 % a frame; lengths arrive three frames late.
        let mut capacity = after([4_000], 1 << 40);
        let mut in_flight = VecDeque::from([4_000u32; 3]);
        let mut needed = 4_000.0f64;
        for _ in 0..200 {
            needed *= 1.05;
            assert!(needed as u64 <= capacity.capacity, "{needed} of {}", capacity.capacity);
            in_flight.push_back(needed as u32);
            capacity.arrives([in_flight.pop_front().unwrap(), 0, 0, 0]);
            capacity.adapt();
        }
    }
}
