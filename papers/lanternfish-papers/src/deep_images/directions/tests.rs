//! The nearest axis against brute force, and the uniformity of the sets.

mod uniformity;

use std::f32::consts::TAU;

use glam::EulerRot;

use super::{cells::range, *};
use crate::testing::Random;

const SETS: [DirectionSet; 16] = [
    DirectionSet::StacksSlices { stacks: 1, slices: 1 },
    DirectionSet::StacksSlices { stacks: 1, slices: 2 },
    DirectionSet::StacksSlices { stacks: 3, slices: 2 },
    DirectionSet::StacksSlices { stacks: 2, slices: 37 },
    DirectionSet::StacksSlices { stacks: 13, slices: 13 },
    DirectionSet::StacksSlices { stacks: 16, slices: 32 },
    DirectionSet::Cube { k: 1 },
    DirectionSet::Cube { k: 2 },
    DirectionSet::Cube { k: 3 },
    DirectionSet::Cube { k: 8 },
    DirectionSet::ZonalEqualArea { count: 1 },
    DirectionSet::ZonalEqualArea { count: 2 },
    DirectionSet::ZonalEqualArea { count: 3 },
    DirectionSet::ZonalEqualArea { count: 64 },
    DirectionSet::ZonalEqualArea { count: 169 },
    DirectionSet::ZonalEqualArea { count: 500 },
];

/// The largest |cosine| of all axes and the first image that has it.
fn brute_force(axes: &[Vec3], direction: Vec3) -> (u32, bool) {
    let mut best = (0, 0.0f32);
    for (image, axis) in axes.iter().enumerate() {
        let dot = axis.dot(direction);
        if dot.abs() > best.1.abs() {
            best = (image as u32, dot);
        }
    }
    (best.0, best.1 < 0.0)
}

/// Directions next to a change of the answer: between axes, at the corners of three cells, on the borders and corners of cells and faces,
/// at the poles, on the rim of the hemisphere, and at the axes.
fn adversarial(directions: &Directions, random: &mut Random, count: usize) -> Vec<Vec3> {
    let axes = directions.axes();
    let edge = directions.cells()[0];
    let mut all = vec![Vec3::X, Vec3::Y, Vec3::Z];
    for corner in 0..4 {
        let sign = |bit: u32| if corner >> bit & 1 == 0 { 1.0 } else { -1.0 };
        all.extend([
            Vec3::new(1.0, sign(0), sign(1)),
            Vec3::new(sign(0), 1.0, 0.0),
            Vec3::new(0.0, sign(0), 1.0),
            Vec3::new(1.0, 0.0, sign(0)),
        ]);
    }
    all.extend(axes);
    let mut pick = |n: usize| ((random.unit() * n as f32) as usize).min(n - 1);
    for _ in 0..count {
        // Neighbours: the nearest of a few to the one, in either direction.
        let axis = axes[pick(axes.len())];
        let mut others: Vec<Vec3> =
            axes.iter().filter(|other| **other != axis).map(|other| *other * other.dot(axis).signum()).collect();
        others.sort_by(|a, b| b.dot(axis).total_cmp(&a.dot(axis)));
        if let [a, b, ..] = others[..others.len().min(6)] {
            let c = others[pick(others.len().min(6))];
            all.extend([axis + a, axis + b, axis + c]);
            all.extend([(axis - a).cross(axis - b), (axis - b).cross(axis - c)]);
        }
        let border = |i: usize| 2.0 * i as f32 / edge as f32 - 1.0;
        let on_border = border(pick(edge as usize + 1));
        let along = border(pick(edge as usize + 1)) + 0.37 * pick(4) as f32 / edge as f32;
        all.extend([Vec3::new(1.0, on_border, along), Vec3::new(along, 1.0, on_border)]);
        all.extend([Vec3::new(on_border, along, 1.0), Vec3::new(along, on_border, 1.0)]);
        let (sin, cos) = (TAU * pick(1 << 20) as f32 / (1 << 20) as f32).sin_cos();
        // The rim, just above and below; and around the pole.
        all.extend([0.0, 1e-7, -1e-7, 1e-3, -1e-3].map(|y| Vec3::new(sin, y, cos)));
        all.extend([1e-7, 1e-4, 1e-2].map(|r| Vec3::new(r * sin, 1.0, r * cos)));
        all.push(Vec3::new(sin, cos, sin));
    }
    all.retain(|direction| direction.length_squared() > 1e-8);
    // All of them displaced by a rounding error to either side, reversed, and of other lengths.
    let nudged: Vec<Vec3> = all.iter().map(|d| *d * Vec3::new(1.0 + 1e-7, 1.0, 1.0 - 1e-7)).collect();
    all.extend(nudged);
    let backwards: Vec<Vec3> = all.iter().enumerate().map(|(i, d)| *d * [-1.0, -1e-9, -1e9][i % 3]).collect();
    all.extend(backwards);
    all
}

