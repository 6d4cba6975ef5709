//! The environment image: its visibility as background, and its coverage.

use glam::{EulerRot, Mat3A, Vec2, Vec3, Vec4};
use lanternfish::{RenderedImage, Settings, settings::Shadows};
use lanternfish_gpu::testing;
use lanternfish_scene::{AlphaMode, Camera, Environment, Light, Material, Projection, Scene};

use crate::support::{EDGE, Front, assert_near, bits, quad, render, scene_of, thin_dielectric};

/// Pixels of smooth, distinct colours in 0.5..1.5.
fn environment() -> Environment {
    let (width, height) = (32, 16);
    let wave = |x: f32| 1.0 + 0.5 * x.sin();
    let pixels = (0..width * height).map(|i| ((i % width) as f32, (i / width) as f32));
    let pixels = pixels.map(|(x, y)| Vec3::new(wave(0.6 * x), wave(0.9 * y + 0.2 * x), wave(0.3 * x - 0.5 * y)));
    Environment { width, height, pixels: pixels.collect(), rotation: 0.0 }
}

/// A scene with only an environment.
fn empty(environment: Environment) -> Scene {
    Scene { environment: Some(environment), sky: Vec3::new(9.0, 0.0, 0.0), ..Scene::default() }
}

/// The direction of a perspective camera through the centre of a pixel.
fn direction(camera: &Camera, (x, y): (u32, u32), (width, height): (u32, u32)) -> Vec3 {
    let Projection::Perspective { fov_y, .. } = camera.projection else { panic!("a perspective camera") };
    let ndc = (Vec2::new(x as f32, y as f32) + 0.5) / Vec2::new(width as f32, height as f32) * 2.0 - 1.0;
    let tangent = (0.5 * fov_y).tan();
    let aspect = width as f32 / height as f32;
    let view = Vec3::new(ndc.x * tangent * aspect, -ndc.y * tangent, -1.0).normalize();
    camera.world_from_camera.transform_vector3(view)
}

fn radiance(rendering: &RenderedImage, x: u32, y: u32) -> Vec4 {
    Vec4::from(rendering.radiance[(y * rendering.width + x) as usize])
}

#[gpu_test]
fn gpu_every_pixel_of_an_empty_view_is_the_environments_radiance(gpu: &Gpu) {
    let size = (37, 23);
    for (yaw, pitch, roll, rotation) in
        [(0.0, 0.0, 0.0, 0.0), (3.1, 0.4, -0.5, 0.0), (-1.0, 1.5, 0.0, 2.0), (0.5, -1.5, 1.0, -40.0)]
    {
        let environment = Environment { rotation, ..environment() };
        let mut camera =
            Camera::look_at(Vec3::new(3.0, -2.0, 1.0), Vec3::ZERO, Projection::Perspective { fov_y: 2.0, near: 0.1 });
        camera.world_from_camera.matrix3 = Mat3A::from_euler(EulerRot::YXZ, yaw, pitch, roll);
        let rendering = render(gpu, &empty(environment.clone()), &camera, size, Settings::direct_light());
        let rotated = Environment { rotation: rotation + 0.1, ..environment.clone() };
        let mut differs_rotated = 0;
        for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
            let direction = direction(&camera, (x, y), size);
            let actual = radiance(&rendering, x, y);
            let expected = environment.radiance(direction);
            assert_near(actual.truncate(), expected, 1.0, &format!("{x}, {y} towards {direction}"));
            assert_eq!(actual.w, 0.0, "no surface covers it");
            differs_rotated += u32::from((rotated.radiance(direction) - expected).abs().max_element() > 0.01);
        }
        // Check that the test can fail: a rotation of six degrees is detected.
        assert!(differs_rotated > size.0 * size.1 / 2, "{differs_rotated}");
    }
}

