//! Resolution scaling: full resolution at rest, reduced while the camera moves and a frame would exceed its time budget.
//!
//! Times are passed in; the module reads no clock.

/// Frame time budget while the camera moves, ms.
const BUDGET: f64 = 60.0;
/// Scale of the image's sides before the first measurement.
const INITIAL: f32 = MIN;
/// Smallest scale of the image's sides.
const MIN: f32 = 0.2;
/// Number of steps of the scale from 0 to 1. Steps avoid reallocation of lists and textures in each frame.
const STEPS: f32 = 10.0;

/// Estimates the frame time per pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct ResolutionScaling {
    /// Moving average of the frame time, ms per million pixels; `None` before the first frame.
    ms_per_megapixel: Option<f64>,
}

impl ResolutionScaling {
    /// Adds a measurement: a frame of `pixels` took `ms`.
    pub fn took(&mut self, pixels: u64, ms: f64) {
        let now = ms / (pixels.max(1) as f64 * 1e-6);
        // Exponential average with weight 1/2, since single frames may be delayed.
        self.ms_per_megapixel = Some(self.ms_per_megapixel.map_or(now, |before| 0.5 * (before + now)));
    }

    /// Scale of the sides of an image whose full resolution is `pixels`, [`MIN`] to 1; 1 at rest.
    pub fn scale(&self, pixels: u64, is_moving: bool) -> f32 {
        if !is_moving {
            return 1.0;
        }
        let Some(cost) = self.ms_per_megapixel else { return INITIAL };
        let fraction = (BUDGET / (cost * pixels as f64 * 1e-6)).sqrt() as f32;
        ((fraction * STEPS).floor() / STEPS).clamp(MIN, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolution_fits_the_budget_in_motion_and_is_full_at_rest() {
        let mut resolution_scaling = ResolutionScaling::default();
        assert_eq!(
            (resolution_scaling.scale(1_000_000, true), resolution_scaling.scale(1_000_000, false)),
            (INITIAL, 1.0)
        );
        resolution_scaling.took(1_000_000, 600.0);
        // A tenth of the pixels fits the budget: a scale of 0.316, rounded down to a step.
        assert_eq!((resolution_scaling.scale(1_000_000, true), resolution_scaling.scale(1_000_000, false)), (0.3, 1.0));
        assert_eq!(resolution_scaling.scale(100_000_000, true), MIN);
        for _ in 0..20 {
            resolution_scaling.took(500_000, 5.0);
        }
        assert_eq!(resolution_scaling.scale(1_000_000, true), 1.0);
    }
}
