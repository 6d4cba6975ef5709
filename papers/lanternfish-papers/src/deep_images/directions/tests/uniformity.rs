//! Uniformity of the sets, and the equal areas of the zonal one.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::{
    super::sets::{Region, unit_from_spherical, zonal_regions},
    DirectionSet, Directions,
};
use crate::testing::Random;

/// Area of the region, sr.
fn area(region: &Region) -> f64 {
    let [top, bottom] = region.colatitudes;
    (top.cos() - bottom.cos()) * (region.longitudes[1] - region.longitudes[0])
}

/// The largest distance between two points of the region's border, sampled in 32 steps per side.
fn diameter(region: &Region) -> f64 {
    let mut border = Vec::new();
    for i in 0..=32 {
        let at = |range: [f64; 2]| range[0] + (range[1] - range[0]) * f64::from(i) / 32.0;
        border.extend(region.colatitudes.map(|colatitude| unit_from_spherical(colatitude, at(region.longitudes))));
        border.extend(region.longitudes.map(|longitude| unit_from_spherical(at(region.colatitudes), longitude)));
    }
    let distances = border.iter().flat_map(|a| border.iter().map(|b| a.distance(*b)));
    distances.fold(0.0, f64::max)
}

#[test]
fn zonal_regions_are_equal_in_area_and_half_of_the_sphere() {
    for count in (1..=300).chain([511, 512, 1000, 4095, 4096]) {
        let regions = zonal_regions(count);
        assert_eq!(regions.len(), count as usize);
        // With their opposites they tile the sphere: collars are adjacent and closed.
        let mut bottom = 0.0;
        for collar in regions.chunk_by(|a, b| a.colatitudes == b.colatitudes) {
            assert_eq!(collar[0].colatitudes[0], bottom, "{count}");
            bottom = collar[0].colatitudes[1];
            assert!(collar.windows(2).all(|pair| pair[0].longitudes[1] == pair[1].longitudes[0]), "{count}");
            let rotation = collar[collar.len() - 1].longitudes[1] - collar[0].longitudes[0];
            // The collar across the equator and its inversion share one belt.
            let across = (collar[0].colatitudes[0] + bottom - PI).abs() < 1e-9;
            assert!((rotation - if across { PI } else { TAU }).abs() < 1e-9, "{count}: {rotation}");
            assert!(across || bottom < FRAC_PI_2 + 1e-9, "{count}");
        }
        for region in &regions {
            let expected = 2.0 * PI / f64::from(count);
            assert!((area(region) / expected - 1.0).abs() < 1e-9, "{count}: {region:?}");
        }
    }
}

/// Ten regions are 1, 4, 4 and 1, by hand: caps of asin √(1/10) · 2, and two collars.
#[test]
fn zonal_regions_of_ten() {
    let regions = zonal_regions(5);
    let cap = 2.0 * 0.1f64.sqrt().asin();
    assert!((cap - 0.643_501_108_793_284).abs() < 1e-12);
    assert!((regions[0].colatitudes[1] - cap).abs() < 1e-12);
    assert!(regions[1..].iter().all(|r| r.colatitudes[0] == cap && (r.colatitudes[1] - FRAC_PI_2).abs() < 1e-12));
}

/// Diameters are at most K / √M for M regions [Leopardi2006, §1]. A square has √(4π) √2 = 5.01; the measured maximum is 5.145.
#[test]
fn zonal_regions_are_small() {
    for count in (1..=64).chain([100, 169, 512, 1000]) {
        let diameter = zonal_regions(count).iter().map(diameter).fold(0.0, f64::max);
        let coefficient = diameter * f64::from(2 * count).sqrt();
        assert!(coefficient < 5.2, "{count}: {coefficient}");
    }
}

#[derive(Debug)]
struct Evenness {
    /// Root mean square and largest error of 2 / N Σ |cos θ| over normals, where 1 is exact [Aalund2015, eq. 2].
    cosine_sum: [f64; 2],
    /// Least and largest angle from one of the points ±axis to its nearest neighbour, degrees.
    neighbor: [f64; 2],
    /// Mean and largest angle between a direction and its image's axis, degrees.
    off_axis: [f64; 2],
}

fn evenness(directions: &Directions) -> Evenness {
    let axes: Vec<DVec3> = directions.axes().iter().map(|axis| axis.as_dvec3()).collect();
    let mut random = Random::new(5);
    let normals = 4000;
    let (mut squares, mut largest) = (0.0, 0.0f64);
    let mut off_axis = [0.0, 0.0f64];
    for _ in 0..normals {
        let normal = random.direction().as_dvec3().normalize();
        let cosines = axes.iter().map(|axis| axis.dot(normal).abs());
        let error = 2.0 / axes.len() as f64 * cosines.clone().sum::<f64>() - 1.0;
        squares += error * error;
        largest = largest.max(error.abs());
        let angle = cosines.fold(0.0, f64::max).min(1.0).acos().to_degrees();
        off_axis = [off_axis[0] + angle / f64::from(normals), off_axis[1].max(angle)];
    }
    let nearest = |i: usize| {
        let others = axes.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, other)| other.dot(axes[i]).abs()).fold(0.0, f64::max).min(1.0).acos().to_degrees()
    };
    let neighbors = (0..axes.len()).map(nearest);
    let neighbor = [neighbors.clone().fold(f64::MAX, f64::min), neighbors.fold(0.0, f64::max)];
    Evenness { cosine_sum: [(squares / f64::from(normals)).sqrt(), largest], neighbor, off_axis }
}

#[test]
fn the_zonal_set_is_the_most_even() {
    let measured = |set: DirectionSet| {
        let even = evenness(&Directions::new(set).unwrap());
        println!("{set:?}: {even:.3?}");
        even
    };
    for (stacks, k) in [(3, 2), (5, 3), (7, 4), (10, 6), (13, 8), (23, 13)] {
        let rows = [
            measured(DirectionSet::StacksSlices { stacks, slices: stacks }),
            measured(DirectionSet::Cube { k }),
            measured(DirectionSet::ZonalEqualArea { count: stacks * stacks }),
            measured(DirectionSet::ZonalEqualArea { count: 3 * k * k }),
        ];
        assert!(rows[2].cosine_sum[0] < rows[0].cosine_sum[0] && rows[3].cosine_sum[0] < rows[1].cosine_sum[0]);
        assert!(rows[2].off_axis[1] < rows[0].off_axis[1] && rows[3].off_axis[1] < rows[1].off_axis[1]);
        assert!(rows[2].neighbor[0] > rows[0].neighbor[0] && rows[3].neighbor[0] > rows[1].neighbor[0]);
    }
    for count in [8, 16, 32, 64, 128, 256, 512] {
        // Measured: 0.29 / N at 8 images, 0.17 / N at 512. Random directions would have 0.58 / √N.
        let rms = measured(DirectionSet::ZonalEqualArea { count }).cosine_sum[0];
        assert!(rms < 0.3 / f64::from(count), "{count}: {rms}");
    }
}
