//! Disks and rectangles: `area.wesl` against the path tracer.

use glam::{DVec3, Vec3, Vec4};
use lanternfish_gpu::{Bindings, Gpu, storage_buffer_of, testing, uniform_buffer_of};
use lanternfish_scene::{Light, LightKind, shading::Attenuation};

use crate::{
    Settings, lights,
    testing::{Random, evaluate_points},
};

/// A disk or a rectangle, alternately.
pub(super) fn area_light(i: usize, random: &mut Random) -> Light {
    let (position, direction) = (5.0 * random.point(), random.direction());
    let radiance = 10.0 * (random.point() + 1.0);
    let mut half = || random.between(0.1, 2.0);
    match i % 2 {
        0 => Light::disk(position, direction, half(), radiance),
        _ => {
            let size = [2.0 * half(), 2.0 * half()];
            Light::rectangle(position, direction, random.direction(), size, radiance)
        }
    }
}

/// The shader's irradiance and distance for each light, and the sampled point of the light. `queries`: a position and the numbers that
/// select the point.
fn sampled(gpu: &Gpu, lights: &[Light], settings: &Settings, queries: &[Vec4]) -> Vec<(Vec4, Vec3)> {
    let packed: Vec<_> = lights.iter().map(|light| lights::Light::new(light, &settings.light_storage())).collect();
    let buffer = storage_buffer_of(&gpu.device, "lights", &packed, wgpu::BufferUsages::empty()).expect("they fit");
    let count = lights::LightCount::new(packed.len() as u32, &settings.light_storage());
    let count = uniform_buffer_of(&gpu.device, "count", &count);
    let bindings = Bindings::new().buffer("lights", &buffer).buffer("light_count", &count);
    let actual = evaluate_points(gpu, "area_incidences", &bindings, queries, 2);
    let points = evaluate_points(gpu, "area_points", &bindings, queries, 2);
    actual.into_iter().zip(points.iter().map(|point| point.truncate())).collect()
}

#[gpu_test]
fn gpu_points_of_areas_shine_as_the_path_tracers(gpu: &Gpu) {
    let mut random = Random::new(8);
    let (mut lit, mut dark) = (0, 0);
    for attenuation in Attenuation::ALL.iter().copied() {
        let settings = super::with_parameters().with_attenuation(attenuation).with_range_threshold(0.1);
        let (mut lights, mut queries) = (Vec::new(), Vec::new());
        for i in 0..512 {
            let range = (i % 4 < 2).then(|| random.between(1.0, 9.0));
            lights.push(Light { range, ..area_light(i, &mut random) });
            queries.push((5.0 * random.point()).extend(0.0));
            queries.push(Vec4::new(random.between(0.0, 1.0), random.between(0.0, 1.0), 0.0, 0.0));
        }
        for (i, (actual, point)) in sampled(gpu, &lights, &settings, &queries).into_iter().enumerate() {
            let (light, p) = (&lights[i], queries[2 * i].truncate());
            assert!(is_on(light, point), "{point} of {light:?}");
            let expected = lanternfish_reference::incidence_from(
                light,
                point.as_dvec3(),
                p.into(),
                settings.lights.falloff(),
                0.1,
            );
            assert!((actual.w / expected.distance - 1.0).abs() < 1e-5, "{actual}, not {expected:?}");
            // As for lights without an area: windows that are nearly closed, and planes seen nearly edge-on.
            let unattenuated = light.greatest_intensity().max_element() * (expected.distance.powi(-2) + 1.0);
            let error = (actual.truncate() - expected.irradiance).abs().max_element();
            assert!(
                error <= 1e-5 * expected.irradiance.max_element() + 1e-5 * unattenuated,
                "{actual}, not {expected:?}"
            );
            lit += usize::from(expected.irradiance.max_element() > 1e-3 * unattenuated);
            dark += usize::from(expected.irradiance == Vec3::ZERO);
        }
    }
    assert!(lit > 800 && dark > 800, "{lit} lit, {dark} dark");
}

/// True if a point lies on a disk or rectangle.
fn is_on(light: &Light, point: Vec3) -> bool {
    let aside = point - light.position;
    let is_within = match light.kind {
        LightKind::Disk { radius } => aside.length() < 1.0001 * radius + 1e-5,
        LightKind::Rectangle { half_width, half_height, right } => {
            let up = right.cross(light.direction);
            let [x, y] = [right, up].map(|axis| aside.dot(axis).abs());
            x < 1.0001 * half_width + 1e-5 && y < 1.0001 * half_height + 1e-5
        }
        _ => false,
    };
    is_within && aside.dot(light.direction).abs() < 1e-5
}

/// The mean and the mean squares along width, height and normal test the distribution of the points.
#[gpu_test]
fn gpu_points_are_even_over_areas(gpu: &Gpu) {
    let mut random = Random::new(9);
    let direction = random.direction();
    let right = direction.any_orthonormal_vector();
    let up = right.cross(direction);
    let disk = Light::disk(Vec3::ZERO, direction, 2.0, Vec3::ONE);
    let rectangle = Light::rectangle(Vec3::ZERO, direction, right, [3.0, 1.0], Vec3::ONE);
    // Mean squares: r² / 4 along each axis of a disk, s² / 12 along a side.
    for (light, squares) in [(disk, [1.0, 1.0]), (rectangle, [0.75, 1.0 / 12.0])] {
        const COUNT: usize = 1 << 14;
        let u = |_| [Vec4::ONE, Vec4::new(random.between(0.0, 1.0), random.between(0.0, 1.0), 0.0, 0.0)];
        let queries: Vec<Vec4> = (0..COUNT).flat_map(u).collect();
        let lights = vec![light.clone(); COUNT];
        let (mut mean, mut actual) = (DVec3::ZERO, [0.0; 2]);
        for (_, point) in sampled(gpu, &lights, &Settings::direct_light(), &queries) {
            mean += point.as_dvec3() / COUNT as f64;
            let of = |axis: Vec3| f64::from(point.dot(axis)).powi(2) / COUNT as f64;
            actual = [actual[0] + of(right), actual[1] + of(up)];
        }
        // Five standard errors: √(mean square / n) for a mean, less than twice the mean square / √n for a mean square.
        assert!(mean.length() < 5.0 * (squares[0] / COUNT as f64).sqrt() * 1.5, "{light:?}: {mean}");
        for (actual, expected) in actual.iter().zip(squares) {
            assert!(
                (actual / expected - 1.0).abs() < 10.0 / (COUNT as f64).sqrt(),
                "{light:?}: {actual}, not {expected}"
            );
        }
    }
}
