//! Keyframes and their interpolation [glTF 2.0, appendix C].

use glam::{Quat, Vec4};

/// Interpolation between two keyframes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the preceding keyframe.
    Step,
    /// Linear; for rotations, along the shorter arc.
    #[default]
    Linear,
    /// A cubic Hermite spline with explicit tangents.
    CubicSpline,
}

/// Values at times. Before the first keyframe the value is the first, after the last keyframe the last.
#[derive(Clone, Debug, Default)]
pub struct Sampler {
    /// Interpolation between keyframes.
    pub interpolation: Interpolation,
    /// Times of the keyframes, s, ascending; at least one.
    pub times: Vec<f32>,
    /// For each keyframe the components of its value; for splines the in-tangent, the value and the out-tangent.
    pub values: Vec<f32>,
}

impl Sampler {
    /// Number of components of a value.
    #[doc(hidden)]
    pub fn width(&self) -> usize {
        self.values.len() / (self.times.len() * self.parts()).max(1)
    }

    /// Number of values stored per keyframe.
    pub(super) fn parts(&self) -> usize {
        if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 }
    }

    /// One part of a keyframe; for splines 0 is the in-tangent, 1 the value, 2 the out-tangent.
    fn part(&self, keyframe: usize, part: usize) -> &[f32] {
        let width = self.width();
        &self.values[(keyframe * self.parts() + part) * width..][..width]
    }

    /// The interpolated value at `time`, s. `is_rotation`: the value is a quaternion; the result then has unit length.
    #[doc(hidden)]
    pub fn at(&self, time: f32, is_rotation: bool) -> Vec<f32> {
        let is_spline = self.interpolation == Interpolation::CubicSpline;
        let value = |keyframe| self.part(keyframe, usize::from(is_spline));
        let last = self.times.len() - 1;
        let next = self.times.partition_point(|keyframe| *keyframe <= time);
        if next == 0 || next > last || self.interpolation == Interpolation::Step {
            return as_unit(value(next.saturating_sub(1)).to_vec(), is_rotation);
        }
        let from = next - 1;
        let span = self.times[next] - self.times[from];
        let t = (time - self.times[from]) / span;
        let (a, b) = (value(from), value(next));
        if !is_spline {
            if is_rotation {
                let [a, b] = [a, b].map(|q| Quat::from_slice(&as_unit(q.to_vec(), true)));
                return a.slerp(b, t).normalize().to_array().to_vec();
            }
            return a.iter().zip(b).map(|(a, b)| a * (1.0 - t) + b * t).collect();
        }
        let (t2, t3) = (t * t, t * t * t);
        let (leaving, arriving) = (self.part(from, 2), self.part(next, 0));
        let spline = |i: usize| {
            (2.0 * t3 - 3.0 * t2 + 1.0) * a[i]
                + span * (t3 - 2.0 * t2 + t) * leaving[i]
                + (3.0 * t2 - 2.0 * t3) * b[i]
                + span * (t3 - t2) * arriving[i]
        };
        as_unit((0..self.width()).map(spline).collect(), is_rotation)
    }
}

/// Normalises a rotation; the identity if it has no direction. Other values are unchanged.
fn as_unit(value: Vec<f32>, is_rotation: bool) -> Vec<f32> {
    if !is_rotation {
        return value;
    }
    Vec4::from_slice(&value).try_normalize().unwrap_or(Vec4::W).to_array().to_vec()
}
