//! Light on transparent surfaces from other surfaces and the environment, and the transmission of dielectric surfaces.

use glam::{UVec2, Vec3, Vec4};
use lanternfish::{
    Renderer, Settings,
    settings::{Indirect, Occlusion, Samples},
    techniques::Sampled,
};
use lanternfish_gpu::Gpu;
use lanternfish_scene::{AlphaMode, Camera, Filter, Image, Material, Projection, Sampler, Scene, Texture, TextureRef};

use crate::{
    Deep, Hbao,
    testing::{self, apart, quad, scene_of},
};

/// The size is not a multiple of the workgroup size.
const SIZE: UVec2 = UVec2::new(37, 29);
const TINT: Vec3 = Vec3::new(0.5, 1.0, 0.25);

fn sampled() -> Settings {
    Settings::direct_light().with_indirect(Sampled::default())
}

fn occlusion(occlusion: Occlusion) -> Settings {
    Settings::direct_light().with_indirect(Indirect::NONE).with_occlusion(occlusion)
}

/// The mean of 16 x 16 pixels in the middle of an image from 3 m in front of the origin; a single pixel's few rays are noisy.
fn middle(gpu: &Gpu, settings: Settings, scene: &Scene) -> Vec3 {
    let camera = Camera::look_at(3.0 * Vec3::Z, Vec3::ZERO, Projection::Perspective { fov_y: 0.1, near: 0.02 });
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let rendering = renderer.render(&uploaded, &camera, SIZE.into()).unwrap();
    let corner = SIZE / 2 - 8;
    let pixels = (0..256).map(|i| corner + UVec2::new(i % 16, i / 16)).map(|p| (SIZE.x * p.y + p.x) as usize);
    pixels.map(|pixel| Vec4::from(rendering.radiance[pixel]).truncate()).sum::<Vec3>() / 256.0
}

fn transparent(base_color: Vec4, perceptual_roughness: f32) -> Material {
    Material {
        base_color,
        metallic: 0.0,
        perceptual_roughness,
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    }
}

fn glass() -> Material {
    Material { transmission: 1.0, ..transparent(TINT.extend(1.0), 0.0) }
}

/// Sheets at these depths, rotated about the vertical axis, under a white sky.
fn sheets(material: Material, depths: &[f32], rotation: f32) -> Scene {
    let right = 20.0 * Vec3::new(rotation.cos(), 0.0, rotation.sin());
    let sheet = |z: &f32| quad(0, *z * Vec3::Z, right, 20.0 * Vec3::Y);
    Scene { sky: Vec3::ONE, ..apart(&scene_of(depths.iter().map(sheet).collect(), vec![material])) }
}

fn assert_near(actual: Vec3, expected: Vec3, most: f32, what: &str) {
    assert!((actual - expected).abs().max_element() < most, "{what}: {actual}, not {expected}");
}

#[gpu_test]
fn gpu_glass_tints_the_background_and_mirrors_the_foreground(gpu: &Gpu) {
    for rotation in [0.0f32, 0.8, 1.3] {
        let reflected = 0.04 + 0.96 * (1.0 - rotation.cos()).powi(5);
        let passing = (1.0 - reflected) * TINT;
        for settings in [sampled(), sampled().with_samples(Samples::Four)] {
            let actual = middle(gpu, settings, &sheets(glass(), &[0.0], rotation));
            // The transmitted fraction is a fit.
            assert_near(actual, passing + reflected, 0.015, "a sheet of glass");
        }
        // Two sheets, each of which mirrors the sky.
        let actual = middle(gpu, sampled(), &sheets(glass(), &[0.0, -0.5], rotation));
        assert_near(actual, passing * (passing + reflected) + reflected, 0.02, "two sheets of glass");
    }
    // Half transmissive.
    let painted = Material { transmission: 0.5, ..glass() };
    let actual = middle(gpu, sampled(), &sheets(painted, &[0.0], 0.0));
    assert_near(actual, 0.96 * TINT + 0.04, 0.015, "half painted");
    // With ambient occlusion instead of rays.
    for technique in [Occlusion::from(Deep::default()), Occlusion::from(Hbao { radius: 1.0, ..Hbao::default() })] {
        let actual = middle(gpu, occlusion(technique), &sheets(glass(), &[0.0], 0.0));
        assert_near(actual, 0.96 * TINT + 0.04, 0.015, "with ambient occlusion");
    }
}

