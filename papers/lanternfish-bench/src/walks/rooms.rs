//! Two closed rooms beside each other: a lamp in the left one, none in the right one.

use glam::{Affine3A, Vec3, Vec4};
use lanternfish_scene::{Camera, Instance, Light, Material, Mesh, Primitive, Projection, Scene};

/// Half the width of both rooms together, and their height and depth, m. The front is at z = 0, the floor at y = 0.
const HALF_WIDTH: f32 = 2.0;
const HEIGHT: f32 = 2.0;
const DEPTH: f32 = 2.0;
/// Thickness of the outer walls, m.
const OUTER: f32 = 0.1;
/// The eye: in front of the front wall, and to the right, so that it sees the dark side of the dividing wall.
const EYE: Vec3 = Vec3::new(0.4, 1.0, 3.0);
/// The near plane's distance behind the front, m: the view cuts the front wall away, and the rooms stay closed.
const CUT: f32 = 0.05;
/// Slope of the view's right side. All of the near plane is inside the rooms: 1.5 m to either side of the eye.
const SLOPE: f32 = 1.5 / (EYE.z + CUT);

/// A box with six quads that face outwards.
fn cuboid(min: Vec3, max: Vec3, material: usize) -> Primitive {
    let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
    let mut primitive = Primitive { material, ..Primitive::default() };
    for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
        // right × up = axis.
        let (right, up) = axis.any_orthonormal_pair();
        let first = primitive.positions.len() as u32;
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            primitive.positions.push(center + half * (axis + x * right + y * up));
            primitive.normals.push(axis);
        }
        primitive.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    primitive
}

/// A matte grey material.
fn grey() -> Material {
    Material { base_color: Vec4::new(0.7, 0.7, 0.7, 1.0), metallic: 0.0, specular: 0.0, ..Material::default() }
}

/// The rooms, with a dividing wall of this thickness that ends this far behind the front, m.
pub fn rooms(thickness: f32, gap: f32) -> Scene {
    let (w, h, d, o) = (HALF_WIDTH, HEIGHT, DEPTH, OUTER);
    let boxes = [
        ([-w - o, -o, -d - o], [w + o, 0.0, o]),
        ([-w - o, h, -d - o], [w + o, h + o, o]),
        ([-w - o, 0.0, -d - o], [-w, h, o]),
        ([w, 0.0, -d - o], [w + o, h, o]),
        ([-w, 0.0, -d - o], [w, h, -d]),
        ([-w, 0.0, 0.0], [w, h, o]),
        ([-0.5 * thickness, 0.0, -d], [0.5 * thickness, h, -gap]),
    ];
    let primitives = boxes.map(|(min, max)| cuboid(min.into(), max.into(), 0)).to_vec();
    let projection = Projection::Frustum { left: -SLOPE, right: SLOPE, bottom: -0.3, top: 0.3, near: EYE.z + CUT };
    Scene {
        name: format!("rooms-{thickness}-{gap}"),
        materials: vec![grey()],
        meshes: vec![Mesh { name: String::new(), primitives }],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::IDENTITY }],
        lights: vec![Light::point(Vec3::new(-1.2, 1.5, -0.8), Vec3::splat(5.0))],
        cameras: vec![Camera::look_at(EYE, EYE - Vec3::Z, projection)],
        ..Scene::default()
    }
}

/// Columns of an image of this width that show the lit room alone: up to the first; and the dark room alone: from the second.
pub fn columns(thickness: f32, width: u32) -> [u32; 2] {
    let column = |x: f32| ((x - EYE.x) / (EYE.z + CUT) / SLOPE * 0.5 + 0.5) * width as f32;
    [column(-0.5 * thickness).floor() as u32, column(0.5 * thickness).ceil() as u32]
}

#[cfg(test)]
mod tests {
    use lanternfish_reference::{Settings, Tracer};

    use super::*;

    #[test]
    fn boxes_face_outwards() {
        let primitive = cuboid(Vec3::ZERO, Vec3::ONE, 0);
        for triangle in primitive.indices.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|i| primitive.positions[i as usize]);
            let outwards = (a + b + c) / 3.0 - Vec3::splat(0.5);
            assert!((b - a).cross(c - a).dot(outwards) > 0.0, "{a} {b} {c}");
        }
    }

    /// From the dark room every ray to the lamp is blocked, unless there is a gap.
    #[test]
    fn the_rooms_are_closed() {
        for (thickness, gap) in [(0.5, 0.0), (0.01, 0.0), (0.01, 0.3)] {
            let scene = rooms(thickness, gap);
            scene.validate().unwrap();
            let tracer = Tracer::new(&scene, Settings::default()).unwrap();
            let lamp = scene.lights[0].position;
            let lit = |i: u32| {
                let p = Vec3::new(
                    0.3 + 0.016 * (i % 100) as f32,
                    0.1 + 0.3 * (i / 100 % 6) as f32,
                    -0.1 - 0.3 * (i / 600) as f32,
                );
                let to = lamp - p;
                tracer.nearest(p.into(), to.normalize().into()).is_none_or(|distance| distance > to.length())
            };
            assert_eq!((0..3600).any(lit), gap > 0.0, "{thickness} {gap}");
        }
        let [left, right] = columns(0.5, 100);
        assert!(left < right && left > 20 && right < 50, "{left} {right}");
    }
}
