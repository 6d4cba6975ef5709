mod built;
mod measured;

use std::collections::HashMap;

use glam::Vec4;
use lanternfish_gpu::{Gpu, storage_buffer_of, testing};
use lanternfish_scene::{Bounds, Light, LightKind, light_tree::Receiver};

use super::*;
use crate::{
    Settings,
    testing::{Random, evaluate_module},
};

/// Point, spot, disk and directional lights, some of them without emission.
fn lights(random: &mut Random) -> Vec<Light> {
    let light = |i: usize| {
        let (position, direction) = (5.0 * random.point(), random.direction());
        let kind = match i % 4 {
            0 => LightKind::Spot { inner_angle: 0.1, outer_angle: random.between(0.2, 1.5) },
            1 if i % 40 == 1 => LightKind::Directional,
            2 => LightKind::Disk { radius: random.between(0.1, 1.0) },
            _ => LightKind::Point,
        };
        let power = if i % 17 == 3 { Vec3::ZERO } else { random.point() + 1.5 };
        Light { kind, direction, range: Some(random.between(2.0, 9.0)), ..Light::point(position, power) }
    };
    (0..400).map(light).collect()
}

/// The lights on the device.
fn set_of(gpu: &Gpu, lights: &[Light]) -> LightSet {
    let settings = Settings::default().light_storage();
    let packed: Vec<_> = lights.iter().map(|light| crate::lights::Light::new(light, &settings)).collect();
    let buffer = storage_buffer_of(&gpu.device, "lights", &packed, wgpu::BufferUsages::empty()).unwrap();
    let mut bounds = Bounds::EMPTY;
    let placed = lights.iter().filter(|light| light.kind != LightKind::Directional);
    placed.for_each(|light| bounds.add_point(light.position));
    LightSet::new(&gpu.device, buffer, packed, bounds, &settings)
}

/// The trees over these.
fn trees_of(gpu: &Gpu, lights: &[Light], triangles: Vec<EmissiveTriangle>) -> SceneLightTrees {
    SceneLightTrees::new(&gpu.device, &gpu.queue, &set_of(gpu, lights), triangles).unwrap()
}

/// True if the light is in the tree.
fn is_in_tree(light: &Light) -> bool {
    light.intensity != Vec3::ZERO && light.kind != LightKind::Directional
}

fn triangles(random: &mut Random) -> Vec<EmissiveTriangle> {
    let triangle = |i: u32| {
        let (position, normal) = (5.0 * random.point(), random.direction());
        let (right, up) = normal.any_orthonormal_pair();
        let corners = [position, position + random.unit() * right, position + random.unit() * up];
        let front = (!i.is_multiple_of(3)).then_some(normal);
        EmissiveTriangle { triangle: 7 * i + 2, emitter: Emitter::of_triangle(corners, 3.0, front) }
    };
    (0..300).map(triangle).collect()
}

/// Emitters of all kinds, in the tree that the host has built.
#[gpu_test]
fn gpu_the_device_chooses_as_the_host_does(gpu: &Gpu) {
    let mut random = Random::new(12);
    let (lights, mut triangles) = (lights(&mut random), triangles(&mut random));
    let of_light = |(light, i): (&Light, u32)| EmissiveTriangle {
        triangle: 10_000 + i,
        emitter: Emitter::of_light(light, light.range.unwrap(), 0.0),
    };
    triangles.extend(lights.iter().zip(0..).filter(|(light, _)| is_in_tree(light)).map(of_light));
    let trees = trees_of(gpu, &lights, triangles.clone());
    let tree = LightTree::new(&triangles.iter().map(|t| t.emitter).collect::<Vec<_>>());

    let mut queries = Vec::new();
    for _ in 0..6000 {
        queries.push((6.0 * random.point()).extend(random.unit()));
        queries.push(random.direction().extend(0.0));
        queries.push(Vec4::ZERO);
    }
    let answers = evaluate_module(gpu, "testing/light_tree", "choices", &trees.bindings(), &queries, 3);
    let (mut chosen, mut other) = (0, 0);
    for (query, answer) in queries.chunks(3).zip(answers) {
        let receiver = Receiver { p: query[0].truncate(), normal: query[1].truncate(), is_transmitting: false };
        let name = |e: u32| triangles[e as usize].triangle;
        let expected = tree.choose(&receiver, query[0].w.into());
        if expected.map_or(-1.0, |(emitter, _)| name(emitter) as f32) != answer.x {
            // A random number at the border between two emitters may select either.
            other += 1;
            continue;
        }
        let Some((_, chance)) = expected else { continue };
        chosen += 1;
        let (actual, climbed) = (f64::from(answer.y), f64::from(answer.z));
        // A dozen levels, of a few roundings each; where cosines are near zero the relative error is larger.
        assert!((actual / chance - 1.0).abs() < 0.01, "{actual}, not {chance}");
        assert!((climbed / actual - 1.0).abs() < 1e-4, "{climbed} by climbing, {actual} on the way down");
    }
    assert!(chosen > 2000 && other < 30, "{chosen} chosen, {other} others");
}

