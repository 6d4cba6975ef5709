//! Tone mapping from radiance to display values, as in HDR-ꟻLIP.

use crate::image::luminance;

/// The curve from exposed radiance to display values in HDR-ꟻLIP [Andersson2021, tone mapping].
///
/// Each is (k₀x² + k₁x + k₂) / (k₃x² + k₄x + k₅). The result is linear and is clamped to 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FlipToneMapper {
    /// Narkowicz's fit of the ACES curve, of 0.6 x: the authors' default. Per channel.
    #[default]
    Aces,
    /// Hable's film curve with its white point divided out. Per channel.
    Hable,
    /// x / (1 + x) of the luminance; the colour is scaled with it. Hues are preserved, bright colours are clamped.
    Reinhard,
}

impl FlipToneMapper {
    /// All tone mappers, the default first.
    pub const ALL: [Self; 3] = [Self::Aces, Self::Hable, Self::Reinhard];

    /// The name in the authors' tool.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aces => "aces",
            Self::Hable => "hable",
            Self::Reinhard => "reinhard",
        }
    }

    /// k₀ to k₅.
    const fn coefficients(self) -> [f32; 6] {
        match self {
            // 2.51, 0.03, 0, 2.43, 0.59, 0.14 of 0.6 x.
            Self::Aces => [0.36 * 2.51, 0.6 * 0.03, 0.0, 0.36 * 2.43, 0.6 * 0.59, 0.14],
            Self::Hable => [0.231_683, 0.013_791, 0.0, 0.18, 0.3, 0.018],
            Self::Reinhard => [0.0, 1.0, 0.0, 0.0, 1.0, 1.0],
        }
    }

    fn curve(self, x: f32) -> f32 {
        let [k0, k1, k2, k3, k4, k5] = self.coefficients();
        ((k0 * x + k1) * x + k2) / ((k3 * x + k4) * x + k5)
    }

    /// Linear display value, 0..=1, of a finite radiance ≥ 0.
    pub(super) fn display(self, radiance: [f32; 3]) -> [f32; 3] {
        // The square of a larger value overflows, and the curves are flat long before.
        const FLAT: f32 = 1e15;
        let mapped = match self {
            Self::Aces | Self::Hable => radiance.map(|v| self.curve(v.min(FLAT))),
            Self::Reinhard => {
                let scale = 1.0 / (1.0 + luminance(radiance).min(f32::MAX));
                radiance.map(|v| v * scale)
            }
        };
        mapped.map(|v| v.clamp(0.0, 1.0))
    }

    /// The luminance that the curve maps to `shown`, which must be below the curve's limit: the greater root.
    pub(super) fn inverse(self, shown: f32) -> f32 {
        let [k0, k1, k2, k3, k4, k5] = self.coefficients();
        let (a, b, c) = (k0 - shown * k3, k1 - shown * k4, k2 - shown * k5);
        if a == 0.0 {
            return -c / b;
        }
        let middle = -0.5 * b / a;
        middle + (middle * middle - c / a).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curves_start_black_rise_and_are_inverted() {
        for mapper in FlipToneMapper::ALL {
            assert_eq!(mapper.display([0.0; 3]), [0.0; 3]);
            let shown: Vec<f32> = (-20..140).map(|i| mapper.display([2f32.powi(i); 3])[1]).collect();
            assert!(shown.windows(2).all(|w| w[0] <= w[1]), "{mapper:?}: {shown:?}");
            assert!(shown[0] > 0.0 && *shown.last().unwrap() > 0.99, "{mapper:?}: {shown:?}");
            for value in [0.2, 0.5, 0.85] {
                let [_, back, _] = mapper.display([mapper.inverse(value); 3]);
                // The rounding error of a few operations on numbers up to 1.
                assert!((back - value).abs() < 1e-5, "{mapper:?}: {value} became {back}");
            }
        }
    }

    #[test]
    fn reinhard_keeps_the_hue() {
        let [red, green, blue] = FlipToneMapper::Reinhard.display([0.4, 0.2, 0.1]);
        assert!((red - 2.0 * green).abs() < 1e-6 && (green - 2.0 * blue).abs() < 1e-6);
        let [red, green, _] = FlipToneMapper::Aces.display([0.4, 0.2, 0.1]);
        assert!((red - 2.0 * green).abs() > 0.01, "the others do not");
    }
}
