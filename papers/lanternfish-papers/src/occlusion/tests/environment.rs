use glam::Vec3;
use lanternfish::{
    Renderer, Settings,
    settings::{Occlusion, Samples},
};
use lanternfish_gpu::Gpu;
use lanternfish_reference::{
    Film, Settings as TracerSettings, Tracer,
    settings::{Integrator, LightChoice},
};
use lanternfish_scene::{Camera, Environment, Material, Scene};

use super::{SIZE, deep as by_deep_images, settings};
use crate::{
    DeepImageSettings, Hbao,
    testing::{
        self, apart, half_white, image,
        inside::brdf_fractions as fractions,
        light::{self, floor, image_of, mean, off},
        looking, quad, scene_of, walks,
    },
};

fn by_horizons() -> Occlusion {
    Occlusion::from(Hbao { radius: 1.0, ..Hbao::default() })
}

fn rendering(gpu: &Gpu, settings: &Settings, scene: &Scene, camera: &Camera) -> Vec<Vec3> {
    image_of(gpu, SIZE, settings.clone(), scene, camera)
}

fn center(pixels: &[Vec3]) -> Vec3 {
    pixels[pixels.len() / 2]
}

fn matt() -> Material {
    light::matt(1.0)
}

fn metal(perceptual_roughness: f32) -> Material {
    Material { metallic: 1.0, perceptual_roughness, double_sided: true, ..Material::default() }
}

/// A plate over a floor and a wall behind it.
fn corner(materials: [Material; 3]) -> Scene {
    let plate = quad(1, 0.5 * Vec3::Y, 0.5 * Vec3::X, -0.5 * Vec3::Z);
    let wall = quad(2, Vec3::new(0.0, 1.0, -1.5), 2.0 * Vec3::X, Vec3::Y);
    scene_of(vec![quad(0, Vec3::ZERO, 4.0 * Vec3::X, -4.0 * Vec3::Z), plate, wall], materials.into())
}

fn even(radiance: Vec3) -> Environment {
    image(16, 8, 0.0, |_| radiance)
}

#[gpu_test]
fn gpu_an_even_image_is_a_constant_sky(gpu: &Gpu) {
    let sky = Vec3::new(1.0, 2.0, 0.5);
    let dielectric = Material { metallic: 0.0, perceptual_roughness: 0.4, double_sided: true, ..Material::default() };
    let constant = Scene { sky, ..corner([matt(), metal(0.3), dielectric]) };
    let imaged = Scene { environment: Some(even(sky)), ..constant.clone() };
    let camera = looking([1.0, 1.5, 4.0], [0.0, 0.3, 0.0]);
    for occlusion in [by_deep_images(), by_horizons()] {
        let [a, b] = [&constant, &imaged].map(|scene| rendering(gpu, &settings(occlusion.clone()), scene, &camera));
        let difference = a.iter().zip(&b).map(|(a, b)| ((*a - *b) / sky).abs().max_element()).fold(0.0, f32::max);
        // Tolerance: half-float rounding of the sums, of a few mip levels and of the image.
        assert!(difference < 4e-3, "{occlusion:?}: {difference}");
        assert!(mean(&a) > 0.3, "{occlusion:?}: black");
    }
}

