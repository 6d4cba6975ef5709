//! The resolution of frames that fit a time budget.

/// Time of a frame at full resolution up to which it follows the last frame in motion immediately, ms. Above, the sides are doubled frame by
/// frame, so that a better image appears soon, and the camera can move again without a wait for a long frame.
const WITHOUT_STEPS: f64 = 300.0;
/// Scale of the image's sides before the first measurement.
const INITIAL: f32 = MIN;
/// Smallest scale of the image's sides.
const MIN: f32 = 0.2;
/// Number of steps of the scale from 0 to 1. Steps avoid reallocation of lists and textures in each frame.
const STEPS: f32 = 10.0;

/// Scale of the sides of a window's frames, from the times of the frames before them: reduced while the view moves and a frame of full
/// resolution would exceed the time budget. At rest it rises to full resolution, in steps if a frame takes long.
///
/// The caller passes times, e.g. the sum of [`crate::FrameReport::passes`]; no clock is read.
#[derive(Clone, Copy, Debug)]
pub struct ResolutionScaling {
    /// Time of a frame while the view moves, ms.
    budget: f64,
    /// Moving average of the frame time, ms per million pixels; `None` before the first frame.
    ms_per_megapixel: Option<f64>,
    /// Number of pixels of the last frame.
    last: u64,
}

impl ResolutionScaling {
    /// `budget`: the longest time of a frame while the view moves, ms.
    pub fn new(budget: f64) -> Self {
        Self { budget, ms_per_megapixel: None, last: 0 }
    }

    /// Adds a measurement: a frame of `pixels` took `ms`.
    pub fn took(&mut self, pixels: u64, ms: f64) {
        self.last = pixels;
        let now = ms / (pixels.max(1) as f64 * 1e-6);
        // Exponential average with weight 1/2, since single frames may be delayed.
        self.ms_per_megapixel = Some(self.ms_per_megapixel.map_or(now, |before| 0.5 * (before + now)));
    }

    /// Scale of the sides of an image whose full resolution has `pixels` pixels, 0.2 to 1, in tenths; at rest 1 after at most a few frames.
    pub fn scale(&self, pixels: u64, is_moving: bool) -> f32 {
        let Some(cost) = self.ms_per_megapixel else { return INITIAL };
        let full_ms = cost * pixels as f64 * 1e-6;
        let fraction = match is_moving {
            true => (self.budget / full_ms).sqrt() as f32,
            false if full_ms <= WITHOUT_STEPS => return 1.0,
            // The last frame's sides are rounded down to pixels, so twice its scale may lie just below a step.
            false => 2.0 * (self.last as f64 / pixels as f64).sqrt() as f32 + 0.5 / STEPS,
        };
        ((fraction * STEPS).floor() / STEPS).clamp(MIN, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolution_fits_the_budget_in_motion_and_is_full_at_rest() {
        let mut resolution_scaling = ResolutionScaling::new(60.0);
        assert_eq!(resolution_scaling.scale(1_000_000, true), INITIAL);
        resolution_scaling.took(1_000_000, 600.0);
        // A tenth of the pixels fits the budget: a scale of 0.316, rounded down to a step.
        assert_eq!((resolution_scaling.scale(1_000_000, true), resolution_scaling.scale(1_000_000, false)), (0.3, 1.0));
        assert_eq!(resolution_scaling.scale(500_000, false), 1.0);
        assert_eq!(resolution_scaling.scale(100_000_000, true), MIN);
        for _ in 0..20 {
            resolution_scaling.took(500_000, 5.0);
        }
        assert_eq!(resolution_scaling.scale(1_000_000, true), 1.0);
    }

    #[test]
    fn a_slow_image_at_rest_rises_to_full_resolution_in_steps() {
        let mut resolution_scaling = ResolutionScaling::new(60.0);
        let full = [380_u64, 515];
        let mut scales = Vec::new();
        while scales.last() != Some(&1.0) && scales.len() < 9 {
            let scale = resolution_scaling.scale(full[0] * full[1], scales.is_empty());
            let sides = full.map(|side| (side as f32 * scale) as u64);
            // 50 s for a million pixels.
            resolution_scaling.took(sides[0] * sides[1], 0.05 * (sides[0] * sides[1]) as f64);
            scales.push(scale);
        }
        assert_eq!(scales, [0.2, 0.4, 0.8, 1.0]);
        assert_eq!(resolution_scaling.scale(full[0] * full[1], false), 1.0, "full resolution stays");
        assert_eq!(
            resolution_scaling.scale(4 * full[0] * full[1], false),
            1.0,
            "a larger window is filled by the next step"
        );
    }
}
