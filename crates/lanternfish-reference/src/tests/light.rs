//! Emitters of every kind give the analytic amount of light, with every sampling technique.

use glam::{Vec2, Vec3, Vec4};
use lanternfish_scene::{
    AlphaMode, Environment, Image, Light, LightKind, Material, Sampler, Scene, Texture, TextureRef,
    shading::{Attenuation, Materials},
};

use super::{area::below_corner, assert_mean, front, material, mean_and_error, quad, render, scene_of};
use crate::{
    Settings,
    settings::{Integrator, LightChoice},
};

fn lambert() -> Settings {
    Settings { materials: Materials::Lambert, attenuation: Attenuation::Physical, ..Settings::default() }
}

/// A white floor of 2 m × 2 m around the origin, in the plane z = 0, facing +z.
fn floor() -> Scene {
    scene_of(vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y)], vec![material(Vec3::ONE, 0.0, 1.0)])
}

const PI: f64 = std::f64::consts::PI;

#[test]
fn punctual_lights_have_their_photometric_irradiance() {
    // The central millimetre of the floor.
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
    // Beyond its range a light has no effect.
    scene.lights[0].range = Some(2.0);
    assert_eq!(mean_and_error(&render(&scene, &camera, 4, 4, Settings::default())).0, 0.0, "range");
}

/// Fraction of a disk's area beyond a line at a distance of `x` radii from its centre: the area of a circular segment.
fn segment(x: f64) -> f64 {
    if x.abs() >= 1.0 { f64::from(x < 0.0) } else { (x.acos() - x * (1.0 - x * x).sqrt()) / PI }
}

#[test]
fn a_light_with_a_radius_casts_a_soft_shadow() {
    // The light is at 2 m, an occluding edge is halfway. From `x` on the floor, the edge cuts the light's disk at -x from its centre.
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
        // Irradiance of the centre, its cosine, the visible fraction of the disk.
        let squared = 4.0 + f64::from(x).powi(2);
        let expected = 8.0 / squared * (2.0 / squared.sqrt()) / PI * segment(-f64::from(x / radius));
        let film = render(&scene, &camera, 8, 512, settings());
        // The disk is tilted by up to 0.25 / 2, an error of about 1 %.
        let actual = mean_and_error(&film).0;
        assert!((actual - expected).abs() < 0.02 * 2.0 / PI, "{x}: {actual}, not {expected}");
    }
}

#[test]
fn a_sun_with_a_diameter_casts_a_soft_shadow() {
    // The sun is overhead, an occluding edge is 1 m above the floor: from `x`, it cuts the sun's disk at distance 1 at -x from its centre.
    let mut scene = scene_of(
        vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y), quad(0, Vec3::new(-1.0, 0.0, 1.0), Vec3::Y, Vec3::X)],
        vec![Material { double_sided: true, ..material(Vec3::ONE, 0.0, 1.0) }],
    );
    scene.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(3.0))];
    let settings = |sun_diameter| Settings { sun_diameter, max_depth: 2, ..lambert() };
    let radius = 5f64.to_radians().tan();
    for x in [-0.1f32, -0.05, -0.02, 0.0, 0.03, 0.07, 0.1] {
        let mut camera = front(0.5, 1e-5);
        camera.world_from_camera.translation.x = x;
        let (actual, error) = mean_and_error(&render(&scene, &camera, 8, 512, settings(10.0)));
        let expected = |radius: f64| 3.0 / PI * segment(-f64::from(x) / radius);
        // Five standard errors, and the rounding of positions, 1e-7 m of 0.09 m.
        let tolerance = 5.0 * error + 1e-5;
        assert!((actual - expected(radius)).abs() < tolerance, "{x}: {actual} ± {error}, not {}", expected(radius));
        // The test can fail: at points in the penumbra off the middle, with another diameter.
        let other = (actual - expected(1.2 * radius)).abs();
        assert!(x == 0.0 || x.abs() > 0.08 || other > tolerance, "{x}: blind to a radius of {}", 1.2 * radius);
    }
    // Unshadowed it has the irradiance of its centre, also at a slant, for every direction of its disk.
    let mut open = floor();
    for (direction, cosine) in [(Vec3::NEG_Z, 1.0), (Vec3::new(0.0, 1.0, -1.0), 0.5f64.sqrt())] {
        open.lights = vec![Light::directional(direction, Vec3::splat(3.0))];
        for diameter in [0.53, 10.0, 80.0] {
            let film = render(&open, &front(3.0, 0.0005), 8, 512, settings(diameter));
            assert_mean(&film, 3.0 * cosine / PI, 1e-5, &format!("{diameter} degrees, cosine {cosine}"));
        }
    }
}