/// With a radius no light loses its probability, and a light that is close above gets about the same probability wherever in the radius the
/// point lies.
#[gpu_test]
fn gpu_patches_keep_the_chance_of_every_light(gpu: &Gpu) {
    let mut random = Random::new(13);
    let mut lights = lights(&mut random);
    for light in &mut lights {
        light.range = Some(random.between(0.5, 3.0));
    }
    let trees = trees_of(gpu, &lights, Vec::new());
    let chances = |queries: &[Vec4]| -> Vec<f32> {
        let answers = evaluate_module(gpu, "testing/light_tree", "chances", &trees.bindings(), queries, 2);
        answers.iter().map(|answer| answer.x).collect()
    };
    let (mut of_points, mut of_patches) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        let (p, normal) = (6.0 * random.point(), random.direction());
        for leaf in 0..1 << trees.layout.light_depth {
            let query = p.extend(leaf as f32);
            of_points.extend([query, normal.extend(0.0)]);
            of_patches.extend([query, normal.extend(2.0)]);
        }
    }
    let (of_points, of_patches) = (chances(&of_points), chances(&of_patches));
    let reaching = of_points.iter().filter(|chance| **chance > 0.0).count();
    assert!(reaching > 200, "{reaching}");
    for (point, patch) in of_points.iter().zip(&of_patches) {
        // A probability that is 1 minus a neighbour's may round to zero.
        let is_rounding = point.max(*patch) < 1e-6;
        assert!((*point > 0.0) == (*patch > 0.0) || is_rounding, "{point} of a point, {patch} of a patch");
    }
    // A light is drawn as often as its probability predicts, and the bottom-up probability from its leaf is the same.
    const DRAWS: usize = 2048;
    for _ in 0..8 {
        let (p, normal) = (4.0 * random.point(), random.direction());
        let query = |i| [p.extend((i as f32 + 0.5) / DRAWS as f32), normal.extend(1.0), Vec4::new(2.0, 0.0, 0.0, 0.0)];
        let queries: Vec<Vec4> = (0..DRAWS).flat_map(query).collect();
        let answers = evaluate_module(gpu, "testing/light_tree", "choices", &trees.bindings(), &queries, 3);
        let mut drawn = HashMap::<u32, (f32, usize)>::new();
        for answer in answers.iter().filter(|answer| answer.x >= 0.0) {
            assert!((answer.z / answer.y - 1.0).abs() < 1e-4, "{} by climbing, {} on the way down", answer.z, answer.y);
            drawn.entry(answer.x as u32).or_insert((answer.y, 0)).1 += 1;
        }
        for (light, (chance, count)) in drawn {
            // Stratified draws: the count of an interval differs from its probability by at most one, and by as much again for rounding.
            assert!((count as f32 - chance * DRAWS as f32).abs() < 2.0, "{light}: {count} of {DRAWS}, chance {chance}");
        }
    }
    // Five millimetres above a floor, and another light far away.
    let lights =
        vec![Light::point(Vec3::new(0.0, 0.005, 0.0), Vec3::ONE), Light::point(4.0 * Vec3::Y, Vec3::splat(4e3))];
    let trees = trees_of(gpu, &lights, Vec::new());
    let spread = |radius: f32| {
        let queries: Vec<Vec4> =
            (0..20).flat_map(|i| [Vec4::new(0.001 * i as f32, 0.0, 0.0, 0.0), Vec3::Y.extend(radius)]).collect();
        let answers = evaluate_module(gpu, "testing/light_tree", "chances", &trees.bindings(), &queries, 2);
        let mut chances: Vec<f32> = answers.iter().map(|answer| answer.x).collect();
        // Leaves are in any order.
        if chances[0] < chances[19] {
            chances.iter_mut().for_each(|chance| *chance = 1.0 - *chance);
        }
        println!("radius {radius}: {chances:.3?}");
        let odds = |chance: f32| chance / (1.0 - chance);
        odds(chances[0]) / odds(chances[19])
    };
    assert!(spread(0.0) > 20.0 && (0.5..2.0).contains(&spread(0.02)));
}
