//! Light rain: any number of small moving lights, to measure how techniques scale with the number of lights.

use glam::Vec3;

use super::hash::{hash, unit};
use crate::{Bounds, Light, Scene};

/// Mean number of lights that reach a point if [`light_rain`] chooses the radius.
const LIGHTS_PER_POINT: f32 = 12.0;

/// Falling speeds, m/s.
const SPEEDS: std::ops::Range<f32> = 1.0..3.0;

/// Luminous intensity over squared radius, cd/m²: a light alone gives a surface that faces it from half its radius
/// 4 × 0.15 × (1 − 1/2⁴)² ≈ 0.5 lx. [`light_rain`] explains why it is not the threshold 0.02.
const INTENSITY_PER_RADIUS2: f32 = 0.15;

/// `count` coloured point lights that fall through `bounds` like rain, as they are at `time` seconds: each starts at
/// a random position, falls at 1 to 3 m/s, and restarts at a new random position of the top when it reaches the bottom
/// [VanGelderen2020, §6.1].
///
/// A pure function: a light depends only on `seed`, its index and `time`. With a given `radius`, more lights do not change
/// the first ones, and times can be evaluated in any order.
///
/// `radius` is each light's range, m. A larger radius has more light–surface pairs. `None` keeps their number
/// constant: 12 lights are expected at an inner point at any count, `count · 4/3 π radius³ = 12 · volume`, but no
/// radius is larger than half the box's diagonal (few lights) or less than 1 cm (very many).
///
/// All lights have the same luminance, at random saturated hues. The greatest component of their intensity is not
/// scaled to a visibility threshold at the radius (0.02 · radius², as the paper's lights without a window would need):
/// the range is explicit, and glTF's window function is zero there. The luminous intensity is
/// 0.15 · radius² cd, which at 12 lights per point gives unoccluded surfaces about 1 lx on average, independent of
/// the count: the mean over orientations is `1/4 · n ∫ I w(d) / d² · 4π d² dd` = 12 · 3/4 · 0.71 · I / radius².
///
/// An empty box gives no lights.
pub fn light_rain(bounds: &Bounds, count: u32, radius: Option<f32>, seed: u32, time: f32) -> Vec<Light> {
    if bounds.is_empty() {
        return Vec::new();
    }
    let size = bounds.size();
    let radius = radius.unwrap_or_else(|| {
        let volume = size.x * size.y * size.z;
        let cubed = LIGHTS_PER_POINT * volume / (count.max(1) as f32 * 4.0 / 3.0 * std::f32::consts::PI);
        cubed.cbrt().min(0.5 * size.length()).max(0.01)
    });
    let height = size.y.max(1e-3);
    let drop = |index: u32| {
        let speed = SPEEDS.start + (SPEEDS.end - SPEEDS.start) * unit(&[seed, index, 0]);
        // Distance fallen since a start above the box; each whole height is one life. f64, for smooth motion after hours.
        let fallen = f64::from(unit(&[seed, index, 1])) + f64::from(time) * f64::from(speed / height);
        let (life, fraction) = (fallen.floor(), (fallen - fallen.floor()) as f32);
        let life = hash(&[life as i64 as u32]);
        let fractions = Vec3::new(unit(&[seed, index, life, 2]), 1.0 - fraction, unit(&[seed, index, life, 3]));
        let position = (bounds.min + fractions * size).clamp(bounds.min, bounds.max);
        let color = saturated(unit(&[seed, index, life, 4]));
        Light { range: Some(radius), ..Light::point(position, INTENSITY_PER_RADIUS2 * radius * radius * color) }
    };
    (0..count).map(drop).collect()
}

/// Light rain among a scene's lights.
#[derive(Clone, Debug, PartialEq)]
pub struct Rain {
    /// Index of the rain's first light in the scene's list.
    first: usize,
    /// The scene's bounds when the rain was added, so that moving objects do not change it.
    bounds: Bounds,
    count: u32,
    radius: Option<f32>,
    seed: u32,
}

impl Rain {
    /// Appends [`light_rain`] at 0 s to the scene's lights.
    pub fn add(scene: &mut Scene, count: u32, radius: Option<f32>, seed: u32) -> Self {
        let rain = Self { first: scene.lights.len(), bounds: scene.bounds(), count, radius, seed };
        scene.lights.extend(light_rain(&rain.bounds, count, radius, seed, 0.0));
        rain
    }

    /// Moves the rain's lights to their positions at any `time`, s. `lights` are the scene's, in the order they had when the rain was
    /// added.
    ///
    /// # Panics
    ///
    /// Panics if `lights` is too short.
    pub fn fall(&self, lights: &mut [Light], time: f32) {
        let drops = light_rain(&self.bounds, self.count, self.radius, self.seed, time);
        lights[self.first..][..drops.len()].clone_from_slice(&drops);
    }

    /// The indices of the rain's lights in the scene's list.
    #[doc(hidden)]
    pub fn indices(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count as usize
    }

    /// Decrements the indices after a light before the rain's was deleted.
    #[doc(hidden)]
    pub fn moves_up(&mut self) {
        self.first -= 1;
    }
}

