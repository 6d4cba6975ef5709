//! How large the image is drawn: whole where nothing moves, smaller where a frame would take too long. No clock: it is told.

/// Milliseconds that a frame may take while the camera moves.
const BUDGET: f64 = 60.0;
/// Share of the window's sides while nothing is known.
const FIRST: f32 = 0.3;
/// Least share of the window's sides.
const LEAST: f32 = 0.2;
/// Sides go by steps of so many parts of the whole, so that lists and textures are not made again for each frame.
const STEPS: f32 = 10.0;

/// What frames have taken.
#[derive(Clone, Copy, Debug, Default)]
pub struct ResolutionScaling {
    /// Milliseconds a million pixels, of the last frames; none before the first.
    ms_per_megapixel: Option<f64>,
}

impl ResolutionScaling {
    /// A frame of so many pixels took so long.
    pub fn took(&mut self, pixels: u64, ms: f64) {
        let now = ms / (pixels.max(1) as f64 * 1e-6);
        // Half of what is known stays: single frames are late for reasons of their own.
        self.ms_per_megapixel = Some(self.ms_per_megapixel.map_or(now, |before| 0.5 * (before + now)));
    }

    /// Share of the sides of an image of so many pixels.
    pub fn scale(&self, pixels: u64, is_moving: bool) -> f32 {
        if !is_moving {
            return 1.0;
        }
        let Some(cost) = self.ms_per_megapixel else { return FIRST };
        let fraction = (BUDGET / (cost * pixels as f64 * 1e-6)).sqrt() as f32;
        ((fraction * STEPS).floor() / STEPS).clamp(LEAST, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_is_drawn_as_large_as_time_allows_and_whole_at_rest() {
        let mut resolution_scaling = ResolutionScaling::default();
        assert_eq!(
            (resolution_scaling.scale(1_000_000, true), resolution_scaling.scale(1_000_000, false)),
            (FIRST, 1.0)
        );
        resolution_scaling.took(1_000_000, 600.0);
        // A tenth of the pixels fits: sides of 0.316, and of a step below that.
        assert_eq!((resolution_scaling.scale(1_000_000, true), resolution_scaling.scale(1_000_000, false)), (0.3, 1.0));
        assert_eq!(resolution_scaling.scale(100_000_000, true), LEAST);
        for _ in 0..20 {
            resolution_scaling.took(500_000, 5.0);
        }
        assert_eq!(resolution_scaling.scale(1_000_000, true), 1.0);
    }
}
