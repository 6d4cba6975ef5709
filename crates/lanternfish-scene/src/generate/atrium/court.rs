//! Floors, walls, mouldings and roofs, and the fountain of the court.

use glam::{Affine3A, Vec2, Vec3};

use super::{BAY, COURT, FLOOR, Materials, OUTER, UPPER_FLOOR, arcade::cells};
use crate::generate::{
    build::Shape,
    hash::{signed, unit},
    surface::Workshop,
};

/// Thickness of the outer walls, m.
const WALL: f32 = 0.4;

/// Adds a moulding of one material around the court or the outer wall.
macro_rules! mouldings {
    ($workshop:expr, $($name:literal: $surface:expr, $half:expr, $profile:expr;)*) => {
        $({
            let mut shape = Shape::new();
            shape.moulding(&$profile, $half, true);
            $workshop.add($name, $surface, shape);
        })*
    };
}

/// Floors, steps, walls and mouldings.
pub(super) fn shell(workshop: &mut Workshop, m: &Materials) {
    // The faces of the panels that look into the court, below and above.
    let (face, upper_face) = (COURT - 0.25, COURT - 0.18);
    let steps = [(0.85, -0.02), (0.85, 0.135), (0.835, 0.15), (0.5, 0.15), (0.5, 0.285), (0.485, 0.30), (-0.5, 0.30)];
    let string_course = [
        (-0.01, 4.70),
        (0.05, 4.72),
        (0.05, 4.78),
        (0.12, 4.84),
        (0.16, 4.86),
        (0.16, 4.91),
        (0.24, 4.95),
        (0.24, 4.99),
        (0.23, UPPER_FLOOR),
        (-0.5, UPPER_FLOOR),
    ];
    let cornice = [
        (-0.01, 8.74),
        (0.05, 8.76),
        (0.05, 9.0),
        (0.20, 9.02),
        (0.20, 9.07),
        (0.24, 9.10),
        (0.30, 9.18),
        (0.33, 9.20),
        (0.33, 9.26),
    ];
    mouldings! { workshop,
        "steps": m.limestone, COURT, steps;
        "arcade floor": m.tiles, COURT, [(-0.5, FLOOR), (-3.0, FLOOR)];
        "dado": m.red_plaster, OUTER, [(0.03, FLOOR), (0.03, 1.45)];
        "dado rail": m.limestone, OUTER, [(0.03, 1.45), (0.06, 1.48), (0.06, 1.54), (0.0, 1.58)];
        "wall": m.ochre_plaster, OUTER, [(0.0, 1.58), (0.0, UPPER_FLOOR)];
        "string course": m.limestone, face, string_course;
        "gallery floor": m.tiles, COURT - 0.25, [(-0.5, UPPER_FLOOR), (-3.25, UPPER_FLOOR)];
        "gallery dado": m.blue_plaster, OUTER, [(0.03, UPPER_FLOOR), (0.03, 6.1)];
        "gallery dado rail": m.limestone, OUTER, [(0.03, 6.1), (0.06, 6.13), (0.06, 6.18), (0.0, 6.21)];
        "gallery wall": m.plaster, OUTER, [(0.0, 6.21), (0.0, 9.0)];
        "ceiling": m.wood, OUTER, [(0.0, 8.95), (3.1, 8.95)];
        "frieze list": m.limestone, upper_face, [(-0.01, 8.29), (0.04, 8.31), (0.04, 8.36), (0.015, 8.365)];
        "frieze": m.painted_tiles, upper_face, [(0.015, 8.365), (0.015, 8.665)];
        "frieze top": m.limestone, upper_face, [(0.015, 8.665), (0.05, 8.67), (0.05, 8.72), (-0.01, 8.75)];
        "cornice": m.limestone, upper_face, cornice;
        "roof": m.roof, upper_face, [(0.33, 9.26), (-3.62, 10.25)];
    }

    // The outside: walls that are hardly visible, and solids for shadows.
    let mut outside = Shape::new();
    outside.moulding(&[(WALL, -0.1), (WALL, 10.5), (0.0, 10.5)], OUTER, false);
    outside.moulding(&[(0.0, 9.9), (0.0, 10.5)], OUTER, true);
    let (x, z) = (OUTER.x + WALL, OUTER.y + WALL);
    outside.polygon(&[[-x, -z], [x, -z], [x, z], [-x, z]].map(|[x, z]| Vec3::new(x, -0.1, z)));
    workshop.add("outside", m.ochre_plaster, outside);
    let mut mortar = Shape::new();
    let (x, z) = (COURT.x - 0.8, COURT.y - 0.8);
    mortar.polygon(&[[-x, z], [x, z], [x, -z], [-x, -z]].map(|[x, z]| Vec3::new(x, -0.012, z)));
    workshop.add("mortar", m.soil, mortar);
    flagstones(workshop, m);
    roof_details(workshop, m);
    beams_and_doors(workshop, m);
}

