//! Bounds of an emitter, or of several together.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{Bounds, Light, LightKind, shading::UNBOUNDED};

/// Maximum of [`Emitter::power`]: brighter emitters have the importance of this one.
const MOST_POWER: f32 = 1e20;

/// One emitter, or several together. World space, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// Bounding box of the emitters.
    pub bounds: Bounds,
    /// Maximum intensity over all directions, brightest channel, cd: a light's intensity, or a triangle's radiance times its area; > 0,
    /// and at most 1e20, so that values derived from it are finite.
    pub power: f32,
    /// Distance from the box beyond which no light arrives, m.
    pub range: f32,
    /// Directions of emission.
    pub cone: Cone,
}

/// Orientation bounds: normals are within an angle of the axis, and light leaves within another angle of its normal [Conty2018, §4.1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Axis of the cone, world space, unit length.
    pub axis: Vec3,
    /// Cosine of the largest angle between the axis and a normal; −1: normals in all directions.
    pub cos_spread: f32,
    /// Cosine of the largest angle between a normal and its emitted light; at least 0.
    pub cos_reach: f32,
}

impl Cone {
    /// The cone of all directions.
    pub const ALL: Self = Self { axis: Vec3::Y, cos_spread: -1.0, cos_reach: 0.0 };

    /// The smallest cone around both [Conty2018, alg. 1].
    fn joined(&self, other: &Self) -> Self {
        let (wide, narrow) = if self.cos_spread <= other.cos_spread { (self, other) } else { (other, self) };
        let cos_reach = wide.cos_reach.min(narrow.cos_reach);
        let between = wide.axis.dot(narrow.axis).clamp(-1.0, 1.0).acos();
        let (wide_spread, narrow_spread) = (wide.cos_spread.acos(), narrow.cos_spread.acos());
        if between + narrow_spread <= wide_spread {
            return Self { cos_reach, ..*wide };
        }
        let spread = 0.5 * (wide_spread + between + narrow_spread);
        // Nearly opposite axes do not define a direction between them.
        if spread >= PI || between > 0.99 * PI {
            return Self { cos_reach, ..Self::ALL };
        }
        let angle = spread - wide_spread;
        let axis = (between - angle).sin() * wide.axis + angle.sin() * narrow.axis;
        Self { axis: axis.try_normalize().unwrap_or(wide.axis), cos_spread: spread.cos(), cos_reach }
    }
}

impl Emitter {
    /// A light with a position and a `range`, m. `radius`, m, is that of point and spot lights: a surface may see a part of the sphere but
    /// not its centre.
    pub fn of_light(light: &Light, range: f32, radius: f32) -> Self {
        let cone = match light.kind {
            LightKind::Spot { outer_angle, .. } => {
                Cone { axis: light.direction, cos_spread: 1.0, cos_reach: outer_angle.cos() }
            }
            LightKind::Disk { .. } | LightKind::Rectangle { .. } => {
                Cone { axis: light.direction, cos_spread: 1.0, cos_reach: 0.0 }
            }
            LightKind::Point | LightKind::Directional => Cone::ALL,
        };
        let half = if light.area().is_some() { light.half_extent() } else { Vec3::splat(radius) };
        let bounds = Bounds { min: light.position - half, max: light.position + half };
        let power = light.greatest_intensity().max_element().min(MOST_POWER);
        Self { bounds, power, range: range.min(UNBOUNDED), cone }
    }

    /// A triangle of mean `radiance` (nits, brightest channel) that emits on the side of the normal `front`; `None`: on both sides.
    pub fn of_triangle(corners: [Vec3; 3], radiance: f32, front: Option<Vec3>) -> Self {
        // Areas and intensities may overflow 32 bits.
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let mut bounds = Bounds::EMPTY;
        corners.into_iter().for_each(|corner| bounds.add_point(corner));
        let doubled = (b - a).cross(c - a);
        let towards = front.and_then(|front| (doubled * doubled.dot(front.into()).signum()).try_normalize());
        let cone = towards.map_or(Cone::ALL, |axis| Cone { axis: axis.as_vec3(), cos_spread: 1.0, cos_reach: 0.0 });
        let power = (f64::from(radiance) * 0.5 * doubled.length()).min(MOST_POWER.into()) as f32;
        Self { bounds, power, range: UNBOUNDED, cone }
    }

    pub(super) fn joined(&self, other: &Self) -> Self {
        let mut bounds = self.bounds;
        bounds.add_bounds(&other.bounds);
        let cone = self.cone.joined(&other.cone);
        Self { bounds, power: (self.power + other.power).min(MOST_POWER), range: self.range.max(other.range), cone }
    }
}
