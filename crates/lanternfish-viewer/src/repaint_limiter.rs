//! Limits repaints of the window while an image at rest accumulates.
//!
//! Times are passed in; the module reads no clock.

/// Largest fraction of time for paints while only the accumulated image changes. A larger fraction shows frames sooner, but renders fewer.
const FRACTION: f64 = 0.02;
/// Longest time between paints, whatever a paint takes, ms.
const LONGEST: f64 = 2000.0;

/// Measures paints and decides when the next is due. All times are in ms.
#[derive(Clone, Copy, Debug, Default)]
pub struct RepaintLimiter {
    /// Moving average of the paint time; `None` before the first.
    takes: Option<f64>,
    /// Number of paints since the last frame of the image ended.
    count: u32,
    /// End of the last frame, if the next one followed immediately.
    last_end: Option<f64>,
}

/// The interval between the ends of two consecutive frames of an image at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Period {
    /// Length, ms.
    pub ms: f64,
    /// Number of paints in the interval.
    pub paints: u32,
}

impl RepaintLimiter {
    /// Adds a measurement: a paint took `ms` while the device was otherwise idle.
    pub fn took(&mut self, ms: f64) {
        // Exponential average with weight 1/2, since single paints may be delayed.
        self.takes = Some(self.takes.map_or(ms, |before| 0.5 * (before + ms)));
    }

    /// Average paint time, ms; `None` before the first.
    pub fn ms(&self) -> Option<f64> {
        self.takes
    }

    /// Counts a paint.
    pub fn painted(&mut self) {
        self.count += 1;
    }

    /// Whether to repaint `since` ms after the last paint, if only the accumulated image has changed.
    pub fn is_due(&self, since: f64) -> bool {
        since >= self.takes.map_or(0.0, |takes| (takes / FRACTION).min(LONGEST))
    }

    /// Registers the end of a frame at `now`. `continues`: the next frame follows immediately. Returns the interval since the last frame, if
    /// that frame continued.
    pub fn ended(&mut self, now: f64, continues: bool) -> Option<Period> {
        let before = std::mem::replace(&mut self.last_end, continues.then_some(now));
        let paints = std::mem::take(&mut self.count);
        before.map(|before| Period { ms: now - before, paints })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fraction of time for paints over one minute of 100 ms frames, each painted if due.
    fn fraction(paint_ms: f64) -> f64 {
        let (mut repaint_limiter, mut now, mut last, mut own) =
            (RepaintLimiter::default(), 0.0, f64::NEG_INFINITY, 0.0);
        while now < 60_000.0 {
            now += 100.0;
            if repaint_limiter.is_due(now - last) {
                repaint_limiter.took(paint_ms);
                (now, own) = (now + paint_ms, own + paint_ms);
                last = now;
            }
        }
        own / now
    }

    #[test]
    fn accumulation_is_painted_for_a_small_fraction_of_the_time() {
        for ms in [0.5, 4.0, 20.0] {
            let fraction = fraction(ms);
            assert!((0.2 * FRACTION..=FRACTION).contains(&fraction), "{ms} ms: {fraction}");
        }
        // A slow paint still runs every 2 s.
        assert!((0.15..0.25).contains(&fraction(500.0)), "{}", fraction(500.0));
    }

    #[test]
    fn a_period_is_returned_for_consecutive_frames() {
        let mut repaint_limiter = RepaintLimiter::default();
        assert_eq!(repaint_limiter.ended(10.0, true), None);
        repaint_limiter.painted();
        assert_eq!(repaint_limiter.ended(30.0, false), Some(Period { ms: 20.0, paints: 1 }));
        assert_eq!(repaint_limiter.ended(90.0, true), None);
        assert_eq!(repaint_limiter.ended(95.0, true), Some(Period { ms: 5.0, paints: 0 }));
    }
}
