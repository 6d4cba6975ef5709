//! Scenes that differ in one thing: in their number of triangles, or in how far rays go.

use std::ops::{Add, Mul};

use glam::{Affine3A, Vec3};
use lanternfish_scene::{Instance, Material, Mesh, Primitive, Scene};

/// The same surfaces with twice the triangles: each is cut from the middle of its longest edge to the opposite corner.
pub fn bisected(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives).for_each(bisect);
    scene
}

fn bisect(primitive: &mut Primitive) {
    let triangles = primitive.indices.as_chunks::<3>().0.to_vec();
    primitive.deformation = None;
    primitive.indices.clear();
    for [a, b, c] in triangles {
        let square =
            |from: u32, to: u32| primitive.positions[from as usize].distance_squared(primitive.positions[to as usize]);
        // Turned, so that the longest edge is the first.
        let turned = [[a, b, c], [b, c, a], [c, a, b]];
        let [from, to, opposite] =
            turned.into_iter().max_by(|x, y| square(x[0], x[1]).total_cmp(&square(y[0], y[1]))).unwrap_or([a, b, c]);
        let middle = primitive.positions.len() as u32;
        add_middle(&mut primitive.positions, from, to);
        add_middle(&mut primitive.normals, from, to);
        add_middle(&mut primitive.tangents, from, to);
        // Between opposite ones, that of a corner.
        let corner = from as usize;
        if let Some(normal) = primitive.normals.pop() {
            primitive.normals.push(normal.try_normalize().unwrap_or_else(|| primitive.normals[corner]));
        }
        if let Some(tangent) = primitive.tangents.pop() {
            let other = primitive.tangents[corner];
            let along = tangent.truncate().try_normalize().unwrap_or(other.truncate());
            primitive.tangents.push(along.extend(other.w));
        }
        add_middle(&mut primitive.uv0, from, to);
        add_middle(&mut primitive.uv1, from, to);
        add_middle(&mut primitive.colors, from, to);
        primitive.indices.extend([from, middle, opposite, middle, to, opposite]);
    }
}

/// A larger scene: two by two copies side by side, along the two longest edges of its box.
pub fn four_of(scene: &Scene) -> Scene {
    let (size, mut four) = (scene.bounds().size(), scene.clone());
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    let [first, second] = match size.min_position() {
        0 => [y, z],
        1 => [x, z],
        _ => [x, y],
    };
    for offset in [first, second, first + second] {
        let moved = |instance: &Instance| {
            let world_from_object = Affine3A::from_translation(offset) * instance.world_from_object;
            Instance { world_from_object, ..instance.clone() }
        };
        four.instances.extend(scene.instances.iter().map(moved));
    }
    four
}

/// Adds the mean of two of the values, where there are any.
fn add_middle<T: Copy + Add<Output = T> + Mul<f32, Output = T>>(values: &mut Vec<T>, from: u32, to: u32) {
    if !values.is_empty() {
        values.push((values[from as usize] + values[to as usize]) * 0.5);
    }
}

/// A closed box with edges of 10 m, divided into `count` by `count` corridors along z; 1: an empty box.
pub fn corridors(count: u32) -> Scene {
    const EDGE: f32 = 10.0;
    let mut primitive = Primitive::default();
    let mut wall = |origin: Vec3, u: Vec3, v: Vec3| {
        let first = primitive.positions.len() as u32;
        primitive.positions.extend([origin, origin + u, origin + u + v, origin + v]);
        primitive.normals.extend([u.cross(v).normalize(); 4]);
        primitive.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    };
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| EDGE * axis);
    for i in 0..=count {
        let at = i as f32 / count as f32;
        wall(at * x, y, z);
        wall(at * y, z, x);
    }
    wall(Vec3::ZERO, x, y);
    wall(z, x, y);
    Scene {
        meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(scene: &Scene) -> f32 {
        let of = |primitive: &Primitive| {
            let corner = |index: u32| primitive.positions[index as usize];
            let triangles = primitive.indices.as_chunks::<3>().0.iter().map(|triangle| triangle.map(corner));
            triangles.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum::<f32>()
        };
        scene.meshes.iter().flat_map(|mesh| &mesh.primitives).map(of).sum()
    }

    #[test]
    fn cut_triangles_are_the_same_surfaces() {
        let scene = lanternfish_scene::generate::demo("atrium").unwrap();
        let twice = bisected(&scene);
        assert_eq!(twice.triangle_counts().1, 2 * scene.triangle_counts().1);
        assert_eq!(twice.bounds(), scene.bounds());
        twice.validate().unwrap();
        assert!((area(&twice) / area(&scene) - 1.0).abs() < 1e-4, "{} {}", area(&twice), area(&scene));
        for primitive in twice.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            let count = primitive.positions.len();
            let lengths = [primitive.tangents.len(), primitive.uv0.len(), primitive.uv1.len(), primitive.colors.len()];
            assert!(lengths.iter().all(|length| *length == 0 || *length == count) && primitive.normals.len() == count);
        }
        // The orientation stays.
        let facing = |scene: &Scene| {
            let primitive = &scene.meshes[0].primitives[0];
            let [a, b, c] = primitive.indices.as_chunks::<3>().0[0].map(|index| primitive.positions[index as usize]);
            (b - a).cross(c - a).normalize()
        };
        assert!(facing(&twice).dot(facing(&scene)) > 0.999);
    }

    #[test]
    fn four_copies_lie_side_by_side() {
        let scene = corridors(1);
        let four = four_of(&scene);
        assert_eq!(four.triangle_counts().1, 4 * scene.triangle_counts().1);
        let sizes = four.bounds().size() / scene.bounds().size();
        assert_eq!([sizes.min_element(), sizes.max_element(), sizes.element_product()], [1.0, 2.0, 4.0]);
        four.validate().unwrap();
    }

    #[test]
    fn corridors_fill_the_box() {
        let (empty, tight) = (corridors(1), corridors(10));
        assert_eq!((empty.triangle_counts().1, tight.triangle_counts().1), (12, 48));
        assert_eq!(empty.bounds(), tight.bounds());
        assert_eq!([area(&empty), area(&tight)], [600.0, 2400.0]);
    }
}