/// Bevelled stones in running bond, in three tints, each cut from another part of the texture.
fn flagstones(workshop: &mut Workshop, m: &Materials) {
    let half = COURT - 0.85;
    let (rows, columns) = (8, 15);
    let depth = 2.0 * half.y / rows as f32;
    let width = 2.0 * half.x / columns as f32;
    let mut tints = [Shape::new(), Shape::new(), Shape::new()];
    for row in 0..rows {
        let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
        for column in 0..columns + row % 2 {
            let at = |c: f32| (c * width - half.x).clamp(-half.x, half.x);
            let (x0, x1) = (at(column as f32 - shift) + 0.004, at(column as f32 + 1.0 - shift) - 0.004);
            let (z0, z1) = (depth * row as f32 - half.y + 0.004, depth * (row + 1) as f32 - half.y - 0.004);
            let seed = [row, column, 5];
            // Each stone is tilted by up to 2 mm.
            let height = |corner: u32| 0.002 * signed(&[row, column, corner]);
            let corner = |x: f32, z: f32, index: u32| Vec3::new(x, height(index), z);
            let (b, low) = (0.012, -0.015);
            let top = [
                corner(x0 + b, z1 - b, 0),
                corner(x1 - b, z1 - b, 1),
                corner(x1 - b, z0 + b, 2),
                corner(x0 + b, z0 + b, 3),
            ];
            let rim = [[x0, z1], [x1, z1], [x1, z0], [x0, z0]].map(|[x, z]| Vec3::new(x, low, z));
            let mut stone = Shape::new();
            stone.polygon(&top);
            for i in 0..4 {
                let j = (i + 1) % 4;
                stone.polygon(&[rim[i], rim[j], top[j], top[i]]);
            }
            let offset = 3.0 * Vec2::new(unit(&seed), unit(&[row, column, 6]));
            stone.uv.iter_mut().for_each(|uv| *uv += offset);
            tints[(unit(&[row, column, 7]) * 2.999) as usize].append_at(&stone, Vec3::ZERO);
        }
    }
    for (tint, surface) in tints.into_iter().zip(m.flagstones) {
        workshop.add("flagstones", surface, tint);
    }
}

/// Dentils under the cornice and rows of round tiles on the roof.
fn roof_details(workshop: &mut Workshop, m: &Materials) {
    let mut dentils = Shape::new();
    for i in 0..15 {
        let x = 0.2 * (i as f32 - 7.0);
        dentils.cuboid(Vec3::new(x - 0.055, 8.86, -0.05), Vec3::new(x + 0.055, 8.99, 0.12), 0.0);
    }
    let dentils = workshop.mesh("dentils", [(m.limestone, dentils)]);
    // Half pipes down the slope of the roof, from the middle of the sheet to over the eaves.
    let (eaves, ridge) = (Vec3::new(0.0, 9.26, 0.40), Vec3::new(0.0, 10.27, -3.60));
    let mut tiles = Shape::new();
    for i in 0..15 {
        let middle = 0.2 * (i as f32 - 7.0);
        tiles.sheet(6, 1, Vec2::new(0.27, 4.1), |s, t| {
            let (sin, cos) = (std::f32::consts::PI * s).sin_cos();
            eaves.lerp(ridge, t) + Vec3::new(middle - 0.085 * cos, 0.085 * sin, 0.0)
        });
    }
    let tiles = workshop.mesh("roof tiles", [(m.roof, tiles)]);
    for (position, angle) in cells(COURT - 0.18, BAY) {
        workshop.place_at(dentils, position, angle);
        workshop.place_at(tiles, position, angle);
    }
}

