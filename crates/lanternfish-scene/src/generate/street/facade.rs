//! Houses, composed of bays: a module is centred on x = 0, its wall faces +z at z = 0, and it stands on y = 0.

use std::f32::consts::PI;

use glam::{Affine3A, Vec2, Vec3};

use super::Materials;
use crate::{
    Light,
    generate::{
        build::Shape,
        hash::{hash, unit},
        surface::{Surface, Workshop},
    },
};

/// Width of a bay, m.
const BAY: f32 = 2.4;
/// Bays per house.
const BAYS: u32 = 5;
/// Width of a house, m.
pub(super) const HOUSE: f32 = BAY * BAYS as f32;
/// Height of the ground storey, m.
const SHOP: f32 = 4.2;
/// Height of a storey above it, m.
const STOREY: f32 = 3.4;
/// Depth of a house behind its façade, m.
const DEPTH: f32 = 9.0;

/// The modules' meshes.
pub(super) struct Modules {
    /// By wall: dark and lit.
    bays: Vec<[usize; 2]>,
    balcony: usize,
    /// By wall and colour of the window.
    shops: Vec<[usize; 3]>,
    /// By wall.
    doors: Vec<usize>,
    cornice: usize,
    roof: usize,
    /// By wall: a box of 1 m, to be scaled.
    bodies: Vec<usize>,
}

impl Modules {
    /// Adds the meshes.
    pub fn new(workshop: &mut Workshop, m: &Materials) -> Self {
        let bay = |workshop: &mut Workshop, wall: Surface, thin_dielectric: Surface| {
            let (mut trim, mut frame, mut glass) = (Shape::new(), Shape::new(), Shape::new());
            let face = panel(STOREY, Vec2::new(1.2, 1.8), 0.9);
            surround(&mut trim);
            window(&mut frame, &mut glass);
            workshop.mesh("bay", [(wall, face), (m.trim, trim), (m.wood, frame), (thin_dielectric, glass)])
        };
        let shop = |workshop: &mut Workshop, wall: Surface, window: Surface| {
            let mut parts = shop();
            let face = panel(SHOP, Vec2::new(2.0, 2.5), 0.6);
            let [frame, glass, awning] = std::array::from_fn(|i| std::mem::take(&mut parts[i]));
            workshop.mesh("shop", [(wall, face), (m.wood, frame), (window, glass), (m.awning, awning)])
        };
        let door = |workshop: &mut Workshop, wall: Surface| {
            let [stone, leaf, iron] = door();
            let face = panel(SHOP, Vec2::new(1.3, 2.7), 0.15);
            workshop.mesh("door", [(wall, face), (m.trim, stone), (m.wood, leaf), (m.iron, iron)])
        };
        let mut unit_box = Shape::new();
        unit_box.cuboid(Vec3::new(-0.5, 0.0, -1.0), Vec3::new(0.5, 1.0, 0.0), 0.0);
        let [floor, iron] = balcony();
        let [slate, chimney] = roof();
        Self {
            bays: m
                .walls
                .map(|wall| {
                    [m.thin_dielectric, m.lit_thin_dielectric]
                        .map(|thin_dielectric| bay(workshop, wall, thin_dielectric))
                })
                .to_vec(),
            balcony: workshop.mesh("balcony", [(m.trim, floor), (m.iron, iron)]),
            shops: m.walls.map(|wall| m.shop_windows.map(|window| shop(workshop, wall, window))).to_vec(),
            doors: m.walls.map(|wall| door(workshop, wall)).to_vec(),
            cornice: workshop.mesh("cornice", [(m.trim, cornice())]),
            roof: workshop.mesh("roof", [(m.roof, slate), (m.walls[2], chimney)]),
            bodies: m.walls.map(|wall| workshop.mesh("house", [(wall, unit_box.clone())])).to_vec(),
        }
    }

