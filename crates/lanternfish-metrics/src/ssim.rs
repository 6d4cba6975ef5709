//! Structural similarity [Wang2004, §III.B].

use rayon::prelude::*;

use crate::{MetricsError, Pair, image::luminance};

/// Width and height of a window, pixels.
const WINDOW: usize = 11;
/// Standard deviation of the Gaussian weights of a window, pixels.
const SIGMA: f64 = 1.5;
/// (K₁ L)² and (K₂ L)² with K₁ = 0.01, K₂ = 0.03 and the range L = 1 [Wang2004, §III.B].
const STABILITY: [f64; 2] = [1e-4, 9e-4];

/// Mean structural similarity over the windows within the image that hold no left-out pixel.
pub(crate) fn mean(pair: &Pair) -> Result<f64, MetricsError> {
    let (width, height) = (pair.image().width, pair.image().height);
    if width < WINDOW || height < WINDOW {
        return Err(MetricsError::TooSmall { width, height, smallest: WINDOW });
    }
    let luma = |pixels: &[[f32; 3]]| pixels.iter().map(|p| f64::from(luminance(*p))).collect::<Vec<f64>>();
    let (a, b) = (luma(&pair.image().pixels), luma(&pair.reference().pixels));
    let weights = weights();

    // For each row of windows: the weighted sums of a, b, a², b², a b along columns, then along rows.
    let rows = (0..=height - WINDOW).into_par_iter().map(|top| {
        let mut columns = vec![[0.0; 5]; width];
        let mut column_is_whole = vec![true; width];
        for (y, weight) in (top..).zip(weights) {
            for x in 0..width {
                let i = y * width + x;
                let moments = [a[i], b[i], a[i] * a[i], b[i] * b[i], a[i] * b[i]];
                columns[x].iter_mut().zip(moments).for_each(|(sum, v)| *sum += weight * v);
                column_is_whole[x] &= pair.is_compared()[i];
            }
        }
        let windows = columns.windows(WINDOW).zip(column_is_whole.windows(WINDOW));
        let complete = windows.filter(|(_, is_complete)| is_complete.iter().all(|is| *is));
        complete.fold((0.0, 0usize), |(sum, count), (columns, _)| (sum + similarity(columns, &weights), count + 1))
    });
    // Collected first, so that the summation order does not depend on the number of threads.
    let (sum, count) = rows.collect::<Vec<_>>().into_iter().fold((0.0, 0), |(sum, count), (s, c)| (sum + s, count + c));
    if count == 0 { Err(MetricsError::NothingFinite) } else { Ok(sum / count as f64) }
}

/// Structural similarity of one window, from the weighted sums of a, b, a², b² and a b down its columns [Wang2004, eq. 13].
fn similarity(columns: &[[f64; 5]], weights: &[f64; WINDOW]) -> f64 {
    let mut moments = [0.0; 5];
    for (column, weight) in columns.iter().zip(weights) {
        moments.iter_mut().zip(column).for_each(|(sum, v)| *sum += weight * v);
    }
    let [a, b, aa, bb, ab] = moments;
    let [c1, c2] = STABILITY;
    let luminance = (2.0 * a * b + c1) / (a * a + b * b + c1);
    let structure = (2.0 * (ab - a * b) + c2) / ((aa - a * a) + (bb - b * b) + c2);
    luminance * structure
}

fn weights() -> [f64; WINDOW] {
    let gaussian: [f64; WINDOW] = std::array::from_fn(|i| {
        let x = i as f64 - (WINDOW / 2) as f64;
        (-0.5 * (x / SIGMA).powi(2)).exp()
    });
    let sum: f64 = gaussian.iter().sum();
    gaussian.map(|w| w / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RgbImage;

    fn uniform(width: usize, height: usize, value: f32) -> RgbImage {
        RgbImage::new(width, height, vec![[value; 3]; width * height]).unwrap()
    }

    fn ssim(a: RgbImage, b: RgbImage) -> f64 {
        Pair::new(a, b).unwrap().ssim().unwrap()
    }

    #[test]
    fn uniform_images_differ_in_luminance_only() {
        // (2 · 0.5 · 0.25 + 1e-4) / (0.25 + 0.0625 + 1e-4).
        let got = ssim(uniform(20, 15, 0.5), uniform(20, 15, 0.25));
        assert!((got - 0.2501 / 0.3126).abs() < 1e-6, "{got}");
    }

    #[test]
    fn an_inverted_image_has_the_opposite_structure() {
        let board = |white: usize| {
            let pixel = |i: usize| [((i % 16 + i / 16 + white) % 2) as f32; 3];
            RgbImage::new(16, 16, (0..256).map(pixel).collect()).unwrap()
        };
        assert_eq!(ssim(board(0), board(0)), 1.0);
        // Means ½ and variances ¼, covariance −¼, up to the weights of the window's ends: (−½ + c₂) / (½ + c₂).
        let got = ssim(board(0), board(1));
        assert!((got + 0.4991 / 0.5009).abs() < 1e-3, "{got}");
    }

    #[test]
    fn small_images_and_images_without_a_complete_window_are_errors() {
        let pair = Pair::new(uniform(10, 40, 0.5), uniform(10, 40, 0.5)).unwrap();
        assert!(matches!(pair.ssim(), Err(MetricsError::TooSmall { width: 10, height: 40, smallest: 11 })));
        let mut holed = uniform(12, 12, 0.5);
        holed.pixels[6 * 12 + 6] = [f32::NAN; 3];
        let pair = Pair::new(holed, uniform(12, 12, 0.5)).unwrap();
        assert!(matches!(pair.ssim(), Err(MetricsError::NothingFinite)));
    }
}
