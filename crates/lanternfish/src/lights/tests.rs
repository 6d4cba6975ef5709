mod area;
mod patch;

use glam::{Vec3, Vec4};
use lanternfish_gpu::{Bindings, storage_buffer_of, testing, uniform_buffer_of};
use lanternfish_scene::{Camera, Light, LightKind, Material, Projection, shading::Falloff};

use super::{LightCount, cpu_reference};
use crate::{
    Renderer, Settings,
    settings::{Attenuation, Coefficients, Materials, Shadows},
    testing::{Random, evaluate, evaluate_points, quad, scene_of},
};

/// True for the functions of the thesis that end at R1; `physical`, `step` and `clq` are cut there.
fn reaches_zero(function: Attenuation) -> bool {
    !matches!(function, Attenuation::Physical | Attenuation::Step | Attenuation::Clq)
}

#[test]
fn the_functions_end_at_the_range_and_approach_the_physical_one() {
    for function in Attenuation::ALL.iter().copied() {
        for (intensity, i0) in [(1.0f64, 0.25f64), (40.0, 0.02), (0.003, 0.02)] {
            let r1 = (intensity / i0).sqrt();
            let a = |d: f64| cpu_reference::attenuation(function, intensity, i0, d);
            if reaches_zero(function) {
                assert!(a(r1).abs() < 1e-12 * intensity.max(i0), "{function}: {} at R1", a(r1));
            }
            // "Force both the attenuation and its derivative to zero" (§A.2); the interpolated ones keep the value only.
            if function == Attenuation::Smooth {
                let slope = (a(r1 * (1.0 + 1e-6)) - a(r1 * (1.0 - 1e-6))) / (2e-6 * r1);
                assert!(slope.abs() < 1e-6 * i0 / r1, "{function}: slope {slope} at R1");
            }
        }
        // "lim I0 -> 0: a = a_phy" (§A.2), for all but the two illustrative functions, and a_clq, which has no I0.
        if !matches!(function, Attenuation::Linear | Attenuation::Step | Attenuation::Clq) {
            assert!((cpu_reference::attenuation(function, 2.0, 1e-9, 3.0) - 2.0 / 9.0).abs() < 1e-8, "{function}");
        }
    }
}

#[gpu_test]
fn gpu_attenuation_is_the_theses(gpu: &Gpu) {
    let mut arguments = Vec::new();
    for function in Attenuation::ALL.iter().copied() {
        for range in [0.5f32, 1.0, 7.5, 300.0] {
            for fraction in [0.01f32, 0.1, 0.3, 0.5, 0.77, 0.9, 0.99, 0.9999, 1.0, 1.0001, 1.5, 40.0] {
                arguments.push((function, fraction * range, range));
            }
        }
    }
    // R0 and the coefficients are varied, too; the same for some.
    let falloff_of = |i: usize, attenuation| Falloff {
        attenuation,
        near_radius: [1e-3, 0.2, 0.75][i % 3],
        coefficients: Coefficients([[1.0, 0.0, 1.0], [0.3, 2.0, 0.5], [0.0, 0.0, 1.0]][i / 3 % 3]),
    };
    let query = |(i, (f, d, r)): (usize, &(Attenuation, f32, f32))| {
        let Falloff { near_radius, coefficients, .. } = falloff_of(i, *f);
        [Vec4::new(*f as u32 as f32, *d, *r, near_radius), Vec3::from(coefficients.0).extend(0.0)]
    };
    let queries: Vec<_> = arguments.iter().enumerate().flat_map(query).collect();
    let answers = evaluate(gpu, "attenuations", &queries, 2);
    let mut lit = 0;
    for (i, ((function, d, range), answer)) in arguments.iter().zip(answers).enumerate() {
        let falloff = falloff_of(i, *function);
        let (d, range) = (f64::from(*d), f64::from(*range));
        let outside = d.max(falloff.near_radius.into()) >= range;
        // The cut-off of a unit intensity is 1 / R².
        let inside = cpu_reference::attenuation(falloff, 1.0, 1.0 / (range * range), d).max(0.0);
        let expected = if outside { 0.0 } else { inside };
        // The terms that cancel near R are at most three times the physical one or the cut-off; eight roundings of each.
        let nearest = d.max(falloff.near_radius.into()).min(range);
        let tolerance = 8.0 * 3.0 * f64::from(f32::EPSILON) * (1.0 / (nearest * nearest)).max(4.0);
        let actual = f64::from(answer.x);
        assert!((actual - expected).abs() <= tolerance, "{function} at {d} of {range}: {actual}, not {expected}");
        assert!(!outside || actual == 0.0);
        // The path tracer's.
        let traced = f64::from(falloff.factor(d as f32, range as f32));
        assert!((traced - expected).abs() <= tolerance, "{falloff:?} at {d} of {range}: {traced}, not {expected}");
        lit += usize::from(actual > 0.0);
    }
    assert!(lit > arguments.len() / 2, "{lit} of {} lit", arguments.len());

    // The default near radius R0 (§A.1) keeps the light itself finite.
    let near = crate::shaders::constant("lights/attenuation", "NEAR_RADIUS") as f32;
    assert_eq!(near, lanternfish_scene::shading::NEAR_RADIUS);
    let at = |d: f32| [Vec4::new(Attenuation::Physical as u32 as f32, d, 1.0, near), Vec4::ONE];
    let answers = evaluate(gpu, "attenuations", &[0.0, 0.5 * near, near, 2.0 * near].map(at).concat(), 2);
    assert!(answers[0].x.is_finite() && answers[0] == answers[1] && answers[0] == answers[2], "{answers:?}");
    assert!(answers[3].x < 0.3 * answers[2].x);
}