    /// Places house `number` with its lights; `world_from_house` takes the middle of its foot to the world.
    pub fn place_house(&self, workshop: &mut Workshop, number: u32, world_from_house: Affine3A) {
        let wall = hash(&[number, 1]) as usize % self.bays.len();
        let storeys = 3 + hash(&[number, 2]) % 3;
        let has_balconies = !hash(&[number, 3]).is_multiple_of(3);
        let mut put = |mesh: usize, at: Vec3| workshop.place(mesh, world_from_house * Affine3A::from_translation(at));
        let mut lights = Vec::new();
        let x_of = |bay: u32| BAY * (bay as f32 - 0.5 * (BAYS - 1) as f32);
        let door = 1 + hash(&[number, 4]) % (BAYS - 2);
        for bay in 0..BAYS {
            let x = x_of(bay);
            if bay == door {
                put(self.doors[wall], Vec3::X * x);
                for side in [-0.95, 0.95] {
                    lights.push(("door lantern", Vec3::new(x + side, 2.45, 0.42), Vec3::new(3.0, 2.0, 1.0)));
                }
                continue;
            }
            let color = hash(&[number, if bay < door { 5 } else { 6 }]) as usize % 3;
            put(self.shops[wall][color], Vec3::X * x);
            let tint = [Vec3::new(1.0, 0.66, 0.32), Vec3::new(0.55, 0.78, 1.0), Vec3::new(1.0, 0.28, 0.56)][color];
            lights.push(("shop window", Vec3::new(x, 2.2, 0.55), 5.0 * tint));
        }
        for storey in 0..storeys {
            let y = SHOP + STOREY * storey as f32;
            for bay in 0..BAYS {
                let lit = usize::from(unit(&[number, storey, bay]) < 0.3);
                put(self.bays[wall][lit], Vec3::new(x_of(bay), y, 0.0));
                if has_balconies && storey < 3 && (bay + storey) % 2 == 1 {
                    put(self.balcony, Vec3::new(x_of(bay), y, 0.0));
                }
            }
        }
        let top = SHOP + STOREY * storeys as f32;
        put(self.cornice, Vec3::Y * top);
        put(self.roof, Vec3::Y * (top + 0.62));
        // Behind the reveals, 0.3 m deep, so that no faces coincide.
        let stretch = Affine3A::from_scale(Vec3::new(HOUSE - 0.02, top + 0.6, DEPTH - 0.3));
        workshop.place(self.bodies[wall], world_from_house * Affine3A::from_translation(Vec3::Z * -0.3) * stretch);
        for (name, position, intensity) in lights {
            let light = Light::point(world_from_house.transform_point3(position), intensity);
            // The illuminance at the range is about 0.1 lx: each of a few hundred lamps reaches only a small part of the street.
            workshop.scene.lights.push(Light { name: name.to_owned(), range: Some(7.0), ..light });
        }
    }
}

