//! Light of every kind arrives in the right amount, however it is looked for.

use glam::{Vec2, Vec3, Vec4};
use lanternfish_scene::{
    AlphaMode, Environment, Image, Light, LightKind, Material, Sampler, Scene, Texture, TextureRef,
    shading::{Attenuation, Materials},
};

use super::{assert_mean, front, material, mean_and_error, quad, render, scene_of};
use crate::{
    Settings,
    settings::{Integrator, LightChoice},
};

fn lambert() -> Settings {
    Settings { materials: Materials::Lambert, attenuation: Attenuation::Physical, ..Settings::default() }
}

/// A white floor seen from the front, 2 m square around the origin, in the plane z = 0.
fn floor() -> Scene {
    scene_of(vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y)], vec![material(Vec3::ONE, 0.0, 1.0)])
}

const PI: f64 = std::f64::consts::PI;

#[test]
fn punctual_lights_shine_as_photometry_says() {
    // The middle millimetre of the floor.
    let camera = front(3.0, 0.0005);
    let mut scene = floor();
    scene.lights = vec![Light::point(Vec3::new(0.0, 0.0, 2.0), Vec3::splat(8.0))];
    assert_mean(&render(&scene, &camera, 4, 4, lambert()), 8.0 / 4.0 / PI, 1e-5, "point");
    scene.lights = vec![Light::directional(Vec3::new(0.0, 1.0, -1.0), Vec3::splat(3.0))];
    assert_mean(&render(&scene, &camera, 4, 4, lambert()), 3.0 * 0.5f64.sqrt() / PI, 1e-5, "sun");
    let spot = LightKind::Spot { inner_angle: 0.2, outer_angle: 0.6 };
    let place = Vec3::new(0.0, 2.0, 2.0);
    scene.lights = vec![Light { kind: spot, direction: Vec3::NEG_Z, ..Light::point(place, Vec3::splat(8.0)) }];
    assert_eq!(mean_and_error(&render(&scene, &camera, 4, 4, lambert())).0, 0.0, "outside the cone");
    scene.lights[0].direction = -place.normalize();
    assert_mean(&render(&scene, &camera, 4, 4, lambert()), 8.0 / 8.0 * 0.5f64.sqrt() / PI, 1e-5, "spot");
    // Past its range there is nothing.
    scene.lights[0].range = Some(2.0);
    assert_eq!(mean_and_error(&render(&scene, &camera, 4, 4, Settings::default())).0, 0.0, "range");
}

/// Share of a disk that a line leaves open which passes its centre at `x` radii: the segment beyond it.
fn segment(x: f64) -> f64 {
    if x.abs() >= 1.0 { f64::from(x < 0.0) } else { (x.acos() - x * (1.0 - x * x).sqrt()) / PI }
}

#[test]
fn a_light_with_a_radius_casts_a_soft_shadow() {
    // At 2 m, with an edge halfway: what the floor sees of the light at `x` is cut at -x from its centre.
    let mut scene = scene_of(
        vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y), quad(0, Vec3::new(-1.0, 0.0, 1.0), Vec3::Y, Vec3::X)],
        vec![Material { double_sided: true, ..material(Vec3::ONE, 0.0, 1.0) }],
    );
    let radius = 0.2;
    let settings = || Settings { light_radius: radius, max_depth: 2, ..lambert() };
    for x in [-0.25f32, -0.1, 0.0, 0.05, 0.15, 0.25] {
        scene.lights = vec![Light::point(Vec3::new(0.0, 0.0, 2.0), Vec3::splat(8.0))];
        let mut camera = front(0.5, 0.0005);
        camera.world_from_camera.translation.x = x;
        // Irradiance of the centre, its cosine, the share of the disk with x above -x.
        let squared = 4.0 + f64::from(x).powi(2);
        let expected = 8.0 / squared * (2.0 / squared.sqrt()) / PI * segment(-f64::from(x / radius));
        let film = render(&scene, &camera, 8, 512, settings());
        // The disk leans by up to 0.25 / 2 m: a hundredth.
        let found = mean_and_error(&film).0;
        assert!((found - expected).abs() < 0.02 * 2.0 / PI, "{x}: {found}, not {expected}");
    }
}

