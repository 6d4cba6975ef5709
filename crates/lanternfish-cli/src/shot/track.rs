//! Camera tracks: keyframes and interpolation.

use std::ops::{Add, Mul, Sub};

use glam::Vec3;
use lanternfish_scene::named_enum;

use crate::parse;

/// The camera at one time. All keyframes of a track set the same of the three values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Time, seconds.
    pub time: f32,
    /// Position, world space, m.
    pub eye: Option<Vec3>,
    /// Target, world space, m.
    pub target: Option<Vec3>,
    /// Full vertical field of view, radians.
    pub fov_y: Option<f32>,
}

named_enum! {
    /// Interpolation between keyframes.
    #[derive(Default)]
    Interpolation {
        /// Straight lines: corners at the keyframes.
        #[default]
        Linear = "linear",
        /// A smooth curve through the keyframes.
        CatmullRom = "catmull-rom",
    }
}

/// At least one keyframe, in order of time, at different times.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    pub interpolation: Interpolation,
    pub keyframes: Vec<Moment>,
}

impl Track {
    /// Time of the first keyframe, seconds.
    pub fn first(&self) -> f32 {
        self.keyframes[0].time
    }

    /// Time of the last keyframe, seconds.
    pub fn last(&self) -> f32 {
        self.keyframes[self.keyframes.len() - 1].time
    }

    /// The camera at a time, seconds. Before the start and after the end it is static.
    pub fn at(&self, time: f32) -> Moment {
        let (frames, last) = (&self.keyframes, self.keyframes.len() - 1);
        let next = frames.partition_point(|frame| frame.time <= time);
        if next == 0 || next > last {
            return Moment { time, ..frames[next.min(last)] };
        }
        // Return a keyframe's own values exactly, without interpolation error.
        if frames[next - 1].time == time {
            return frames[next - 1];
        }
        let around = [next.saturating_sub(2), next - 1, next, (next + 1).min(last)].map(|i| &frames[i]);
        let times = around.map(|frame| frame.time);
        Moment {
            time,
            eye: between(self.interpolation, time, times, around.map(|frame| frame.eye)),
            target: between(self.interpolation, time, times, around.map(|frame| frame.target)),
            // A curve may overshoot the keyframes' range.
            fov_y: between(self.interpolation, time, times, around.map(|frame| frame.fov_y))
                .map(|angle| angle.clamp(parse::FOV_Y.start().to_radians(), parse::FOV_Y.end().to_radians())),
        }
    }
}

/// Interpolates at `time` between the second and the third of four values. At the ends of a track, two of the four are the
/// same.
///
/// Catmull–Rom is the cubic Hermite curve whose slope at a value is that of the line from the previous to the next value, so
/// keyframes need not be equally spaced.
fn between<T>(interpolation: Interpolation, time: f32, times: [f32; 4], values: [Option<T>; 4]) -> Option<T>
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>,
{
    let [Some(before), Some(from), Some(to), Some(after)] = values else { return None };
    let span = times[2] - times[1];
    let u = (time - times[1]) / span;
    Some(match interpolation {
        Interpolation::Linear => from * (1.0 - u) + to * u,
        Interpolation::CatmullRom => {
            let slope_from = (to - before) * (span / (times[2] - times[0]));
            let slope_to = (after - from) * (span / (times[3] - times[1]));
            let (u2, u3) = (u * u, u * u * u);
            from * (2.0 * u3 - 3.0 * u2 + 1.0)
                + slope_from * (u3 - 2.0 * u2 + u)
                + to * (3.0 * u2 - 2.0 * u3)
                + slope_to * (u3 - u2)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(interpolation: Interpolation, keyframes: &[(f32, f32)]) -> Track {
        let frame = |&(time, x)| Moment { time, eye: Some(x * Vec3::X), fov_y: Some(0.1 * x), ..Moment::default() };
        Track { interpolation, keyframes: keyframes.iter().map(frame).collect() }
    }

    fn x(track: &Track, time: f32) -> f32 {
        track.at(time).eye.unwrap().x
    }

    #[test]
    fn keyframes_are_exact_and_the_ends_are_static() {
        let frames = [(-1.0, 0.7), (0.3, 5.0), (1.0, 2.3), (4.0, 3.1)];
        for &interpolation in Interpolation::ALL {
            let track = track(interpolation, &frames);
            for (time, value) in frames {
                assert_eq!(x(&track, time), value, "{interpolation:?} at {time}");
                // Without a jump.
                assert!((x(&track, time + 1e-4) - value).abs() < 1e-2 && (x(&track, time - 1e-4) - value).abs() < 1e-2);
            }
            assert_eq!((x(&track, -9.0), x(&track, 9.0)), (0.7, 3.1));
            assert_eq!(track.at(0.0).target, None, "no keyframe sets it");
        }
    }

    #[test]
    fn lines_are_straight_and_curves_follow_parabolas() {
        let line: Vec<_> = [0.0, 1.0, 3.0, 4.0].map(|t| (t, 2.0 * t + 1.0)).into();
        for &interpolation in Interpolation::ALL {
            let track = track(interpolation, &line);
            for time in [0.25, 1.5, 2.75, 3.9] {
                assert!((x(&track, time) - (2.0 * time + 1.0)).abs() < 1e-5, "{interpolation:?} at {time}");
            }
        }
        // With equal spacing, central differences are a parabola's exact slopes.
        let parabola: Vec<_> = [0.0, 1.0, 2.0, 3.0].map(|t: f32| (t, t * t)).into();
        assert!((x(&track(Interpolation::CatmullRom, &parabola), 1.5) - 2.25).abs() < 1e-6);
        assert_eq!(x(&track(Interpolation::Linear, &parabola), 1.5), 2.5);
    }
}
