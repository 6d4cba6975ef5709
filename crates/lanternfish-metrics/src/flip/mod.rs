//! The perceived difference of two images: LDR-ꟻLIP [Andersson2020, algorithm], and HDR-ꟻLIP [Andersson2021, algorithm], its
//! maximum over exposures (`hdr`).
//!
//! The measure models an observer who flips between two images on one display. Colour: each image is filtered by the
//! eye's contrast sensitivity (`filters`), and the colour difference is measured in a perceptually uniform space
//! (`color`). Features: an edge or a point that only one image has amplifies the colour difference.

mod color;
mod filters;
mod hdr;
mod magma;
#[cfg(test)]
mod tests;
mod tone_mapper;

pub use hdr::{Exposures, HdrFlip, HdrFlipMap, flip_hdr};
pub use tone_mapper::FlipToneMapper;

use rayon::prelude::*;

use self::{
    color::{ColorDifference, Opponent, lab_from_opponent, linear_from_srgb},
    filters::{Filters, Kernel, filtered_row},
};
use crate::{MetricsError, RgbImage, compare::check_sizes};

/// Pixels per degree of visual angle for a 3840-pixel display of 0.7 m seen from 0.7 m: 67.02.
///
/// 3840 px / 0.7 m × 0.7 m × π/180 [Andersson2020, viewing conditions].
pub const PIXELS_PER_DEGREE: f32 = 3840.0 * std::f32::consts::PI / 180.0;

/// Exponent of the feature difference [Andersson2020, feature pipeline].
const FEATURE_EXPONENT: f32 = 0.5;

/// The perceived difference of two images, per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Error of each pixel, 0 (no difference) to 1 (the largest); `width * height` values, rows from the top.
    pub errors: Vec<f32>,
}

impl FlipMap {
    /// The mean over all pixels, 0..=1; 0 for an empty map. Summed in 64 bits.
    pub fn mean(&self) -> f32 {
        let sum: f64 = self.errors.iter().map(|e| f64::from(*e)).sum();
        (sum / self.errors.len().max(1) as f64) as f32
    }

    /// The map as an sRGB-encoded image, three bytes per pixel: 0 is black, 1 pale yellow, with purple and orange between.
    ///
    /// The colour map is *magma*, as in the authors' images. For [`write_png`](crate::write_png).
    #[doc(hidden)]
    pub fn magma(&self) -> Vec<u8> {
        self.errors.iter().flat_map(|error| magma::srgb(*error)).collect()
    }
}

/// LDR-ꟻLIP of `test` against `reference` [Andersson2020, algorithm].
///
/// Both hold **sRGB-encoded** values, not linear ones: display bytes over 255. They are clamped to 0..=1. The measure is
/// symmetric. The border pixels extend beyond the image.
///
/// `pixels_per_degree` (2..=1000) is the resolution in pixels per degree of visual angle, usually [`PIXELS_PER_DEGREE`].
/// Higher: the viewing distance is larger, fine differences blur, and the errors fall. Lower: single pixels are visible;
/// below 2, all detail that the eye resolves would be narrower than a pixel.
///
/// An error if sizes differ, if `pixels_per_degree` is out of range, or if a value is NaN. The cost is proportional to
/// pixels × `pixels_per_degree`. It runs on rayon's threads; their number does not change the result.
pub fn flip_ldr(reference: &RgbImage, test: &RgbImage, pixels_per_degree: f32) -> Result<FlipMap, MetricsError> {
    check_sizes(test, reference)?;
    check_numbers(reference)?;
    check_numbers(test)?;
    let observer = Observer::new(pixels_per_degree)?;
    let (width, height) = (reference.width, reference.height);
    let errors = observer.errors(reference, test, |pixel| pixel.map(linear_from_srgb));
    Ok(FlipMap { width, height, errors })
}

/// The filters and the colour difference for one viewing distance.
struct Observer {
    filters: Filters,
    color_difference: ColorDifference,
}

