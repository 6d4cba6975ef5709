//! Two images for comparison, and counts of invalid pixels.

use std::fmt;

use crate::{
    FlipMap, HdrFlip, HdrFlipMap, ImageErrors, MetricsError, RgbImage, Spread, ZTest, compare::check_sizes, flip_hdr,
    flip_ldr, ssim,
};

/// Numbers of an image's pixels with invalid channels, by kind. A pixel can count in several kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelFaults {
    /// Pixels with a channel that is NaN.
    pub nan: usize,
    /// Pixels with a channel that is +∞.
    pub positive_infinity: usize,
    /// Pixels with a channel that is −∞.
    pub negative_infinity: usize,
    /// Pixels with a finite channel below 0; they are compared like any other.
    pub negative: usize,
    /// Pixels with a channel that is not finite; they are left out of every comparison.
    pub not_finite: usize,
}

impl PixelFaults {
    /// Counts the invalid pixels of an image.
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

/// `3 NaN, 1 +inf, 2 negative`, or `none`.
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

/// Two images of one size, for comparison by any metric.
///
/// A pixel that is not finite in either image is set to black in both and left out of all metrics. Both images hold linear
/// radiance, or both hold display values ([`Self::shown`], [`read_png`](crate::read_png)); each metric's documentation says
/// which it expects.
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
    /// Creates a pair of an image under test and its reference. An error if sizes differ, or if no pixel is finite in both.
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

    /// True for each pixel that is finite in both images; one value per pixel, rows from the top.
    #[doc(hidden)]
    pub fn is_compared(&self) -> &[bool] {
        &self.is_compared
    }

    /// Number of compared pixels.
    #[doc(hidden)]
    pub fn compared_count(&self) -> usize {
        self.compared_count
    }

    /// Counts of invalid pixels in the image and in the reference.
    #[doc(hidden)]
    pub fn faults(&self) -> [PixelFaults; 2] {
        self.faults
    }

    /// The compared pixels: (image, reference).
    pub(crate) fn pixels(&self) -> impl Iterator<Item = (&[f32; 3], &[f32; 3])> {
        let pixels = self.image.pixels.iter().zip(&self.reference.pixels).zip(&self.is_compared);
        pixels.filter(|(_, is_compared)| **is_compared).map(|(pixel, _)| pixel)
    }

    /// Display values of a pair of linear images: scaled by 2^`exposure` (stops), clamped to 0..=1, sRGB-encoded.
    #[doc(hidden)]
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

    /// Errors of the images' values, for linear radiance and display values alike.
    pub fn errors(&self) -> ImageErrors {
        ImageErrors::measure(self)
    }

    /// Peak signal-to-noise ratio of **display values**, dB: 10 log₁₀(1 / mean squared error). Infinite if the
    /// images are equal; higher is better.
    pub fn psnr(&self) -> f64 {
        -10.0 * self.errors().mse.log10()
    }

    /// Structural similarity of **display values**, at most 1; 1 if the images are equal [Wang2004, eq. 13].
    ///
    /// It compares the luma 0.2126 R + 0.7152 G + 0.0722 B in windows of 11 × 11 pixels weighted by a Gaussian of σ = 1.5
    /// pixels, with K₁ = 0.01, K₂ = 0.03 and the range 1. The result is the mean over all windows within the image that hold no
    /// left-out pixel. An error if a side has less than 11 pixels, or if there is no such window.
    pub fn ssim(&self) -> Result<f64, MetricsError> {
        ssim::mean(self)
    }

    /// LDR-ꟻLIP of **display values**: see [`flip_ldr`]. Left-out pixels have the error 0; [`Self::mean_of`] gives the
    /// mean.
    pub fn flip_ldr(&self, pixels_per_degree: f32) -> Result<FlipMap, MetricsError> {
        flip_ldr(&self.reference, &self.image, pixels_per_degree).map(|map| self.without_left_out(map))
    }

    /// HDR-ꟻLIP of **linear** images: see [`flip_hdr`]. Left-out pixels have the error 0; [`Self::mean_of`] gives the
    /// mean.
    pub fn flip_hdr(&self, looks: &HdrFlip) -> Result<HdrFlipMap, MetricsError> {
        let HdrFlipMap { map, exposures } = flip_hdr(&self.reference, &self.image, looks)?;
        Ok(HdrFlipMap { map: self.without_left_out(map), exposures })
    }

    /// The mean of a map of this pair over the compared pixels.
    #[doc(hidden)]
    pub fn mean_of(&self, map: &FlipMap) -> f64 {
        map.errors.iter().map(|e| f64::from(*e)).sum::<f64>() / self.compared_count as f64
    }

    /// The mean, the 95th percentile and the largest error of a map of this pair, over the compared pixels.
    #[doc(hidden)]
    pub fn spread_of(&self, map: &FlipMap) -> Spread {
        let errors = map.errors.iter().zip(&self.is_compared).filter(|(_, is_compared)| **is_compared);
        Spread::of(errors.map(|(error, _)| f64::from(*error)))
    }

    /// Tests whether noise explains the differences of **linear** images: see [`ZTest`].
    ///
    /// Each variance is that of the *pixel's mean*: the variance of its samples over their number. An image without
    /// variances counts as exact. An error if both are missing, or if a size differs.
    #[doc(hidden)]
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

/// sRGB-encoded value of a linear one, both 0..=1; values outside are clamped [IEC 61966-2-1].
pub(crate) fn srgb_from_linear(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests;
