//! The two storeys around the court: arches, columns, vaults, balustrade, ceilings.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Vec2, Vec3};

use super::{BAY, COURT, FLOOR, Materials, OUTER, SPRING, UPPER_FLOOR, UPPER_SPRING, WALL_TOP};
use crate::generate::{
    build::Shape,
    surface::{Surface, Workshop},
};

/// A position on the line of columns or of bays, and the rotation about y, radians, from +z to the court.
type Spot = (Vec3, f32);

/// Centres of the bays of `width` along the rectangle of half size `half`; +z points inside.
pub(super) fn cells(half: Vec2, width: f32) -> Vec<Spot> {
    let mut spots = Vec::new();
    for (angle, length, distance) in
        [(PI, half.x, half.y), (0.0, half.x, half.y), (-FRAC_PI_2, half.y, half.x), (FRAC_PI_2, half.y, half.x)]
    {
        let count = (2.0 * length / width).round() as u32;
        for i in 0..count {
            // On the −z side, +z points inside without rotation.
            let along = (i as f32 + 0.5) * width - length;
            spots.push((glam::Quat::from_rotation_y(angle) * Vec3::new(along, 0.0, -distance), angle));
        }
    }
    spots
}

/// A wall panel of half width `half_width` from the springing (y = 0) to `top`, centred on z = 0, with a round-arched
/// opening. Without its bottom and ends, which touch capitals and other panels.
pub(super) fn arch_panel(half_width: f32, radius: f32, top: f32, thickness: f32, steps: u32) -> Shape {
    let corner = top.atan2(half_width);
    let mut angles: Vec<f32> = (0..=steps).map(|i| PI * i as f32 / steps as f32).collect();
    angles.extend([corner, PI - corner]);
    angles.sort_by(f32::total_cmp);
    let mut panel = Shape::new();
    let z = 0.5 * thickness;
    for pair in angles.windows(2) {
        let arc = [0, 1].map(|i| Vec2::from_angle(pair[i]));
        let border = arc.map(|d| d * (half_width / d.x.abs().max(1e-6)).min(top / d.y.abs().max(1e-6)));
        let [a, b] = arc.map(|d| radius * d);
        let [c, d] = border;
        panel.polygon(&[a.extend(z), c.extend(z), d.extend(z), b.extend(z)]);
        panel.polygon(&[b.extend(-z), d.extend(-z), c.extend(-z), a.extend(-z)]);
    }
    let at = |s: f32| radius * Vec2::from_angle(PI * s);
    let size = Vec2::new(PI * radius, thickness);
    panel.sheet(steps, 1, size, |s, t| at(s).extend(z - thickness * t));
    panel
}

/// Wedge stones `first`, `first + 2`, … of the `count` around an arch of `radius`, `depth` deep, standing `relief`
/// out of a panel of `thickness`; 1.5 cm into the opening, so that no faces coincide.
fn voussoirs(radius: f32, depth: f32, thickness: f32, relief: f32, count: u32, first: u32) -> Shape {
    let mut stones = Shape::new();
    let z = 0.5 * thickness + relief;
    for stone in (first..count).step_by(2) {
        let key = stone == count / 2;
        let (inner, outer) = (radius - 0.015 - 0.5 * relief, radius + depth + if key { 0.3 * depth } else { 0.0 });
        let z = if key { z + 0.03 } else { z };
        let [a, b] = [0, 1].map(|i| Vec2::from_angle(PI * (stone + i) as f32 / count as f32));
        let at = |side: Vec2, radius: f32, z: f32| (radius * side).extend(z);
        stones.polygon(&[at(a, inner, z), at(a, outer, z), at(b, outer, z), at(b, inner, z)]);
        stones.polygon(&[at(b, inner, -z), at(b, outer, -z), at(a, outer, -z), at(a, inner, -z)]);
        stones.polygon(&[at(b, inner, z), at(b, inner, -z), at(a, inner, -z), at(a, inner, z)]);
        stones.polygon(&[at(a, outer, z), at(a, outer, -z), at(b, outer, -z), at(b, outer, z)]);
        stones.polygon(&[at(a, inner, z), at(a, inner, -z), at(a, outer, -z), at(a, outer, z)]);
        stones.polygon(&[at(b, inner, -z), at(b, inner, z), at(b, outer, z), at(b, outer, -z)]);
    }
    stones
}

