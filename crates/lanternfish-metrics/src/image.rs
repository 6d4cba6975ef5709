//! Linear images in memory.

use crate::MetricsError;

/// A linear, scene-referred image in Rec. 709. `pixels` has `width * height` entries, rows from the top.
///
/// Only [`flip_ldr`](crate::flip_ldr) takes images of sRGB-encoded values instead.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Radiance, red, green, blue.
    pub pixels: Vec<[f32; 3]>,
}

impl RgbImage {
    /// Creates an image; an error unless there are `width * height` pixels.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Self, MetricsError> {
        if pixels.len() != width * height {
            return Err(MetricsError::PixelCount { got: pixels.len(), expected: width * height });
        }
        Ok(Self { width, height, pixels })
    }

    /// The image at 1/`factor` of its size: each pixel is the mean of a `factor` × `factor` box.
    ///
    /// Both sides must be multiples of `factor`, which must not be zero. Sums are in 64 bits, so that the image's mean
    /// is preserved up to the last bits of `f32`.
    pub fn box_downsampled(&self, factor: usize) -> Result<Self, MetricsError> {
        let (width, height) = (self.width, self.height);
        if factor == 0 || !width.is_multiple_of(factor) || !height.is_multiple_of(factor) {
            return Err(MetricsError::Indivisible { width, height, factor });
        }
        let (small_width, small_height) = (width / factor, height / factor);
        let mut pixels = Vec::with_capacity(small_width * small_height);
        for y in 0..small_height {
            for x in 0..small_width {
                let mut sum = [0.0f64; 3];
                for row in y * factor..(y + 1) * factor {
                    for pixel in &self.pixels[row * width + x * factor..][..factor] {
                        for (sum, value) in sum.iter_mut().zip(pixel) {
                            *sum += f64::from(*value);
                        }
                    }
                }
                pixels.push(sum.map(|s| (s / (factor * factor) as f64) as f32));
            }
        }
        Self::new(small_width, small_height, pixels)
    }
}

/// Luminance of a linear Rec. 709 colour.
pub(crate) fn luminance([red, green, blue]: [f32; 3]) -> f32 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_the_mean_of_its_own_pixels() {
        let pixels = (0..24).map(|i| [i as f32, 0.0, -(i as f32)]).collect();
        let small = RgbImage::new(6, 4, pixels).unwrap().box_downsampled(2).unwrap();
        assert_eq!((small.width, small.height), (3, 2));
        // The first box holds 0, 1, 6, 7; the last 16, 17, 22, 23.
        assert_eq!(small.pixels[0], [3.5, 0.0, -3.5]);
        assert_eq!(small.pixels[5], [19.5, 0.0, -19.5]);
    }

    #[test]
    fn sizes_that_are_no_multiple_are_refused() {
        let image = RgbImage::new(6, 4, vec![[0.0; 3]; 24]).unwrap();
        assert!(matches!(image.box_downsampled(4), Err(MetricsError::Indivisible { factor: 4, .. })));
        assert!(image.box_downsampled(0).is_err());
        assert!(matches!(
            RgbImage::new(6, 4, vec![[0.0; 3]; 23]),
            Err(MetricsError::PixelCount { got: 23, expected: 24 })
        ));
    }
}
