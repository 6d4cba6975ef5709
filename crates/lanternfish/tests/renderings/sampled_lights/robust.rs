//! Lights whose number changes, lights in difficult places, and extreme lights.

use super::*;

const SMALL: (u32, u32) = (16, 16);

fn image(renderer: &mut Renderer, uploaded: &lanternfish::GpuScene, scene: &Scene) -> RenderedImage {
    let image = renderer.render(uploaded, &scene.cameras[0], SMALL.into()).unwrap();
    assert!(image.radiance.iter().flatten().all(|value| value.is_finite()));
    image
}

/// The number of lights changes within a scene, and single lights of a tree do.
#[gpu_test]
fn gpu_sampled_lights_follow_updates(gpu: &Gpu) {
    let settings = sampled().with_direct(SampledLights::default()).with_history(History::Off);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let mut now = cornell(10, point);
    let mut uploaded = renderer.upload(&now).unwrap();
    let first = image(&mut renderer, &uploaded, &now);
    let mut images = Vec::new();
    for count in [0, 1_000_000, 1, 10] {
        now.lights = cornell(count, point).lights;
        renderer.update(&mut uploaded, &now).unwrap();
        let updated = image(&mut renderer, &uploaded, &now);
        let fresh = renderer.upload(&now).unwrap();
        assert!(bits(&updated) == bits(&image(&mut renderer, &fresh, &now)), "{count} lights");
        images.push(updated);
    }
    let green = |image: &RenderedImage| energies(&linear(image))[1];
    assert_eq!(green(&images[0]), 0.0);
    assert!(green(&images[1]) > 1e3 * green(&images[2]) && green(&images[2]) > 0.0);
    assert!(bits(&images[3]) == bits(&first));
    // A light of the tree goes elsewhere, and ends.
    for light in [point(3, Vec3::new(0.4, 1.6, 0.4)), Light::point(Vec3::Y, Vec3::ZERO)] {
        now.lights[4] = light.clone();
        renderer.set_light(&mut uploaded, 4, &light).unwrap();
        let (set, fresh) = (image(&mut renderer, &uploaded, &now), renderer.upload(&now).unwrap());
        assert!(bits(&set) == bits(&image(&mut renderer, &fresh, &now)), "{light:?}");
        assert!(bits(&set) != bits(&first));
    }
}

/// Every pixel is finite, and none is dark for want of precision.
#[gpu_test]
fn gpu_extreme_lights_give_finite_sampled_light(gpu: &Gpu) {
    let at = |position: [f32; 3], power: f32| Light::point(position.into(), Vec3::splat(power));
    let with = |lights: Vec<Light>| {
        let mut scene = cornell(20, point);
        scene.lights.extend(lights);
        scene
    };
    let only = |lights: Vec<Light>| Scene { lights, ..cornell(0, point) };
    let far: Vec<Light> = (0..20).map(|i| at([1e4 * i as f32, 1e5, 1e5], 1e11)).collect();
    let dark = |i: usize, place: Vec3| Light::point(place, if i.is_multiple_of(2) { color(i) } else { Vec3::ZERO });
    let cases = [
        ("some without emission", cornell(40, dark), false),
        ("only lights without emission", cornell(40, |_, place| Light::point(place, Vec3::ZERO)), true),
        ("a thousand in one place", only(vec![at([0.0, 1.4, 0.3], 0.01); 1000]), false),
        (
            "in a wall, at a wall, and behind it",
            with(vec![at([-1.0, 1.0, 0.0], 1.0), at([0.0, 0.0, 0.5], 1.0), at([0.0, 1.0, -1.5], 9.0)]),
            false,
        ),
        ("all behind the wall", only((0..20).map(|i| at([0.08 * i as f32 - 0.8, 1.0, -2.0], 5.0)).collect()), true),
        ("far away", only(far), false),
        ("very bright", only((0..20).map(|i| at([0.05 * i as f32 - 0.5, 1.5, 0.2], 1e20)).collect()), false),
        ("very bright among others", with(vec![at([0.3, 1.4, 0.2], 1e20), at([0.3, 1.4, 0.2], f32::MAX)]), false),
        // Hidden by the floor, and other lights are nothing beside them.
        ("very bright at a surface", with(vec![at([0.0, 1e-5, 0.5], 1e30); 12]), true),
        (
            "very bright disks",
            only(vec![Light::disk(Vec3::new(0.0, 1.6, 0.0), Vec3::NEG_Y, 0.3, Vec3::splat(1e30)); 20]),
            false,
        ),
    ];
    let filtered = sampled().with_direct(SampledLights::default());
    for settings in [sampled(), filtered] {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        for (name, scene, is_dark) in &cases {
            let uploaded = renderer.upload(scene).unwrap();
            for frame in 0..3 {
                let image = image(&mut renderer, &uploaded, scene);
                let sum = energies(&linear(&image))[1];
                assert_eq!(sum > 0.0, !is_dark, "{name}, frame {frame}: {sum}");
            }
        }
    }
    // Equal lights in one place are equally likely: any of them stands for all.
    let (_, scene, _) = &cases[2];
    let of = |settings| linear(&render(gpu, scene, &scene.cameras[0], SMALL, settings));
    let settings = sampled().with_history(History::Off);
    let ratio = energy(&of(settings.clone()), &of(settings.with_direct(Direct::NONE)));
    println!("a thousand in one place: energy {ratio:.4}");
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}