#[test]
fn an_emissive_quad_has_its_form_factor_with_every_light_choice() {
    // A square lamp of edge 2 m, 1 m above the centre of the floor: its form factor is four times that from the point below a corner.
    let expected = 5.0 * 4.0 * below_corner(1.0, 1.0);
    let lamp = Material { emissive: Vec3::splat(5.0), ..material(Vec3::ZERO, 0.0, 1.0) };
    let mut scene = scene_of(
        vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y), quad(1, Vec3::Z, Vec3::Y, Vec3::X)],
        vec![material(Vec3::ONE, 0.0, 1.0), lamp],
    );
    // The camera is below the lamp.
    let camera = front(0.5, 0.0005);
    for light_choice in LightChoice::ALL.iter().copied() {
        let settings = Settings { light_choice, max_depth: 2, ..lambert() };
        assert_mean(&render(&scene, &camera, 8, 512, settings), expected, 1e-4, &light_choice.to_string());
    }
    // Its back is dark: the flipped lamp gives no light, unless it is double-sided.
    let settings = || Settings { max_depth: 2, ..lambert() };
    scene.meshes[0].primitives[1] = quad(1, Vec3::Z, Vec3::X, Vec3::Y);
    assert_eq!(mean_and_error(&render(&scene, &camera, 4, 16, settings())).0, 0.0);
    scene.materials[1].double_sided = true;
    assert_mean(&render(&scene, &camera, 8, 512, settings()), expected, 1e-4, "two sides");
}

#[test]
fn an_environment_gives_the_irradiance_of_its_integral() {
    // Radiance 1 from the upper half of the sky (+y), 0 from the lower: a surface that faces +z has an irradiance of π / 2.
    let pixels = (0..64 * 32).map(|i| if i < 64 * 16 { Vec3::ONE } else { Vec3::ZERO }).collect();
    let scene = Scene { environment: Some(Environment { width: 64, height: 32, pixels, rotation: 0.3 }), ..floor() };
    let film = render(&scene, &front(3.0, 0.5), 8, 256, lambert());
    // The edge is bilinear and symmetric about the horizon.
    assert_mean(&film, 0.5, 1e-3, "half a sky");
}

#[test]
fn the_light_tree_samples_all_lights() {
    // 300 lights of short range over a floor: the tree must not miss any of them.
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
    // The tree has less noise with a quarter of the samples.
    assert!(tree_error < all_error, "{tree_error} and {all_error}");
}