/// A near radius and coefficients that are not the default ones.
fn with_parameters() -> Settings {
    Settings::direct_light()
        .with_attenuation_near_radius(1.5)
        .with_attenuation_coefficients(Coefficients([0.5, 0.25, 2.0]))
}

/// Lights of all kinds against the path tracer (`lanternfish_reference::incidence`), at positions in and out of reach.
#[gpu_test]
fn gpu_incidence_is_the_path_tracers(gpu: &Gpu) {
    let mut random = Random::new(5);
    let (mut lights, mut packed, mut queries, mut expected) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for i in 0..4096 {
        let outer_angle = random.between(0.1, 1.5);
        let kind = match i % 5 {
            0 => LightKind::Point,
            1 => LightKind::Spot { inner_angle: random.between(0.0, 0.9 * outer_angle), outer_angle },
            _ => LightKind::Directional,
        };
        let range = (i % 2 == 0).then(|| random.between(1.0, 9.0));
        let direction = random.direction();
        // Disks and rectangles emit from their centres here.
        let light = match i % 5 {
            3 | 4 => area::area_light(i, &mut random),
            _ => Light { kind, direction, ..Light::point(5.0 * random.point(), 10.0 * (random.point() + 1.0)) },
        };
        let light = Light { range, ..light };
        let attenuation = Attenuation::ALL[i % Attenuation::ALL.len()];
        let settings = with_parameters().with_attenuation(attenuation).with_range_threshold(0.1);
        let position = 5.0 * random.point();
        packed.push(super::Light::new(&light, &settings.light_storage()));
        queries.push(position.extend(f32::INFINITY));
        expected.push(lanternfish_reference::incidence(&light, position.into(), settings.lights.falloff(), 0.1));
        lights.push(light);
    }
    let packed = storage_buffer_of(&gpu.device, "lights", &packed, wgpu::BufferUsages::empty()).expect("they fit");
    let count = uniform_buffer_of(&gpu.device, "count", &LightCount::new(4096, &with_parameters().light_storage()));
    let lights_on_device = Bindings::new().buffer("lights", &packed).buffer("light_count", &count);
    let mut lit = 0;
    let actual = evaluate_points(gpu, "incidences", &lights_on_device, &queries, 1);
    for ((light, expected), actual) in lights.iter().zip(&expected).zip(actual) {
        let (actual, distance) = (actual.truncate(), actual.w);
        assert!(distance == expected.distance || (distance / expected.distance - 1.0).abs() < 1e-5);
        // Windows and cones that are nearly closed are differences of numbers near one: their error is a few roundings of the unattenuated
        // light.
        let unattenuated = 20.0 / expected.distance.min(1e3).powi(2).max(1e-6) + 20.0;
        let unattenuated = unattenuated * light.area().unwrap_or(1.0).max(1.0);
        let error = (actual - expected.irradiance).abs().max_element();
        assert!(error <= 1e-5 * expected.irradiance.max_element() + 2e-5 * unattenuated, "{actual}, not {expected:?}");
        lit += usize::from(expected.irradiance.max_element() > 0.1);
    }
    assert!(lit > 1500, "{lit} lit");
}