#[gpu_test]
fn gpu_white_surfaces_under_white_environment_are_white(gpu: &Gpu) {
    let camera = looking([0.0, 3.0, 0.1], [0.0, 0.0, 0.0]);
    let white = |material| Scene { environment: Some(even(Vec3::ONE)), ..floor(material) };
    let without = rendering(gpu, &settings(Occlusion::NONE), &white(matt()), &camera);
    assert_eq!(center(&without), Vec3::ZERO, "without a technique");
    for occlusion in [by_deep_images(), by_horizons()] {
        for pixel in rendering(gpu, &settings(occlusion.clone()), &white(matt()), &camera) {
            // Means of environment samples and direction cells are off by about 2⁻²³.
            assert!((pixel - 1.0).abs().max_element() < 1e-3, "{occlusion:?}: {pixel}");
        }
        for roughness in [0.0f32, 0.3, 0.6, 1.0] {
            let actual = center(&rendering(gpu, &settings(occlusion.clone()), &white(metal(roughness)), &camera)).x;
            let [near, grazing] = fractions(1.0, roughness.into());
            // One reflection between microfacets only: energy that hits another facet is lost, 0.69 of it at roughness 1.
            println!("{occlusion:?}, roughness {roughness}: {actual}");
            assert!((f64::from(actual) - near - grazing).abs() < 5e-3, "{roughness}: {actual}, {}", near + grazing);
            assert!(actual < 1.002 && actual > 0.998 - 0.7 * roughness * roughness, "{roughness}: {actual}");
        }
        // A dielectric loses less than a tenth: 0.04 of its light is reflected like the metal's.
        let dielectric = Material { metallic: 0.0, ..metal(0.5) };
        let actual = center(&rendering(gpu, &settings(occlusion), &white(dielectric), &camera)).x;
        assert!((0.9..1.002).contains(&actual), "{actual}");
    }
}

/// A plane whose normal has angle a to the middle of a white half of the environment receives (1 + cos a) / 2 of the irradiance of a full
/// sphere, for a rotated plane or a rotated environment; a metal mirrors one half.
#[gpu_test]
fn gpu_planes_receive_the_light_that_they_face(gpu: &Gpu) {
    let wall =
        |normal: Vec3, up: Vec3, material| scene_of(vec![quad(0, Vec3::ZERO, up.cross(normal), up)], vec![material]);
    for degrees in [0.0f32, 60.0, 90.0, 135.0, 180.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let expected = 0.5 * (1.0 + cos);
        let (tilted, up) = (Vec3::new(sin, cos, 0.0), Vec3::new(-cos, sin, 0.0));
        // White from above, and from +x.
        let from_x = image(256, 128, degrees.to_radians(), |d| Vec3::splat(f32::from(d.x > 0.0)));
        for (normal, up, environment, turned) in [(tilted, up, half_white(), 0.0), (Vec3::X, Vec3::Y, from_x, 0.06)] {
            let eye = 3.0 * normal + 0.1 * Vec3::Z;
            let camera = Camera::look_at(eye, Vec3::ZERO, looking([0.0; 3], [1.0; 3]).projection);
            // A cell that the horizon cuts is white or black in one frame; the mean of the frames smooths that.
            for (occlusion, most) in [(by_deep_images(), 0.025f32), (by_horizons(), 3e-3)] {
                let lit = |material| {
                    let scene = Scene { environment: Some(environment.clone()), ..wall(normal, up, material) };
                    center(&rendering(gpu, &settings(occlusion.clone()), &scene, &camera)).x
                };
                let actual = lit(matt());
                println!("{degrees}°, {occlusion:?}: {actual:.4}, not {expected:.4}");
                assert!((actual - expected).abs() < most.max(turned), "{degrees}°, {occlusion:?}: {actual}");
                if degrees == 0.0 || degrees == 180.0 {
                    let mirrored = lit(metal(0.2));
                    assert!((mirrored - expected).abs() < 0.1, "{degrees}°, {occlusion:?}: {mirrored} in a mirror");
                }
            }
        }
    }
}

#[gpu_test]
fn gpu_moved_objects_are_lit_at_their_new_position(gpu: &Gpu) {
    let glossy = Material { metallic: 0.5, perceptual_roughness: 0.3, ..matt() };
    let mut scene = apart(&corner([glossy, matt(), matt()]));
    scene.environment = Some(image(64, 32, 0.0, |d| Vec3::new(1.0, 0.5, 0.2) * (1.0 + d.x) + d.y.max(0.0)));
    let camera = looking([1.0, 1.5, 4.0], [0.0, 0.3, 0.0]);
    for occlusion in [by_deep_images(), by_horizons()] {
        let settings = settings(occlusion.clone());
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        let mut uploaded = renderer.upload(&scene).unwrap();
        let mut render = |uploaded: &_| walks::pixels(&renderer.render(uploaded, &camera, SIZE.into()).unwrap());
        let before = render(&uploaded);
        assert!(before == render(&uploaded), "{occlusion:?}: differs from frame to frame");
        let mut moved = scene.clone();
        moved.instances[1].world_from_object.translation.x -= 1.0;
        let other = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        other.update(&mut uploaded, &moved).unwrap();
        let after = render(&uploaded);
        let changed = before.iter().zip(&after).filter(|(a, b)| (**a - **b).abs().max_element() > 0.02).count();
        assert!(changed > 100, "{occlusion:?}: {changed} pixels");
        assert!(after == rendering(gpu, &settings, &moved, &camera), "{occlusion:?}: differs from a fresh upload");
    }
}