/// The floor behind a sheet at z = 1 with this alpha mode, whose alpha is 0 on its left half and 128 / 255 on its right.
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
fn masks_have_holes_and_transparent_sheets_transmit_one_minus_alpha() {
    let [left, right] = [-0.5, 0.5].map(|x| {
        let mut camera = front(3.0, 0.2);
        camera.world_from_camera.translation.x = x;
        camera
    });
    let mask = behind_a_sheet(AlphaMode::Mask { cutoff: 0.25 });
    let settings = || Settings { max_depth: 2, ..lambert() };
    assert_mean(&render(&mask, &left, 4, 8, settings()), 1.0, 1e-4, "a hole, for camera rays and shadow rays");
    assert_eq!(mean_and_error(&render(&mask, &right, 4, 8, settings())).0, 0.0, "no hole");

    let blend = behind_a_sheet(AlphaMode::Blend);
    assert_mean(&render(&blend, &left, 4, 8, settings()), 1.0, 1e-4, "alpha 0");
    // Light passes the black sheet twice: from the light to the floor, and from the floor to the camera.
    let transmittance = 1.0 - 128.0 / 255.0;
    assert_mean(&render(&blend, &right, 16, 512, settings()), transmittance * transmittance, 1e-4, "alpha 0.5");

    // A thin dielectric, weighted by alpha: it transmits 0.96 of the light, and light passes it twice.
    let thin_dielectric = |alpha_mode, camera| {
        let mut scene = behind_a_sheet(alpha_mode);
        scene.images[0].rgba = vec![255, 255, 255, 0, 255, 255, 255, 128];
        let sheet = &mut scene.materials[1];
        (sheet.transmission, sheet.perceptual_roughness, sheet.base_color) = (1.0, 0.0, Vec4::ONE);
        // Oblique, so that the sheet does not mirror the light into the camera.
        scene.lights = vec![Light::directional(Vec3::new(0.0, 0.3, -1.0), Vec3::splat(PI as f32))];
        render(&scene, camera, 16, 256, Settings { max_depth: 2, ..Settings::default() })
    };
    let mask = AlphaMode::Mask { cutoff: 0.25 };
    let nothing = mean_and_error(&thin_dielectric(mask, &left)).0;
    assert!((0.85..1.0).contains(&nothing), "{nothing}");
    let through = nothing * 0.96f64.powi(2);
    assert_mean(&thin_dielectric(AlphaMode::Opaque, &left), through, 1e-3, "an opaque thin dielectric ignores alpha");
    assert_mean(&thin_dielectric(mask, &right), through, 1e-3, "a masked thin dielectric, above the cutoff");
    assert_mean(&thin_dielectric(AlphaMode::Blend, &left), nothing, 1e-4, "a transparent thin dielectric, alpha 0");
    let half = nothing * (1.0 - 0.04 * (1.0 - transmittance)).powi(2);
    assert_mean(&thin_dielectric(AlphaMode::Blend, &right), half, 1e-3, "a transparent thin dielectric, alpha 0.5");
}

#[test]
fn the_last_segment_of_a_path_passes_thin_dielectrics() {
    let mut scene = behind_a_sheet(AlphaMode::Opaque);
    scene.lights.clear();
    scene.materials[0].emissive = Vec3::ONE;
    let sheet = &mut scene.materials[1];
    (sheet.transmission, sheet.perceptual_roughness, sheet.base_color) = (1.0, 0.0, Vec4::ONE);
    scene.images[0].rgba = vec![255; 8];
    let film = render(&scene, &front(3.0, 0.2), 16, 256, Settings { max_depth: 1, ..Settings::default() });
    assert_mean(&film, 0.96, 2e-3, "emission behind a thin dielectric");
}

#[test]
fn occlusion_is_the_unoccluded_fraction_of_the_hemisphere() {
    // A very high wall occludes half of the hemisphere at its foot.
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
    // A ceiling at 1 m occludes everything. Weighted by distance with d_max = 4 m, the cosine-weighted mean of min(1/cos θ / 4, 1)² is
    // ∫ 2 c dc min(1 / (16 c²), 1) = ∫₀^¼ 2 c dc + ∫_¼^1 dc / (8 c) = 1/16 + ln 4 / 8.
    scene.meshes[0].primitives[1] = quad(0, Vec3::Z, 500.0 * Vec3::Y, 500.0 * Vec3::X);
    let mut camera = front(0.5, 0.0005);
    camera.world_from_camera.translation.x = 0.001;
    let render_with = |integrator| {
        render(&scene, &camera, 8, 512, Settings { integrator, materials: Materials::Lambert, ..Settings::default() })
    };
    assert_eq!(mean_and_error(&render_with(Integrator::Occlusion)).0, 0.0);
    let expected = 1.0 / 16.0 + 4f64.ln() / 8.0;
    assert_mean(&render_with(Integrator::Obscurance { max_distance: 4.0 }), expected, 1e-4, "weighted");
    let normal = render_with(Integrator::Normal).mean()[0];
    assert_eq!(normal, [0.5, 0.5, 1.0]);
}
