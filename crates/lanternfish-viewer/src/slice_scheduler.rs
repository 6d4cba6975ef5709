//! Slices of a frame: decides whether the window is painted, the next slice is submitted, or neither.
//!
//! A device executes its submissions in order, so a paint waits for what was submitted before it. A slow frame is therefore submitted in
//! slices, each when the one before it has ended, and paints run between them. Times are passed in, ms; the module reads no clock.

/// Desired time of a slice on the device, ms. Higher: less overhead for submissions; lower: the interface answers sooner.
const SLICE: f64 = 20.0;
/// Time of a frame from which the next one is submitted in slices, ms: 15 frames a second.
const WHOLE: f64 = 1000.0 / 15.0;

/// What happens next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// The window is painted.
    Paint,
    /// This many command buffers are submitted.
    Submit(usize),
    /// Nothing: the device is busy.
    Wait,
}

/// Measures the slices of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct SliceScheduler {
    /// The slice on the device: its number of command buffers, and the time of its submission, ms.
    running: Option<(usize, f64)>,
    /// Number of command buffers of the last slice, and its time, ms; `None` before the first slice of a frame.
    last: Option<(usize, f64)>,
    /// True if the window was painted since the last submission.
    is_painted: bool,
}

impl SliceScheduler {
    /// True if a frame is submitted in slices. `last_ms`: the time of the frame before it, if there is one.
    pub fn slices(last_ms: Option<f64>) -> bool {
        last_ms.is_none_or(|ms| ms > WHOLE)
    }

    /// Begins a frame.
    pub fn begin(&mut self) {
        *self = Self::default();
    }

    /// The next turn at `now`. `is_done`: the device has ended the last slice. `left`: number of command buffers that were not submitted.
    pub fn turn(&mut self, now: f64, is_done: bool, wants_paint: bool, left: usize) -> Turn {
        if is_done && let Some((count, since)) = self.running.take() {
            self.last = Some((count, now - since));
        }
        match self.running {
            // A second paint behind the same slice would show nothing new.
            _ if wants_paint && !self.is_painted => Turn::Paint,
            None if left > 0 => Turn::Submit(self.count().min(left)),
            None if wants_paint => Turn::Paint,
            _ => Turn::Wait,
        }
    }

    /// Notes that the window was painted.
    pub fn painted(&mut self) {
        self.is_painted = true;
    }

    /// Notes that a slice of `count` command buffers was submitted.
    pub fn submitted(&mut self, now: f64, count: usize) {
        (self.running, self.is_painted) = (Some((count, now)), false);
    }

    /// Number of command buffers of the next slice: it grows by at most a factor of 2, because the times of passes differ.
    fn count(&self) -> usize {
        let Some((count, ms)) = self.last else { return 1 };
        let fits = count as f64 * (SLICE / ms.max(1e-3)).min(2.0);
        (fits as usize).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a frame of command buffers with these times on a device that executes paints of 5 ms in order. The window wants a paint every
    /// `period` ms. Returns the longest time from the wish to the painted window, and the number of slices.
    fn run(times: &[f64], period: f64) -> (f64, usize) {
        let mut scheduler = SliceScheduler::default();
        scheduler.begin();
        let (mut now, mut free, mut next) = (0.0, 0.0, 0);
        let (mut wish, mut longest, mut slices) = (0.0_f64, 0.0_f64, 0);
        let mut slice_end = 0.0;
        while next < times.len() || slice_end > now {
            match scheduler.turn(now, slice_end <= now, wish <= now, times.len() - next) {
                Turn::Paint => {
                    free = f64::max(free, now) + 5.0;
                    longest = longest.max(free - wish);
                    wish = f64::max(wish + period, now);
                    scheduler.painted();
                }
                Turn::Submit(count) => {
                    free = f64::max(free, now) + times[next..next + count].iter().sum::<f64>();
                    (slice_end, next, slices) = (free, next + count, slices + 1);
                    scheduler.submitted(now, count);
                }
                Turn::Wait => now += 1.0,
            }
        }
        (longest, slices)
    }

    #[test]
    fn a_paint_waits_for_one_slice() {
        // 300 passes of 10 ms: 3 s.
        let (longest, slices) = run(&[10.0; 300], 100.0);
        assert!(longest < 60.0 && (140..320).contains(&slices), "{longest} ms, {slices} slices");
        // Short passes share slices.
        let (longest, slices) = run(&[0.5; 1000], 100.0);
        assert!(longest < 60.0 && slices < 60, "{longest} ms, {slices} slices");
        // A long pass among short ones delays a paint by its own time and that of one slice.
        let mut times = [1.0; 200];
        times[120] = 80.0;
        let (longest, _) = run(&times, 10.0);
        assert!((80.0..130.0).contains(&longest), "{longest} ms");
    }

    #[test]
    fn a_paint_precedes_the_next_slice_and_is_not_repeated_behind_one() {
        let mut scheduler = SliceScheduler::default();
        scheduler.begin();
        assert_eq!(scheduler.turn(0.0, true, false, 9), Turn::Submit(1));
        scheduler.submitted(0.0, 1);
        assert_eq!(scheduler.turn(1.0, false, false, 8), Turn::Wait);
        assert_eq!(scheduler.turn(2.0, false, true, 8), Turn::Paint);
        scheduler.painted();
        assert_eq!(scheduler.turn(3.0, false, true, 8), Turn::Wait);
        // The slice took 5 ms, so two fit into the next one. It precedes the second paint in a row.
        assert_eq!(scheduler.turn(5.0, true, true, 8), Turn::Submit(2));
        scheduler.submitted(5.0, 2);
        // 80 ms for two: one at a time.
        assert_eq!(scheduler.turn(85.0, true, true, 6), Turn::Paint);
        scheduler.painted();
        assert_eq!(scheduler.turn(86.0, true, false, 6), Turn::Submit(1));
        scheduler.submitted(86.0, 6);
        assert_eq!(scheduler.turn(90.0, true, false, 0), Turn::Wait);
        assert_eq!(scheduler.turn(90.0, true, true, 0), Turn::Paint);
    }

    #[test]
    fn frames_of_a_fast_device_stay_whole() {
        assert!(
            SliceScheduler::slices(None) && SliceScheduler::slices(Some(100.0)) && !SliceScheduler::slices(Some(16.0))
        );
    }
}