/// A wall of one bay, `height` high, with an opening of size `opening` above `sill`, and reveals 0.25 m deep (all in m).
fn panel(height: f32, opening: Vec2, sill: f32) -> Shape {
    let (x, half) = (0.5 * BAY, 0.5 * opening.x);
    let (low, high, back) = (sill, sill + opening.y, -0.25);
    let mut shape = Shape::new();
    let mut face = |x0: f32, x1: f32, y0: f32, y1: f32| {
        shape.polygon(&[[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| Vec3::new(x, y, 0.0)));
    };
    face(-x, x, 0.0, low);
    face(-x, -half, low, high);
    face(half, x, low, high);
    face(-x, x, high, height);
    // The reveals face the opening's middle.
    let corners = [[-half, low], [half, low], [half, high], [-half, high]];
    for i in 0..4 {
        let [a, b] = [corners[i], corners[(i + 1) % 4]];
        let at = |[x, y]: [f32; 2], z: f32| Vec3::new(x, y, z);
        shape.polygon(&[at(a, 0.0), at(b, 0.0), at(b, back), at(a, back)]);
    }
    shape
}

/// Stone around a window of 1.2 × 1.8 m at 0.9 m, and the string course above it.
fn surround(trim: &mut Shape) {
    // 2 cm into the opening, so that no faces coincide with the reveals.
    for side in [-1.0f32, 1.0] {
        let (inner, outer) = (side * 0.58, side * 0.74);
        let (from, to) = (inner.min(outer), inner.max(outer));
        trim.cuboid(Vec3::new(from, 0.94, -0.05), Vec3::new(to, 2.7, 0.06), 0.015);
        // A console under the sill, and one under the hood.
        trim.cuboid(Vec3::new(from, 0.62, -0.02), Vec3::new(to, 0.84, 0.13), 0.03);
        trim.cuboid(Vec3::new(from, 2.72, -0.02), Vec3::new(to, 2.92, 0.12), 0.0);
    }
    trim.cuboid(Vec3::new(-0.85, 0.82, -0.1), Vec3::new(0.85, 0.95, 0.2), 0.02);
    trim.cuboid(Vec3::new(-0.58, 2.68, -0.05), Vec3::new(0.58, 2.86, 0.05), 0.0);
    trim.cuboid(Vec3::new(-0.11, 2.64, -0.03), Vec3::new(0.11, 2.93, 0.1), 0.02);
    trim.cuboid(Vec3::new(-0.9, 2.9, -0.02), Vec3::new(0.9, 3.02, 0.24), 0.02);
    trim.cuboid(Vec3::new(-0.5 * BAY, STOREY - 0.16, -0.02), Vec3::new(0.5 * BAY, STOREY - 0.02, 0.09), 0.0);
}

/// Two casements with glazing bars and glass.
fn window(frame: &mut Shape, glass: &mut Shape) {
    let mut bar = |x0: f32, x1: f32, y0: f32, y1: f32, z: f32| {
        frame.cuboid(Vec3::new(x0, y0, -0.24), Vec3::new(x1, y1, z), 0.0);
    };
    bar(-0.61, -0.53, 0.89, 2.71, -0.16);
    bar(0.53, 0.61, 0.89, 2.71, -0.16);
    bar(-0.54, 0.54, 0.89, 0.99, -0.165);
    bar(-0.54, 0.54, 2.62, 2.71, -0.165);
    bar(-0.045, 0.045, 0.98, 2.63, -0.15);
    for y in [1.5, 2.1] {
        bar(-0.54, -0.04, y, y + 0.035, -0.18);
        bar(0.04, 0.54, y, y + 0.035, -0.18);
    }
    glass.polygon(&[[-0.6, 0.9], [0.6, 0.9], [0.6, 2.7], [-0.6, 2.7]].map(|[x, y]| Vec3::new(x, y, -0.21)));
}

/// A balcony before a window: the floor with consoles, and the iron railing.
fn balcony() -> [Shape; 2] {
    let (mut floor, mut iron) = (Shape::new(), Shape::new());
    floor.cuboid(Vec3::new(-1.05, 0.02, 0.0), Vec3::new(1.05, 0.16, 0.85), 0.03);
    for x in [-0.8, 0.0, 0.8] {
        floor.cuboid(Vec3::new(x - 0.09, -0.38, -0.02), Vec3::new(x + 0.09, -0.16, 0.30), 0.04);
        floor.cuboid(Vec3::new(x - 0.09, -0.2, -0.02), Vec3::new(x + 0.09, 0.04, 0.62), 0.04);
    }
    let mut baluster = Shape::new();
    baluster.lathe(&[(0.014, 0.0), (0.03, 0.4), (0.014, 0.84)], 5);
    let rail = |iron: &mut Shape, y: f32| {
        let [a, b, c, d] = [[-1.0, 0.0], [-1.0, 0.8], [1.0, 0.8], [1.0, 0.0]].map(|[x, z]| Vec3::new(x, y, z));
        iron.bar(a, b, 0.025, 6).bar(b, c, 0.025, 6).bar(c, d, 0.025, 6);
    };
    rail(&mut iron, 0.24);
    rail(&mut iron, 1.0);
    for i in 0..17 {
        iron.append_at(&baluster, Vec3::new(0.125 * (i as f32 - 8.0), 0.15, 0.8));
    }
    for i in 1..6 {
        for x in [-1.0, 1.0] {
            iron.append_at(&baluster, Vec3::new(x, 0.15, 0.8 - 0.135 * i as f32));
        }
    }
    [floor, iron]
}

/// Frame, window and awning of a shop.
fn shop() -> [Shape; 3] {
    let (mut frame, mut glass, mut awning) = (Shape::new(), Shape::new(), Shape::new());
    let mut bar = |x0: f32, x1: f32, y0: f32, y1: f32, z: f32| {
        frame.cuboid(Vec3::new(x0, y0, -0.24), Vec3::new(x1, y1, z), 0.015);
    };
    bar(-1.02, -0.92, 0.58, 3.12, 0.04);
    bar(0.92, 1.02, 0.58, 3.12, 0.04);
    bar(-0.93, 0.93, 0.58, 0.72, 0.05);
    bar(-0.93, 0.93, 3.0, 3.12, 0.03);
    bar(-0.03, 0.03, 0.71, 2.55, -0.1);
    bar(-0.93, 0.93, 2.5, 2.58, -0.08);
    glass.polygon(&[[-1.0, 0.6], [1.0, 0.6], [1.0, 3.1], [-1.0, 3.1]].map(|[x, y]| Vec3::new(x, y, -0.2)));
    awning.sheet(16, 6, Vec2::new(2.2, 1.3), |s, t| {
        let scallop = if t < 0.01 { 0.05 * (8.0 * PI * s).sin().abs() } else { 0.0 };
        let drop = if t < 0.17 { 0.2 * (1.0 - t / 0.17) } else { 0.0 };
        Vec3::new(2.2 * (s - 0.5), 2.95 + 0.55 * t - drop - scallop, 0.06 + 1.05 * (1.0 - t.max(0.17)))
    });
    [frame, glass, awning]
}

/// Steps and surround, leaf, and lanterns of a door.
fn door() -> [Shape; 3] {
    let (mut stone, mut leaf, mut iron) = (Shape::new(), Shape::new(), Shape::new());
    stone.cuboid(Vec3::new(-0.9, 0.0, -0.2), Vec3::new(0.9, 0.15, 0.5), 0.02);
    for side in [-1.0f32, 1.0] {
        let (from, to) = ((side * 0.63).min(side * 0.83), (side * 0.63).max(side * 0.83));
        stone.cuboid(Vec3::new(from, 0.14, -0.05), Vec3::new(to, 2.85, 0.1), 0.02);
        let x = side * 0.95;
        iron.bar(Vec3::new(x, 2.75, -0.02), Vec3::new(x, 2.75, 0.3), 0.02, 6);
        let mut lantern = Shape::new();
        lantern.lathe(&[(0.0, 0.0), (0.06, 0.02), (0.09, 0.25), (0.11, 0.26), (0.03, 0.36), (0.0, 0.37)], 8);
        iron.append_at(&lantern, Vec3::new(x, 2.5, 0.3));
        for row in 0..3 {
            let (x, y) = (side * 0.3, 0.3 + 0.8 * row as f32);
            leaf.cuboid(Vec3::new(x - 0.22, y, -0.2), Vec3::new(x + 0.22, y + 0.66, -0.14), 0.02);
        }
    }
    stone.cuboid(Vec3::new(-0.95, 2.83, -0.05), Vec3::new(0.95, 3.05, 0.2), 0.03);
    leaf.cuboid(Vec3::new(-0.64, 0.16, -0.24), Vec3::new(0.64, 2.84, -0.17), 0.0);
    [stone, leaf, iron]
}

/// The cornice of a house with its dentils, 0.6 m high.
fn cornice() -> Shape {
    let mut shape = Shape::new();
    let half = 0.5 * HOUSE;
    for (low, high, reach) in [(0.0, 0.16, 0.08), (0.3, 0.42, 0.3), (0.42, 0.6, 0.42)] {
        shape.cuboid(Vec3::new(-half, low, -0.29), Vec3::new(half, high, reach), 0.0);
    }
    shape.cuboid(Vec3::new(-half, 0.15, -0.29), Vec3::new(half, 0.31, 0.05), 0.0);
    for i in 0..40 {
        let x = HOUSE * ((i as f32 + 0.5) / 40.0 - 0.5);
        shape.cuboid(Vec3::new(x - 0.08, 0.14, 0.0), Vec3::new(x + 0.08, 0.32, 0.22), 0.0);
    }
    shape
}

/// A mansard with chimneys: slates, bricks.
fn roof() -> [Shape; 2] {
    let (mut slate, mut chimney) = (Shape::new(), Shape::new());
    let half = 0.5 * HOUSE;
    let profile = [(0.1, 0.0), (-1.0, 2.4), (-4.5, 3.4), (-8.0, 2.4), (-DEPTH, 0.0)];
    for ends in profile.windows(2) {
        let [(z0, y0), (z1, y1)] = [ends[0], ends[1]];
        slate.polygon(&[[-half, y0, z0], [half, y0, z0], [half, y1, z1], [-half, y1, z1]].map(Vec3::from));
    }
    for side in [1.0f32, -1.0] {
        let mut gable = profile.map(|(z, y)| Vec3::new(side * half, y, z));
        if side > 0.0 {
            gable.reverse();
        }
        slate.polygon(&gable);
    }
    for (x, z) in [(-4.6, -3.0), (4.2, -5.5)] {
        chimney.cuboid(Vec3::new(x - 0.4, 2.0, z - 0.7), Vec3::new(x + 0.4, 4.6, z + 0.7), 0.02);
        for pot in 0..3 {
            let mut pipe = Shape::new();
            pipe.lathe(&[(0.14, 0.0), (0.11, 0.5), (0.14, 0.52), (0.14, 0.58), (0.1, 0.58)], 10);
            chimney.append_at(&pipe, Vec3::new(x, 4.58, z + 0.42 * (pot as f32 - 1.0)));
        }
    }
    [slate, chimney]
}