/// A groin vault: two crossing half cylinders of `radius` over a square, springing at y = 0, seen from below.
fn groin_vault(radius: f32) -> Shape {
    let mut web = Shape::new();
    let size = Vec2::new(PI * radius, radius);
    web.sheet(16, 1, size, |s, t| {
        let arc = radius * Vec2::from_angle(PI * s);
        Vec3::new(-arc.x, arc.y, arc.x.abs() + (radius - arc.x.abs()) * t)
    });
    let mut vault = Shape::new();
    for side in 0..4 {
        vault.append(&web, &glam::Affine3A::from_rotation_y(FRAC_PI_2 * side as f32));
    }
    vault
}

/// A column of the ground storey, 2.9 m: plinth, base, shaft with entasis, leaf capital, abacus.
fn column() -> Shape {
    let mut column = Shape::new();
    column.cuboid(Vec3::new(-0.36, 0.0, -0.36), Vec3::new(0.36, 0.12, 0.36), 0.015);
    let mut profile = vec![(0.36, 0.12)];
    torus(&mut profile, 0.315, 0.165, 0.045, 4);
    profile.extend([(0.30, 0.215), (0.285, 0.235), (0.285, 0.25), (0.30, 0.265)]);
    torus(&mut profile, 0.285, 0.30, 0.03, 3);
    profile.extend([(0.265, 0.335), (0.265, 0.36)]);
    for i in 0..=5 {
        // Entasis: straight at the foot, a little more than a quarter of a circle narrower at the neck.
        let t = i as f32 / 5.0;
        profile.push((0.25 - 0.045 * t * t, 0.38 + 1.87 * t));
    }
    torus(&mut profile, 0.215, 2.285, 0.022, 3);
    profile.push((0.20, 2.31));
    column.lathe(&profile, 16);
    // The bell of the capital, gathered to eight leaves that curl at their tips, in two tiers.
    for (bottom, top, flare, phase) in [(2.30, 2.54, 0.09, 0.0), (2.46, 2.78, 0.14, PI / 8.0)] {
        column.sheet(32, 4, Vec2::new(1.4, 0.4), |s, t| {
            let angle = TAU * s;
            let leaf = (0.5 + 0.5 * (8.0 * (angle + phase)).cos()).sqrt();
            let radius = 0.205 + 0.3 * (bottom - 2.30) + flare * t * t * (0.35 + 0.65 * leaf) + 0.02 * leaf;
            Vec3::new(
                radius * angle.cos(),
                bottom + (top - bottom) * t - 0.07 * t * t * t * leaf,
                -radius * angle.sin(),
            )
        });
    }
    column.cuboid(Vec3::new(-0.27, 2.66, -0.27), Vec3::new(0.27, 2.74, 0.27), 0.02);
    column.cuboid(Vec3::new(-0.34, 2.735, -0.34), Vec3::new(0.34, 2.925, 0.34), 0.03);
    column
}

/// Appends a half-round bulge around (radius, y) to a lathe profile.
fn torus(profile: &mut Vec<(f32, f32)>, radius: f32, y: f32, thickness: f32, steps: u32) {
    profile.extend((0..=steps).map(|i| {
        let (sin, cos) = (PI * i as f32 / steps as f32 - FRAC_PI_2).sin_cos();
        (radius + thickness * cos, y + thickness * sin)
    }));
}

