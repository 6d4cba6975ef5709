//! Errors of pixel values: mean, 95th percentile and maximum.

use crate::Pair;

/// Offset that keeps relative errors of dark pixels finite. It is added to the reference, and for the relative mean squared
/// error to the reference's square. 0.01 is usual where white is about 1.
///
/// Relative errors therefore depend on the unit of radiance.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// Errors of an image a against a reference r, over every channel of the compared pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageErrors {
    /// Mean of (a − r)².
    pub mse: f64,
    /// relMSE: mean of (a − r)² / (r² + ε) with ε = [`RELATIVE_EPSILON`].
    pub relative_mse: f64,
    /// Statistics of the absolute error |a − r|.
    pub absolute: Spread,
    /// Statistics of the relative error |a − r| / (|r| + ε) with ε = [`RELATIVE_EPSILON`].
    pub relative: Spread,
    /// Sum of a over sum of r; not finite if the reference is black.
    pub energy_ratio: f64,
}

/// Mean, 95th percentile and maximum of errors, over every channel of an image or every pixel of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean error.
    pub mean: f64,
    /// 95th percentile: the smallest error that 95 % of the errors do not exceed.
    pub percentile_95: f64,
    /// Largest error.
    pub max: f64,
}

impl ImageErrors {
    pub(crate) fn measure(pair: &Pair) -> Self {
        let channels = || pair.pixels().flat_map(|(a, r)| a.iter().zip(r).map(|(a, r)| (f64::from(*a), f64::from(*r))));
        let count = (3 * pair.compared_count()) as f64;
        let (mut squares, mut relative_squares, mut energy, mut reference_energy) = (0.0, 0.0, 0.0, 0.0);
        for (a, r) in channels() {
            let square = (a - r) * (a - r);
            squares += square;
            relative_squares += square / (r * r + RELATIVE_EPSILON);
            energy += a;
            reference_energy += r;
        }
        Self {
            mse: squares / count,
            relative_mse: relative_squares / count,
            absolute: Spread::of(channels().map(|(a, r)| (a - r).abs())),
            relative: Spread::of(channels().map(|(a, r)| (a - r).abs() / (r.abs() + RELATIVE_EPSILON))),
            energy_ratio: energy / reference_energy,
        }
    }
}

impl Spread {
    /// The statistics of these errors. They must be 0 or more, and there must be at least one.
    pub(crate) fn of(errors: impl Iterator<Item = f64>) -> Self {
        let mut errors: Vec<f64> = errors.collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let max = errors.iter().copied().fold(0.0, f64::max);
        // The nearest rank, counted from 1, is ⌈0.95 n⌉.
        let rank = (95 * errors.len()).div_ceil(100) - 1;
        let percentile_95 = *errors.select_nth_unstable_by(rank, f64::total_cmp).1;
        Self { mean, percentile_95, max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RgbImage;

    fn image(pixels: &[[f32; 3]]) -> RgbImage {
        RgbImage::new(pixels.len(), 1, pixels.to_vec()).unwrap()
    }

    fn close(a: f64, b: f64) -> bool {
        // f32 values near 1.
        (a - b).abs() <= 1e-6 * b.abs().max(1.0)
    }

    #[test]
    fn errors_are_those_worked_out_by_hand() {
        // Differences 0, 1, 2; 0, 0.5, 0.
        let pair =
            Pair::new(image(&[[1.0, 2.0, 5.0], [0.0, 0.5, 4.0]]), image(&[[1.0, 1.0, 3.0], [0.0, 0.0, 4.0]])).unwrap();
        let errors = pair.errors();
        assert!(close(errors.mse, (1.0 + 4.0 + 0.25) / 6.0));
        assert!(close(errors.relative_mse, (1.0 / 1.01 + 4.0 / 9.01 + 0.25 / 0.01) / 6.0));
        assert!(close(errors.absolute.mean, 3.5 / 6.0) && errors.absolute.max == 2.0);
        assert!(close(errors.relative.mean, (1.0 / 1.01 + 2.0 / 3.01 + 0.5 / 0.01) / 6.0));
        assert!(close(errors.relative.max, 50.0));
        assert!(close(errors.energy_ratio, 12.5 / 9.0));
    }

    #[test]
    fn the_95th_percentile_is_not_moved_by_the_worst_5_per_cent() {
        // 100 pixels, 300 channels: the 285th of the errors 1, 2, …, 300 hundredths.
        let a: Vec<[f32; 3]> = (0..100).map(|i| [1, 2, 3].map(|c| (3 * i + c) as f32 / 100.0)).collect();
        let mut b = a.clone();
        let zero = vec![[0.0; 3]; 100];
        let p95 = |pixels: &[[f32; 3]]| Pair::new(image(pixels), image(&zero)).unwrap().errors().absolute;
        assert!(close(p95(&b).percentile_95, 2.85) && close(p95(&b).max, 3.0));
        b[95..].fill([1e6; 3]);
        assert!(close(p95(&b).percentile_95, 2.85) && p95(&b).max == 1e6);
        b[94] = [1e6; 3];
        assert_eq!(p95(&b).percentile_95, 1e6);
    }

    #[test]
    fn a_change_of_1_per_cent_is_detected() {
        let reference: Vec<[f32; 3]> = (1..=50).map(|i| [i as f32; 3]).collect();
        let brighter: Vec<[f32; 3]> = reference.iter().map(|p| p.map(|v| 1.01 * v)).collect();
        let errors = Pair::new(image(&brighter), image(&reference)).unwrap().errors();
        assert!((errors.energy_ratio - 1.01).abs() < 1e-6);
        assert!((errors.relative_mse / 1e-4 - 1.0).abs() < 0.01, "{}", errors.relative_mse);
        assert!((errors.relative.percentile_95 - 0.01).abs() < 1e-4);
    }
}
