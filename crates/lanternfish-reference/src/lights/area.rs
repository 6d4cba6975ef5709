//! Disk and rectangle lights. CPU reference of `lights/area.wesl`.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3, Vec3A};
use lanternfish_scene::{
    Light, LightKind,
    shading::{Falloff, NEAR_RADIUS},
};

use super::Incidence;

/// A point of an area light, uniform over its area for uniform numbers in 0..1; world space, m. The position of other lights.
pub fn point_of_area(light: &Light, [u, v]: [f64; 2]) -> DVec3 {
    let direction = light.direction.as_dvec3();
    let aside = match light.kind {
        LightKind::Disk { radius } => {
            let (right, up) = direction.any_orthonormal_pair();
            let (sin, cos) = (TAU * v).sin_cos();
            f64::from(radius) * u.sqrt() * (cos * right + sin * up)
        }
        LightKind::Rectangle { half_width, half_height, right } => {
            let right = right.as_dvec3();
            let up = right.cross(direction);
            f64::from(half_width) * (2.0 * u - 1.0) * right + f64::from(half_height) * (2.0 * v - 1.0) * up
        }
        LightKind::Point | LightKind::Spot { .. } | LightKind::Directional => DVec3::ZERO,
    };
    light.position.as_dvec3() + aside
}

/// Unshadowed light at the point `p` from an area light, as if the entire light were at `place`, one of its points; both world space, m.
/// The mean over the light's points is the light at `p`.
///
/// The irradiance is radiance times area times the cosine at the light, divided by the squared distance, times the attenuation's window at
/// the light's centre. So the entire light ends at its range from the centre.
pub fn incidence_from(
    light: &Light,
    place: DVec3,
    p: Vec3A,
    falloff: impl Into<Falloff>,
    range_threshold: f32,
) -> Incidence {
    let falloff = falloff.into();
    let p = p.as_dvec3();
    let (to_centre, to_place) = (light.position.as_dvec3() - p, place - p);
    let distance = to_place.length();
    let wi = to_place / distance.max(1e-20);
    // In front of the light's plane, m.
    let height = -to_centre.dot(light.direction.as_dvec3());
    let range = light.effective_range(falloff.attenuation, range_threshold);
    let window = falloff.window(to_centre.length() as f32, range);
    let nearest = distance.max(falloff.near_radius.into());
    let cosine = (height / distance.max(f64::from(NEAR_RADIUS))).max(0.0);
    let factor = cosine / (nearest * nearest);
    let irradiance: Vec3 = factor as f32 * window * light.greatest_intensity();
    Incidence { wi, distance: distance as f32, irradiance }
}
