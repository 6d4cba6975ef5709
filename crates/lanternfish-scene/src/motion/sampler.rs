//! Keyframes, and what is between them [glTF 2.0, appendix C].

use glam::{Quat, Vec4};

/// What is between two keyframes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the keyframe before.
    Step,
    /// A straight line; of rotations the shorter arc.
    #[default]
    Linear,
    /// A cubic Hermite spline through values with tangents of their own.
    CubicSpline,
}

/// Values at times. Before the first keyframe its value holds, after the last one that of the last.
#[derive(Clone, Debug, Default)]
pub struct Sampler {
    /// What is between keyframes.
    pub interpolation: Interpolation,
    /// Seconds, rising; one at least.
    pub times: Vec<f32>,
    /// Of each keyframe as many numbers as the property has; of a spline the tangent that comes in, the value, the tangent that goes out.
    pub values: Vec<f32>,
}

impl Sampler {
    /// Numbers of a value.
    pub fn width(&self) -> usize {
        self.values.len() / (self.times.len() * self.parts()).max(1)
    }

    /// Values that are stored for a keyframe.
    pub(super) fn parts(&self) -> usize {
        if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 }
    }

    /// One part of a keyframe: of a spline 0 is the tangent that comes in, 1 the value, 2 the tangent that goes out.
    fn part(&self, keyframe: usize, part: usize) -> &[f32] {
        let width = self.width();
        &self.values[(keyframe * self.parts() + part) * width..][..width]
    }

    /// The value at a time, seconds: as many numbers as it has. `is_rotation`: it is a quaternion; the result is of unit length.
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

/// A rotation made unit length; the identity where it has no direction.
fn as_unit(value: Vec<f32>, is_rotation: bool) -> Vec<f32> {
    if !is_rotation {
        return value;
    }
    Vec4::from_slice(&value).try_normalize().unwrap_or(Vec4::W).to_array().to_vec()
}
