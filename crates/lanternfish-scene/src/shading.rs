//! Conventions common to all renderers: attenuation, light ranges, and the material model.

use std::{fmt, str::FromStr};

use crate::{Light, LightKind, Setting, named_enum};

named_enum! {
    /// Attenuation of light with distance d. R is the light's range, I₀ = I / R² [VanGelderen2020, app. A].
    Attenuation {
        /// glTF's window: max(1 − (d/R)⁴, 0) / d².
        Gltf = "gltf": "Inverse square, faded out towards the range: glTF's formula",
        /// I / d², cut off at the stated range; unbounded where none is stated.
        Physical = "physical": "Inverse square; without end where the file states no range",
        /// I / d² − I₀.
        Reduced = "reduced": "Inverse square, less its value at the range",
        /// I / d² + 2 I₀ d / R − 3 I₀: value and slope reach zero.
        Smooth = "smooth": "As reduced, with a slope of zero at the range",
        /// I / d² − I₀ d / R.
        PhysicalReduced1 = "physical_reduced_1": "As reduced, correct close to the light",
        /// I / d² − I₀ d² / R²: the thesis' choice (eq. 5.1). The same function as `gltf`.
        PhysicalReduced2 = "physical_reduced_2":
            "As physical_reduced_1, correct farther out: the same function as gltf",
        /// I / d² + 2 I₀ d² / R² − 3 I₀ d / R.
        PhysicalSmooth1 = "physical_smooth_1": "As smooth, correct close to the light",
        /// I / d² + 2 I₀ d³ / R³ − 3 I₀ d² / R².
        PhysicalSmooth2 = "physical_smooth_2": "As physical_smooth_1, correct farther out",
        /// I (R − d) / R: for illustration.
        Linear = "linear": "Straight down to the range: for illustration",
        /// I up to R: for illustration.
        Step = "step": "Constant up to the range: for illustration",
        /// I / (c0 + c1 d + c2 d²) with [`Coefficients`] (eq. A.2), cut off at the range.
        Clq = "clq": "Intensity over c0 + c1 d + c2 d², with `attenuation-coefficients`",
    }
}

named_enum! {
    /// Material model.
    Materials {
        /// The file's materials: Cook–Torrance.
        File = "file": "The file's metallic-roughness materials",
        /// Base colour as a two-sided diffuse albedo. Emission, alpha mask and blending are kept; all else is ignored.
        Lambert = "lambert": "Base colour as a two-sided diffuse surface; emission, alpha mask and blending are kept",
    }
}

/// Default of the near radius R0, m [VanGelderen2020, §A.1]: it only avoids division by zero.
pub const NEAR_RADIUS: f32 = 1e-3;

/// The coefficients c0, c1 (1/m) and c2 (1/m²) of `clq` [VanGelderen2020, eq. A.2]: at least 0, finite, not all 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients(pub [f32; 3]);

/// 1, 0, 1: at most the intensity itself, and the inverse square far away. The thesis states no values.
impl Default for Coefficients {
    fn default() -> Self {
        Self([1.0, 0.0, 1.0])
    }
}

impl fmt::Display for Coefficients {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self([c0, c1, c2]) = self;
        write!(f, "{c0},{c1},{c2}")
    }
}

impl FromStr for Coefficients {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
        let coefficients = numbers.and_then(|numbers| <[f32; 3]>::try_from(numbers).ok()).map(Self);
        let valid = coefficients.filter(Self::is_valid);
        valid.ok_or_else(|| "expected three numbers c0,c1,c2, at least 0 and not all 0".to_owned())
    }
}

impl Setting for Coefficients {
    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = text.parse()?;
        Ok(())
    }
}

impl Coefficients {
    /// True if they are at least 0 and finite, and not all 0.
    #[doc(hidden)]
    pub fn is_valid(&self) -> bool {
        self.0.iter().all(|c| *c >= 0.0 && c.is_finite()) && self.0.iter().any(|c| *c > 0.0)
    }
}

/// Range of an unbounded light, m. Its square is a finite float.
pub const UNBOUNDED: f32 = 1e18;

/// A distance attenuation with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Falloff {
    /// The function.
    pub attenuation: Attenuation,
    /// Near radius R0 [VanGelderen2020, §A.1], m, > 0: nearer than this, a light is as bright as at this distance.
    pub near_radius: f32,
    /// Of `clq`.
    pub coefficients: Coefficients,
}

/// With the default parameters.
impl From<Attenuation> for Falloff {
    fn from(attenuation: Attenuation) -> Self {
        Self { attenuation, near_radius: NEAR_RADIUS, coefficients: Coefficients::default() }
    }
}

