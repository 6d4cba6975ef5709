//! Cloth, plants and lanterns.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::{COURT, FLOOR, Materials, SPRING, UPPER_FLOOR, court::ball_profile};
use crate::{
    Light,
    generate::{
        build::Shape,
        hash::{signed, unit},
        surface::Workshop,
    },
};

/// Banners over the balustrade, curtains in the arches, sails over the court.
pub(super) fn cloths(workshop: &mut Workshop, m: &Materials) {
    let banners: Vec<usize> = (0..4).map(|i| workshop.mesh("banner", [(m.cloths[i], banner(i as u32))])).collect();
    for (i, x) in [-4.5f32, 0.0, 4.5].into_iter().enumerate() {
        workshop.place_at(banners[(i * 3 + 2) % 4], Vec3::new(x, UPPER_FLOOR + 0.99, -COURT.y), 0.0);
        workshop.place_at(banners[(i * 3) % 4], Vec3::new(x, UPPER_FLOOR + 0.99, COURT.y), PI);
    }
    for (i, z) in [-3.0f32, 3.0].into_iter().enumerate() {
        workshop.place_at(banners[i + 1], Vec3::new(-COURT.x, UPPER_FLOOR + 0.99, z), 0.5 * PI);
        workshop.place_at(banners[3 - i], Vec3::new(COURT.x, UPPER_FLOOR + 0.99, z), -0.5 * PI);
    }

    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    for (color, x, side, mirrored) in [
        (0, -4.5, 1.0, false),
        (3, -1.5, 1.0, true),
        (2, 4.5, 1.0, false),
        (1, -7.5, -1.0, false),
        (0, 1.5, -1.0, true),
        (3, 7.5, -1.0, false),
    ] {
        let curtain = workshop.mesh("curtain", [(m.cloths[color], curtain(color as u32))]);
        let angle = if side > 0.0 { PI } else { 0.0 };
        let placed =
            Affine3A::from_rotation_translation(Quat::from_rotation_y(angle), Vec3::new(x, FLOOR, side * COURT.y));
        workshop.place(curtain, if mirrored { placed * mirror } else { placed });
    }
    let mut rods = Shape::new();
    for (x, side) in [(-4.5, 1.0), (-1.5, 1.0), (4.5, 1.0), (-7.5, -1.0), (1.5, -1.0), (7.5, -1.0)] {
        let center = Vec3::new(x, SPRING + 0.02, side * COURT.y);
        rods.bar(center - Vec3::X * 1.25, center + Vec3::X * 1.25, 0.022, 8);
    }
    workshop.add("curtain rods", m.bronze, rods);

    for (color, x, width) in [(3, -5.2, 2.0), (0, -1.2, 1.7), (2, 2.6, 1.9)] {
        workshop.add("sail", m.cloths[color], sail(x, width, color as u32));
    }
}

/// A banner over a rail at the origin, that hangs down on the +z side, clear of the string course.
fn banner(seed: u32) -> Shape {
    let phase = TAU * unit(&[seed, 1]);
    let mut shape = Shape::new();
    shape.sheet(10, 26, Vec2::new(1.0, 3.6), |s, t| {
        // Length along the cloth from the back of the rail, m.
        let along = 3.3 * (1.0 - t);
        let (y, z) = if along < 0.45 {
            (-0.45 + along, -0.14)
        } else if along < 0.73 {
            let angle = (along - 0.45) / 0.28 * PI;
            (0.06 * angle.sin() + 0.01, -0.14 * angle.cos())
        } else {
            let drop = along - 0.73;
            (-drop, 0.14 + 0.55 * (1.0 - (-drop * 2.2).exp()))
        };
        let hang = ((along - 0.8) / 2.0).clamp(0.0, 1.0);
        let x = (s - 0.5) * (1.05 - 0.12 * hang);
        let wave = 0.07 * hang * (9.0 * s + phase + 1.2 * along).sin() + 0.03 * hang * (17.0 * s - 2.0 * along).sin();
        // The hem comes to a point.
        let point = if t < 0.12 { (1.0 - t / 0.12) * 0.30 * (1.0 - (2.0 * s - 1.0).abs()) } else { 0.0 };
        Vec3::new(x, y - point, z + wave)
    });
    shape
}

/// A curtain in an arch 2.4 m wide, from a rod at the springing to the floor (y = 0), tied back on the −x side.
fn curtain(seed: u32) -> Shape {
    let phase = TAU * unit(&[seed, 2]);
    let height = SPRING - FLOOR;
    let mut shape = Shape::new();
    shape.sheet(42, 14, Vec2::new(3.2, height), |s, t| {
        let tie = 0.42;
        // Width narrows from the rod to the tie, and falls open a little below it.
        let width = if t > tie {
            let u = (t - tie) / (1.0 - tie);
            0.30 + 1.95 * u.powf(1.7)
        } else {
            0.30 + 0.34 * (1.0 - (1.0 - (tie - t) / tie).powi(2))
        };
        let fold = 0.022 + 0.03 * width / 2.3;
        let bulge = 0.05 * (TAU * 1.5 * s + phase).sin();
        let x = -1.16 + width * s;
        // The free edge sags between rod and tie.
        let sag = if t > tie { 0.25 * s * (PI * (t - tie) / (1.0 - tie)).sin() } else { 0.0 };
        let y = 0.03 + (height - 0.03) * t - sag;
        Vec3::new(x, y, fold * (TAU * 6.0 * s + phase).sin() + bulge * (1.0 - t))
    });
    shape
}