/// A colonnette of the upper storey with its pedestal, 2.5 m: its shaft is a twist of four strands.
fn colonnette() -> Shape {
    let mut shape = pedestal();
    let mut base = vec![(0.165, 1.0), (0.165, 1.03)];
    torus(&mut base, 0.135, 1.06, 0.03, 3);
    base.push((0.115, 1.11));
    shape.lathe(&base, 12);
    shape.sheet(24, 7, Vec2::new(0.75, 1.1), |s, t| {
        let angle = TAU * s;
        let strand = (2.0 * (angle - 2.6 * t)).cos().abs();
        let radius = 0.088 + 0.022 * strand;
        Vec3::new(radius * angle.cos(), 1.10 + 1.08 * t, -radius * angle.sin())
    });
    let mut capital = vec![(0.10, 2.16)];
    torus(&mut capital, 0.115, 2.19, 0.018, 2);
    capital.extend([(0.115, 2.215), (0.125, 2.26), (0.15, 2.32), (0.185, 2.36), (0.185, 2.38)]);
    shape.lathe(&capital, 12);
    shape.cuboid(Vec3::new(-0.21, 2.37, -0.21), Vec3::new(0.21, 2.52, 0.21), 0.025);
    shape
}

/// A pedestal of the balustrade, 1 m.
fn pedestal() -> Shape {
    let mut shape = Shape::new();
    shape.cuboid(Vec3::new(-0.2, 0.0, -0.2), Vec3::new(0.2, 0.12, 0.2), 0.0);
    shape.cuboid(Vec3::new(-0.17, 0.11, -0.17), Vec3::new(0.17, 0.89, 0.17), 0.0);
    shape.cuboid(Vec3::new(-0.2, 0.88, -0.2), Vec3::new(0.2, 1.0, 0.2), 0.02);
    shape
}

/// A square pier with base and capital; `height` to its top.
fn pier(half: f32, height: f32) -> Shape {
    let mut shape = Shape::new();
    let mut block = |half: f32, from: f32, to: f32, bevel: f32| {
        shape.cuboid(Vec3::new(-half, from, -half), Vec3::new(half, to, half), bevel);
    };
    block(half + 0.05, 0.0, 0.22, 0.0);
    block(half, 0.21, height, 0.015);
    block(half + 0.03, 2.60, 2.68, 0.02);
    block(half + 0.05, 2.74, 2.93, 0.03);
    shape
}

/// Half a bay of balustrade between pedestals, 1.5 m from middle to middle.
fn balustrade() -> Shape {
    let mut shape = Shape::new();
    shape.cuboid(Vec3::new(-0.6, 0.0, -0.1), Vec3::new(0.6, 0.1, 0.1), 0.0);
    shape.cuboid(Vec3::new(-0.6, 0.87, -0.12), Vec3::new(0.6, 0.985, 0.12), 0.025);
    for i in 0..4 {
        shape.append_at(&baluster(), Vec3::new(0.28 * (i as f32 - 1.5), 0.09, 0.0));
    }
    shape
}

/// A turned baluster, 0.79 m.
pub(super) fn baluster() -> Shape {
    let profile = [(0.06, 0.0), (0.06, 0.05), (0.035, 0.10), (0.068, 0.22), (0.03, 0.52), (0.03, 0.64), (0.055, 0.79)];
    let mut shape = Shape::new();
    shape.lathe(&profile, 7);
    shape
}