/// Number of directions with another image than brute force gives: for equals, the first is expected.
fn wrong<'d>(directions: &Directions, requested: impl IntoIterator<Item = &'d Vec3>) -> usize {
    let wrong = |d: &&Vec3| directions.nearest(**d) != brute_force(&directions.axes_in_set, **d);
    requested.into_iter().filter(wrong).count()
}

/// The sets above, and others at random.
#[test]
fn nearest_is_brute_forces() {
    let mut random = Random::new(3);
    let mut below = |count: u32| 1 + (random.unit() * count as f32) as u32;
    let others = (0..36).map(|i| match i % 3 {
        0 => DirectionSet::StacksSlices { stacks: below(17), slices: below(17) },
        1 => DirectionSet::Cube { k: below(9) },
        _ => DirectionSet::ZonalEqualArea { count: below(300) },
    });
    for set in SETS.into_iter().chain(others.collect::<Vec<_>>()) {
        let directions = Directions::new(set).unwrap();
        let mut requested: Vec<Vec3> = (0..5000).map(|_| random.direction()).collect();
        requested.extend(adversarial(&directions, &mut random, 100));
        assert_eq!(wrong(&directions, &requested), 0, "{set:?}: of {}", requested.len());
    }
}

/// Without one of its candidates a cell is wrong somewhere. Exceptions are candidates whose polygon touches a cell with a corner or only by
/// its margin; the symmetric cube has most of them.
#[test]
fn a_lost_candidate_is_detected() {
    for set in [SETS[4], SETS[9], SETS[14]] {
        let directions = Directions::new(set).unwrap();
        let mut random = Random::new(7);
        let mut requested: Vec<Vec3> = (0..200_000).map(|_| random.direction()).collect();
        requested.extend(adversarial(&directions, &mut random, 100));
        let edge = directions.cells()[0];
        let mut by_cell = vec![Vec::new(); (3 * edge * edge) as usize];
        requested.iter().for_each(|d| by_cell[cells::cell_of(*d, edge) as usize].push(*d));
        let (mut lost, mut noticed) = (0, 0);
        for (cell, requested) in by_cell.iter().enumerate() {
            for at in range(directions.cells(), cell as u32) {
                let mut broken = directions.clone();
                let table = Arc::make_mut(&mut broken.cells);
                let others = range(table, cell as u32);
                table[at] = if at == others.start { table[others.end - 1] } else { table[others.start] };
                lost += usize::from(others.len() > 1);
                noticed += usize::from(wrong(&broken, requested) > 0);
            }
        }
        println!("{set:?}: {noticed} of {lost} lost candidates noticed");
        assert!(5 * noticed > 4 * lost, "{set:?}: {noticed} of {lost}");
    }
}

/// Candidate lists are short: two on average and at most four, except for the slices that share a pole and sets of few axes.
#[test]
fn candidate_lists_do_not_grow_with_the_set() {
    for set in SETS {
        let directions = Directions::new(set).unwrap();
        let edge = directions.cells()[0];
        let length = |cell| range(directions.cells(), cell).len();
        let longest = (0..3 * edge * edge).map(length).max().unwrap();
        let mut random = Random::new(1);
        let walked: usize = (0..20_000).map(|_| length(cells::cell_of(random.direction(), edge))).sum();
        let mean = walked as f64 / 20_000.0;
        println!("{set:?}: {} cells, {mean:.2} candidates, at most {longest}", 3 * edge * edge);
        let pole = if let DirectionSet::StacksSlices { slices, .. } = set { slices as usize } else { 0 };
        assert!(longest <= pole.max(6), "{set:?}: {longest}");
        assert!(mean < 3.2, "{set:?}: {mean}");
        // All words that a shader reads without a bounds check exist.
        let cells = directions.cells();
        let starts = &cells[1..=(3 * edge * edge + 1) as usize];
        assert!(starts.is_sorted_by(|a, b| a < b) && *starts.last().unwrap() as usize == cells.len());
        assert!(cells[starts[0] as usize..].iter().all(|image| (*image as usize) < directions.len()));
    }
}