#[test]
fn a_lamp_lights_the_same_by_search_and_by_chance() {
    // A square lamp of edge 2 at 1 m over the middle of the floor. Its form factor from the point below the middle:
    // four times that below a corner, (a / √(1 + a²) atan(b / √(1 + a²)) + b / √(1 + b²) atan(a / √(1 + b²))) / 2π.
    let corner = |a: f64, b: f64| {
        let part = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
        (part(a, b) + part(b, a)) / (2.0 * PI)
    };
    let expected = 5.0 * 4.0 * corner(1.0, 1.0);
    let lamp = Material { emissive: Vec3::splat(5.0), ..material(Vec3::ZERO, 0.0, 1.0) };
    let mut scene = scene_of(
        vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y), quad(1, Vec3::Z, Vec3::Y, Vec3::X)],
        vec![material(Vec3::ONE, 0.0, 1.0), lamp],
    );
    // From below the lamp.
    let camera = front(0.5, 0.0005);
    for light_choice in LightChoice::ALL.iter().copied() {
        let settings = Settings { light_choice, max_depth: 2, ..lambert() };
        assert_mean(&render(&scene, &camera, 8, 512, settings), expected, 1e-4, light_choice.name());
    }
    // Its back is dark: the lamp upside down lights nothing, unless it has two sides.
    let settings = || Settings { max_depth: 2, ..lambert() };
    scene.meshes[0].primitives[1] = quad(1, Vec3::Z, Vec3::X, Vec3::Y);
    assert_eq!(mean_and_error(&render(&scene, &camera, 4, 16, settings())).0, 0.0);
    scene.materials[1].double_sided = true;
    assert_mean(&render(&scene, &camera, 8, 512, settings()), expected, 1e-4, "two sides");
}

#[test]
fn an_environment_lights_as_its_integral_says() {
    // Radiance 1 from the half of the sky above the horizon of +y, 0 below: a floor that faces +z gets half of π.
    let pixels = (0..64 * 32).map(|i| if i < 64 * 16 { Vec3::ONE } else { Vec3::ZERO }).collect();
    let scene = Scene { environment: Some(Environment { width: 64, height: 32, pixels, rotation: 0.3 }), ..floor() };
    let film = render(&scene, &front(3.0, 0.5), 8, 256, lambert());
    // The edge is bilinear, symmetric about the horizon.
    assert_mean(&film, 0.5, 1e-3, "half a sky");
}

#[test]
fn many_lights_are_all_found() {
    // 300 lights of short range over a floor: the tree must lose none of them.
    let mut scene = floor();
    let mut random = crate::Random::new(1, 2, 3);
    for _ in 0..300 {
        let place = Vec3::new(random.unit() as f32, random.unit() as f32, 0.3 + random.unit() as f32)
            - Vec3::new(0.5, 0.5, 0.0);
        scene.lights.push(Light { range: Some(0.8), ..Light::point(place, Vec3::splat(0.2)) });
    }
    let settings = |light_choice, seed| Settings { light_choice, seed, attenuation: Attenuation::Gltf, ..lambert() };
    let (tree, tree_error) = mean_and_error(&render(&scene, &front(3.0, 0.9), 16, 128, settings(LightChoice::Tree, 1)));
    let (all, all_error) =
        mean_and_error(&render(&scene, &front(3.0, 0.9), 16, 512, settings(LightChoice::Uniform, 2)));
    let error = tree_error.hypot(all_error);
    assert!((tree - all).abs() < 5.0 * error && error < 0.015 * all, "{tree} ± {tree_error}, not {all} ± {all_error}");
    // With a quarter of the samples it is no noisier.
    assert!(tree_error < all_error, "{tree_error} and {all_error}");
}

/// The scene behind a sheet at z = 1 of this material, whose alpha is 0 on its left half and 128 on its right.
fn behind_a_sheet(alpha_mode: AlphaMode) -> Scene {
    let image = Image { name: String::new(), width: 2, height: 1, rgba: vec![0, 0, 0, 0, 0, 0, 0, 128] };
    let sheet = Material {
        alpha_mode,
        base_color_texture: Some(TextureRef::new(0)),
        double_sided: true,
        ..material(Vec3::ZERO, 0.0, 1.0)
    };
    let mut thin_dielectric = quad(1, Vec3::Z, Vec3::X, Vec3::Y);
    thin_dielectric.uv0 = vec![Vec2::ZERO, Vec2::X, Vec2::X, Vec2::ZERO];
    let mut scene = scene_of(
        vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y), thin_dielectric],
        vec![material(Vec3::ONE, 0.0, 1.0), sheet],
    );
    scene.images = vec![image];
    scene.textures = vec![Texture { image: 0, sampler: 0 }];
    scene.samplers = vec![Sampler { mag: lanternfish_scene::Filter::Nearest, ..Sampler::default() }];
    scene.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(PI as f32))];
    scene
}

