//! Capacity of a list, from its needs in recent frames.

use std::collections::VecDeque;

use super::LIST_WORDS;

/// Frames whose needs count. More: room is given back later.
const RECENT_FRAMES: usize = 64;
/// Capacity that a list has at least where frames do not wait.
const LEAST: u64 = 1 << 12;

#[derive(Debug, Default)]
pub(super) struct Capacity {
    capacity: u64,
    limit: u64,
    /// The words of the longest list of the frame that arrived last.
    pub last: [u32; LIST_WORDS],
    /// The most elements that any list of the frame has had which is arriving.
    arriving: Option<u64>,
    recent: VecDeque<u64>,
}

impl Capacity {
    /// Where the frame has waited: room for all, and never less than before.
    pub fn waited_for(&mut self, list: &str, guess: u64, limit: u64, elements: u64) -> u64 {
        if elements > self.capacity && self.capacity > 0 {
            tracing::debug!(elements, capacity = self.capacity, "{list} grows");
        }
        // What cannot be is refused: no room is kept for it.
        let wanted = if elements > limit { 0 } else { elements };
        self.capacity = self.capacity.max(guess).max(wanted).min(limit);
        self.capacity
    }

    /// Elements that there is room for.
    pub fn capacity(&self) -> u64 {
        self.capacity
    }

    /// Before anything is counted, where the frame will wait: what was enough before.
    pub fn before_waiting(&self, guess: u64, limit: u64) -> u64 {
        self.capacity.max(guess).min(limit)
    }

    /// Where it does not: what earlier frames have shown to be enough.
    pub fn later(&mut self, guess: u64, limit: u64) -> u64 {
        self.limit = limit;
        self.capacity = self.capacity.max(guess).max(LEAST).min(limit);
        self.capacity
    }

    /// One list of a frame that has run.
    pub fn arrives(&mut self, words: [u32; LIST_WORDS]) {
        let elements = u64::from(words[0]);
        if self.arriving.is_none_or(|most| elements > most) {
            self.last = words;
        }
        self.arriving = Some(self.arriving.unwrap_or(0).max(elements));
    }

    /// All lists of a frame have arrived: half as much room again as the most that was needed lately, as soon as four fifths of what is
    /// there are used; less, where less than a half of it would do. Whether that is other room.
    pub fn adapt(&mut self) -> bool {
        let Some(needed) = self.arriving.take() else { return false };
        self.recent.truncate(RECENT_FRAMES - 1);
        self.recent.push_front(needed);
        let most = self.recent.iter().copied().max().unwrap_or(0);
        let wanted = (most + most / 2).clamp(LEAST.min(self.limit), self.limit);
        let before = self.capacity;
        if 5 * most > 4 * before || 2 * wanted < before {
            tracing::debug!(most, capacity = before, wanted, "a list gets other room");
            self.capacity = wanted;
        }
        self.capacity != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A list that frames have counted so.
    fn after(needs: impl IntoIterator<Item = u32>, limit: u64) -> Capacity {
        let mut capacity = Capacity { limit, capacity: LEAST.min(limit), ..Capacity::default() };
        for needed in needs {
            capacity.arrives([needed, 0, 0, 0]);
            capacity.adapt();
        }
        capacity
    }

    #[test]
    fn a_list_that_is_refused_gets_no_room() {
        let mut capacity = Capacity::default();
        assert_eq!(capacity.waited_for("a list", 0, 1000, 100), 100);
        assert_eq!(capacity.waited_for("a list", 0, 1000, 1001), 100);
        assert_eq!(capacity.waited_for("a list", 0, 1000, 1000), 1000);
    }

    #[test]
    fn there_is_room_for_half_as_much_again_and_it_is_given_back_late() {
        let plenty = 1 << 40;
        assert_eq!(after([10_000], plenty).capacity, 15_000);
        // What goes up and down by less than a quarter changes nothing.
        assert_eq!(after((0..1000).map(|i| 10_000 - 17 * (i % 100)), plenty).capacity, 15_000);
        let long_ago = RECENT_FRAMES - 1;
        assert_eq!(after([10_000].into_iter().chain(vec![5; long_ago]), plenty).capacity, 15_000);
        assert_eq!(after([10_000].into_iter().chain(vec![5; long_ago + 1]), plenty).capacity, LEAST);
        // Never beyond the limit, whatever was counted: a total of 2³² and more arrives as the largest number.
        assert_eq!(after([u32::MAX], 100_000).capacity, 100_000);
        assert_eq!(after([], 100).capacity, 100);
    }

    #[test]
    fn the_longest_of_a_frames_lists_is_kept() {
        let mut capacity = Capacity::default();
        for (frame, expected) in [([9, 70, 3], 70), ([5, 4, 6], 6), ([0, 0, 0], 0)] {
            frame.iter().for_each(|needed| capacity.arrives([*needed, 1, 2, 3]));
            capacity.adapt();
            assert_eq!(capacity.last, [expected, 1, 2, 3], "{frame:?}");
        }
    }

    #[test]
    fn a_list_that_grows_slowly_is_never_full() {
        // A twentieth more a frame, known three frames later.
        let mut capacity = after([4_000], 1 << 40);
        let mut on_the_way = VecDeque::from([4_000u32; 3]);
        let mut needed = 4_000.0f64;
        for _ in 0..200 {
            needed *= 1.05;
            assert!(needed as u64 <= capacity.capacity, "{needed} of {}", capacity.capacity);
            on_the_way.push_back(needed as u32);
            capacity.arrives([on_the_way.pop_front().unwrap(), 0, 0, 0]);
            capacity.adapt();
        }
    }
}
