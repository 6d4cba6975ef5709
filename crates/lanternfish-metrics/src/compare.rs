//! Difference measures of two images.

use crate::{MetricsError, RgbImage, image::luminance};

/// Error of an image against a ground truth, per pixel and over the image.
///
/// The error of a pixel is ‖image − reference‖₁ / ‖reference‖₁ over the three channels: a channel that is dark in the
/// reference does not inflate it, and a wrong colour of the right brightness still counts. Only pixels that are lit in the
/// reference count, since an error relative to black is undefined. A pixel that is not finite has an infinite error.
#[derive(Clone, Debug)]
pub struct RelativeError {
    /// Error of each lit pixel, ascending; never empty.
    sorted: Vec<f32>,
    energy_ratio: f64,
}

impl RelativeError {
    /// Compares over the pixels whose luminance in `reference` is above `lit_threshold` (> 0).
    pub fn measure(image: &RgbImage, reference: &RgbImage, lit_threshold: f32) -> Result<Self, MetricsError> {
        check_sizes(image, reference)?;
        let mut sorted: Vec<f32> = image
            .pixels
            .iter()
            .zip(&reference.pixels)
            .filter(|(_, reference)| luminance(**reference) > lit_threshold)
            .map(|(pixel, reference)| relative_error(*pixel, *reference))
            .collect();
        if sorted.is_empty() {
            return Err(MetricsError::NothingLit { threshold: lit_threshold });
        }
        sorted.sort_unstable_by(f32::total_cmp);
        Ok(Self { sorted, energy_ratio: energy(image) / energy(reference) })
    }

    /// Number of compared pixels.
    pub fn lit_count(&self) -> usize {
        self.sorted.len()
    }

    /// The median over lit pixels: 0.01 is one per cent. The upper of the two middle ones where their count is even.
    pub fn median(&self) -> f32 {
        self.sorted[self.sorted.len() / 2]
    }

    /// Fraction of lit pixels, 0..=1, whose error is at most `error`.
    pub fn fraction_within(&self, error: f32) -> f32 {
        self.sorted.partition_point(|e| *e <= error) as f32 / self.sorted.len() as f32
    }

    /// Sum of all channels of **all** pixels, lit or not, over the reference's: light that leaks into dark areas
    /// counts. NaN or infinite if the image has such a pixel.
    #[doc(hidden)]
    pub fn energy_ratio(&self) -> f64 {
        self.energy_ratio
    }
}

/// Fraction of pixels, 0..=1, in which any channel differs by more than `tolerance`.
///
/// Equal infinities are equal; NaN differs from everything, itself included.
pub fn fraction_differing(a: &RgbImage, b: &RgbImage, tolerance: f32) -> Result<f32, MetricsError> {
    check_sizes(a, b)?;
    let same = |(x, y): (&f32, &f32)| x == y || (x - y).abs() <= tolerance;
    let differing = a.pixels.iter().zip(&b.pixels).filter(|(a, b)| !a.iter().zip(b.iter()).all(same)).count();
    Ok(differing as f32 / a.pixels.len().max(1) as f32)
}

pub(crate) fn check_sizes(image: &RgbImage, reference: &RgbImage) -> Result<(), MetricsError> {
    let (image, reference) = ((image.width, image.height), (reference.width, reference.height));
    if image == reference { Ok(()) } else { Err(MetricsError::SizeMismatch { image, reference }) }
}

fn relative_error(pixel: [f32; 3], reference: [f32; 3]) -> f32 {
    let difference: f32 = pixel.iter().zip(&reference).map(|(p, r)| (p - r).abs()).sum();
    let error = difference / reference.iter().map(|r| r.abs()).sum::<f32>();
    if error.is_finite() { error } else { f32::INFINITY }
}