#[test]
fn masks_have_holes_and_blended_sheets_let_their_share_through() {
    let left = {
        let mut camera = front(3.0, 0.2);
        camera.world_from_camera.translation.x = -0.5;
        camera
    };
    let right = {
        let mut camera = front(3.0, 0.2);
        camera.world_from_camera.translation.x = 0.5;
        camera
    };
    let mask = behind_a_sheet(AlphaMode::Mask { cutoff: 0.25 });
    let settings = || Settings { max_depth: 2, ..lambert() };
    assert_mean(&render(&mask, &left, 4, 8, settings()), 1.0, 1e-4, "a hole, for the eye and for light");
    assert_eq!(mean_and_error(&render(&mask, &right, 4, 8, settings())).0, 0.0, "no hole");

    let blend = behind_a_sheet(AlphaMode::Blend);
    assert_mean(&render(&blend, &left, 4, 8, settings()), 1.0, 1e-4, "nothing there");
    // What is left of light on its way down, and again of what comes back; the sheet itself is black.
    let open = 1.0 - 128.0 / 255.0;
    assert_mean(&render(&blend, &right, 16, 512, settings()), open * open, 1e-4, "half there");

    // A pane that lets all through but what it reflects, where it is: 0.96 of the light, down and up again.
    let thin_dielectric = |alpha_mode, camera| {
        let mut scene = behind_a_sheet(alpha_mode);
        scene.images[0].rgba = vec![255, 255, 255, 0, 255, 255, 255, 128];
        let sheet = &mut scene.materials[1];
        (sheet.transmission, sheet.perceptual_roughness, sheet.base_color) = (1.0, 0.0, Vec4::ONE);
        // Aside, so that the pane does not mirror it.
        scene.lights = vec![Light::directional(Vec3::new(0.0, 0.3, -1.0), Vec3::splat(PI as f32))];
        render(&scene, camera, 16, 256, Settings { max_depth: 2, ..Settings::default() })
    };
    let mask = AlphaMode::Mask { cutoff: 0.25 };
    let nothing = mean_and_error(&thin_dielectric(mask, &left)).0;
    assert!((0.85..1.0).contains(&nothing), "{nothing}");
    let through = nothing * 0.96f64.powi(2);
    assert_mean(&thin_dielectric(AlphaMode::Opaque, &left), through, 1e-3, "all of a pane, whatever its alpha");
    assert_mean(&thin_dielectric(mask, &right), through, 1e-3, "no hole of a pane");
    assert_mean(&thin_dielectric(AlphaMode::Blend, &left), nothing, 1e-4, "no pane");
    let half = nothing * (1.0 - 0.04 * (1.0 - open)).powi(2);
    assert_mean(&thin_dielectric(AlphaMode::Blend, &right), half, 1e-3, "half a pane");
}

#[test]
fn the_last_segment_of_a_path_goes_through_panes() {
    let mut scene = behind_a_sheet(AlphaMode::Opaque);
    scene.lights.clear();
    scene.materials[0].emissive = Vec3::ONE;
    let sheet = &mut scene.materials[1];
    (sheet.transmission, sheet.perceptual_roughness, sheet.base_color) = (1.0, 0.0, Vec4::ONE);
    scene.images[0].rgba = vec![255; 8];
    let seen = render(&scene, &front(3.0, 0.2), 16, 256, Settings { max_depth: 1, ..Settings::default() });
    assert_mean(&seen, 0.96, 2e-3, "what shines behind a pane");
}

#[test]
fn occlusion_is_the_open_share_of_the_hemisphere() {
    // A wall of infinite height along one side hides half of the sky from a floor's edge.
    let mut scene = scene_of(
        vec![
            quad(0, Vec3::ZERO, Vec3::X, Vec3::Y),
            quad(0, Vec3::new(0.0, 0.0, 500.0), 500.0 * Vec3::Y, 500.0 * Vec3::Z),
        ],
        vec![Material { double_sided: true, ..material(Vec3::ONE, 0.0, 1.0) }],
    );
    let mut camera = front(3.0, 0.0005);
    camera.world_from_camera.translation.x = 0.001;
    let of = |integrator, scene: &Scene| {
        render(scene, &camera, 8, 512, Settings { integrator, materials: Materials::Lambert, ..Settings::default() })
    };
    assert_mean(&of(Integrator::Occlusion, &scene), 0.5, 2e-3, "half hidden");
    // A ceiling at 1 m hides all; weighed by distance with d_max = 4 m: E[min(1/cos θ / 4, 1)²] over the cosine:
    // ∫ 2 c dc min(1 / (16 c²), 1) = ∫₀^¼ 2 c dc + ∫_¼^1 dc / (8 c) = 1/16 + ln 4 / 8.
    scene.meshes[0].primitives[1] = quad(0, Vec3::Z, 500.0 * Vec3::Y, 500.0 * Vec3::X);
    let mut camera = front(0.5, 0.0005);
    camera.world_from_camera.translation.x = 0.001;
    let render_with = |integrator| {
        render(&scene, &camera, 8, 512, Settings { integrator, materials: Materials::Lambert, ..Settings::default() })
    };
    assert_eq!(mean_and_error(&render_with(Integrator::Occlusion)).0, 0.0);
    let expected = 1.0 / 16.0 + 4f64.ln() / 8.0;
    assert_mean(&render_with(Integrator::Obscurance { max_distance: 4.0 }), expected, 1e-4, "weighed");
    let normal = render_with(Integrator::Normal).mean()[0];
    assert_eq!(normal, [0.5, 0.5, 1.0]);
}