/// The colour of luminance 1 at `hue` in 0..1, linear Rec. 709, with a tenth of white mixed in, so
/// that blue lights do not glare.
fn saturated(hue: f32) -> Vec3 {
    let ramp = |offset: f32| (((hue + offset).fract() * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
    let color = Vec3::new(ramp(0.0), ramp(2.0 / 3.0), ramp(1.0 / 3.0)) * 0.9 + 0.1;
    color / color.dot(LUMINANCE)
}

/// Luminance of linear Rec. 709.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds = Bounds { min: Vec3::new(-12.0, 0.0, -7.0), max: Vec3::new(12.0, 9.0, 7.0) };

    #[test]
    fn rain_is_a_function_of_its_arguments() {
        let rain = light_rain(&BOX, 100, Some(2.0), 3, 1.5);
        assert_eq!(rain, light_rain(&BOX, 100, Some(2.0), 3, 1.5));
        assert_eq!(rain[..40], light_rain(&BOX, 40, Some(2.0), 3, 1.5), "fewer lights must be the first of more");
        let other = light_rain(&BOX, 100, Some(2.0), 4, 1.5);
        assert!(rain.iter().zip(&other).all(|(a, b)| a.position != b.position));
    }

    #[test]
    fn rain_stays_in_its_box() {
        for time in [-5.0, 0.0, 0.4, 17.0, 1e5] {
            let rain = light_rain(&BOX, 500, None, 1, time);
            assert_eq!(rain.len(), 500);
            let inside = |l: &&Light| l.position.cmpge(BOX.min).all() && l.position.cmple(BOX.max).all();
            assert_eq!(rain.iter().filter(inside).count(), 500, "at {time} s");
        }
        assert_eq!(light_rain(&Bounds::EMPTY, 5, None, 1, 0.0), []);
        assert_eq!(light_rain(&BOX, 0, None, 1, 0.0), []);
    }

    #[test]
    fn lights_fall_and_restart_elsewhere() {
        let (before, after) = (light_rain(&BOX, 1000, None, 9, 2.0), light_rain(&BOX, 1000, None, 9, 2.1));
        let (mut fell, mut reborn) = (0, 0);
        for (a, b) in before.iter().zip(&after) {
            let drop = a.position.y - b.position.y;
            if drop > 0.0 {
                // 0.1 s at 1 to 3 m/s; 1e-4 m for f32 positions of 9 m.
                assert!((0.1 - 1e-4..=0.3 + 1e-4).contains(&drop), "fell {drop} m");
                assert_eq!(a.intensity, b.intensity);
                assert_eq!((a.position.x, a.position.z), (b.position.x, b.position.z));
                fell += 1;
            } else {
                assert!(a.position.y < 0.3 && b.position.y > 8.7, "{} to {}", a.position, b.position);
                assert_ne!(a.position.x, b.position.x);
                reborn += 1;
            }
        }
        // 0.2 m of 9 m: 22 of 1000 expected.
        assert!(fell > 900 && (5..60).contains(&reborn), "{fell} fell, {reborn} came back");
    }

    #[test]
    fn the_chosen_radius_preserves_the_lights_per_point() {
        for count in [100, 1_000, 20_000] {
            let rain = light_rain(&BOX, count, None, 5, 0.0);
            let radius = rain[0].range.unwrap();
            // Inner points only: near a wall part of the ball lies outside.
            let probes = (0..400u32).map(|i| {
                let fractions = Vec3::new(unit(&[i, 1]), unit(&[i, 2]), unit(&[i, 3]));
                BOX.min + radius + fractions * (BOX.size() - 2.0 * radius).max(Vec3::ZERO)
            });
            let reached: usize = probes.map(|p| rain.iter().filter(|l| l.position.distance(p) < radius).count()).sum();
            let mean = reached as f32 / 400.0;
            // The box holds about count / 12 balls that do not overlap, each with a Poisson number of lights, mean 12:
            // a standard error of 12 / sqrt(count); five of them.
            let tolerance = 5.0 * LIGHTS_PER_POINT / (count as f32).sqrt();
            assert!((mean - LIGHTS_PER_POINT).abs() < tolerance, "{count} lights: {mean} a point");
        }
        assert_eq!(light_rain(&BOX, 1, None, 5, 0.0)[0].range, Some(0.5 * BOX.size().length()), "clamped");
    }

    #[test]
    fn all_hues_have_the_same_luminance() {
        for i in 0..60 {
            let color = saturated(i as f32 / 60.0);
            assert!((color.dot(LUMINANCE) - 1.0).abs() < 1e-5);
            assert!(color.min_element() / color.max_element() < 0.11, "{color} is not saturated");
        }
    }

    #[test]
    fn rain_falls_among_the_other_lights_in_any_order() {
        let mut scene = super::super::demo("cornell").unwrap();
        let mut rain = Rain::add(&mut scene, 5, None, 3);
        let drops = rain.indices();
        scene.lights.push(Light::point(Vec3::ONE, Vec3::ONE));
        let start = scene.lights.clone();
        let mut at = |time| {
            rain.fall(&mut scene.lights, time);
            scene.lights.clone()
        };
        let later = at(0.7);
        assert_eq!(at(0.0), start);
        at(-5.0);
        assert_eq!(at(0.7), later);
        assert_eq!(
            (0..start.len()).filter(|i| start[*i] != later[*i]).collect::<Vec<_>>(),
            drops.clone().collect::<Vec<_>>()
        );
        scene.lights.remove(0);
        rain.moves_up();
        rain.fall(&mut scene.lights, 0.0);
        assert_eq!(scene.lights, start[1..]);
    }
}