/// A strip of cloth across the court at `x`, sagging between the friezes.
fn sail(x: f32, width: f32, seed: u32) -> Shape {
    let phase = TAU * unit(&[seed, 3]);
    let reach = COURT.y - 0.16;
    let mut shape = Shape::new();
    shape.sheet(12, 32, Vec2::new(width, 9.5), |s, t| {
        let across = 2.0 * t - 1.0;
        let sag = 1.25 * (1.0 - across * across);
        let cup = 0.22 * (1.0 - (2.0 * s - 1.0).powi(2)) * (1.0 - across.powi(4));
        let narrow = 1.0 - 0.25 * (1.0 - across * across);
        let wave = 0.04 * (11.0 * t + 5.0 * s + phase).sin() * (1.0 - across * across);
        Vec3::new(x + width * narrow * (s - 0.5), 8.52 - sag - cup + wave, -reach * across)
    });
    shape
}

/// Palms and orange trees in pots.
pub(super) fn plants(workshop: &mut Workshop, m: &Materials) {
    let (mut pot, mut soil) = (Shape::new(), Shape::new());
    let profile =
        [(0.22, 0.0), (0.25, 0.03), (0.30, 0.30), (0.34, 0.46), (0.39, 0.47), (0.39, 0.55), (0.34, 0.56), (0.33, 0.48)];
    pot.lathe(&profile, 28);
    soil.lathe(&[(0.335, 0.50), (0.0, 0.52)], 20);

    let (mut trunk, mut fronds) = (Shape::new(), Shape::new());
    trunk.lathe(&[(0.09, 0.5), (0.06, 0.7), (0.055, 1.15), (0.03, 1.28)], 10);
    for i in 0..18u32 {
        let angle = 2.399_963 * i as f32 + 0.3 * signed(&[i, 1]);
        let (rise, reach) = (1.5 - 0.055 * i as f32 + 0.15 * signed(&[i, 2]), 0.55 + 0.035 * i as f32);
        let mut frond = Shape::new();
        frond.sheet(2, 6, Vec2::ONE, |s, t| {
            let side = 2.0 * s - 1.0;
            let x = 0.05 + reach * (1.6 * t).sin();
            let y = 1.2 + rise * (t - 0.55 * t * t) - 0.6 * t * t * t - 0.16 * side * side * (1.0 - 0.5 * t);
            Vec3::new(x, y, -0.24 * side)
        });
        fronds.append(&frond, &Affine3A::from_rotation_y(angle));
    }
    let palm_parts = [(m.terracotta, pot.clone()), (m.soil, soil.clone()), (m.bark, trunk), (m.frond, fronds)];
    let palm = workshop.mesh("palm", palm_parts);

    let (mut trunk, mut crown, mut fruit) = (Shape::new(), Shape::new(), Shape::new());
    trunk.lathe(&[(0.05, 0.5), (0.035, 0.8), (0.03, 1.6)], 8);
    let mut orange = Shape::new();
    orange.lathe(&ball_profile(0.045, 4), 7);
    let center = Vec3::new(0.0, 1.75, 0.0);
    for i in 0..150u32 {
        // Evenly over the sphere by the golden angle, at different depths.
        let y = 1.0 - 2.0 * (i as f32 + 0.5) / 150.0;
        let direction =
            (Quat::from_rotation_y(2.399_963 * i as f32) * Vec3::new((1.0 - y * y).sqrt(), y, 0.0)).normalize();
        let position = center + direction * (0.34 + 0.18 * unit(&[i, 5]));
        let twist = Quat::from_rotation_arc(Vec3::Z, direction)
            * Quat::from_euler(
                glam::EulerRot::ZYX,
                3.0 * signed(&[i, 6]),
                0.7 * signed(&[i, 7]),
                0.7 * signed(&[i, 8]),
            );
        let mut card = Shape::new();
        card.sheet(1, 2, Vec2::ONE, |s, t| {
            let (x, y) = (s - 0.5, t - 0.5);
            Vec3::new(0.43 * x, 0.43 * y, -0.14 * (x * x + y * y))
        });
        crown.append(&card, &Affine3A::from_rotation_translation(twist, position));
        if i % 17 == 4 {
            fruit.append_at(&orange, center + direction * 0.50);
        }
    }
    let tree_parts = [(m.terracotta, pot), (m.soil, soil), (m.bark, trunk), (m.leaves, crown), (m.orange, fruit)];
    let tree = workshop.mesh("orange tree", tree_parts);

    let palms = [[-6.4, 2.3], [-6.4, -2.3], [-0.4, 1.9], [-0.4, -1.9]];
    for (i, [x, z]) in palms.into_iter().enumerate() {
        workshop.place_at(palm, Vec3::new(x, 0.0, z), 1.7 * i as f32);
    }
    let trees = [[-3.0, 3.1], [0.0, 3.1], [3.0, 3.1], [-3.0, -3.1], [0.4, -3.1]];
    for (i, [x, z]) in trees.into_iter().enumerate() {
        workshop.place_at(tree, Vec3::new(x, 0.0, z), 0.9 * i as f32);
    }
    for (i, [x, z]) in [[-5.2, 5.4], [8.2, -6.4]].into_iter().enumerate() {
        workshop.place_at(palm, Vec3::new(x, UPPER_FLOOR, z), 0.8 + 1.1 * i as f32);
    }
}