#[gpu_test]
fn gpu_a_lambert_quad_shines_as_the_functions_say(gpu: &Gpu) {
    let white = Material::default();
    let mut scene = scene_of(vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y)], vec![white]);
    let camera =
        Camera::look_at(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, Projection::Perspective { fov_y: 0.5, near: 0.1 });
    let (intensity, range, d) = (5.0f32, 2.0f32, 1.25f32);
    scene.lights = vec![Light { range: Some(range), ..Light::point(Vec3::new(0.0, 0.0, d), Vec3::splat(intensity)) }];
    let mut actual = Vec::new();
    for attenuation in Attenuation::ALL.iter().copied() {
        let settings = Settings::direct_light()
            .with_attenuation(attenuation)
            .with_attenuation_coefficients(Coefficients([1.0, 0.5, 1.0]))
            .with_materials(Materials::Lambert)
            .with_shadows(Shadows::None);
        let falloff = settings.lights.falloff();
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        // The centre of an image with odd dimensions shows the quad's centre, directly below the light.
        let rendering = renderer.render(&uploaded, &camera, [5, 5]).unwrap();
        let pixel = rendering.radiance[12];
        // A light of intensity I and range R has the cut-off I / R².
        let (intensity, i0) = (f64::from(intensity), f64::from(intensity / (range * range)));
        let expected = cpu_reference::attenuation(falloff, intensity, i0, d.into()) / std::f64::consts::PI;
        // A unit in the last place of a half float, 2⁻¹⁰: adapters may round to the target's format in either direction.
        let tolerance = 9.8e-4 * expected;
        for channel in &pixel[..3] {
            assert!((f64::from(*channel) - expected).abs() < tolerance, "{attenuation}: {channel}, not {expected}");
        }
        actual.push(pixel[0].to_bits());
    }
    // The test can fail: all functions differ here, except glTF's window and physical_reduced_2, which are equal:
    // I / d² (1 − d⁴ / R⁴) = I / d² − I₀ d² / R².
    actual.sort_unstable();
    actual.dedup();
    assert_eq!(actual.len(), Attenuation::ALL.len() - 1);
}

#[test]
fn kinds_are_the_shaders() {
    let point = Light::point(Vec3::ZERO, Vec3::ONE);
    let spot = LightKind::Spot { inner_angle: 0.1, outer_angle: 0.5 };
    let disk = LightKind::Disk { radius: 1.0 };
    let rectangle = LightKind::Rectangle { half_width: 1.0, half_height: 1.0, right: Vec3::X };
    for (kind, name) in [
        (point.kind, "POINT"),
        (spot, "SPOT"),
        (LightKind::Directional, "DIRECTIONAL"),
        (disk, "DISK"),
        (rectangle, "RECTANGLE"),
    ] {
        let light = Light { kind, ..point.clone() };
        let number = f64::from(super::Light::new(&light, &Settings::direct_light().light_storage()).kind);
        assert_eq!(crate::shaders::constant("lights/light", name), number, "{name}");
    }
    assert_eq!(
        crate::shaders::constant("light_culling/volume", "INFINITE") as f32,
        lanternfish_scene::shading::UNBOUNDED
    );
}
