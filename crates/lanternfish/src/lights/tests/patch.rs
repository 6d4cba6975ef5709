//! `patch.wesl` against numerical integration.

use glam::{DVec3, Vec3, Vec4};
use lanternfish_gpu::testing;

use crate::testing::{Random, evaluate};

/// A surface square and a light.
struct Case {
    n: Vec3,
    edge: f32,
    shading: Vec3,
    to_light: Vec3,
}

fn fractions(gpu: &lanternfish_gpu::Gpu, cases: &[Case]) -> Vec<f64> {
    let query = |case: &Case| [case.n.extend(case.edge), case.shading.extend(0.0), case.to_light.extend(0.0)];
    let queries: Vec<Vec4> = cases.iter().flat_map(query).collect();
    evaluate(gpu, "patch_fractions", &queries, 3).iter().map(|answer| f64::from(answer.x)).collect()
}

/// Numerical mean over the square of cosine / distance², relative to its value at the centre. The square's sides lie along `across` of
/// `math.wesl`.
fn summed(case: &Case) -> f64 {
    const POINTS: usize = 400;
    let (n, to_light) = (case.n.as_dvec3(), case.to_light.as_dvec3());
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let right = DVec3::new(1.0 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x);
    let up = n.cross(right);
    let arrives = |from: DVec3| (to_light - from).dot(case.shading.as_dvec3()) / (to_light - from).length().powi(3);
    let side = |i: usize| f64::from(case.edge) * ((i as f64 + 0.5) / POINTS as f64 - 0.5);
    let all = (0..POINTS * POINTS).map(|i| arrives(side(i % POINTS) * right + side(i / POINTS) * up));
    all.sum::<f64>() / (POINTS * POINTS) as f64 / arrives(DVec3::ZERO)
}

#[gpu_test]
fn gpu_a_patch_has_the_mean_of_its_points(gpu: &Gpu) {
    let mut random = Random::new(41);
    let mut cases = Vec::new();
    while cases.len() < 60 {
        let (n, edge) = (random.direction(), random.between(0.1, 3.0));
        let shading = (n + 0.7 * random.unit() * random.direction()).normalize();
        let to_light =
            edge * (random.between(0.05, 0.7) * n + 1.5 * n.any_orthogonal_vector() * random.between(-1.0, 1.0));
        if shading.dot(to_light.normalize()) > 0.1 {
            cases.push(Case { n, edge, shading, to_light });
        }
    }
    let mut far = 0;
    for (case, actual) in cases.iter().zip(fractions(gpu, &cases)) {
        let expected = summed(case).max(0.0);
        assert!((actual - expected).abs() < 2e-3 * expected.max(0.1), "{actual}, not {expected}");
        far += usize::from((expected - 1.0).abs() > 0.2);
    }
    assert!(far > 20, "{far} of the squares differ from their middle");
}

#[gpu_test]
fn gpu_a_patch_ends_at_its_reach_and_under_the_light(gpu: &Gpu) {
    let reach = crate::shaders::constant("lights/patch", "PATCH_REACH") as f32;
    let above = |edge, height: f32| Case { n: Vec3::Y, edge, shading: Vec3::Y, to_light: height * Vec3::Y };
    let actual = fractions(gpu, &[above(1.0, reach), above(10.0, 0.01), above(1.0, 1e-5)]);
    assert!((actual[0] - 0.985).abs() < 1e-3, "{actual:?}");
    // At this distance the square covers half of all directions, relative to the 1 / d² of a point at distance d.
    assert!((actual[1] / (2.0 * std::f64::consts::PI * 1e-6) - 1.0).abs() < 0.01, "{actual:?}");
    // The near radius of the attenuation bounds the distance.
    assert!((actual[2] / (2.0 * std::f64::consts::PI * 1e-6) - 1.0).abs() < 0.01, "{actual:?}");
}
