//! Two images to be compared, and the pixels that cannot be.

use std::fmt;

use crate::{
    FlipMap, HdrFlip, HdrFlipMap, ImageErrors, MetricsError, RgbImage, Spread, ZTest, compare::check_sizes, flip_hdr,
    flip_ldr, ssim,
};

/// Number of pixels of an image with a channel of each kind that no renderer should produce. A pixel can count in several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelFaults {
    /// A channel that is not a number.
    pub nan: usize,
    /// A channel that is +∞.
    pub positive_infinity: usize,
    /// A channel that is −∞.
    pub negative_infinity: usize,
    /// A finite channel below 0: compared like any other value.
    pub negative: usize,
    /// Pixels with a channel that is not finite: left out of every comparison.
    pub not_finite: usize,
}

impl PixelFaults {
    /// Counts the faults of all pixels of an image.
    pub fn of(image: &RgbImage) -> Self {
        let count = |is: fn(f32) -> bool| image.pixels.iter().filter(|pixel| pixel.iter().any(|v| is(*v))).count();
        Self {
            nan: count(f32::is_nan),
            positive_infinity: count(|v| v == f32::INFINITY),
            negative_infinity: count(|v| v == f32::NEG_INFINITY),
            negative: count(|v| v < 0.0 && v.is_finite()),
            not_finite: count(|v| !v.is_finite()),
        }
    }
}

/// `3 NaN, 1 +inf, 2 negative`; `none` where there are none.
impl fmt::Display for PixelFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kinds = [
            (self.nan, "NaN"),
            (self.positive_infinity, "+inf"),
            (self.negative_infinity, "-inf"),
            (self.negative, "negative"),
        ];
        let named: Vec<_> =
            kinds.iter().filter(|(count, _)| *count > 0).map(|(count, kind)| format!("{count} {kind}")).collect();
        f.write_str(&if named.is_empty() { "none".to_owned() } else { named.join(", ") })
    }
}

/// Two images of one size, ready for every measure.
///
/// A pixel that is not finite in either image is left out of all of them, and black in both. Both images hold linear
/// radiance, or both hold what a display shows ([`Self::shown`], [`read_png`](crate::read_png)); each measure says
/// which it takes.
#[derive(Clone, Debug)]
pub struct Pair {
    image: RgbImage,
    reference: RgbImage,
    /// True if each pixel is finite in both images, rows from the top.
    is_compared: Vec<bool>,
    compared_count: usize,
    faults: [PixelFaults; 2],
}

impl Pair {
    /// An image under test and its reference. An error when sizes differ, or when no pixel is finite in both.
    pub fn new(mut image: RgbImage, mut reference: RgbImage) -> Result<Self, MetricsError> {
        check_sizes(&image, &reference)?;
        let faults = [PixelFaults::of(&image), PixelFaults::of(&reference)];
        let mut is_compared = vec![true; image.pixels.len()];
        for (is_compared, (a, b)) in is_compared.iter_mut().zip(image.pixels.iter_mut().zip(&mut reference.pixels)) {
            *is_compared = a.iter().chain(b.iter()).all(|v| v.is_finite());
            if !*is_compared {
                (*a, *b) = ([0.0; 3], [0.0; 3]);
            }
        }
        let compared_count = is_compared.iter().filter(|is| **is).count();
        if compared_count == 0 {
            return Err(MetricsError::NothingFinite);
        }
        Ok(Self { image, reference, is_compared, compared_count, faults })
    }

    /// The image under test; pixels that are left out are black.
    pub fn image(&self) -> &RgbImage {
        &self.image
    }

    /// The reference; pixels that are left out are black.
    pub fn reference(&self) -> &RgbImage {
        &self.reference
    }

    /// Whether each pixel is compared, that is finite in both images; one value a pixel, rows from the top.
    pub fn is_compared(&self) -> &[bool] {
        &self.is_compared
    }

    /// Number of compared pixels.
    pub fn compared_count(&self) -> usize {
        self.compared_count
    }

    /// Counts of pixels that no renderer should make: in the image, and in the reference.
    pub fn faults(&self) -> [PixelFaults; 2] {
        self.faults
    }

