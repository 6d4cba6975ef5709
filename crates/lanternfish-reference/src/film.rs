//! The film: sums of each pixel's samples, from which the mean and variance follow.

use lanternfish_limits::memory::Budget;

use crate::error::ReferenceError;

/// Sums of a pixel's samples in fixed point, so that the sums do not depend on the order or the grouping of additions.
///
/// Sums saturate at 2¹²⁷ steps. Samples are non-negative, except in tests of the sums.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// Sum of the samples, by channel, in steps of 2⁻⁶⁴: up to 9·10¹⁸.
    pub value: [i128; 3],
    /// Sum of the samples' squares, by channel, in steps of 2⁻⁵²: up to 3·10²².
    pub square: [i128; 3],
}

/// Steps per unit of [`Sums::value`]: fine enough for values below anything visible.
const VALUE_STEPS: f64 = (1u128 << 64) as f64;
/// Steps per unit of [`Sums::square`]: the resolution of `f64` around 1, with a range for 10,000 samples of the sun's disk.
const SQUARE_STEPS: f64 = (1u64 << 52) as f64;

/// A value in steps, rounded to the nearest.
fn steps(value: f64, steps_in_1: f64) -> i128 {
    // The cast saturates.
    (value * steps_in_1).round() as i128
}

impl Sums {
    pub fn add(&mut self, sample: [f32; 3]) {
        for (channel, value) in sample.into_iter().enumerate() {
            let value = f64::from(value);
            self.value[channel] = self.value[channel].saturating_add(steps(value, VALUE_STEPS));
            self.square[channel] = self.square[channel].saturating_add(steps(value * value, SQUARE_STEPS));
        }
    }

    fn add_all(&mut self, other: &Self) {
        for channel in 0..3 {
            self.value[channel] = self.value[channel].saturating_add(other.value[channel]);
            self.square[channel] = self.square[channel].saturating_add(other.square[channel]);
        }
    }

    /// Mean of the samples, by channel; zero without samples.
    fn mean(&self, samples: u64) -> [f64; 3] {
        self.value.map(|value| value as f64 / VALUE_STEPS / (samples as f64).max(1.0))
    }

    /// Unbiased variance of the mean, by channel; infinite below two samples, and if the sum of squares is saturated.
    fn variance(&self, samples: u64) -> [f64; 3] {
        if samples < 2 {
            return [f64::INFINITY; 3];
        }
        let (n, mean) = (samples as f64, self.mean(samples));
        std::array::from_fn(|c| match self.square[c] {
            i128::MAX => f64::INFINITY,
            square => (square as f64 / SQUARE_STEPS / n - mean[c] * mean[c]).max(0.0) / (n - 1.0),
        })
    }
}

/// An image during accumulation. All pixels of a row have the same number of samples. Rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Index of its first sample, which selects the random numbers.
    pub(crate) first: u64,
    /// Number of samples per pixel of each row, from the top.
    pub(crate) samples: Vec<u64>,
    pub(crate) pixels: Vec<Sums>,
    pub(crate) dropped: u64,
}

/// Expected error of an image, estimated from its own samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Expected relative error: the root of the mean, over pixels and channels, of variance of the mean / (mean² + 0.01 m²), where m is
    /// the mean of the entire image.
    pub relative: f64,
}

impl Film {
    /// Memory of a pixel, bytes.
    #[doc(hidden)]
    pub const BYTES_PER_PIXEL: u64 = size_of::<Sums>() as u64;

    /// A black film of `width` × `height` pixels without samples. Fails if either side is zero, or if the process may not allocate
    /// [`Self::BYTES_PER_PIXEL`] for each pixel.
    pub fn new([width, height]: [u32; 2]) -> Result<Self, ReferenceError> {
        Self::allocated(width as usize, height as usize)
    }

