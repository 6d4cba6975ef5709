//! A statistical test whether noise explains the difference of two images.

use crate::{
    MetricsError, Pair, RgbImage,
    compare::check_sizes,
    normal::{chi_square_deviate, two_sided},
};

/// Edge of the tiles whose sums are tested, pixels.
///
/// The sum over a tile of 256 pixels is nearly normal even if the samples of one pixel are not, and its variance is
/// accurate enough.
pub const Z_TEST_TILE: usize = 16;

/// Significance level: the probability that images that differ by noise alone are reported as different.
const LEVEL: f64 = 1e-3;

/// Test of the difference of two noisy images against their variances: per value z = (a − b) / √(var a + var b), and sums.
///
/// A value is a channel of a pixel. If both images have the same expectation and the stated variances, independent between
/// pixels and between the images, z has mean 0 and mean square 1. If it is normal, 4.55 % of the values lie beyond 2 and
/// 0.27 % beyond 3. It is not normal if variances are estimated from few samples, or if light comes from rare bright
/// samples: then these four figures are descriptive only. The test uses sums, per channel, since the channels of a pixel
/// have the same samples:
///
/// 1. *offset*: Σ(a − b) / √Σ(var a + var b) over the image is a standard normal deviate. It detects a change of the
///    image's mean, down to the noise of a pixel over the root of the number of pixels.
/// 2. *spread*: the sum of the squared deviates of all tiles of [`Z_TEST_TILE`]² pixels is χ² with one degree of freedom
///    per tile, converted to a normal deviate by [WilsonHilferty1931, cube root]. It detects changes that cancel out.
///
/// [`Self::p_value`] is the smallest probability of these six, times six (Bonferroni). It is valid only under these
/// assumptions: correlated pixels (filters wider than a pixel, denoising) make the spread too large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZTest {
    /// Values that were tested.
    pub value_count: usize,
    /// Mean of z: 0 for noise, positive if the image is brighter than the reference.
    pub mean_z: f64,
    /// Mean of z²: 1 for noise, more if the images differ or the variances are too small.
    pub mean_z_squared: f64,
    /// Fraction of values with |z| > 2, 0..=1.
    pub share_beyond_2: f64,
    /// Fraction of values with |z| > 3, 0..=1.
    pub share_beyond_3: f64,
    /// Equal values without variance in either image: nothing to test.
    pub certain_equal: usize,
    /// **Different** values without variance in either image: noise cannot explain them. No other figure includes them.
    pub certain_different: usize,
    /// Pixels whose variance is negative or not finite in a channel of either image; they are left out.
    pub invalid_variance: usize,
    /// Standard normal deviate of the image's sum of differences, for red, green and blue. NaN if no value was tested.
    pub offset: [f64; 3],
    /// Standard normal deviate of the tiles' χ², for red, green and blue. NaN if no value was tested.
    pub spread: [f64; 3],
}

/// Verdict of a [`ZTest`] at the significance level 0.001.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZVerdict {
    /// Noise of the stated variances explains the difference.
    Noise,
    /// One image is brighter than the other in a channel.
    Offset,
    /// The images differ locally by more than the noise, or the variances are too small.
    Spread,
    /// The images differ by less than the noise: the variances are too large, or the images have common samples.
    TooAlike,
    /// No value has a variance.
    Untested,
}

/// Sums of differences and of variances over an image or a tile.
#[derive(Clone, Copy, Default)]
struct Sums {
    difference: f64,
    variance: f64,
}

impl Sums {
    fn add(&mut self, difference: f64, variance: f64) {
        self.difference += difference;
        self.variance += variance;
    }

    /// The sum of differences over its standard deviation; NaN if nothing was added.
    fn deviate(self) -> f64 {
        self.difference / self.variance.sqrt()
    }
}