/// Lanterns on chains, below the vaults and the gallery's beams, each with a light.
pub(super) fn lanterns(workshop: &mut Workshop, m: &Materials) {
    let short = lantern(workshop, m, 1.35);
    let long = lantern(workshop, m, 1.65);
    let vault_top = SPRING + 1.26;
    for (x, z) in [
        (-10.5, 6.0),
        (-4.5, 6.0),
        (1.5, 6.0),
        (7.5, 6.0),
        (10.5, -6.0),
        (4.5, -6.0),
        (-1.5, -6.0),
        (-7.5, -6.0),
        (10.5, 0.0),
        (-10.5, 0.0),
    ] {
        hang(workshop, short, Vec3::new(x, vault_top, z), 1.35, 8.0);
    }
    for (x, z) in [(-6.375, 6.0), (-0.375, 6.0), (5.625, 6.0), (-6.375, -6.0), (0.375, -6.0), (6.375, -6.0)] {
        hang(workshop, long, Vec3::new(x, 8.75, z), 1.65, 6.0);
    }
    for z in [-2.625, 2.625] {
        hang(workshop, long, Vec3::new(-10.5, 8.75, z), 1.65, 6.0);
    }
}

/// Places a lantern whose chain begins at `top` and is `length` long, and a light of `intensity` cd in its cage.
fn hang(workshop: &mut Workshop, mesh: usize, top: Vec3, length: f32, intensity: f32) {
    workshop.place_at(mesh, top, top.x + top.z);
    // Over the tip of the flame, which would hide a light inside it.
    let position = top - Vec3::Y * (length - 0.02);
    let warm = Vec3::new(1.0, 0.64, 0.32) * intensity;
    workshop.scene.lights.push(Light { name: "lantern".to_owned(), ..Light::point(position, warm) });
}

/// A bronze cage with a flame, 0.5 m high, on a chain; the origin is the chain's top, the cage's middle `length` below.
fn lantern(workshop: &mut Workshop, m: &Materials, length: f32) -> usize {
    let mut bronze = Shape::new();
    let mut cage = Shape::new();
    cage.lathe(
        &[(0.0, -0.25), (0.03, -0.24), (0.02, -0.21), (0.12, -0.19), (0.14, -0.17), (0.14, -0.15), (0.0, -0.14)],
        10,
    );
    cage.lathe(&[(0.14, 0.15), (0.15, 0.17), (0.11, 0.21), (0.05, 0.25), (0.02, 0.28), (0.0, 0.28)], 10);
    cage.lathe(&[(0.13, 0.16), (0.14, 0.15)], 10);
    for i in 0..6 {
        let foot = 0.125 * Vec3::new((TAU * i as f32 / 6.0).cos(), 0.0, (TAU * i as f32 / 6.0).sin());
        cage.bar(foot - Vec3::Y * 0.16, foot + Vec3::Y * 0.16, 0.007, 5);
    }
    bronze.append_at(&cage, Vec3::Y * -length);
    // Links of the chain, every other one rotated.
    let count = ((length - 0.26) / 0.09) as u32;
    for i in 0..count {
        let middle = Vec3::Y * (-0.035 - (length - 0.29) / count as f32 * i as f32);
        let side = if i % 2 == 0 { Vec3::X } else { Vec3::Z } * 0.014;
        let end = Vec3::Y * 0.055;
        bronze.bar(middle - side - end, middle - side + end, 0.005, 3);
        bronze.bar(middle + side - end, middle + side + end, 0.005, 3);
    }
    let mut flame = Shape::new();
    flame.lathe(&[(0.0, -0.14), (0.028, -0.10), (0.022, -0.05), (0.0, 0.0)], 10);
    let mut lit = Shape::new();
    lit.append_at(&flame, Vec3::Y * -length);
    workshop.mesh("lantern", [(m.bronze, bronze), (m.flame, lit)])
}
