//! The Cornell box.

use glam::{Vec2, Vec3};

use super::{
    build::Shape,
    surface::{Finish, Workshop},
};
use crate::{Camera, Light, Projection, Scene};

/// Metres per published millimetre: the published box is 548.8 mm high and becomes 2 m.
const SCALE: f32 = 2.0 / 548.8;

/// The Cornell box with the published measurements, 2 m high: floor at y = 0, centred in x and z, open to +z. The
/// lamp is an emissive quad in the ceiling. A point light just below it is for renderers that only support punctual
/// lights.
pub(super) fn cornell() -> Scene {
    let mut workshop = Workshop { scene: Scene { name: "cornell".to_owned(), ..Scene::default() } };
    let white = workshop.surface(Finish::new("white", [0.73, 0.73, 0.73], 1.0));
    let red = workshop.surface(Finish::new("red", [0.63, 0.065, 0.05], 1.0));
    let green = workshop.surface(Finish::new("green", [0.14, 0.45, 0.091], 1.0));
    let lamp = workshop.surface(Finish { emissive: Vec3::new(17.0, 12.0, 4.0), ..Finish::new("lamp", [0.78; 3], 1.0) });

    // 1 m either way: the published box is 549.6 to 556.0 mm wide, less than 1 % more than it is high.
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, 1.0 + y, z);
    let mut walls = Shape::new();
    walls.polygon(&[corner(-1., -1., 1.), corner(1., -1., 1.), corner(1., -1., -1.), corner(-1., -1., -1.)]);
    walls.polygon(&[corner(-1., 1., -1.), corner(1., 1., -1.), corner(1., 1., 1.), corner(-1., 1., 1.)]);
    walls.polygon(&[corner(-1., -1., -1.), corner(1., -1., -1.), corner(1., 1., -1.), corner(-1., 1., -1.)]);
    workshop.add("floor, ceiling, back", white, walls);
    let mut left = Shape::new();
    left.polygon(&[corner(-1., -1., 1.), corner(-1., -1., -1.), corner(-1., 1., -1.), corner(-1., 1., 1.)]);
    workshop.add("left", red, left);
    let mut right = Shape::new();
    right.polygon(&[corner(1., -1., -1.), corner(1., -1., 1.), corner(1., 1., 1.), corner(1., 1., -1.)]);
    workshop.add("right", green, right);

    // The published blocks: corners of their tops, x from the right wall, z from the front, mm.
    let short = [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]];
    let tall = [[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]];
    workshop.add("short block", white, block(short, 165.0));
    workshop.add("tall block", white, block(tall, 330.0));

    // The published lamp: x 213 to 343, z 227 to 332 mm; 1 mm below the ceiling, so that they do not coincide.
    let [a, b] = [world([213.0, 227.0]), world([343.0, 332.0])];
    let y = 2.0 - 1e-3;
    let mut quad = Shape::new();
    quad.polygon(&[Vec3::new(b.x, y, b.y), Vec3::new(a.x, y, b.y), Vec3::new(a.x, y, a.y), Vec3::new(b.x, y, a.y)]);
    workshop.add("lamp", lamp, quad);

    let mut scene = workshop.scene;
    // 3.5 cd at 2 m: the floor's centre has 0.9 lx and reflects 0.2 nits; the walls, which are nearer, up to 1 nit.
    let position = Vec3::new(0.5 * (a.x + b.x), 1.95, 0.5 * (a.y + b.y));
    scene.lights.push(Light { name: "lamp".to_owned(), ..Light::point(position, Vec3::new(4.6, 3.4, 1.8)) });
    let projection = Projection::Perspective { fov_y: 36f32.to_radians(), near: 0.01 };
    let camera = Camera::look_at(Vec3::new(0.0, 1.0, 4.2), Vec3::Y, projection);
    scene.cameras.push(Camera { name: "front".to_owned(), ..camera });
    scene
}

/// Converts a published position (x from the right wall, z from the front), mm, to world (x, z), m.
fn world([x, z]: [f32; 2]) -> Vec2 {
    Vec2::new(1.0 - SCALE * x, 1.0 - SCALE * z)
}

/// A block with the given top corners and published height, mm. It stands on the floor and has no bottom face.
fn block(corners: [[f32; 2]; 4], height: f32) -> Shape {
    let mut corners = corners.map(world);
    // Counter-clockwise seen from above is clockwise in (x, z).
    let area: f32 = (0..4).map(|i| corners[i].perp_dot(corners[(i + 1) % 4])).sum();
    if area > 0.0 {
        corners.reverse();
    }
    let at = |i: usize, y: f32| Vec3::new(corners[i % 4].x, y, corners[i % 4].y);
    let top = SCALE * height;
    let mut block = Shape::new();
    block.polygon(&[at(0, top), at(1, top), at(2, top), at(3, top)]);
    for i in 0..4 {
        block.polygon(&[at(i, 0.0), at(i + 1, 0.0), at(i + 1, top), at(i, top)]);
    }
    block
}