    fn allocated(width: usize, height: usize) -> Result<Self, ReferenceError> {
        let film = Self::empty(width, height)?;
        let bytes = Self::BYTES_PER_PIXEL.saturating_mul(width as u64).saturating_mul(height as u64);
        Budget::of_process()
            .check(bytes, || format!("the samples of {width} × {height} pixels need"))
            .map_err(ReferenceError::ImageTooLarge)?;
        Ok(Self { pixels: vec![Sums::default(); width * height], ..film })
    }

    /// A film whose pixels are not allocated yet.
    fn empty(width: usize, height: usize) -> Result<Self, ReferenceError> {
        if width == 0 || height == 0 {
            return Err(ReferenceError::InvalidSetting {
                setting: "size",
                got: format!("{width}×{height}"),
                remedy: "both sides must be at least 1",
            });
        }
        Ok(Self { width, height, first: 0, samples: vec![0; height], pixels: Vec::new(), dropped: 0 })
    }

    /// Restores a film after an interruption, from its [`Film::row_samples`], [`Film::mean`] and [`Film::variance`]. The sums equal the
    /// original ones up to rounding to 32 bits. Fails if a list does not have one entry per pixel.
    #[doc(hidden)]
    pub fn resume(
        width: usize,
        row_samples: &[u64],
        mean: &[[f32; 3]],
        variance: &[[f32; 3]],
    ) -> Result<Self, ReferenceError> {
        let height = row_samples.len();
        let mut film = Self::allocated(width, height)?;
        for list in [mean, variance] {
            if list.len() != film.pixels.len() {
                return Err(ReferenceError::PixelCount { got: list.len(), width, height });
            }
        }
        film.samples = row_samples.to_vec();
        let samples = row_samples.iter().flat_map(|samples| std::iter::repeat_n(*samples, width));
        for (((sums, samples), mean), variance) in film.pixels.iter_mut().zip(samples).zip(mean).zip(variance) {
            let n = samples as f64;
            for channel in 0..3 {
                let (mean, variance) = (f64::from(mean[channel]), f64::from(variance[channel]));
                sums.value[channel] = steps(n * mean, VALUE_STEPS);
                // A single sample gives no estimate of the variance.
                let deviations = if samples < 2 { 0.0 } else { variance * n * (n - 1.0) };
                sums.square[channel] = steps(n * mean * mean + deviations, SQUARE_STEPS);
            }
        }
        Ok(film)
    }

    /// A black film for the part of an image that starts at sample index `first` (from 0), for [`Film::add_next`].
    #[doc(hidden)]
    pub fn part(width: usize, height: usize, first: u64) -> Result<Self, ReferenceError> {
        Ok(Self { first, ..Self::allocated(width, height)? })
    }

    /// Restores a part of an image bit for bit after an interruption, from its [`Film::row_samples`] and [`Film::exact_sums`]. Fails if
    /// `sums` does not have one entry per pixel.
    #[doc(hidden)]
    pub fn resume_part(
        width: usize,
        row_samples: &[u64],
        first: u64,
        sums: impl ExactSizeIterator<Item = [[i128; 3]; 2]>,
    ) -> Result<Self, ReferenceError> {
        let height = row_samples.len();
        // Checked before allocating.
        if Some(sums.len()) != width.checked_mul(height) {
            return Err(ReferenceError::PixelCount { got: sums.len(), width, height });
        }
        let pixels = sums.map(|[value, square]| Sums { value, square }).collect();
        Ok(Self { first, samples: row_samples.to_vec(), pixels, ..Self::empty(width, height)? })
    }

    /// Adds the next part of the image. The sum of the parts equals an image traced at once, bit for bit. Fails, without a change, if sizes
    /// differ, if rows of either film differ in their number of samples, or if `next` does not begin where this film ends.
    #[doc(hidden)]
    pub fn add_next(&mut self, next: &Self) -> Result<(), ReferenceError> {
        let end = self.first + self.samples();
        if self.size() != next.size() || !self.is_even() || !next.is_even() || next.first != end {
            let what = |film: &Self| {
                let ([width, height], first) = (film.size(), film.first);
                format!("{width}×{height}, samples {first}..{}", first + film.samples())
            };
            return Err(ReferenceError::Parts { first: what(self), second: what(next) });
        }
        self.samples.iter_mut().zip(&next.samples).for_each(|(samples, more)| *samples += more);
        self.pixels.iter_mut().zip(&next.pixels).for_each(|(sums, more)| sums.add_all(more));
        self.dropped += next.dropped;
        Ok(())
    }