impl Observer {
    fn new(pixels_per_degree: f32) -> Result<Self, MetricsError> {
        if !(2.0..=1000.0).contains(&pixels_per_degree) {
            return Err(MetricsError::PixelsPerDegree { got: pixels_per_degree });
        }
        Ok(Self { filters: Filters::new(pixels_per_degree), color_difference: ColorDifference::new() })
    }

    /// The errors of two images of one size. `linear` converts their values to linear display colours, 0..=1.
    fn errors(&self, reference: &RgbImage, test: &RgbImage, linear: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Vec<f32> {
        let mut errors = vec![0.0; reference.pixels.len()];
        if errors.is_empty() {
            return errors;
        }
        let (reference, test) = (Opponent::new(reference, &linear), Opponent::new(test, &linear));
        errors.par_chunks_mut(reference.width).enumerate().for_each(|(y, errors)| {
            let (reference, test) =
                (FilteredRow::new(&reference, &self.filters, y), FilteredRow::new(&test, &self.filters, y));
            for (x, error) in errors.iter_mut().enumerate() {
                let color = self.color_difference.between(reference.lab[x], test.lab[x]);
                let edge = (reference.edges[x] - test.edges[x]).abs();
                let point = (reference.points[x] - test.points[x]).abs();
                // Each detector's response is at most 1 along an axis and √2 along both. Rounding must not make the
                // exponent negative, which would give equal colours an infinite error.
                let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).min(1.0).powf(FEATURE_EXPONENT);
                *error = color.powf(1.0 - feature);
            }
        });
        errors
    }
}

fn check_numbers(image: &RgbImage) -> Result<(), MetricsError> {
    match image.pixels.iter().position(|pixel| pixel.iter().any(|v| v.is_nan())) {
        Some(i) => Err(MetricsError::NotANumber { x: i % image.width, y: i / image.width }),
        None => Ok(()),
    }
}

fn check_finite(image: &RgbImage) -> Result<(), MetricsError> {
    match image.pixels.iter().position(|pixel| pixel.iter().any(|v| !v.is_finite())) {
        Some(i) => Err(MetricsError::NotFinite { x: i % image.width, y: i / image.width }),
        None => Ok(()),
    }
}

/// A row of an image, filtered for an observer.
struct FilteredRow {
    /// Colour of each pixel after the contrast sensitivity filter, in the space of [`lab_from_opponent`].
    lab: Vec<[f32; 3]>,
    /// Length of the luminance's gradient at each pixel.
    edges: Vec<f32>,
    /// Length of the vector of the luminance's second derivatives along x and y at each pixel.
    points: Vec<f32>,
}

impl FilteredRow {
    fn new(rendering: &Opponent, filters: &Filters, y: usize) -> Self {
        let width = rendering.width;
        let filtered = |plane: &[f32], parts: &[Kernel]| {
            let mut sum = vec![0.0; width];
            for part in parts {
                sum.iter_mut().zip(filtered_row(plane, width, y, part, part)).for_each(|(sum, value)| *sum += value);
            }
            sum
        };
        let luminance = filtered(&rendering.luminance, &filters.luminance);
        let red_green = filtered(&rendering.red_green, &filters.red_green);
        let blue_yellow = filtered(&rendering.blue_yellow, &filters.blue_yellow);
        let lab = (0..width).map(|x| lab_from_opponent([luminance[x], red_green[x], blue_yellow[x]])).collect();

        let lengths = |detector: &Kernel| {
            let across = filtered_row(&rendering.luminance, width, y, &filters.smooth, detector);
            let down = filtered_row(&rendering.luminance, width, y, detector, &filters.smooth);
            across.into_iter().zip(down).map(|(x, y)| x.hypot(y)).collect()
        };
        Self { lab, edges: lengths(&filters.edge), points: lengths(&filters.point) }
    }
}