/// The ground storey: columns, arches, ribs and vaults.
pub(super) fn ground_storey(workshop: &mut Workshop, materials: &Materials) {
    let top = UPPER_FLOOR - SPRING - 0.02;
    let panel = workshop.mesh("arch", [(materials.ashlar, arch_panel(1.5, 1.2, top, 0.5, 18))]);
    let ring = workshop.mesh(
        "voussoirs",
        [
            (materials.red_stone, voussoirs(1.2, 0.27, 0.5, 0.02, 17, 1)),
            (materials.limestone, voussoirs(1.2, 0.27, 0.5, 0.035, 17, 0)),
        ],
    );
    let vault = workshop.mesh("groin vault", [(materials.plaster, groin_vault(1.25))]);
    let column = workshop.mesh("column", [(materials.limestone, column())]);
    let corner = workshop.mesh("pier", [(materials.limestone, pier(0.31, UPPER_FLOOR - FLOOR - 0.03))]);
    let pilaster = workshop.mesh("pilaster", [(materials.limestone, pier(0.26, SPRING - FLOOR))]);
    let medallion = workshop.mesh("medallion", medallion(materials));

    let up = Vec3::new(0.0, SPRING, 0.0);
    for (position, angle) in cells(COURT, BAY) {
        workshop.place_at(panel, position + up, angle);
        workshop.place_at(ring, position + up, angle);
    }
    // Blind arches on the outer wall, half sunk into it, and ribs across the walk.
    for (position, angle) in cells(OUTER, BAY) {
        workshop.place_at(panel, position + up, angle);
    }
    let middle = 0.5 * (COURT + OUTER);
    for (position, angle) in cells(middle, BAY) {
        workshop.place_at(vault, position + up, angle);
    }
    for (sx, sz) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        workshop.place_at(vault, Vec3::new(sx * middle.x, SPRING, sz * middle.y), 0.0);
        workshop.place_at(corner, Vec3::new(sx * COURT.x, FLOOR, sz * COURT.y), 0.0);
        workshop.place_at(corner, Vec3::new(sx * OUTER.x, FLOOR, sz * OUTER.y), 0.0);
    }
    for (index, side) in [-1.0f32, 1.0].into_iter().enumerate() {
        let inward = if index == 0 { 0.0 } else { PI };
        for i in 0..=6 {
            let x = BAY * i as f32 - COURT.x;
            workshop.place_at(panel, Vec3::new(x, SPRING, side * middle.y), FRAC_PI_2);
            workshop.place_at(pilaster, Vec3::new(x, FLOOR, side * OUTER.y), 0.0);
            if (1..6).contains(&i) {
                workshop.place_at(column, Vec3::new(x, FLOOR, side * COURT.y), 0.0);
                workshop.place_at(medallion, Vec3::new(x, SPRING + 1.0, side * (COURT.y - 0.25)), inward);
            }
        }
        for i in 0..=3 {
            let z = BAY * i as f32 - COURT.y;
            workshop.place_at(panel, Vec3::new(side * middle.x, SPRING, z), 0.0);
            workshop.place_at(pilaster, Vec3::new(side * OUTER.x, FLOOR, z), 0.0);
            if (1..3).contains(&i) {
                workshop.place_at(column, Vec3::new(side * COURT.x, FLOOR, z), 0.0);
                let angle = -side * FRAC_PI_2;
                workshop.place_at(medallion, Vec3::new(side * (COURT.x - 0.25), SPRING + 1.0, z), angle);
            }
        }
    }
}

/// A round frame with a painted dish, facing +z; its back lies in z = 0.
fn medallion(materials: &Materials) -> [(Surface, Shape); 2] {
    let upright = glam::Affine3A::from_rotation_x(FRAC_PI_2);
    let (mut frame, mut dish, mut turned) = (Shape::new(), Shape::new(), Shape::new());
    frame.lathe(&[(0.27, -0.01), (0.27, 0.03), (0.25, 0.05), (0.22, 0.05), (0.20, 0.02)], 18);
    turned.append(&frame, &upright);
    let mut disc = Shape::new();
    disc.lathe(&[(0.205, 0.02), (0.16, 0.035), (0.0, 0.06)], 18);
    dish.append(&disc, &upright);
    // A planar texture projection, one tile across.
    for (uv, p) in dish.uv.iter_mut().zip(&dish.positions) {
        *uv = Vec2::new(p.x, -p.y) * (0.3 / 0.41) + 0.15;
    }
    [(materials.limestone, turned), (materials.painted_tiles, dish)]
}

