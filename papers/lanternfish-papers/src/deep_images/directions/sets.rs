//! The axes of each set, in double precision. The pole is +y; longitudes go from +z towards +x.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

/// One region of a partition of the sphere by parallels and meridians, radians.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    /// From the pole: top and bottom.
    pub colatitudes: [f64; 2],
    /// West and east.
    pub longitudes: [f64; 2],
}

impl Region {
    /// Unit vector through the middle of the region; for a polar cap, the pole.
    pub fn center(&self) -> DVec3 {
        if self.colatitudes[0] == 0.0 && self.longitudes[1] - self.longitudes[0] == TAU {
            return DVec3::Y;
        }
        let middle = |range: [f64; 2]| 0.5 * (range[0] + range[1]);
        unit_from_spherical(middle(self.colatitudes), middle(self.longitudes))
    }
}

pub(super) fn unit_from_spherical(colatitude: f64, longitude: f64) -> DVec3 {
    let (sin, cos) = colatitude.sin_cos();
    DVec3::new(sin * longitude.sin(), cos, sin * longitude.cos())
}

/// Centres of the cells into which `stacks` equal steps of colatitude and `slices` of longitude divide the upper hemisphere, from the pole
/// down.
pub(super) fn stacks_slices(stacks: u32, slices: u32) -> Vec<DVec3> {
    let cell = |stack: u32, slice: u32| {
        let colatitude = FRAC_PI_2 * (f64::from(stack) + 0.5) / f64::from(stacks);
        unit_from_spherical(colatitude, TAU * (f64::from(slice) + 0.5) / f64::from(slices))
    };
    (0..stacks).flat_map(|stack| (0..slices).map(move |slice| cell(stack, slice))).collect()
}

/// Centres of k × k squares on each of the cube's faces +x, +y, +z, one face after the other.
pub(super) fn cube(k: u32) -> Vec<DVec3> {
    let middle = |i: u32| (2.0 * f64::from(i) + 1.0) / f64::from(k) - 1.0;
    let on_x = |row: u32, column: u32| DVec3::new(1.0, middle(column), middle(row)).normalize();
    let squares = || (0..k).flat_map(move |row| (0..k).map(move |column| on_x(row, column)));
    let x = squares();
    let y = squares().map(|p| DVec3::new(p.z, p.x, p.y));
    let z = squares().map(|p| DVec3::new(p.y, p.z, p.x));
    x.chain(y).chain(z).collect()
}

/// One region of each pair of opposites of the recursive zonal equal-area partition of the sphere into 2 `count` regions [Leopardi2006,
/// §3], from the pole down.
///
/// The unit of area is a region: the cap down to colatitude θ has M sin²(θ / 2) of M = 2 `count`.
///
/// 1. The polar caps are one region each.
/// 2. The number of collars between them makes their height nearest to the side √(4π / M) of a square region.
/// 3. Each collar has the integer number of regions nearest to its area, with the rounding error carried to the next: the number of regions
///    above a collar's lower border is its ideal cap's area, rounded.
/// 4. Borders move so that the caps have these areas.
///
/// M is even, so the number of regions from each pole is the same, and the collar across the equator, if there is one, has an even number.
/// The partition does not define the rotation of a collar. Here the lower half is the upper one's inversion, so the centres and their
/// opposites together are the centres of the complete partition. Half of the collar across the equator is kept [Aalund2015, fig. 5]. Each
/// collar is rotated so that its centres' meridians are as far as possible from those of the one above.
pub(super) fn zonal_regions(count: u32) -> Vec<Region> {
    let m = 2 * count;
    let total = f64::from(m);
    let colatitude = |regions_above: u32| 2.0 * (f64::from(regions_above) / total).sqrt().min(1.0).asin();
    let cap = colatitude(1);
    let mut regions = vec![Region { colatitudes: [0.0, cap], longitudes: [0.0, TAU] }];
    if count == 1 {
        return regions;
    }
    let between = PI - 2.0 * cap;
    let collars = (between / (4.0 * PI / total).sqrt()).round().max(1.0) as u32;
    let height = between / f64::from(collars);
    let mut above = 1;
    // Regions and first meridian, in rotations, of the previous collar.
    let mut previous: Option<(u32, f64)> = None;
    for i in 1..=collars.div_ceil(2) {
        let across = 2 * i > collars;
        let ideal = total * (0.5 * (cap + f64::from(i) * height)).sin().powi(2);
        let below = if across { m - above } else { ideal.round() as u32 };
        let n = below - above;
        // Centres of two collars differ by multiples of 1 / lcm, plus a shift; half of 1 / lcm is the maximum distance that all can have.
        let start = previous.map_or(0.0, |(n_above, start)| {
            let apart = f64::from(gcd(n_above, n)) / (2.0 * f64::from(n_above) * f64::from(n));
            start + 0.5 / f64::from(n_above) - 0.5 / f64::from(n) + apart
        });
        let colatitudes = [colatitude(above), colatitude(below)];
        let meridian = |j: u32| TAU * (start + f64::from(j) / f64::from(n));
        let kept = if across { n / 2 } else { n };
        regions.extend((0..kept).map(|j| Region { colatitudes, longitudes: [meridian(j), meridian(j + 1)] }));
        previous = Some((n, start));
        above = below;
    }
    regions
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
