mod host;

use std::f32::consts::TAU;

use glam::{Vec3, Vec4};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{Bounds, Environment};

use super::{EnvironmentImage, EnvironmentLight};
use crate::{
    testing::{Random, evaluate_points, half_white, image, looking},
    view::View,
};

/// Mirrored radiance by direction, with the roughness as the fourth component.
fn mirrored(gpu: &Gpu, environment: &Environment, queries: &[Vec4]) -> Vec<Vec3> {
    let uploaded = EnvironmentImage::new(&gpu.device, &gpu.queue, environment).unwrap();
    let light = EnvironmentLight::new(&gpu.device, &gpu.queue, Some((environment, &uploaded))).unwrap();
    let bounds = Bounds { min: -Vec3::ONE, max: Vec3::ONE };
    let camera = looking([0.0, 0.0, 3.0], [0.0; 3]);
    let view = View::new(&camera, glam::UVec2::ONE, Vec3::ZERO, &bounds).upload(&gpu.device);
    let (view, light) = (view.bindings(), light.bindings());
    let answers = evaluate_points(gpu, "mirrored_radiances", &view.with(&light), queries, 1);
    answers.into_iter().map(Vec4::truncate).collect()
}

fn directions(count: usize, roughness: f32) -> Vec<Vec4> {
    let mut random = Random::new(5);
    (0..count).map(|_| random.direction().extend(roughness)).collect()
}

fn greatest_distance(actual: &[Vec3], queries: &[Vec4], expected: impl Fn(Vec3) -> Vec3) -> f32 {
    let off =
        actual.iter().zip(queries).map(|(actual, query)| (*actual - expected(query.truncate())).abs().max_element());
    off.fold(0.0, f32::max)
}

#[gpu_test]
fn gpu_smooth_surfaces_mirror_the_image(gpu: &Gpu) {
    let environment = image(512, 256, 0.7, |d| Vec3::new(1.0 + d.x, 2.0 + d.y * d.z, 1.5 + (3.0 * d.x).sin()));
    let queries = directions(2000, 0.0);
    let actual = mirrored(gpu, &environment, &queries);
    let off = greatest_distance(&actual, &queries, |direction| environment.radiance(direction));
    // Half floats up to 2.5 have an error of 0.001; texels of 0.7° average a function with a curvature of up to 9 per square radian.
    assert!(off < 4e-3, "{off}");
    // Check that the test can fail: an image rotated by three degrees differs.
    let rotated = Environment { rotation: 0.75, ..environment.clone() };
    assert!(greatest_distance(&actual, &queries, |direction| rotated.radiance(direction)) > 0.05);
}

#[gpu_test]
fn gpu_rougher_levels_blur_and_keep_the_energy(gpu: &Gpu) {
    let even = image(64, 32, 0.0, |_| Vec3::new(0.5, 3.0, 20.0));
    for roughness in [0.0, 0.1, 0.25, 0.5, 0.8, 1.0] {
        let queries = directions(500, roughness);
        let actual = mirrored(gpu, &even, &queries);
        let off = greatest_distance(&actual, &queries, |_| Vec3::new(0.5, 3.0, 20.0));
        // Half floats: 2⁻¹¹ of 20, at each of a few levels.
        assert!(off < 0.03, "{roughness}: {off}");

        // White above the horizon: one half at the horizon for every roughness, and the full value far enough above it.
        let around = |i: u8| TAU * f32::from(i) / 100.0;
        let edge = (0..100).map(|i| Vec3::new(around(i).sin(), 0.0, around(i).cos()).extend(roughness));
        let edge: Vec<Vec4> = edge.collect();
        let actual = mirrored(gpu, &half_white(), &edge);
        let mean = actual.iter().map(|radiance| radiance.x).sum::<f32>() / actual.len() as f32;
        assert!((mean - 0.5).abs() < 0.03, "{roughness}: {mean} at the horizon");
    }
    // The blur is as wide as the lobe. 30° above the horizon, a mirror direction receives from below half of the GGX half vectors that tilt
    // by more than 15°: 1 % for alpha = 0.04, 23 % for 0.25, and more for 1, minus the rays below the surface.
    let at = |roughness: f32| Vec3::new(0.75f32.sqrt(), 0.5, 0.0).extend(roughness);
    let actual = mirrored(gpu, &half_white(), &[at(0.2), at(0.5), at(1.0)]).iter().map(|f| f.x).collect::<Vec<_>>();
    assert!(actual[0] > 0.97 && (0.8..0.95).contains(&actual[1]) && (0.6..0.8).contains(&actual[2]), "{actual:?}");
}

/// Light from a sun is the same at every roughness, wherever the sun is on the cube's faces.
#[gpu_test]
fn gpu_a_small_sun_keeps_its_flux_at_every_roughness(gpu: &Gpu) {
    // Directions that represent equal solid angles.
    let spiral = |i: usize, count: usize| {
        let height = 1.0 - (2.0 * i as f32 + 1.0) / count as f32;
        let angle = TAU * (i as f32 * 0.618_034).fract();
        let radius = (1.0 - height * height).sqrt();
        Vec3::new(radius * angle.cos(), height, radius * angle.sin())
    };
    for (place, sun) in [
        ("centre of a face", Vec3::Y),
        ("75 degrees high", Vec3::new(0.2, 0.97, 0.1)),
        ("edge", Vec3::new(0.0, 1.0, 1.0)),
        ("corner", Vec3::ONE),
    ] {
        let sun = sun.normalize();
        let environment = image(512, 256, 0.0, |d| if d.dot(sun) > 0.998 { Vec3::splat(1000.0) } else { Vec3::ZERO });
        let expected = (0..1 << 18).map(|i| environment.radiance(spiral(i, 1 << 18)).x).sum::<f32>() / (1 << 18) as f32;
        let flux = [0.2, 0.4, 0.6, 1.0].map(|roughness: f32| {
            let queries: Vec<Vec4> = (0..8192).map(|i| spiral(i, 8192).extend(roughness)).collect();
            let actual = mirrored(gpu, &environment, &queries);
            actual.iter().map(|radiance| radiance.x).sum::<f32>() / queries.len() as f32 / expected
        });
        println!("{place}: {flux:.3?}");
        // Means of four texels by equal weights gave 0.93, 0.81, 0.68 and 0.53 at the centre of a face.
        assert!(flux.iter().all(|part| (part - 1.0).abs() < 0.06), "{place}: {flux:?}");
    }
}
