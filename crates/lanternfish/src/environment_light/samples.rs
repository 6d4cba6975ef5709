//! An environment image as cells that are each small enough for one direction, and sums over them.

use std::{f64::consts::PI, ops::Range};

use glam::{DVec3, Vec3, Vec4};
use lanternfish_scene::Environment;

/// Cells across and down: a set of 169 images has 338 directions, with about a hundred cells each.
const COLUMNS: usize = 256;
const ROWS: usize = 128;

/// A cell of the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Direction of its centre: unit, world space, away from the receiver.
    pub direction: Vec3,
    /// Its solid angle, sr.
    pub solid_angle: f32,
    /// Its mean radiance, nits.
    pub radiance: Vec3,
}

/// Cells that cover the complete sphere. An image of this resolution or more is averaged; a smaller one is sampled at the cells' centres.
pub fn samples_of(environment: &Environment) -> Vec<EnvironmentSample> {
    let Environment { width, height, .. } = *environment;
    let averages = width >= COLUMNS && height >= ROWS;
    let (columns, rows) = if averages { (width, height) } else { (COLUMNS, ROWS) };
    let part = |i: usize, parts: usize, count: usize| i * count / parts..(i + 1) * count / parts;
    let middle = |part: &Range<usize>, count: usize| (part.start + part.end) as f32 / (2 * count) as f32;
    let mut samples = Vec::with_capacity(COLUMNS * ROWS);
    for down in (0..ROWS).map(|i| part(i, ROWS, rows)) {
        for across in (0..COLUMNS).map(|i| part(i, COLUMNS, columns)) {
            let direction = environment.direction(middle(&across, columns), middle(&down, rows));
            let heights = zone_height(&down, rows);
            let radiance =
                if averages { mean_of(environment, &across, &down) } else { environment.radiance(direction) };
            let solid_angle = 2.0 * PI * heights * across.len() as f64 / columns as f64;
            samples.push(EnvironmentSample { direction, solid_angle: solid_angle as f32, radiance });
        }
    }
    samples
}

/// Height of the zone of a unit sphere that these rows cover.
fn zone_height(rows: &Range<usize>, count: usize) -> f64 {
    let cosine = |row: usize| (PI * row as f64 / count as f64).cos();
    cosine(rows.start) - cosine(rows.end)
}

/// Mean radiance of some pixels, weighted by their solid angle, nits.
fn mean_of(environment: &Environment, across: &Range<usize>, down: &Range<usize>) -> Vec3 {
    let mut sum = DVec3::ZERO;
    for y in down.clone() {
        let row = &environment.pixels[y * environment.width..][across.clone()];
        let of_row: DVec3 = row.iter().map(|pixel| pixel.as_dvec3()).sum();
        sum += of_row * zone_height(&(y..y + 1), environment.height);
    }
    (sum / (zone_height(down, environment.height) * across.len() as f64)).as_vec3()
}

/// Radius of a possible sun around the brightest cell, rad.
const SUN_RADIUS: f32 = 0.05;
/// Least fraction of all light that a sun emits.
const SUN_FRACTION: f32 = 0.05;

/// Direction of the sun, if the image has one: a small area that emits a large fraction of all light. Unit, world space.
pub(super) fn sun_of(samples: &[EnvironmentSample]) -> Option<Vec3> {
    let light = |sample: &EnvironmentSample| sample.radiance.element_sum() * sample.solid_angle;
    let brightest = samples.iter().max_by(|a, b| a.radiance.element_sum().total_cmp(&b.radiance.element_sum()))?;
    let is_near = |sample: &&EnvironmentSample| sample.direction.dot(brightest.direction) > SUN_RADIUS.cos();
    let near: f32 = samples.iter().filter(is_near).map(light).sum();
    let towards: Vec3 = samples.iter().filter(is_near).map(|sample| light(sample) * sample.direction).sum();
    let all: f32 = samples.iter().map(light).sum();
    (near > SUN_FRACTION * all).then(|| towards.normalize_or(brightest.direction))
}

/// Unoccluded irradiance over π by the surface normal, nits: the sum of these coefficients times 1, y, z, x, xy, yz, 3z² − 1, xz, x² − y²,
/// within about 1 % of the mean for any environment [Ramamoorthi2001, eq. 7–13]; w is unused.
pub fn harmonics(samples: &[EnvironmentSample]) -> [Vec4; 9] {
    let mut irradiance = [DVec3::ZERO; 9];
    let mut sphere = 0.0;
    for sample in samples {
        let solid_angle = f64::from(sample.solid_angle);
        let light = sample.radiance.as_dvec3() * solid_angle;
        sphere += solid_angle;
        for (sum, value) in irradiance.iter_mut().zip(polynomials(sample.direction.as_dvec3())) {
            *sum += light * value;
        }
    }
    // Squared normalization factors of the harmonics times 4π, times the cosine lobe's factor per order: 1, 2/3, 1/4.
    const FACTORS: [f64; 9] = [1.0, 2.0, 2.0, 2.0, 3.75, 3.75, 0.3125, 3.75, 0.9375];
    std::array::from_fn(|i| (irradiance[i] * (FACTORS[i] / sphere)).as_vec3().extend(0.0))
}

fn polynomials(DVec3 { x, y, z }: DVec3) -> [f64; 9] {
    [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y]
}

#[cfg(test)]
pub(super) fn by_normal(harmonics: &[Vec4; 9], normal: Vec3) -> Vec3 {
    let values = polynomials(normal.as_dvec3());
    harmonics.iter().zip(values).map(|(factor, value)| factor.truncate() * value as f32).sum()
}