/// The upper storey: colonnettes, small arches, balustrade, and the portal at the head of the stairs (−x).
pub(super) fn upper_storey(workshop: &mut Workshop, materials: &Materials) {
    let half_bay = 0.5 * BAY;
    let top = WALL_TOP - UPPER_SPRING;
    let panel = workshop.mesh("small arch", [(materials.ashlar, arch_panel(0.75, 0.57, top, 0.36, 14))]);
    let ring = workshop.mesh(
        "small voussoirs",
        [
            (materials.red_stone, voussoirs(0.57, 0.16, 0.36, 0.015, 9, 1)),
            (materials.limestone, voussoirs(0.57, 0.16, 0.36, 0.025, 9, 0)),
        ],
    );
    let portal = workshop.mesh(
        "portal",
        [
            (materials.ashlar, arch_panel(1.5, 1.2, WALL_TOP - 6.9, 0.36, 24)),
            (materials.red_stone, voussoirs(1.2, 0.15, 0.36, 0.02, 21, 1)),
            (materials.limestone, voussoirs(1.2, 0.15, 0.36, 0.035, 21, 0)),
            (materials.limestone, portal_jambs()),
        ],
    );
    let colonnette = workshop.mesh("colonnette", [(materials.limestone, colonnette())]);
    let rail = workshop.mesh("balustrade", [(materials.limestone, balustrade())]);
    let corner = {
        let mut shape = pedestal();
        shape.cuboid(Vec3::new(-0.25, 0.98, -0.25), Vec3::new(0.25, WALL_TOP - UPPER_FLOOR, 0.25), 0.015);
        workshop.mesh("upper pier", [(materials.limestone, shape)])
    };

    let floor = Vec3::new(0.0, UPPER_FLOOR, 0.0);
    workshop.place_at(portal, Vec3::new(-COURT.x, 6.9, 0.0), FRAC_PI_2);
    for (position, angle) in cells(COURT, half_bay) {
        if position.x < -COURT.x + 0.1 && position.z.abs() < half_bay {
            continue;
        }
        let up = Vec3::new(0.0, UPPER_SPRING, 0.0);
        workshop.place_at(panel, position + up, angle);
        workshop.place_at(ring, position + up, angle);
        workshop.place_at(rail, position + floor, angle);
    }
    for side in [-1.0f32, 1.0] {
        for i in 1..12 {
            workshop.place_at(colonnette, floor + Vec3::new(half_bay * i as f32 - COURT.x, 0.0, side * COURT.y), 0.0);
        }
        for i in 1..6 {
            let z = half_bay * i as f32 - COURT.y;
            if side > 0.0 || z.abs() > half_bay + 0.1 {
                workshop.place_at(colonnette, floor + Vec3::new(side * COURT.x, 0.0, z), 0.0);
            }
        }
        for end in [-1.0f32, 1.0] {
            workshop.place_at(corner, floor + Vec3::new(side * COURT.x, 0.0, end * COURT.y), 0.0);
        }
    }
}

/// The jambs of the portal's arch; y = 0 is its springing, the floor 1.9 m below.
fn portal_jambs() -> Shape {
    let mut shape = Shape::new();
    for side in [-1.0f32, 1.0] {
        let mut block = |half_x: f32, half_z: f32, from: f32, to: f32, bevel: f32| {
            let center = Vec3::X * side * 1.47;
            shape.cuboid(center + Vec3::new(-half_x, from, -half_z), center + Vec3::new(half_x, to, half_z), bevel);
        };
        block(0.30, 0.26, -1.9, -1.7, 0.02);
        block(0.26, 0.22, -1.71, -0.1, 0.015);
        block(0.30, 0.26, -0.15, 0.02, 0.03);
        let (inner, outer) = (side * 1.40, side * 1.70);
        let (from, to) = (Vec3::new(inner.min(outer), 0.0, -0.19), Vec3::new(inner.max(outer), 0.62, 0.19));
        shape.cuboid(from, to, 0.0);
    }
    shape
}