    /// Sums of each pixel's samples, and of their squares, by channel, rows from the top, in the film's internal steps. For
    /// [`Film::resume_part`].
    #[doc(hidden)]
    pub fn exact_sums(&self) -> impl ExactSizeIterator<Item = [[i128; 3]; 2]> + Clone + '_ {
        self.pixels.iter().map(|sums| [sums.value, sums.square])
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.width as u32, self.height as u32]
    }

    /// Number of samples per pixel; the minimum if rows differ.
    pub fn samples(&self) -> u64 {
        self.samples.iter().copied().min().unwrap_or(0)
    }

    /// Number of samples per pixel of each row. Rows differ if [`crate::Tracer::render_unless`] was stopped.
    #[doc(hidden)]
    pub fn row_samples(&self) -> &[u64] {
        &self.samples
    }

    /// True if all rows have the same number of samples.
    #[doc(hidden)]
    pub fn is_even(&self) -> bool {
        self.samples.iter().all(|samples| *samples == self.samples[0])
    }

    /// Number of samples, summed over all pixels.
    pub fn sample_count(&self) -> u64 {
        self.width as u64 * self.samples.iter().sum::<u64>()
    }

    /// Number of samples that were not finite and count as black. Anything but zero indicates a fault of the scene or of the tracer.
    #[doc(hidden)]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The mean of the samples so far; a row without samples is black.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        self.sums().map(|(sums, samples)| sums.mean(samples).map(|v| v as f32)).collect()
    }

    /// Unbiased variance of each value of [`Film::mean`], estimated from its samples; infinite below two samples.
    #[doc(hidden)]
    pub fn variance(&self) -> Vec<[f32; 3]> {
        self.sums().map(|(sums, samples)| sums.variance(samples).map(|v| v as f32)).collect()
    }

    /// The sums and the number of samples of every pixel, rows from the top.
    fn sums(&self) -> impl Iterator<Item = (&Sums, u64)> {
        let rows = self.pixels.chunks_exact(self.width).zip(&self.samples);
        rows.flat_map(|(row, samples)| row.iter().map(|sums| (sums, *samples)))
    }

    /// Expected error of the image; infinite below two samples, zero for a black image.
    pub fn noise(&self) -> Noise {
        if self.samples() < 2 {
            return Noise { relative: f64::INFINITY };
        }
        let values = 3.0 * self.pixels.len() as f64;
        let image_mean = self.sums().flat_map(|(sums, samples)| sums.mean(samples)).sum::<f64>() / values;
        if image_mean == 0.0 {
            return Noise { relative: 0.0 };
        }
        let floor = 0.01 * image_mean * image_mean;
        let error = |(sums, samples): (&Sums, u64)| {
            let (mean, variance) = (sums.mean(samples), sums.variance(samples));
            let of = |c: usize| variance[c] / (mean[c].powi(2) + floor);
            of(0) + of(1) + of(2)
        };
        Noise { relative: (self.sums().map(error).sum::<f64>() / values).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(samples: &[[f32; 3]]) -> Film {
        let mut film = Film::new([1, 1]).unwrap();
        samples.iter().for_each(|s| film.pixels[0].add(*s));
        film.samples = vec![samples.len() as u64];
        film
    }

    #[test]
    fn mean_and_variance_are_those_of_the_samples() {
        let film = film(&[[1.0, 0.0, 5.0], [2.0, 0.0, 5.0], [3.0, 0.0, 5.0], [6.0, 0.0, 5.0]]);
        assert_eq!(film.mean(), [[3.0, 0.0, 5.0]]);
        // Σ (x − 3)² = 14; over n − 1 = 3, over n = 4.
        let [[red, green, blue]] = film.variance()[..] else { panic!() };
        assert!((red - 14.0 / 12.0).abs() < 1e-6 && green == 0.0 && blue == 0.0);
    }

    #[test]
    fn a_resumed_film_equals_the_original() {
        let before = film(&[[1.0, 0.5, 5.0], [2.0, 0.25, 5.0], [4.0, 0.125, 5.0]]);
        let after = Film::resume(1, &[3], &before.mean(), &before.variance()).unwrap();
        for channel in 0..3 {
            let (a, b) = (before.pixels[0], after.pixels[0]);
            assert!((a.value[channel] - b.value[channel]).abs() < a.value[channel] / 1_000_000);
            assert!((a.square[channel] - b.square[channel]).abs() < a.square[channel] / 1_000_000);
        }
        let once = film(&[[1.0, 0.5, 5.0]]);
        assert_eq!(Film::resume(1, &[1], &once.mean(), &once.variance()).unwrap(), once);
        assert!(Film::resume(2, &[3], &before.mean(), &before.variance()).is_err());
        assert!(Film::new([0, 4]).is_err());
    }

    #[test]
    fn memory_of_pixels_is_checked_before_it_is_allocated() {
        for (width, height) in [(1 << 24, 1 << 24), (usize::MAX, 2)] {
            let error = Film::allocated(width, height).unwrap_err();
            assert!(matches!(error, ReferenceError::ImageTooLarge(_)), "{error}");
            assert!(error.to_string().contains(&format!("{width} × {height} pixels need")), "{error}");
        }
    }

    #[test]
    fn parts_add_up_to_the_complete_image_bit_for_bit() {
        // A range of values so large that float sums would lose the darkest ones.
        let samples: Vec<[f32; 3]> =
            (0..97).map(|i| [0.1 * i as f32, 10f32.powi(i % 17 - 8), if i == 3 { 1e9 } else { 1e-7 }]).collect();
        let complete = film(&samples);
        for cuts in [[1, 50], [16, 32], [40, 96]] {
            let part = |from: usize, to: usize| {
                let part = Film { first: from as u64, ..film(&samples[from..to]) };
                // As restored from a file.
                Film::resume_part(1, part.row_samples(), part.first, part.exact_sums()).unwrap()
            };
            let mut parts = part(0, cuts[0]);
            parts.add_next(&part(cuts[0], cuts[1])).unwrap();
            parts.add_next(&part(cuts[1], 97)).unwrap();
            assert_eq!(parts, complete);
            assert!(parts.add_next(&part(cuts[0], cuts[1])).is_err(), "added twice");
        }
        assert!(Film::part(1, 1, 97).unwrap().add_next(&complete).is_err(), "in the wrong order");
        assert!(complete.clone().add_next(&Film::part(2, 1, 97).unwrap()).is_err());
    }

    #[test]
    fn a_saturated_sum_of_squares_gives_infinite_variance() {
        let bright = film(&[[1e12, 1e30, 1.0]; 4]);
        let [[red, green, blue]] = bright.variance()[..] else { panic!() };
        assert_eq!((red, green, blue), (f32::INFINITY, f32::INFINITY, 0.0));
        assert_eq!(bright.mean()[0][0], 1e12);
    }

    #[test]
    fn noise_falls_with_the_root_of_the_samples() {
        let samples: Vec<[f32; 3]> = (0..400).map(|i| [(i % 2) as f32; 3]).collect();
        let (few, many) = (film(&samples[..100]).noise().relative, film(&samples).noise().relative);
        assert!((few / many - 2.0).abs() < 0.02, "{few} {many}");
        assert_eq!(film(&samples[..1]).noise().relative, f64::INFINITY);
        assert_eq!(film(&[[0.0; 3]; 4]).noise().relative, 0.0);
    }
}
