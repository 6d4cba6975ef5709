//! Objects of the street: lamp posts, trees, cars, bollards, strings of bulbs.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::Materials;
use crate::{
    Light, LightKind,
    generate::{
        build::Shape,
        furnace::sphere,
        hash::{signed, unit},
        surface::Workshop,
    },
};

/// Height of a lamp above the foot of its post, m.
const LAMP_HEIGHT: f32 = 5.6;
/// Reach of a lamp from its post towards +z, m.
const LAMP_REACH: f32 = 1.6;

/// A post whose lamp hangs from an arm towards +z.
pub(super) fn lamp_post(workshop: &mut Workshop, m: &Materials) -> usize {
    let (mut iron, mut lamp) = (Shape::new(), Shape::new());
    let foot = [
        (0.22, 0.0),
        (0.22, 0.12),
        (0.17, 0.16),
        (0.14, 0.5),
        (0.16, 0.54),
        (0.16, 0.6),
        (0.09, 0.7),
        (0.075, 2.4),
        (0.10, 2.44),
        (0.10, 2.5),
        (0.065, 2.56),
        (0.05, 5.9),
        (0.08, 5.94),
        (0.08, 6.0),
        (0.03, 6.06),
        (0.055, 6.14),
        (0.0, 6.26),
    ];
    iron.lathe(&foot, 18);
    let arm = |t: f32| Vec3::new(0.0, 5.3 + 0.75 * (FRAC_PI_2 * 1.25 * t).sin(), LAMP_REACH * t);
    for i in 0..16 {
        iron.bar(arm(i as f32 / 16.0), arm((i + 1) as f32 / 16.0), 0.028, 8);
    }
    // A scroll under the arm.
    let scroll = |t: f32| {
        let (sin, cos) = (1.7 * TAU * t).sin_cos();
        Vec3::new(0.0, 5.12, 0.42) + (0.32 - 0.26 * t) * Vec3::new(0.0, sin, -cos)
    };
    for i in 0..24 {
        iron.bar(scroll(i as f32 / 24.0), scroll((i + 1) as f32 / 24.0), 0.014, 6);
    }
    let mut shade = Shape::new();
    shade.lathe(&[(0.27, 0.0), (0.25, 0.08), (0.12, 0.2), (0.07, 0.3), (0.0, 0.34)], 18);
    shade.lathe(&[(0.11, 0.18), (0.24, 0.07), (0.265, 0.0)], 18);
    iron.append_at(&shade, Vec3::new(0.0, LAMP_HEIGHT + 0.1, LAMP_REACH));
    lamp.append_at(&sphere(0.11, 14, 8), Vec3::new(0.0, LAMP_HEIGHT + 0.2, LAMP_REACH));
    workshop.mesh("lamp post", [(m.iron, iron), (m.lamp, lamp)])
}

/// The light of a lamp post that stands at `foot`, rotated by `angle`, radians.
pub(super) fn lamp_light(foot: Vec3, angle: f32) -> Light {
    // Below the globe, which would hide a light inside it. 60 cd at 5.6 m: 1.9 lx on the ground beneath.
    let position = foot + Quat::from_rotation_y(angle) * Vec3::new(0.0, LAMP_HEIGHT + 0.06, LAMP_REACH);
    let kind = LightKind::Spot { inner_angle: 0.75, outer_angle: 1.25 };
    Light { name: "street lamp".to_owned(), kind, ..Light::point(position, 60.0 * Vec3::new(1.0, 0.70, 0.40)) }
}

/// A plane tree of about 7 m; `seed` determines its shape.
pub(super) fn tree(workshop: &mut Workshop, m: &Materials, seed: u32) -> usize {
    let (mut bark, mut crown, mut soil) = (Shape::new(), Shape::new(), Shape::new());
    soil.lathe(&[(0.7, 0.0), (0.6, 0.05), (0.0, 0.08)], 16);
    bark.lathe(&[(0.19, 0.0), (0.15, 0.25), (0.12, 1.2), (0.11, 2.3), (0.08, 3.4), (0.02, 4.8)], 12);
    for branch in 0..14u32 {
        let angle = 2.399_963 * branch as f32 + 0.4 * signed(&[seed, branch, 1]);
        let start = Vec3::Y * (2.2 + 0.16 * branch as f32);
        let reach = 1.5 + 0.5 * unit(&[seed, branch, 2]) - 0.05 * branch as f32;
        let way = Quat::from_rotation_y(angle) * Vec3::new(reach, 0.9 + 0.5 * unit(&[seed, branch, 3]), 0.0);
        let middle = start + 0.5 * way + 0.12 * Vec3::Y;
        bark.bar(start, middle, 0.035, 6).bar(middle, start + way, 0.02, 6);
        for card in 0..64u32 {
            let at = |k: u32| signed(&[seed, branch, card, k]);
            let along = 0.3 + 0.75 * unit(&[seed, branch, card, 4]);
            let spread = Vec3::new(at(5), 0.7 * at(6), at(7)) * 0.75;
            let rotation = Quat::from_euler(glam::EulerRot::YXZ, 3.1 * at(8), 1.1 * at(9), 3.1 * at(10));
            let mut leaf = Shape::new();
            leaf.sheet(1, 1, Vec2::ONE, |s, t| 0.42 * Vec3::new(s - 0.5, t - 0.5, 0.0));
            crown.append(&leaf, &Affine3A::from_rotation_translation(rotation, start + along * way + spread));
        }
    }
    workshop.mesh("tree", [(m.soil, soil), (m.bark, bark), (m.leaves, crown)])
}

