//! The normal distribution, and a normal approximation of the χ² distribution.

/// Two-sided tail probability of a standard normal variable beyond `deviate`: erfc(|x|/√2).
pub(crate) fn two_sided(deviate: f64) -> f64 {
    if deviate.is_nan() {
        return f64::NAN;
    }
    erfc(deviate.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// The standard normal deviate that a χ² variable of `freedom` > 0 degrees corresponds to [WilsonHilferty1931, cube root].
///
/// The error is less than 0.05 up to 3 standard deviations for 3 or more degrees of freedom, and much less for many.
pub(crate) fn chi_square_deviate(chi_square: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    ((chi_square / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// The complementary error function of x ≥ 0.
fn erfc(x: f64) -> f64 {
    let gauss = std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp();
    if x < 2.5 {
        // erf x = 2/√π e^(−x²) Σ 2ⁿ x^(2n+1) / (2n+1)!!, all terms positive.
        let (mut term, mut sum) = (x, x);
        for n in 1..60 {
            term *= 2.0 * x * x / f64::from(2 * n + 1);
            sum += term;
        }
        return 1.0 - gauss * sum;
    }
    // The continued fraction 1/√π e^(−x²) / (x + ½/(x + 1/(x + 3/2/(x + …)))), evaluated from the innermost term.
    let fraction = (1..=100).rev().fold(x, |rest, n| x + 0.5 * f64::from(n) / rest);
    0.5 * gauss / fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected values are from tables of the normal distribution.
    #[test]
    fn tails_are_those_of_the_tables() {
        for (deviate, fraction) in [
            (0.0, 1.0),
            (1.0, 0.317_310_507_863),
            (1.959_963_984_54, 0.05),
            (3.0, 2.699_796_063_26e-3),
            // On either side of the switch of method at 2.5 √2.
            (3.53, 4.155_6e-4),
            (3.54, 4.001_3e-4),
            (6.0, 1.973_175_290_08e-9),
            (10.0, 1.523_970_604_83e-23),
        ] {
            for deviate in [deviate, -deviate] {
                let tail = two_sided(deviate);
                assert!((tail / fraction - 1.0).abs() < 1e-4, "{deviate}: {tail:e}, not {fraction:e}");
            }
        }
        assert_eq!(two_sided(f64::INFINITY), 0.0);
        assert!(two_sided(f64::NAN).is_nan());
    }

    /// Quantiles of χ² from tables: 5 %, 50 %, 95 %, 99.9 %.
    #[test]
    fn deviates_of_chi_square_are_those_of_the_tables() {
        for (freedom, quantiles) in [
            (3.0, [0.3518, 2.3660, 7.8147, 16.266]),
            (10.0, [3.9403, 9.3418, 18.307, 29.588]),
            (100.0, [77.929, 99.334, 124.342, 149.449]),
        ] {
            for (chi_square, deviate) in quantiles.into_iter().zip([-1.644_85, 0.0, 1.644_85, 3.090_23]) {
                let got = chi_square_deviate(chi_square, freedom);
                assert!((got - deviate).abs() < 0.05, "χ² {chi_square} of {freedom}: {got}, not {deviate}");
            }
        }
    }
}