    /// The pixels that are compared: image, reference.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = (&[f32; 3], &[f32; 3])> {
        let pixels = self.image.pixels.iter().zip(&self.reference.pixels).zip(&self.is_compared);
        pixels.filter(|(_, is_compared)| **is_compared).map(|(pixel, _)| pixel)
    }

    /// The pair as a display shows it, from linear images: times 2^`exposure` (stops), clamped to 0..=1, sRGB-encoded.
    pub fn shown(&self, exposure: f32) -> Self {
        let scale = exposure.exp2();
        let shown = |image: &RgbImage| RgbImage {
            pixels: image.pixels.iter().map(|pixel| pixel.map(|v| srgb_from_linear(v * scale))).collect(),
            ..*image
        };
        Self {
            image: shown(&self.image),
            reference: shown(&self.reference),
            is_compared: self.is_compared.clone(),
            ..*self
        }
    }

    /// Errors of the images' values, linear radiance or display values alike.
    pub fn errors(&self) -> ImageErrors {
        ImageErrors::measure(self)
    }

    /// Peak signal-to-noise ratio of **display values**, dB: 10 log₁₀(1 / mean squared error). Infinite where the
    /// images are equal; higher is better.
    pub fn psnr(&self) -> f64 {
        -10.0 * self.errors().mse.log10()
    }

    /// Structural similarity of **display values**, at most 1, which equal images have [Wang2004, eq. 13].
    ///
    /// It compares the luma 0.2126 R + 0.7152 G + 0.0722 B in windows of 11 × 11 pixels weighted by a Gaussian of σ = 1.5
    /// pixels, with K₁ = 0.01, K₂ = 0.03 and the range 1, and is the mean over all windows that lie in the image and hold no pixel
    /// that is left out. An error when a side has less than 11 pixels, or when there is no such window.
    pub fn ssim(&self) -> Result<f64, MetricsError> {
        ssim::mean(self)
    }

    /// LDR-ꟻLIP of **display values**: see [`flip_ldr`]. What is left out has the error 0; for the mean, ask
    /// [`Self::mean_of`].
    pub fn flip_ldr(&self, pixels_per_degree: f32) -> Result<FlipMap, MetricsError> {
        flip_ldr(&self.reference, &self.image, pixels_per_degree).map(|map| self.without_left_out(map))
    }

    /// HDR-ꟻLIP of **linear** images: see [`flip_hdr`]. What is left out has the error 0; for the mean, ask
    /// [`Self::mean_of`].
    pub fn flip_hdr(&self, looks: &HdrFlip) -> Result<HdrFlipMap, MetricsError> {
        let HdrFlipMap { map, exposures } = flip_hdr(&self.reference, &self.image, looks)?;
        Ok(HdrFlipMap { map: self.without_left_out(map), exposures })
    }

    /// The mean of a map of this pair over the pixels that are compared.
    pub fn mean_of(&self, map: &FlipMap) -> f64 {
        map.errors.iter().map(|e| f64::from(*e)).sum::<f64>() / self.compared_count as f64
    }

    /// The mean, the 95th percentile and the largest error of a map of this pair, over the pixels that are compared.
    pub fn spread_of(&self, map: &FlipMap) -> Spread {
        let errors = map.errors.iter().zip(&self.is_compared).filter(|(_, is_compared)| **is_compared);
        Spread::of(errors.map(|(error, _)| f64::from(*error)))
    }

    /// Whether the differences of **linear** images are noise: see [`ZTest`].
    ///
    /// Each variance is that of the *pixel's value*, not of its samples: theirs over their number. An image without
    /// variances is taken to be exact. An error when both are missing, or when a size differs.
    pub fn z_test(
        &self,
        image_variance: Option<&RgbImage>,
        reference_variance: Option<&RgbImage>,
    ) -> Result<ZTest, MetricsError> {
        ZTest::measure(self, image_variance, reference_variance)
    }

    fn without_left_out(&self, mut map: FlipMap) -> FlipMap {
        let left_out = map.errors.iter_mut().zip(&self.is_compared).filter(|(_, is_compared)| !**is_compared);
        left_out.for_each(|(error, _)| *error = 0.0);
        map
    }
}

/// What a display is sent for a linear value, both 0..=1; values outside are clamped [IEC 61966-2-1].
pub(crate) fn srgb_from_linear(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests;
