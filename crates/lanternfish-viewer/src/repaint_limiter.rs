//! When the window is painted while an image at rest gets better, and what its own work takes. No clock: it is told.

/// Share of the time that painting may take while nothing but the mean of frames changes. More: each frame is seen sooner, and there are
/// fewer of them.
const FRACTION: f64 = 0.02;
/// Milliseconds after which it is painted whatever that takes.
const LONGEST: f64 = 2000.0;

/// What painting takes, and since when it has not been done. All times are milliseconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct RepaintLimiter {
    /// Of the last paints by themselves; none before the first.
    takes: Option<f64>,
    /// Since the last frame of the image ended: how often it was painted.
    count: u32,
    /// When the last frame ended, where the next one followed at once.
    last_end: Option<f64>,
}

/// What lies between the ends of two frames of an image at rest that follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Period {
    /// How long it is.
    pub ms: f64,
    /// How often the window was painted meanwhile.
    pub repaint_limiter: u32,
}

impl RepaintLimiter {
    /// The window was painted while the device did nothing else, which took so long.
    pub fn took(&mut self, ms: f64) {
        // Half of what is known stays: single paints are late for reasons of their own.
        self.takes = Some(self.takes.map_or(ms, |before| 0.5 * (before + ms)));
    }

    /// What it takes.
    pub fn ms(&self) -> Option<f64> {
        self.takes
    }

    /// It was painted, whatever else was done.
    pub fn painted(&mut self) {
        self.count += 1;
    }

    /// True if it is to be painted again, so long after the last time, though only the mean of frames has become another.
    pub fn is_due(&self, since: f64) -> bool {
        since >= self.takes.map_or(0.0, |takes| (takes / FRACTION).min(LONGEST))
    }

    /// A frame of the image has ended at this time. `goes_on`: the next one follows at once. What lies behind it, where the last one did so.
    pub fn ended(&mut self, now: f64, goes_on: bool) -> Option<Period> {
        let before = std::mem::replace(&mut self.last_end, goes_on.then_some(now));
        let repaint_limiter = std::mem::take(&mut self.count);
        before.map(|before| Period { ms: now - before, repaint_limiter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of 100 ms for a minute, each painted where it may be: the share of the time that painting takes.
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
    fn what_only_gets_better_is_painted_for_a_small_share_of_the_time() {
        for ms in [0.5, 4.0, 20.0] {
            let fraction = fraction(ms);
            assert!((0.2 * FRACTION..=FRACTION).contains(&fraction), "{ms} ms: {fraction}");
        }
        // It is seen now and then, whatever that takes.
        assert!((0.15..0.25).contains(&fraction(500.0)), "{}", fraction(500.0));
    }

    #[test]
    fn a_period_is_told_of_frames_that_follow_each_other() {
        let mut repaint_limiter = RepaintLimiter::default();
        assert_eq!(repaint_limiter.ended(10.0, true), None);
        repaint_limiter.painted();
        assert_eq!(repaint_limiter.ended(30.0, false), Some(Period { ms: 20.0, repaint_limiter: 1 }));
        assert_eq!(repaint_limiter.ended(90.0, true), None);
        assert_eq!(repaint_limiter.ended(95.0, true), Some(Period { ms: 5.0, repaint_limiter: 0 }));
    }
}
