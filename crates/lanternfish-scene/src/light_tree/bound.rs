//! The bound of a node's emitters, and its importance for a surface.

use glam::Vec3;

use super::{Cone, Emitter};

/// Tolerance of the cosines that cull a node: rounding must not lose light at grazing angles.
const COSINE_ERROR: f32 = 1e-3;
/// Minimum of the receiver's and the emitter's cosine factor: emitters at grazing angles are rarely selected, but never excluded.
const LEAST_COSINE: f32 = 0.02;
/// Minimum of the window factor near the range: attenuations that end in a step are still bright there.
const LEAST_WINDOW: f32 = 0.01;
/// Minimum distance, m.
const LEAST_DISTANCE: f32 = 1e-6;
/// Largest integer of an 8-bit snorm.
const SNORM: f32 = 127.0;
/// Maximum length of the axis's error from rounding its three components to snorms, half a step each: √3 / 2 < 0.87 steps.
const AXIS_ERROR: f32 = 0.87 / SNORM;

/// A bound of emitters at the precision of the GPU's copy. All numbers are rounded conservatively, towards more light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Centre of the emitters' box, world space, m.
    pub center: Vec3,
    /// Half the box's size along each axis, m; floats of 16 bits (bfloat16), rounded up.
    pub half: Vec3,
    /// Sum of the emitters' [`Emitter::power`], cd; a float of 16 bits (bfloat16), rounded up. 0: no emitters.
    pub power: f32,
    /// Reciprocal of the distance from the box beyond which no light arrives, 1/m; a float of 16 bits (bfloat16), rounded down.
    pub inverse_range: f32,
    /// Axis of the cone of the emitters' normals, world space, nearly unit length: three 8-bit snorms. Zero: normals in all directions.
    pub axis: Vec3,
    /// Cosine of the largest angle between a normal and its emitted light; an 8-bit snorm, rounded down.
    pub cos_reach: f32,
    /// Sine of the largest angle between axis and normals, plus the axis's rounding error; 1 if the angle is 90° or more. A float of
    /// 16 bits (bfloat16), rounded up.
    pub sin_spread: f32,
}

/// A point on a surface that receives light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Position, world space, m.
    pub p: Vec3,
    /// Normal, world space, unit length.
    pub normal: Vec3,
    /// True if light from behind counts too.
    pub is_transmitting: bool,
}

impl Bound {
    /// The bound of nodes without emitters, which pad the tree's last levels.
    pub(super) const NONE: Self = Self {
        center: Vec3::ZERO,
        half: Vec3::ZERO,
        power: 0.0,
        inverse_range: 1.0,
        axis: Vec3::ZERO,
        cos_reach: 0.0,
        sin_spread: 1.0,
    };

    pub(super) fn new(emitter: &Emitter) -> Self {
        let Emitter { bounds, power, range, cone: Cone { axis, cos_spread, cos_reach } } = *emitter;
        let down = |v: f32| f32::from_bits(v.to_bits() & 0xffff_0000);
        let up = |v: f32| f32::from_bits(v.to_bits().saturating_add(0xffff) & 0xffff_0000);
        let is_cone = cos_spread > 0.0;
        let sin_spread = (1.0 - cos_spread * cos_spread).max(0.0).sqrt() + AXIS_ERROR;
        Self {
            center: bounds.center(),
            half: (0.5 * bounds.size()).map(up),
            power: up(power),
            inverse_range: down(1.0 / range),
            axis: if is_cone { (axis * SNORM).round() / SNORM } else { Vec3::ZERO },
            cos_reach: if is_cone { (cos_reach * SNORM).floor() / SNORM } else { 0.0 },
            sin_spread: if is_cone { up(sin_spread.min(1.0)) } else { 1.0 },
        }
    }

    /// Importance for a receiver: the light that may arrive, up to a factor [Conty2018, eq. 3]. Zero only if no light arrives.
    ///
    /// A direction, a normal or the axis that is uncertain by an angle adds the sine of that angle to the cosine. For acute angles
    /// the sum is at least the cosine of their difference, and it is negative only if that difference is obtuse.
    pub fn importance(&self, receiver: &Receiver) -> f32 {
        let towards = self.center - receiver.p;
        // The sphere around the box bounds the directions from p.
        let (squared, radius_squared) = (towards.length_squared(), self.half.length_squared());
        let inverse = 1.0 / squared.max(radius_squared).max(LEAST_DISTANCE * LEAST_DISTANCE).sqrt();
        let sine = radius_squared.sqrt() * inverse;
        let away = (towards.abs() - self.half).max(Vec3::ZERO);
        let along_squared = away.length_squared() * self.inverse_range * self.inverse_range;
        let facing = receiver.normal.dot(towards) * inverse + sine;
        let forwards = -self.axis.dot(towards) * inverse;
        let leaving = forwards + sine + self.sin_spread;
        let reaching = forwards.max(0.0) + sine + self.sin_spread;
        if along_squared >= 1.0
            || (facing < -COSINE_ERROR && !receiver.is_transmitting)
            || leaving < -COSINE_ERROR
            || reaching < self.cos_reach - COSINE_ERROR
        {
            return 0.0;
        }
        let window = (1.0 - along_squared * along_squared).max(LEAST_WINDOW);
        let cosines = facing.clamp(LEAST_COSINE, 1.0) * leaving.clamp(LEAST_COSINE, 1.0);
        self.power * window * cosines * inverse * inverse
    }
}