/// Ceiling beams of the gallery, and doors in the outer wall of both storeys.
fn beams_and_doors(workshop: &mut Workshop, m: &Materials) {
    let mut beam = Shape::new();
    beam.cuboid(Vec3::new(-0.07, 8.74, -1.52), Vec3::new(0.07, 8.97, 1.36), 0.0);
    let beam = workshop.mesh("beam", [(m.wood, beam)]);
    let middle = 0.5 * (COURT + OUTER);
    for (position, angle) in cells(middle, 0.75) {
        workshop.place_at(beam, position, angle);
    }

    let (mut frame, mut leaf, mut parameter) = (Shape::new(), Shape::new(), Shape::new());
    for side in [-1.0f32, 1.0] {
        let x = side * 0.72;
        frame.cuboid(Vec3::new(x - 0.1, 0.0, -0.05), Vec3::new(x + 0.1, 2.2, 0.13), 0.0);
        leaf.cuboid(
            Vec3::new(side.min(0.0) * 0.63 + 0.004, 0.02, -0.05),
            Vec3::new(side.max(0.0) * 0.63 - 0.004, 2.14, 0.06),
            0.005,
        );
        for (low, high) in [(0.15, 0.95), (1.15, 2.02)] {
            leaf.cuboid(Vec3::new(side * 0.32 - 0.21, low, 0.0), Vec3::new(side * 0.32 + 0.21, high, 0.085), 0.02);
        }
        let mut ball = Shape::new();
        ball.lathe(&ball_profile(0.035, 4), 8);
        parameter.append_at(&ball, Vec3::new(side * 0.07, 1.05, 0.10));
    }
    frame.cuboid(Vec3::new(-0.9, 2.19, -0.05), Vec3::new(0.9, 2.42, 0.16), 0.0);
    frame.cuboid(Vec3::new(-0.98, 2.41, -0.05), Vec3::new(0.98, 2.50, 0.22), 0.03);
    let door = workshop.mesh("door", [(m.limestone, frame), (m.wood, leaf), (m.bronze, parameter)]);
    for (index, (position, angle)) in cells(OUTER, BAY).into_iter().enumerate() {
        if index % 4 == 1 {
            workshop.place_at(door, position + Vec3::Y * FLOOR, angle);
        }
        if index % 3 == 0 {
            workshop.place_at(door, position + Vec3::Y * UPPER_FLOOR, angle);
        }
    }
}

/// Half a circle of `radius` from the bottom up, as a lathe profile.
pub(super) fn ball_profile(radius: f32, steps: u32) -> Vec<(f32, f32)> {
    let angle = |i: u32| std::f32::consts::PI * (i as f32 / steps as f32 - 0.5);
    (0..=steps).map(|i| (radius * angle(i).cos().max(0.0), radius * angle(i).sin())).collect()
}

/// A round basin with a bowl on a stem and a golden ball, at `center`; and a glass vase on a plinth near it.
pub(super) fn fountain(workshop: &mut Workshop, m: &Materials, center: Vec3) {
    let mut stone = Shape::new();
    let basin = [
        (1.62, -0.02),
        (1.62, 0.12),
        (1.59, 0.15),
        (1.46, 0.15),
        (1.40, 0.20),
        (1.40, 0.42),
        (1.48, 0.48),
        (1.52, 0.50),
        (1.52, 0.57),
        (1.49, 0.60),
        (1.27, 0.60),
        (1.24, 0.57),
        (1.24, 0.10),
    ];
    stone.lathe(&basin, 48);
    let stem = [
        (0.36, 0.30),
        (0.36, 0.52),
        (0.30, 0.56),
        (0.16, 0.66),
        (0.13, 0.80),
        (0.17, 0.92),
        (0.13, 1.02),
        (0.12, 1.14),
        (0.20, 1.22),
        (0.45, 1.30),
        (0.66, 1.42),
        (0.72, 1.52),
        (0.71, 1.55),
        (0.67, 1.55),
        (0.60, 1.44),
    ];
    stone.lathe(&stem, 40);
    let finial = [(0.15, 1.40), (0.10, 1.56), (0.07, 1.66), (0.10, 1.72), (0.12, 1.73), (0.12, 1.76), (0.05, 1.77)];
    stone.lathe(&finial, 20);
    let mut water = Shape::new();
    water.lathe(&[(1.25, 0.46), (0.0, 0.46)], 48);
    water.lathe(&[(0.66, 1.51), (0.0, 1.51)], 40);
    let mut ball = Shape::new();
    let mut sphere = Shape::new();
    sphere.lathe(&ball_profile(0.17, 14), 24);
    ball.append_at(&sphere, Vec3::Y * 1.91);
    let fountain = workshop.mesh("fountain", [(m.limestone, stone), (m.water, water), (m.gold, ball)]);
    workshop.place(fountain, Affine3A::from_translation(center));

    let mut plinth = Shape::new();
    plinth.cuboid(Vec3::new(-0.34, -0.02, -0.34), Vec3::new(0.34, 0.10, 0.34), 0.02);
    plinth.cuboid(Vec3::new(-0.27, 0.09, -0.27), Vec3::new(0.27, 0.80, 0.27), 0.015);
    plinth.cuboid(Vec3::new(-0.33, 0.79, -0.33), Vec3::new(0.33, 0.90, 0.33), 0.025);
    let mut vase = Shape::new();
    let profile = [
        (0.0, 0.905),
        (0.10, 0.905),
        (0.11, 0.92),
        (0.06, 0.95),
        (0.12, 1.02),
        (0.19, 1.16),
        (0.20, 1.26),
        (0.15, 1.38),
        (0.07, 1.46),
        (0.065, 1.54),
        (0.11, 1.60),
    ];
    vase.lathe(&profile, 32);
    let vase = workshop.mesh("glass vase", [(m.limestone, plinth), (m.glass, vase)]);
    workshop.place_at(vase, center + Vec3::new(2.5, 0.0, 1.9), 0.5);
}
