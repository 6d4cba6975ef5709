//! Nodes that rays visit in one and in two levels, counted on the device.

use std::f32::consts::PI;

use glam::{Quat, Vec3Swizzles};
use lanternfish_scene::generate;

use super::*;
use crate::testing::edited_engine;

const DISTANCE: &str = "return hit_distance(first_triangle(origin + offset * direction, direction, NO_HIT), offset);";
const COUNT: &str = "var walk: Walk;
    begin_walk(&walk, origin, direction, NO_HIT);
    var count = 0.0;
    while !advance_walk(&walk, true, 1u) { count += 1.0; }
    return count;";

/// Mean number of nodes that a ray visits.
fn nodes_a_ray(gpu: &Gpu, scene: &Scene, tracer: Tracer, rays: &[TracedRay]) -> f64 {
    let uploaded = renderer(gpu, tracer).upload(scene).unwrap();
    let path = if tracer == Tracer::BVH { "rays/bvh/tracer" } else { "rays/two_level/tracer" };
    let engine = edited_engine(gpu, &[(path, DISTANCE, COUNT)]);
    let counts = engine.within(|| distances(gpu, &uploaded, tracer, rays));
    counts.iter().map(|count| f64::from(*count)).sum::<f64>() / rays.len() as f64
}

/// Boxes of so many rectangles each, as cars in four lanes, on a plane.
fn cars(count: usize, each: usize) -> Scene {
    let mut random = Random::new(5);
    let mut scene = scene_of(vec![quad(0, Vec3::ZERO, 300.0 * Vec3::X, -12.0 * Vec3::Z)], vec![Material::default()]);
    let part = |_| {
        let size = 0.15 * Vec3::new(random.unit(), random.unit(), random.unit());
        quad(
            0,
            Vec3::new(2.2, 0.7, 0.9) * random.point() + 0.7 * Vec3::Y,
            size * random.direction(),
            size.yzx() * random.direction(),
        )
    };
    scene.meshes.push(Mesh { name: "car".to_owned(), primitives: (0..each).map(part).collect() });
    for i in 0..count {
        let place = Vec3::new(5.5 * (i / 4) as f32 - 275.0, 0.0, 3.2 * (i % 4) as f32 - 4.8);
        let turn = Quat::from_rotation_y(0.04 * random.unit() + if i % 4 < 2 { PI } else { 0.0 });
        let world_from_object = Affine3A::from_rotation_translation(turn, place);
        scene.instances.push(Instance { name: String::new(), mesh: 1, world_from_object });
    }
    assert_eq!(scene.validate(), Ok(()));
    scene
}

fn rays_within(scene: &Scene) -> Vec<TracedRay> {
    let bounds = scene.bounds();
    let mut random = Random::new(9);
    let ray = |_| {
        let place = Vec3::new(random.unit(), 0.1 * random.unit(), 0.2 + 0.6 * random.unit());
        TracedRay::new(bounds.min + bounds.size() * place, random.direction(), 0.0, 0, false)
    };
    (0..20_000).map(ray).collect()
}

/// Instances cost a ray some nodes, not a multiple.
fn check_nodes(gpu: &Gpu, name: &str, scene: &Scene) {
    let rays = rays_within(scene);
    let [one, two] = [Tracer::BVH, Tracer::TWO_LEVEL].map(|tracer| nodes_a_ray(gpu, scene, tracer, &rays));
    println!("{name}: {one:.1} nodes a ray in one level, {two:.1} in two");
    assert!(one > 2.0 && two < 2.0 * one, "{name}: {one}, {two}");
}

#[gpu_test]
fn gpu_a_ray_visits_few_more_nodes_in_two_levels(gpu: &Gpu) {
    check_nodes(gpu, "cars", &cars(400, 100));
}

#[gpu_test(full)]
fn gpu_a_ray_visits_few_more_nodes_among_many_triangles(gpu: &Gpu) {
    check_nodes(gpu, "cars", &cars(400, 500));
    check_nodes(gpu, "street", &generate::demo("street").unwrap());
}