#[gpu_test]
fn gpu_an_orthographic_view_shows_one_point_of_the_environment(gpu: &Gpu) {
    let environment = environment();
    let target = Vec3::new(0.3, -0.2, 0.9);
    let projection = Projection::Orthographic { half_height: 50.0, near: 0.0, far: 10.0 };
    let camera = Camera::look_at(Vec3::ZERO, target, projection);
    let rendering = render(gpu, &empty(environment.clone()), &camera, (9, 5), Settings::direct_light());
    for texel in &rendering.radiance {
        assert_near(Vec4::from(*texel).truncate(), environment.radiance(target.normalize()), 1.0, "one direction");
    }
    assert!(bits(&rendering).iter().all(|texel| *texel == bits(&rendering)[0]));
}

/// A lit opaque square on the left, a transparent one on the right, a gap between them.
fn covered() -> Scene {
    let matt = Material { metallic: 0.0, ..Material::default() };
    let glass = Material {
        base_color: Vec4::new(0.5, 1.0, 0.25, 0.25),
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        ..Material::default()
    };
    let mut scene = scene_of(
        vec![
            quad(0, Vec3::new(-1.0, 0.0, 0.0), Vec3::X * 0.5, Vec3::Y),
            quad(1, Vec3::new(1.0, 0.0, 0.0), Vec3::X * 0.5, Vec3::Y),
        ],
        vec![matt, glass],
    );
    scene.lights = vec![Light::point(Vec3::new(0.0, 0.5, 3.0), Vec3::splat(40.0))];
    scene
}

#[gpu_test]
fn gpu_surfaces_cover_the_environment_and_blend_over_it(gpu: &Gpu) {
    let plain = covered();
    let surrounded = Scene { environment: Some(environment()), ..covered() };
    for shadows in [Shadows::None, Shadows::BVH] {
        let settings = Settings::direct_light().with_shadows(shadows);
        let [without, with] = [&plain, &surrounded].map(|scene| Front::render(gpu, scene, settings.clone()));
        let behind = environment().radiance(Vec3::NEG_Z);
        assert_near(with.at(0.0, 0.0), behind, 1.0, "nothing covers it");
        // Both the environment and the sum are rounded.
        let through = 0.25 * Vec3::new(0.5, 1.0, 0.25) + 0.75 * behind;
        assert_near(with.at(1.0, 0.0), through, 2.0, "a quarter covers it");
        let mut covered = 0;
        for (i, (with, without)) in bits(&with.0).iter().zip(bits(&without.0)).enumerate() {
            let alpha = f32::from_bits(without[3]);
            assert_eq!(with[3], without[3], "pixel {i}: alpha is the coverage of surfaces");
            if alpha == 1.0 {
                assert_eq!(*with, without, "pixel {i}: it lights nothing");
                covered += 1;
            }
        }
        assert_eq!(covered, EDGE * EDGE / 4 / 2, "the square of 1 × 2 m of 4 × 4 m");
    }
}

#[gpu_test]
fn gpu_radiance_beyond_half_floats_is_kept(gpu: &Gpu) {
    let front = |pixel| {
        let sun = Environment { width: 1, height: 1, pixels: vec![pixel], rotation: 0.0 };
        Front::render(gpu, &empty(sun), Settings::direct_light()).at(0.0, 0.0)
    };
    let bright = Vec3::new(1e9, 2e9, 3e8);
    let relative = (front(bright) - bright) / bright;
    assert!(relative.abs().max_element() < 1.0 / 1024.0, "{relative}");
    // Beyond the range of units it ends.
    let largest = front(Vec3::splat(f32::MAX));
    assert!(largest.is_finite() && largest.min_element() > 1e20, "{largest}");
}

#[gpu_test]
fn gpu_a_constant_environment_equals_the_sky(gpu: &Gpu) {
    // Exactly representable as half floats, and so are the means.
    let sky = Vec3::new(0.25, 0.5, 2.0);
    let mut constant = scene_of(vec![thin_dielectric(0, 0.0, 1.0)], vec![Material::default()]);
    constant.sky = sky;
    let image = Environment { width: 4, height: 2, pixels: vec![sky; 8], rotation: 1.0 };
    let surrounded = Scene { environment: Some(image), sky: Vec3::ZERO, ..constant.clone() };
    let [a, b] = [constant, surrounded].map(|scene| Front::render(gpu, &scene, Settings::direct_light()));
    assert_eq!(bits(&a.0), bits(&b.0));
}