/// A parked car along x, 4.3 m long, its front towards +x, painted `paint`.
pub(super) fn car(workshop: &mut Workshop, m: &Materials, paint: usize) -> usize {
    let (mut body, mut glass, mut chrome) = (Shape::new(), Shape::new(), Shape::new());
    let (mut rubber, mut tail) = (Shape::new(), Shape::new());
    body.cuboid(Vec3::new(-2.1, 0.3, -0.82), Vec3::new(2.1, 0.86, 0.82), 0.09);
    body.cuboid(Vec3::new(-1.35, 1.36, -0.6), Vec3::new(0.45, 1.44, 0.6), 0.03);
    // The cabin: windows that slope inwards.
    let low = [[-1.75, -0.74], [1.0, -0.74], [1.0, 0.74], [-1.75, 0.74]].map(|[x, z]| Vec3::new(x, 0.85, z));
    let high = [[-1.3, -0.58], [0.4, -0.58], [0.4, 0.58], [-1.3, 0.58]].map(|[x, z]| Vec3::new(x, 1.38, z));
    for i in 0..4 {
        let k = (i + 1) % 4;
        glass.polygon(&[low[k], low[i], high[i], high[k]]);
        body.bar(low[i], high[i], 0.035, 8);
    }
    let along = Affine3A::from_rotation_x(FRAC_PI_2);
    let (mut tyre, mut hub) = (Shape::new(), Shape::new());
    tyre.lathe(&[(0.2, -0.1), (0.29, -0.1), (0.32, -0.07), (0.32, 0.07), (0.29, 0.1), (0.2, 0.1)], 20);
    hub.lathe(&[(0.0, -0.09), (0.2, -0.08), (0.21, 0.0), (0.2, 0.08), (0.0, 0.09)], 16);
    for x in [-1.35, 1.35] {
        for z in [-0.8, 0.8] {
            let car_from_wheel = Affine3A::from_translation(Vec3::new(x, 0.32, z)) * along;
            rubber.append(&tyre, &car_from_wheel);
            chrome.append(&hub, &car_from_wheel);
        }
    }
    for x in [-2.12, 2.12f32] {
        chrome.cuboid(Vec3::new(x - 0.06, 0.38, -0.8), Vec3::new(x + 0.06, 0.48, 0.8), 0.03);
    }
    for z in [-0.62, 0.62] {
        chrome.append_at(&sphere(0.11, 16, 8), Vec3::new(2.06, 0.66, z));
        tail.cuboid(Vec3::new(-2.13, 0.62, z - 0.14), Vec3::new(-2.05, 0.72, z + 0.14), 0.02);
    }
    workshop.mesh(
        "car",
        [(m.cars[paint], body), (m.car_glass, glass), (m.chrome, chrome), (m.rubber, rubber), (m.tail_light, tail)],
    )
}

/// A bollard of 0.9 m.
pub(super) fn bollard(workshop: &mut Workshop, m: &Materials) -> usize {
    let mut iron = Shape::new();
    let profile = [(0.1, 0.0), (0.1, 0.08), (0.07, 0.12), (0.06, 0.7), (0.08, 0.73), (0.08, 0.78), (0.05, 0.86)];
    iron.lathe(&profile, 14);
    iron.lathe(&[(0.05, 0.86), (0.0, 0.9)], 14);
    workshop.mesh("bollard", [(m.iron, iron)])
}

/// Number of bulbs per string.
pub(super) const BULBS: u32 = 9;

/// Positions of the bulbs of a string across the street, `span` wide, m; the origin is the midpoint between its ends.
pub(super) fn bulb_places(span: f32) -> impl Iterator<Item = Vec3> {
    (1..=BULBS).map(move |i| on_string(span, i as f32 / (BULBS + 1) as f32) - Vec3::Y * 0.09)
}

fn on_string(span: f32, t: f32) -> Vec3 {
    Vec3::new(0.0, -4.0 * t * (1.0 - t), span * (t - 0.5))
}

/// A string of bulbs along z.
pub(super) fn bulb_string(workshop: &mut Workshop, m: &Materials, span: f32) -> usize {
    let (mut wire, mut bulbs) = (Shape::new(), Shape::new());
    for i in 0..40 {
        wire.bar(on_string(span, i as f32 / 40.0), on_string(span, (i + 1) as f32 / 40.0), 0.008, 4);
    }
    for position in bulb_places(span) {
        bulbs.append_at(&sphere(0.06, 12, 6), position);
    }
    workshop.mesh("string of bulbs", [(m.iron, wire), (m.bulb, bulbs)])
}