impl Falloff {
    /// Illuminance per intensity at distance `d` of a light of range `r`, both m: lx/cd. Zero from `r` on.
    pub fn factor(&self, d: f32, r: f32) -> f32 {
        let d = self.near_radius.max(d);
        if d >= r {
            return 0.0;
        }
        let physical = d.powi(-2);
        let (t, i0) = (d / r, (r * r).recip());
        match self.attenuation {
            Attenuation::Gltf => physical * (1.0 - t.powi(4)).clamp(0.0, 1.0),
            Attenuation::Physical => physical,
            Attenuation::Reduced => (physical - i0).max(0.0),
            Attenuation::Smooth => (physical + i0 * (2.0 * t - 3.0)).max(0.0),
            Attenuation::PhysicalReduced1 => (physical - i0 * t).max(0.0),
            Attenuation::PhysicalReduced2 => (physical - i0 * t * t).max(0.0),
            Attenuation::PhysicalSmooth1 => (physical + i0 * (2.0 * t * t - 3.0 * t)).max(0.0),
            Attenuation::PhysicalSmooth2 => (physical + i0 * (2.0 * t * t * t - 3.0 * t * t)).max(0.0),
            Attenuation::Linear => 1.0 - t,
            Attenuation::Step => 1.0,
            Attenuation::Clq => {
                let [c0, c1, c2] = self.coefficients.0;
                (c0 + c1 * d + c2 * d * d).recip()
            }
        }
    }

    /// [`Self::factor`] over the inverse square, for a light of range `r` at distance `d`, both m. The light of a disk or rectangle is the
    /// inverse square of each point times this window at the centre's distance, so that all of it ends at one distance.
    pub fn window(&self, d: f32, r: f32) -> f32 {
        self.factor(d, r) * self.near_radius.max(d).powi(2)
    }
}

impl Light {
    /// The light's range, m: the stated range, or else the distance at which the inverse square of the brightest channel falls to
    /// `threshold`, cd/m², > 0 [Elagabani2025, eq. 4.1]; for a disk or rectangle along its axis. [`UNBOUNDED`] for directional lights and
    /// under `physical` attenuation.
    #[doc(hidden)]
    pub fn effective_range(&self, attenuation: Attenuation, threshold: f32) -> f32 {
        if self.kind == LightKind::Directional {
            return UNBOUNDED;
        }
        match self.range {
            Some(range) => range,
            None if attenuation == Attenuation::Physical => UNBOUNDED,
            None => (self.greatest_intensity().max_element() / threshold).sqrt().max(1e-3),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn names_are_read_back_and_others_are_refused_with_the_list() {
        for attenuation in Attenuation::ALL {
            assert_eq!(attenuation.to_string().parse::<Attenuation>(), Ok(*attenuation));
        }
        assert!("16px".parse::<Materials>().unwrap_err().contains("file, lambert"));
        let coefficients = Coefficients([0.5, 0.0, 2.25]);
        assert_eq!(coefficients.to_string().parse(), Ok(coefficients));
        for mistaken in ["1,2", "1,2,3,4", "1,,2", "0,0,0", "-1,1,1", "inf,0,0", "NaN,0,1", ""] {
            assert!(mistaken.parse::<Coefficients>().unwrap_err().starts_with("expected"), "{mistaken}");
        }
    }

    /// [VanGelderen2020, §A.1]: "we define a near-radius R0 which we use as the minimum d".
    #[test]
    fn the_near_radius_is_the_least_distance() {
        for attenuation in Attenuation::ALL.iter().copied() {
            let falloff = Falloff { near_radius: 0.75, ..attenuation.into() };
            assert_eq!(falloff.factor(0.1, 2.0), falloff.factor(0.75, 2.0), "{attenuation}");
            assert_eq!(falloff.factor(1.5, 2.0), Falloff::from(attenuation).factor(1.5, 2.0), "{attenuation}");
            assert_eq!(falloff.factor(0.1, 0.75), 0.0, "{attenuation}: the light ends at R0");
        }
        // "If we take R0 = 1 then the maximum intensity should be I."
        assert_eq!(Falloff { near_radius: 1.0, ..Attenuation::Physical.into() }.factor(0.0, 2.0), 1.0);
    }

    #[test]
    fn ranges_follow_the_paper() {
        // [Elagabani2025, eq. 4.1]: I / D² = 0.02.
        let light = Light::point(Vec3::ZERO, Vec3::new(8.0, 2.0, 1.0));
        assert!((light.effective_range(Attenuation::Gltf, 0.02) - 20.0).abs() < 1e-5);
        assert_eq!(light.effective_range(Attenuation::Physical, 0.02), UNBOUNDED);
        let stated = Light { range: Some(3.0), ..light };
        assert_eq!(stated.effective_range(Attenuation::Gltf, 0.02), 3.0);
        // Two square metres of 4 nits are 8 cd on the axis.
        let lamp = Light::rectangle(Vec3::ZERO, Vec3::NEG_Y, Vec3::X, [1.0, 2.0], Vec3::splat(4.0));
        assert!((lamp.effective_range(Attenuation::Gltf, 0.02) - 20.0).abs() < 1e-5);
        let sun = Light::directional(Vec3::NEG_Y, Vec3::ONE);
        assert_eq!(sun.effective_range(Attenuation::Gltf, 0.02), UNBOUNDED);
    }
}