/// Ground truth: paths of two segments. Bounds are about a quarter above the measured values.
#[gpu_test]
fn gpu_light_is_the_path_tracers(gpu: &Gpu) {
    let mut scene = corner([matt(), Material { metallic: 0.0, ..metal(0.5) }, metal(0.6)]);
    let towards = Vec3::new(0.5, 0.6, 0.6).normalize();
    let patch = |d: Vec3| if d.dot(towards) > 0.9 { Vec3::new(4.0, 3.0, 2.0) } else { Vec3::ZERO };
    scene.environment = Some(image(128, 64, 0.0, |d| Vec3::new(0.4, 0.6, 1.0) * (1.2 + d.y) + patch(d)));
    // The view shows surfaces only.
    let camera = looking([0.3, 1.6, 2.0], [0.0, 0.3, -0.6]);
    let tracer = TracerSettings {
        integrator: Integrator::Path,
        max_depth: 2,
        light_choice: LightChoice::Uniform,
        ..TracerSettings::default()
    };
    let mut film = Film::new(SIZE.into()).unwrap();
    Tracer::new(&scene, tracer).unwrap().render(&camera, &mut film, 96);
    let ground_truth: Vec<Vec3> = film.mean().iter().map(|pixel| Vec3::from(*pixel)).collect();
    let actual = |occlusion, accumulate, scene: &Scene| {
        let deep_images = DeepImageSettings { resolution: 128, ..DeepImageSettings::default() };
        let actual = rendering(
            gpu,
            &settings(occlusion).with_structure(deep_images).with_accumulate(accumulate),
            scene,
            &camera,
        );
        println!("off by {:.4}, energy {:.4}", off(&actual, &ground_truth), mean(&actual) / mean(&ground_truth));
        (off(&actual, &ground_truth), mean(&actual) / mean(&ground_truth))
    };
    let [deep, frames, hbao] =
        [(by_deep_images(), 1), (by_deep_images(), 4), (by_horizons(), 1)].map(|(o, count)| actual(o, count, &scene));
    assert!(deep.0 < 0.09 && (deep.1 - 1.0).abs() < 0.03, "{deep:?}");
    assert!(frames.0 < deep.0 && (frames.1 - 1.0).abs() < 0.03, "{frames:?}");
    assert!(hbao.0 < 0.25 && hbao.0 > 1.5 * deep.0, "{hbao:?}");
    // Negative control: a rotated environment gives another image.
    scene.environment.as_mut().unwrap().rotation = 0.5;
    let rotated = actual(by_deep_images(), 1, &scene);
    assert!(rotated.0 > 1.25 * deep.0, "{rotated:?}");
}

/// Each sample takes the value of the matching pixel: away from edges the images are equal.
#[gpu_test]
fn gpu_several_samples_are_lit_as_one(gpu: &Gpu) {
    let scene = Scene { environment: Some(half_white()), ..floor(metal(0.5)) };
    let camera = looking([0.0, 1.5, 2.0], [0.0, 0.0, 0.0]);
    let [one, four] = [Samples::One, Samples::Four]
        .map(|samples| rendering(gpu, &settings(by_deep_images()).with_samples(samples), &scene, &camera));
    assert!(off(&four, &one) < 5e-3, "{}", off(&four, &one));
}
