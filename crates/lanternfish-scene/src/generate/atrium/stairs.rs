//! The stairs from the court to the gallery, on the axis at its −x end.

use glam::{Affine3A, Vec3};

use super::{COURT, Materials, UPPER_FLOOR, arcade, court::ball_profile};
use crate::generate::{build::Shape, surface::Workshop};

/// Steps; each is 5 m / 29 = 17.2 cm high, and 28 treads of 27 cm lead up to the gallery.
const RISERS: u32 = 29;
const GOING: f32 = 0.27;
/// Half the width between the side walls, m.
const HALF_WIDTH: f32 = 1.1;
/// Thickness of the side walls, m.
const SIDE: f32 = 0.25;

/// Adds the stairs with their side walls, an arched passage, railings and a carpet.
pub(super) fn stairs(workshop: &mut Workshop, m: &Materials) {
    let riser = UPPER_FLOOR / RISERS as f32;
    // The last riser stands at the front of the gallery's string course.
    let top_x = -(COURT.x - 0.25 - 0.23);
    let riser_x = |step: u32| top_x + GOING * (RISERS - 1 - step) as f32;
    // Height of the line through the nosings, at any x.
    let slope = |x: f32| riser + (riser_x(0) - x) / GOING * riser;

    let mut steps = Shape::new();
    let mut carpet = Shape::new();
    for step in 0..RISERS - 1 {
        let (x, y) = (riser_x(step), riser * step as f32);
        let tread = y + riser;
        let next = riser_x(step + 1);
        steps.cuboid(
            Vec3::new(next - 0.01, tread - 0.05, -HALF_WIDTH - 0.02),
            Vec3::new(x + 0.025, tread, HALF_WIDTH + 0.02),
            0.012,
        );
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let w = HALF_WIDTH + 0.02;
        steps.polygon(&[at(x, y, w), at(x, y, -w), at(x, tread - 0.04, -w), at(x, tread - 0.04, w)]);
        // The carpet lies 6 mm over the steps and bends around each nosing.
        let (w, over) = (0.72, 0.006);
        let path = [
            (x + over, y + over),
            (x + over, tread - 0.055),
            (x + 0.025 + over, tread - 0.045),
            (x + 0.025 + over, tread - 0.008),
            (x + 0.012, tread + over),
            (next + over, tread + over),
        ];
        for pair in path.windows(2) {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            carpet.polygon(&[at(x0, y0, w), at(x0, y0, -w), at(x1, y1, -w), at(x1, y1, w)]);
        }
    }
    workshop.add("stairs", m.limestone, steps);
    workshop.add("carpet", m.cloths[0], carpet);

    let (foot, passage_front, passage_back) = (riser_x(0) + 0.35, -5.7, -8.5);
    let (mut wall, mut trim) = (Shape::new(), Shape::new());
    let rise = 0.12;
    for side in [-1.0f32, 1.0] {
        let (inner, outer) = (side * HALF_WIDTH, side * (HALF_WIDTH + SIDE));
        // Both faces as one outline, wound for the +z face and mirrored for the other.
        let mut face = |z: f32, outline: &[(f32, f32)]| {
            let mut points: Vec<Vec3> = outline.iter().map(|(x, y)| Vec3::new(*x, *y, z)).collect();
            if (z > 0.0) != (z.abs() > HALF_WIDTH + 0.01) {
                points.reverse();
            }
            wall.polygon(&points);
        };
        let lip = |x: f32| slope(x) + rise;
        for z in [inner, outer] {
            face(z, &[(passage_front, 0.0), (foot, 0.0), (foot, lip(foot)), (passage_front, lip(passage_front))]);
            let arch_top = 2.9;
            face(
                z,
                &[
                    (passage_back, arch_top),
                    (passage_front, arch_top),
                    (passage_front, lip(passage_front)),
                    (passage_back, lip(passage_back)),
                ],
            );
        }
        // Coping and handrail follow the slope between the newels.
        let direction = Vec3::new(-GOING, riser, 0.0);
        let start = Vec3::new(foot, lip(foot), side * (HALF_WIDTH + 0.5 * SIDE));
        let length = (foot + COURT.x - 0.25 - 0.24) / GOING;
        trim.append(&slanted(start, direction * length, 0.16, 0.09), &Affine3A::IDENTITY);
        trim.append(&slanted(start + Vec3::Y * 0.84, direction * length, 0.11, 0.11), &Affine3A::IDENTITY);
        let baluster = arcade::baluster();
        for i in 0..length as u32 {
            let position = start + direction * (i as f32 + 0.9) + Vec3::Y * 0.06;
            trim.append(
                &baluster,
                &(Affine3A::from_translation(position) * Affine3A::from_scale(Vec3::new(1.0, 1.02, 1.0))),
            );
        }
        let newel = Vec3::new(foot + 0.1, 0.0, start.z);
        trim.cuboid(newel + Vec3::new(-0.24, -0.02, -0.24), newel + Vec3::new(0.24, 0.2, 0.24), 0.02);
        trim.cuboid(newel + Vec3::new(-0.19, 0.19, -0.19), newel + Vec3::new(0.19, 1.2, 0.19), 0.015);
        trim.cuboid(newel + Vec3::new(-0.24, 1.19, -0.24), newel + Vec3::new(0.24, 1.32, 0.24), 0.03);
    }
    // The passage under the upper flight: one deep arch, its jambs, and the wall at its back.
    let center = Vec3::new(0.5 * (passage_front + passage_back), 1.6, 0.0);
    let mut arch = Shape::new();
    let depth = 2.0 * (HALF_WIDTH + SIDE);
    arch.append_at(&arcade::arch_panel(1.4, 1.0, 1.3, depth, 20), center);
    let z = HALF_WIDTH + SIDE;
    arch.cuboid(Vec3::new(passage_front - 0.4, 0.0, -z), Vec3::new(passage_front, 1.6, z), 0.0);
    arch.cuboid(Vec3::new(passage_back, 0.0, -z), Vec3::new(passage_back + 0.4, 1.6, z), 0.0);
    let back = [(-z, 0.0), (z, 0.0), (z, 4.9), (-z, 4.9)].map(|(z, y)| Vec3::new(passage_back - 0.01, y, z));
    arch.polygon(&back);
    wall.append_at(&arch, Vec3::ZERO);
    workshop.add("stair walls", m.ashlar, wall);
    workshop.add("stair railings", m.limestone, trim);

    // Bronze braziers with a golden ball on the newels.
    let mut ball = Shape::new();
    ball.lathe(&ball_profile(0.17, 12), 18);
    let mut cup = Shape::new();
    cup.lathe(&[(0.12, 0.0), (0.06, 0.05), (0.05, 0.09), (0.11, 0.13), (0.13, 0.16)], 20);
    let mut raised = Shape::new();
    raised.append_at(&ball, Vec3::Y * 0.27);
    let finial = workshop.mesh("newel ball", [(m.bronze, cup), (m.gold, raised)]);
    for side in [-1.0f32, 1.0] {
        let z = side * (HALF_WIDTH + 0.5 * SIDE);
        workshop.place_at(finial, Vec3::new(foot + 0.1, 1.315, z), 0.0);
    }
}

/// A beam from `start` along `run`, `width` in z and `height` upright, on top of the line.
fn slanted(start: Vec3, run: Vec3, width: f32, height: f32) -> Shape {
    let (up, side) = (Vec3::Y * height, Vec3::Z * 0.5 * width);
    let end = start + run;
    let mut beam = Shape::new();
    beam.polygon(&[start + side, start + side + up, end + side + up, end + side]);
    beam.polygon(&[end - side, end - side + up, start - side + up, start - side]);
    beam.polygon(&[start + side + up, start - side + up, end - side + up, end + side + up]);
    beam.polygon(&[end + side, end - side, start - side, start + side]);
    beam
}
