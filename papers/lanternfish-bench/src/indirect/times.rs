//! Sums pass times into the times of a row.

use lanternfish_cli::times::{frame_ms, ms_of};
use lanternfish_gpu::PassTime;

use crate::table::Row;

const TRACE: &str = "indirect/trace";
const SHADE: &str = "indirect/shade";
/// Shadow rays from shaded hits to their sampled lights.
const SHADOW: &str = "indirect/shadow";

/// Device times of one image, summed over its frames, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// Tracing all rays.
    pub trace_ms: f64,
    pub shade_ms: f64,
    pub resolve_ms: f64,
    pub filter_ms: f64,
    /// Building deep images in these frames; 0 if they were reused.
    pub images_ms: f64,
    /// All passes but those that build deep images.
    pub frame_ms: f64,
    /// Tracing the counted rays: those after the skipped samples.
    pub counted_trace_ms: f64,
    /// Shading the hits of the counted rays.
    pub counted_shade_ms: f64,
}

impl Times {
    /// Sums the passes of an image's frames. Each frame traces `samples` rays per pixel, many in one pass, and shades each sample in a
    /// separate pass. The first `skipped` samples are excluded from `counted_trace_ms`, where all samples are assumed to take equally long,
    /// and from `counted_shade_ms`.
    pub fn of(frames: &[Vec<PassTime>], samples: u32, skipped: u32) -> Self {
        let mut times = Self::default();
        for passes in frames {
            let all = |name: &str| -> Vec<f64> {
                passes.iter().filter(|pass| pass.name == name).map(|pass| pass.ms).collect()
            };
            let sum = |name: &str| all(name).iter().sum::<f64>();
            times.trace_ms += sum(TRACE);
            times.shade_ms += sum(SHADE) + sum(SHADOW);
            times.resolve_ms += sum("indirect/resolve");
            times.filter_ms += sum("indirect/filter");
            times.images_ms += ms_of(passes, "deep_images/");
            times.frame_ms += frame_ms(passes);
            let counted = |name: &str| {
                let all = all(name);
                all[skipped as usize * all.len() / samples as usize..].iter().sum::<f64>()
            };
            times.counted_trace_ms += sum(TRACE) * f64::from(samples - skipped) / f64::from(samples);
            times.counted_shade_ms += counted(SHADE) + counted(SHADOW);
        }
        times
    }

    /// The times as figures of a row.
    pub fn row(&self) -> Row {
        Row::default()
            .fixed("trace_ms", "trace", 1, self.trace_ms)
            .fixed("shade_ms", "shade", 1, self.shade_ms)
            .fixed("resolve_ms", "resolve", 1, self.resolve_ms)
            .fixed("filter_ms", "filter, ms", 1, self.filter_ms)
            .fixed("images_ms", "images", 1, self.images_ms)
            .fixed("frame_ms", "frame, ms", 1, self.frame_ms)
            .data("counted_trace_ms", self.counted_trace_ms)
            .data("counted_shade_ms", self.counted_shade_ms)
    }
}

/// Upper bound on the number of traced rays that are counted. Rays into their own surface are not traced.
///
/// `covered` is the coverage of each pixel by surfaces, as the mean over `frames` frames. A pixel with any surface in a frame traces `rays`
/// rays.
pub fn rays(covered: impl Iterator<Item = f32>, frames: u32, rays: u32) -> u64 {
    // Tolerates rounding errors of the mean.
    let pixels: f64 = covered.map(|fraction| (f64::from(fraction) * f64::from(frames) - 1e-3).ceil().max(0.0)).sum();
    pixels as u64 * u64::from(rays)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(passes: &[(&str, f64)]) -> Vec<PassTime> {
        passes.iter().map(|(name, ms)| PassTime { name: (*name).to_owned(), ms: *ms }).collect()
    }

    #[test]
    fn skipped_samples_are_left_out_of_the_rate_only() {
        // Two samples, traced through two chunks.
        let passes = frame(&[
            ("prepass", 1.0),
            ("deep_images/sort", 100.0),
            (TRACE, 6.0),
            (TRACE, 10.0),
            (SHADE, 3.0),
            (SHADOW, 1.0),
            (SHADE, 5.0),
            (SHADOW, 2.0),
            ("indirect/resolve", 8.0),
            ("indirect/filter", 9.0),
            ("indirect/filter", 10.0),
        ]);
        let times = Times::of(std::slice::from_ref(&passes), 2, 1);
        let expected = Times {
            trace_ms: 16.0,
            shade_ms: 11.0,
            resolve_ms: 8.0,
            filter_ms: 19.0,
            images_ms: 100.0,
            frame_ms: 55.0,
            counted_trace_ms: 8.0,
            counted_shade_ms: 7.0,
        };
        assert_eq!(times, expected);
        let all = Times::of(&[passes.clone(), passes], 2, 0);
        assert_eq!((all.counted_trace_ms, all.counted_shade_ms, all.frame_ms), (32.0, 22.0, 110.0));
    }

    #[test]
    fn pixels_without_surface_trace_no_rays() {
        assert_eq!(rays([0.0, 1.0, 1.0].into_iter(), 1, 8), 16);
        // A pixel with partial coverage by several samples.
        assert_eq!(rays([0.25, 0.0].into_iter(), 1, 8), 8);
        // Pixels with coverage in three and in one of four frames.
        assert_eq!(rays([0.75, 0.250_000_03].into_iter(), 4, 2), 8);
        assert_eq!(rays(std::iter::empty(), 4, 2), 0);
    }
}