impl ZTest {
    pub(crate) fn measure(
        pair: &Pair,
        image_variance: Option<&RgbImage>,
        reference_variance: Option<&RgbImage>,
    ) -> Result<Self, MetricsError> {
        if image_variance.is_none() && reference_variance.is_none() {
            return Err(MetricsError::NoVariance);
        }
        for variance in [image_variance, reference_variance].into_iter().flatten() {
            check_sizes(variance, pair.image())?;
        }
        let variance_at =
            |image: Option<&RgbImage>, i: usize| image.map_or([0.0; 3], |image| image.pixels[i].map(f64::from));

        let (width, height) = (pair.image().width, pair.image().height);
        let tiles_across = width.div_ceil(Z_TEST_TILE);
        let mut tiles = vec![[Sums::default(); 3]; tiles_across * height.div_ceil(Z_TEST_TILE)];
        let mut total = [Sums::default(); 3];
        let (mut sum, mut squares, mut beyond_2, mut beyond_3) = (0.0, 0.0, 0usize, 0usize);
        let (mut value_count, mut certain_equal, mut certain_different, mut invalid_variance) = (0, 0, 0, 0);
        for i in (0..pair.is_compared().len()).filter(|i| pair.is_compared()[*i]) {
            let (va, vb) = (variance_at(image_variance, i), variance_at(reference_variance, i));
            if va.iter().chain(&vb).any(|v| !v.is_finite() || *v < 0.0) {
                invalid_variance += 1;
                continue;
            }
            let tile = &mut tiles[i / width / Z_TEST_TILE * tiles_across + i % width / Z_TEST_TILE];
            for c in 0..3 {
                let difference = f64::from(pair.image().pixels[i][c]) - f64::from(pair.reference().pixels[i][c]);
                let variance = va[c] + vb[c];
                if variance == 0.0 {
                    *(if difference == 0.0 { &mut certain_equal } else { &mut certain_different }) += 1;
                    continue;
                }
                let z = difference / variance.sqrt();
                value_count += 1;
                sum += z;
                squares += z * z;
                beyond_2 += usize::from(z.abs() > 2.0);
                beyond_3 += usize::from(z.abs() > 3.0);
                total[c].add(difference, variance);
                tile[c].add(difference, variance);
            }
        }

        let spread = [0, 1, 2].map(|c| {
            let deviates = tiles.iter().filter(|tile| tile[c].variance > 0.0).map(|tile| tile[c].deviate());
            let (chi_square, count) = deviates.fold((0.0, 0usize), |(sum, n), z| (sum + z * z, n + 1));
            if count == 0 { f64::NAN } else { chi_square_deviate(chi_square, count as f64) }
        });
        let fraction = |count: usize| count as f64 / value_count as f64;
        Ok(Self {
            value_count,
            mean_z: sum / value_count as f64,
            mean_z_squared: squares / value_count as f64,
            share_beyond_2: fraction(beyond_2),
            share_beyond_3: fraction(beyond_3),
            certain_equal,
            certain_different,
            invalid_variance,
            offset: total.map(Sums::deviate),
            spread,
        })
    }

    /// Probability of deviates at least this large if the images differ by noise alone, 0..=1: see [`ZTest`]. NaN if no
    /// value was tested.
    pub fn p_value(&self) -> f64 {
        let deviates = self.offset.iter().chain(&self.spread).filter(|d| !d.is_nan());
        let smallest = deviates.map(|d| two_sided(*d)).fold(f64::NAN, f64::min);
        if smallest > 1.0 / 6.0 { 1.0 } else { 6.0 * smallest }
    }

    /// The test's verdict: if [`Self::p_value`] is below 0.001, the deviate with the largest magnitude decides.
    pub fn verdict(&self) -> ZVerdict {
        let p_value = self.p_value();
        if p_value.is_nan() {
            return ZVerdict::Untested;
        }
        if p_value >= LEVEL {
            return ZVerdict::Noise;
        }
        let furthest = |deviates: [f64; 3]| {
            deviates
                .into_iter()
                .filter(|d| !d.is_nan())
                .fold(0.0f64, |far, d| if d.abs() > far.abs() { d } else { far })
        };
        let (offset, spread) = (furthest(self.offset), furthest(self.spread));
        if offset.abs() >= spread.abs() {
            ZVerdict::Offset
        } else if spread > 0.0 {
            ZVerdict::Spread
        } else {
            ZVerdict::TooAlike
        }
    }
}

#[cfg(test)]
mod tests;
