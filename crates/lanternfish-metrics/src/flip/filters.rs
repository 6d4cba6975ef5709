//! Contrast sensitivity, edge and point filters of ꟻLIP. All are separable.

use std::f64::consts::PI;

/// Weights of a filter along one axis, centred; their number is odd.
pub(super) struct Kernel(Vec<f32>);

/// The filters for one viewing distance.
pub(super) struct Filters {
    /// Contrast sensitivity of the eye to each opponent channel; the filter is the sum of the kernels.
    pub(super) luminance: Vec<Kernel>,
    pub(super) red_green: Vec<Kernel>,
    pub(super) blue_yellow: Vec<Kernel>,
    /// Gaussian, applied across a detector's direction.
    pub(super) smooth: Kernel,
    /// First derivative of `smooth`.
    pub(super) edge: Kernel,
    /// Second derivative of `smooth`.
    pub(super) point: Kernel,
}

impl Filters {
    pub(super) fn new(pixels_per_degree: f32) -> Self {
        let pixels_per_degree = f64::from(pixels_per_degree);
        // Amplitudes and squared widths in degrees² of the Gaussians [Andersson2020, spatial filtering].
        let luminance = sensitivity(&[(1.0, 0.0047)], pixels_per_degree);
        let red_green = sensitivity(&[(1.0, 0.0053)], pixels_per_degree);
        let blue_yellow = sensitivity(&[(34.1, 0.04), (13.5, 0.025)], pixels_per_degree);

        // A detector is as wide as the most visible edge, 0.082 degrees [Andersson2020, feature pipeline].
        let sigma = 0.5 * 0.082 * pixels_per_degree;
        let radius = (3.0 * sigma).ceil() as i32;
        let gaussian = |x: f64| (-0.5 * (x / sigma).powi(2)).exp();
        Self {
            luminance,
            red_green,
            blue_yellow,
            smooth: balanced(radius, gaussian),
            edge: balanced(radius, |x| -x * gaussian(x)),
            point: balanced(radius, |x| ((x / sigma).powi(2) - 1.0) * gaussian(x)),
        }
    }
}

/// Σ a √(π/b) exp(−π²x²/b) over `(a, b)`, x in degrees, scaled such that the sum over the pixels is 1.
fn sensitivity(gaussians: &[(f64, f64)], pixels_per_degree: f64) -> Vec<Kernel> {
    // Three standard deviations of the widest Gaussian of any channel.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
    let lines: Vec<(f64, Vec<f64>)> = gaussians
        .iter()
        .map(|(a, b)| {
            // Weights below e⁻²⁵, 1e-11 of the central one, vanish in an `f32`.
            let radius = radius.min((5.0 / PI * b.sqrt() * pixels_per_degree).ceil() as i32);
            let weight = |x: i32| (-(PI * f64::from(x) / pixels_per_degree).powi(2) / b).exp();
            (a * (PI / b).sqrt(), (-radius..=radius).map(weight).collect())
        })
        .collect();
    // The sum over the square of pixels is the square of the sum along a line.
    let total: f64 = lines.iter().map(|(scale, line)| scale * line.iter().sum::<f64>().powi(2)).sum();
    let kernel = |(scale, line): (f64, Vec<f64>)| {
        // Applied vertically and horizontally, so that each pass has the square root.
        let scale = (scale / total).sqrt();
        Kernel(line.into_iter().map(|weight| (scale * weight) as f32).collect())
    };
    lines.into_iter().map(kernel).collect()
}

/// A filter whose positive weights sum to 1 and whose negative weights, if any, sum to −1.
fn balanced(radius: i32, weight: impl Fn(f64) -> f64) -> Kernel {
    let weights: Vec<f64> = (-radius..=radius).map(|x| weight(f64::from(x))).collect();
    let positive: f64 = weights.iter().map(|w| w.max(0.0)).sum();
    let negative: f64 = weights.iter().map(|w| (-w).max(0.0)).sum();
    Kernel(
        weights
            .into_iter()
            .map(|w| (if w > 0.0 { w / positive } else { w / negative.max(f64::MIN_POSITIVE) }) as f32)
            .collect(),
    )
}

/// Row `y` of a plane, filtered in both directions. The border values extend beyond the plane.
///
/// The plane's length must be a multiple of `width` > 0, and `y` must be one of its rows.
pub(super) fn filtered_row(plane: &[f32], width: usize, y: usize, down: &Kernel, across: &Kernel) -> Vec<f32> {
    let last_row = plane.len() / width - 1;
    let mut sums = vec![0.0f32; width];
    for (i, weight) in down.0.iter().enumerate() {
        let row = (y + i).saturating_sub(down.0.len() / 2).min(last_row);
        add(&mut sums, &plane[row * width..][..width], *weight);
    }

    let radius = across.0.len() / 2;
    let mut line = Vec::with_capacity(width + 2 * radius);
    line.resize(radius, sums[0]);
    line.extend_from_slice(&sums);
    line.resize(width + 2 * radius, sums[width - 1]);
    sums.fill(0.0);
    for (i, weight) in across.0.iter().enumerate() {
        add(&mut sums, &line[i..][..width], *weight);
    }
    sums
}

fn add(sums: &mut [f32], values: &[f32], weight: f32) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(kernel: &Kernel) -> f64 {
        kernel.0.iter().map(|w| f64::from(*w)).sum()
    }

    #[test]
    fn filters_preserve_constants_and_detectors_remove_them() {
        for pixels_per_degree in [2.0, 20.0, super::super::PIXELS_PER_DEGREE, 1000.0] {
            let filters = Filters::new(pixels_per_degree);
            for parts in [&filters.luminance, &filters.red_green, &filters.blue_yellow] {
                let total: f64 = parts.iter().map(|part| sum(part).powi(2)).sum();
                // Each weight is rounded to 2⁻²⁴ of itself.
                assert!((total - 1.0).abs() < 1e-6, "{pixels_per_degree}: {total}");
            }
            assert!((sum(&filters.smooth) - 1.0).abs() < 1e-6);
            assert!(sum(&filters.edge).abs() < 1e-6);
            assert!(sum(&filters.point).abs() < 1e-6);
        }
    }

    #[test]
    fn a_filtered_row_equals_the_two_dimensional_filter() {
        let (width, height) = (7, 5);
        let plane: Vec<f32> = (0..width * height).map(|i| ((i * 37) % 11) as f32).collect();
        let (down, across) = (Kernel(vec![0.5, -1.0, 0.25, 2.0, 3.0]), Kernel(vec![1.0, 0.0, -4.0]));
        for y in 0..height {
            for (x, value) in filtered_row(&plane, width, y, &down, &across).into_iter().enumerate() {
                let mut expected = 0.0;
                for (j, down) in down.0.iter().enumerate() {
                    for (i, across) in across.0.iter().enumerate() {
                        let row = (y + j).saturating_sub(2).min(height - 1);
                        let column = (x + i).saturating_sub(1).min(width - 1);
                        expected += down * across * plane[row * width + column];
                    }
                }
                // All are multiples of 1/4 below 2¹⁰: exact.
                assert_eq!(value, expected, "{x}, {y}");
            }
        }
    }
}
