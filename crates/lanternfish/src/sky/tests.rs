use glam::{Vec3, Vec4};
use lanternfish_gpu::testing;
use lanternfish_scene::Environment;

use crate::testing::{Random, evaluate};

#[gpu_test]
fn gpu_directions_lie_where_the_scene_says(gpu: &Gpu) {
    let mut random = Random::new(1);
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
    let near_poles = [1e-3f32, 1e-5, 1e-12].into_iter().flat_map(|x| [Vec3::new(x, 1.0, -x), Vec3::new(-x, -1.0, x)]);
    let mut directions: Vec<Vec3> = axes.chain(near_poles).map(Vec3::normalize).collect();
    directions.extend((0..10_000).map(|_| random.direction()));
    for rotation_turns in [0.0f32, 0.125, -0.4] {
        let rotation = rotation_turns * std::f32::consts::TAU;
        let environment = Environment { width: 1, height: 1, pixels: vec![Vec3::ZERO], rotation };
        let queries: Vec<Vec4> = directions.iter().map(|direction| direction.extend(rotation_turns)).collect();
        let answers = evaluate(gpu, "environment_uvs", &queries, 1);
        let mut greatest = 0.0f32;
        for (direction, answer) in directions.iter().zip(answers) {
            let (u, v) = environment.uv(*direction);
            assert!((0.0..1.0).contains(&answer.x) && (0.0..=1.0).contains(&answer.y), "{direction}: {answer}");
            // 0 and 1 are the same column; at the poles all columns are.
            let is_pole = direction.x == 0.0 && direction.z == 0.0;
            let across = if is_pole { 0.0 } else { (answer.x - u).abs() };
            greatest = greatest.max(across.min(1.0 - across)).max((answer.y - v).abs());
        }
        // An angle of up to π within 2e-7, a division within 2.5 units in the last place, and sums near 1 with an error of 2⁻²⁴ each: 1/200
        // of a pixel of the widest image.
        assert!(greatest < 3e-7, "{rotation_turns}: {greatest}");
    }
}