#[test]
fn axes_are_unit_and_no_two_are_parallel() {
    for set in SETS {
        let directions = Directions::new(set).unwrap();
        assert_eq!(directions.len() as u64, set.count());
        for (i, axis) in directions.axes().iter().enumerate() {
            assert!((axis.as_dvec3().length() - 1.0).abs() < 1.2e-7, "{set:?}: {axis}");
            assert!(directions.axes()[..i].iter().all(|other| other.cross(*axis).length() > 1e-3), "{set:?}: {axis}");
            assert_eq!(directions.nearest(*axis), (i as u32, false), "{set:?}");
            assert_eq!(directions.nearest(-*axis), (i as u32, true), "{set:?}");
        }
    }
}

#[test]
fn a_set_rotates_with_its_frames() {
    let mut random = Random::new(11);
    for set in SETS {
        let directions = Directions::new(set).unwrap();
        let by = Quat::from_euler(EulerRot::XYZ, 6.0 * random.unit(), 3.0 * random.unit(), 6.0 * random.unit());
        let rotated = directions.rotated(by);
        assert!(Arc::ptr_eq(&rotated.cells, &directions.cells));
        // Four quarter rotations are the identity.
        let quarter = Quat::from_rotation_y(0.25 * TAU);
        let again = (0..4).fold(rotated.clone(), |set, _| set.rotated(quarter));
        assert!(again.axes().iter().zip(rotated.axes()).all(|(a, b)| a.distance(*b) < 2e-6), "{set:?}");
        for image in 0..directions.len() as u32 {
            for set in [&directions, &rotated] {
                let frame = set.frame(image);
                assert!((frame.transpose() * frame).abs_diff_eq(Mat3::IDENTITY, 1e-6), "{frame}");
                assert!(
                    (frame.determinant() - 1.0).abs() < 1e-6
                        && frame.z_axis.distance(set.axes()[image as usize]) < 1e-6
                );
            }
            let expected = Mat3::from_quat(by) * directions.frame(image);
            assert!(rotated.frame(image).abs_diff_eq(expected, 1e-6));
        }
        for _ in 0..5000 {
            let direction = random.direction();
            let (image, reversed) = rotated.nearest(direction);
            let cosine = |image: u32| rotated.axes()[image as usize].dot(direction);
            // Both the direction and the axes are rotated, each with a few rounding errors.
            let best = cosine(brute_force(rotated.axes(), direction).0).abs();
            assert!(cosine(image).abs() > best - 2e-6, "{set:?}: {direction}");
            assert!(reversed == (cosine(image) < 0.0) || best < 2e-6, "{set:?}: {direction}");
        }
    }
}

#[test]
fn impossible_sets_are_refused() {
    let sets = [
        DirectionSet::StacksSlices { stacks: 0, slices: 4 },
        DirectionSet::StacksSlices { stacks: u32::MAX, slices: u32::MAX },
        DirectionSet::Cube { k: 0 },
        DirectionSet::Cube { k: 37 },
        DirectionSet::Cube { k: u32::MAX },
        DirectionSet::ZonalEqualArea { count: 0 },
        DirectionSet::ZonalEqualArea { count: 4097 },
    ];
    for set in sets {
        let error = Directions::new(set).unwrap_err();
        assert_eq!(error, DirectionError::Count { set });
        assert!(error.to_string().ends_with("must be from 1 to 4096"), "{error}");
    }
    let set = DirectionSet::StacksSlices { stacks: 1, slices: 257 };
    assert_eq!(Directions::new(set).unwrap_err(), DirectionError::Slices { set });
    assert!(Directions::new(DirectionSet::StacksSlices { stacks: 1, slices: 256 }).is_ok());
}
