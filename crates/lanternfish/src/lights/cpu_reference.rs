//! The attenuation functions of [VanGelderen2020, app. A]: the CPU reference of `attenuation.wesl`.

use lanternfish_scene::shading::{Attenuation, Falloff};

/// Illuminance at distance `d` (m) of a light of `intensity` with the cut-off `i0` (both cd), not clamped at zero.
pub(crate) fn attenuation(falloff: impl Into<Falloff>, intensity: f64, i0: f64, d: f64) -> f64 {
    let Falloff { attenuation: function, near_radius, coefficients } = falloff.into();
    // "R0, which we use as the minimum d" (§A.1).
    let d = d.max(near_radius.into());
    // R1 solves a_phy(R1) = I0 (§A.1).
    let r1 = (intensity / i0).sqrt();
    let physical = intensity / (d * d);
    let reduced = physical - i0;
    let smooth = physical + 2.0 * i0 / r1 * d - 3.0 * i0;
    let (t1, t2) = (d / r1, d * d / (r1 * r1));
    let mix = |t: f64, a: f64, b: f64| (1.0 - t) * a + t * b;
    match function {
        // KHR_lights_punctual, "Range property"; not the thesis'.
        Attenuation::Gltf => physical * (1.0 - t2 * t2).clamp(0.0, 1.0),
        Attenuation::Physical => physical,
        Attenuation::Reduced => reduced,
        Attenuation::Smooth => smooth,
        Attenuation::PhysicalReduced1 => mix(t1, physical, reduced),
        Attenuation::PhysicalReduced2 => mix(t2, physical, reduced),
        Attenuation::PhysicalSmooth1 => mix(t1, physical, smooth),
        Attenuation::PhysicalSmooth2 => mix(t2, physical, smooth),
        Attenuation::Linear => intensity * (r1 - d) / r1,
        Attenuation::Step => intensity * f64::from(d < r1),
        Attenuation::Clq => {
            let [c0, c1, c2] = coefficients.0.map(f64::from);
            intensity / (c0 + c1 * d + c2 * d * d)
        }
    }
}