/// Alpha is the coverage of glass, for any transmission.
#[gpu_test]
fn gpu_alpha_is_the_coverage_of_glass(gpu: &Gpu) {
    let thin_dielectric = |alpha_mode, alpha: u8| {
        let mut scene =
            sheets(Material { alpha_mode, base_color_texture: Some(TextureRef::new(0)), ..glass() }, &[0.0], 0.0);
        scene.images = vec![Image { name: String::new(), width: 1, height: 1, rgba: vec![255, 255, 255, alpha] }];
        scene.samplers = vec![Sampler { mag: Filter::Nearest, ..Sampler::default() }];
        scene.textures = vec![Texture { image: 0, sampler: 0 }];
        scene
    };
    let there = 0.96 * TINT + 0.04;
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    for (alpha_mode, alpha, fraction) in [
        (AlphaMode::Opaque, 0, 1.0),
        (mask, 102, 0.0),
        (mask, 204, 1.0),
        (AlphaMode::Blend, 0, 0.0),
        (AlphaMode::Blend, 102, 0.4),
        (AlphaMode::Blend, 255, 1.0),
    ] {
        let in_screen_space = occlusion(Occlusion::from(Hbao { radius: 1.0, ..Hbao::default() }));
        for settings in [Some(sampled()), (alpha == 102).then_some(in_screen_space)].into_iter().flatten() {
            let actual = middle(gpu, settings, &thin_dielectric(alpha_mode, alpha));
            assert_near(actual, Vec3::ONE.lerp(there, fraction), 0.015, &format!("{alpha_mode:?}, alpha {alpha}"));
        }
    }
}

/// Lighting of transparent surfaces runs for exactly the views that show some.
#[gpu_test]
fn gpu_glass_may_be_in_a_later_view_only(gpu: &Gpu) {
    let scene = Scene { sky: Vec3::ONE, ..scene_of(vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y)], vec![glass()]) };
    let [towards, away] = [Vec3::ZERO, 50.0 * Vec3::X].map(|target| {
        let projection = Projection::Perspective { fov_y: 0.1, near: 0.02 };
        Camera::look_at(target + 3.0 * Vec3::Z, target, projection)
    });
    for settings in [sampled(), occlusion(Occlusion::from(Hbao { radius: 1.0, ..Hbao::default() }))] {
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        let [towards, away] = [(&towards, SIZE.into()), (&away, [SIZE.y, SIZE.x])];
        let renderings = renderer.render_views(&uploaded, &[away, towards, away, towards]).unwrap();
        let alone = renderer.render(&uploaded, towards.0, SIZE.into()).unwrap();
        assert!(renderings[1].radiance == alone.radiance && renderings[3].radiance == alone.radiance);
        assert!(renderings[0].radiance.iter().all(|pixel| pixel[..3] == [1.0; 3]), "the sky alone");
    }
}

#[gpu_test]
fn gpu_glass_mirrors_emitters_behind_the_viewer(gpu: &Gpu) {
    let lamp = Material { emissive: Vec3::new(50.0, 100.0, 25.0), ..Material::default() };
    let sheet = quad(0, Vec3::ZERO, Vec3::X, Vec3::Y);
    let behind = quad(1, 6.0 * Vec3::Z, -4.0 * Vec3::X, 4.0 * Vec3::Y);
    let scene = apart(&scene_of(vec![sheet, behind], vec![glass(), lamp]));
    for settings in [sampled(), sampled().with_samples(Samples::Four)] {
        assert_near(middle(gpu, settings, &scene), Vec3::new(2.0, 4.0, 1.0), 0.02, "0.04 of the lamp");
    }
    // Negative control: without rays the mirror is black.
    let dark = Settings::direct_light().with_indirect(Indirect::NONE);
    assert_eq!(middle(gpu, dark, &scene), Vec3::ZERO);
}

#[gpu_test]
fn gpu_the_sky_lights_transparent_surfaces(gpu: &Gpu) {
    // White with alpha 0.5: the covered fraction reflects all light.
    let scene = sheets(transparent(Vec4::new(1.0, 1.0, 1.0, 0.5), 0.5), &[0.0], 0.4);
    for settings in [
        sampled(),
        sampled().with_samples(Samples::Four),
        occlusion(Occlusion::from(Deep::default())),
        occlusion(Occlusion::from(Hbao { radius: 1.0, ..Hbao::default() })),
    ] {
        assert_near(middle(gpu, settings, &scene), Vec3::ONE, 0.02, "half a white sheet");
    }
}

/// A lens of two sheets, the near one first in the mesh: the far one is visible through the near one.
#[gpu_test]
fn gpu_the_far_side_of_glass_is_seen_through_the_near_one(gpu: &Gpu) {
    let near = quad(0, 0.1 * Vec3::Z, Vec3::X, Vec3::Y);
    let far = quad(0, -0.1 * Vec3::Z, -Vec3::X, Vec3::Y);
    let lens = |material: &Material| {
        let mut scene = scene_of(vec![near.clone(), far.clone()], vec![material.clone()]);
        let [near, far] = scene.meshes[0].primitives.get_disjoint_mut([0, 1]).unwrap();
        let first = near.positions.len() as u32;
        near.positions.append(&mut far.positions);
        near.normals.append(&mut far.normals);
        near.uv0.append(&mut far.uv0);
        near.indices.extend(far.indices.iter().map(|index| first + index));
        scene.meshes[0].primitives.truncate(1);
        scene
    };
    let shining = Material { emissive: Vec3::new(1.0, 2.0, 4.0), ..glass() };
    let emitted = 0.96 * TINT * shining.emissive + shining.emissive;
    assert_near(middle(gpu, Settings::direct_light(), &lens(&shining)), emitted, 0.05, "glass");
}