fn energy(image: &RgbImage) -> f64 {
    image.pixels.iter().flatten().map(|v| f64::from(*v)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 grey pixels from 0.01 to 1.
    fn reference() -> RgbImage {
        RgbImage::new(10, 10, (1..=100).map(|i| [i as f32 / 100.0; 3]).collect()).unwrap()
    }

    fn changed(change: impl Fn(usize, [f32; 3]) -> [f32; 3]) -> RgbImage {
        let mut image = reference();
        for (i, pixel) in image.pixels.iter_mut().enumerate() {
            *pixel = change(i, *pixel);
        }
        image
    }

    fn measured(image: &RgbImage) -> RelativeError {
        RelativeError::measure(image, &reference(), 1e-3).unwrap()
    }

    #[test]
    fn an_image_agrees_with_itself() {
        let error = measured(&reference());
        assert_eq!((error.lit_count(), error.median(), error.fraction_within(0.0)), (100, 0.0, 1.0));
        assert_eq!(error.energy_ratio(), 1.0);
        assert_eq!(fraction_differing(&reference(), &reference(), 0.0).unwrap(), 0.0);
    }

    #[test]
    fn the_median_sees_an_error_of_most_pixels() {
        let error = measured(&changed(|_, p| p.map(|v| 1.03 * v)));
        assert!((error.median() - 0.03).abs() < 1e-5, "{}", error.median());
        assert!((error.energy_ratio() - 1.03).abs() < 1e-5);
        assert_eq!(error.fraction_within(0.02), 0.0);
    }

    #[test]
    fn the_fraction_sees_what_the_median_does_not() {
        let error = measured(&changed(|i, p| if i % 10 == 0 { [0.0; 3] } else { p }));
        assert_eq!(error.median(), 0.0);
        assert_eq!(error.fraction_within(0.02), 0.9);
    }

    #[test]
    fn a_wrong_colour_of_the_right_energy_is_seen() {
        let error = measured(&changed(|_, [r, g, b]| [1.2 * r, 0.8 * g, b]));
        assert!((error.energy_ratio() - 1.0).abs() < 1e-5);
        assert!((error.median() - 0.4 / 3.0).abs() < 1e-5, "{}", error.median());
    }

    #[test]
    fn energy_sees_light_in_dark_areas() {
        let mut dark = reference();
        dark.pixels[99] = [0.0; 3];
        let error = RelativeError::measure(&reference(), &dark, 1e-3).unwrap();
        assert_eq!((error.lit_count(), error.fraction_within(0.0)), (99, 1.0));
        // The reference sums to 50.5; the black pixel holds 1 of it.
        assert!((error.energy_ratio() - 50.5 / 49.5).abs() < 1e-5);
    }

    #[test]
    fn a_pixel_that_is_not_finite_is_an_error_and_not_a_hole() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let error = measured(&changed(|_, [_, g, b]| [bad, g, b]));
            assert_eq!((error.median(), error.fraction_within(f32::MAX)), (f32::INFINITY, 0.0));
            assert!(!error.energy_ratio().is_finite());
        }
    }

    #[test]
    fn the_differing_fraction_counts_pixels_beyond_the_tolerance() {
        let image = changed(|i, [r, g, b]| if i < 7 { [r, g + 0.25, b] } else { [r, g, b + 1e-4] });
        assert_eq!(fraction_differing(&image, &reference(), 0.1).unwrap(), 0.07);
        assert_eq!(fraction_differing(&image, &reference(), 0.5).unwrap(), 0.0);
        assert_eq!(fraction_differing(&image, &reference(), 0.0).unwrap(), 1.0);
        let nan = changed(|_, _| [f32::NAN; 3]);
        assert_eq!(fraction_differing(&nan, &nan, 1.0).unwrap(), 1.0);
    }

    #[test]
    fn different_sizes_and_black_references_are_errors() {
        let other = RgbImage::new(20, 5, vec![[1.0; 3]; 100]).unwrap();
        let error = RelativeError::measure(&other, &reference(), 1e-3).unwrap_err();
        assert!(error.to_string().contains("20×5") && error.to_string().contains("10×10"), "{error}");
        assert!(fraction_differing(&other, &reference(), 1.0).is_err());
        assert!(matches!(
            RelativeError::measure(&reference(), &reference(), 2.0),
            Err(MetricsError::NothingLit { threshold: 2.0 })
        ));
    }
}
