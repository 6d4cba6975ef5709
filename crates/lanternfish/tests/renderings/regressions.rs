//! Regression tests: each failed before its fix.

use glam::{Vec2, Vec3, Vec4};
use lanternfish::{
    Settings,
    settings::{DebugView, Exposure, Preset, RayCulling, Shadows, ToneMap},
};
use lanternfish_gpu::testing;
use lanternfish_scene::{Camera, Image, Light, Material, Projection, Sampler, Scene, Texture, TextureRef, generate};

use crate::support::{EDGE, Front, assert_near, linear, quad, render, scene_of, thin_dielectric};

fn matt(color: Vec3) -> Material {
    Material { base_color: color.extend(1.0), metallic: 0.0, ..Material::default() }
}

/// A white texture of 4 x 4 texels with trilinear, and so anisotropic, filtering.
fn white_texture(scene: &mut Scene) -> TextureRef {
    scene.images.push(Image { name: String::new(), width: 4, height: 4, rgba: vec![255; 64] });
    scene.samplers.push(Sampler::default());
    scene.textures.push(Texture { image: scene.images.len() - 1, sampler: scene.samplers.len() - 1 });
    TextureRef::new(scene.textures.len() - 1)
}

#[gpu_test]
fn gpu_a_texture_seen_at_one_point_is_not_nan(gpu: &Gpu) {
    let mut scene = scene_of(vec![thin_dielectric(0, 0.0, 2.0)], vec![matt(Vec3::new(0.5, 0.4, 0.3))]);
    scene.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(3.0))];
    let plain = Front::render(gpu, &scene, Settings::direct_light()).at(0.0, 0.0);
    scene.materials[0].base_color_texture = Some(white_texture(&mut scene));
    for uv in [vec![Vec2::splat(0.5); 4], vec![Vec2::splat(-1000.3); 4], Vec::new()] {
        scene.meshes[0].primitives[0].uv0 = uv;
        // Means of frames filter with gradients computed in the shader.
        for accumulate in [1, 3] {
            let front = Front::render(gpu, &scene, Settings::direct_light().with_accumulate(accumulate));
            for (x, y) in [(0.0, 0.0), (-1.9, 1.9), (1.3, -0.2)] {
                assert_near(front.at(x, y), plain, 1.0, "one point of a white texture");
            }
        }
    }
    // Coordinates that differ by a unit in the last place, as files of palettes have them.
    let [least, most] = [0.5589074f32, 0.5589074f32.next_up()];
    let camera =
        Camera::look_at(Vec3::new(2.0, -3.0, 3.0), Vec3::ZERO, Projection::Perspective { fov_y: 0.8, near: 0.1 });
    for uv in [[least, most, least, least], [least, most, most, least], [least; 4], [least, least, most, most]] {
        scene.meshes[0].primitives[0].uv0 = uv.map(|u| Vec2::new(u, 0.437_992_16)).into();
        let rendering = render(gpu, &scene, &camera, (EDGE, EDGE), Settings::direct_light());
        let wrong = rendering.radiance.iter().filter(|pixel| pixel.iter().any(|value| !value.is_finite())).count();
        assert_eq!(wrong, 0, "{uv:?}");
    }
}

#[gpu_test]
fn gpu_a_tangent_along_the_normal_is_not_nan(gpu: &Gpu) {
    let mut scene = scene_of(vec![thin_dielectric(0, 0.0, 2.0)], vec![matt(Vec3::splat(0.5))]);
    scene.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(3.0))];
    let normal_map = white_texture(&mut scene);
    // Flat: (0.5, 0.5, 1).
    scene.images[0].rgba = [128, 128, 255, 255].repeat(16);
    scene.materials[0].normal_texture = Some(normal_map);
    scene.meshes[0].primitives[0].tangents = vec![Vec3::X.extend(1.0); 4];
    let sound = Front::render(gpu, &scene, Settings::direct_light()).at(0.0, 0.0);
    assert!(sound.min_element() > 0.1);
    scene.meshes[0].primitives[0].tangents = vec![Vec3::Z.extend(1.0); 4];
    let along = Front::render(gpu, &scene, Settings::direct_light()).at(0.0, 0.0);
    // The map's 128 is 0.004 above the middle; only a valid tangent applies it.
    assert!((along - sound).abs().max_element() < 0.01 * sound.x, "{along}, not {sound}");
}

#[gpu_test]
fn gpu_a_far_plane_far_away_casts_no_shadows(gpu: &Gpu) {
    // A slope with a block on it, in an orthographic view.
    let slope = quad(0, Vec3::ZERO, Vec3::X * 3.0, Vec3::new(0.0, 2.0, -2.0));
    let block = thin_dielectric(0, 1.0, 0.3);
    let mut scene = scene_of(vec![slope, block], vec![matt(Vec3::splat(0.8))]);
    scene.lights = vec![Light::directional(Vec3::new(0.2, -0.3, -1.0), Vec3::splat(3.0))];
    let lit = |far: f32| {
        let projection = Projection::Orthographic { half_height: 2.0, near: 0.0, far };
        let camera = Camera::look_at(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, projection);
        let rendering = render(gpu, &scene, &camera, (64, 64), Settings::direct_light());
        rendering.radiance.iter().filter(|texel| texel[0] > 0.0).count()
    };
    let near = lit(20.0);
    assert!((3000..64 * 64).contains(&near), "the block's shadow is there: {near} lit pixels");
    for far in [1e3, 1e5, 1e7] {
        assert_eq!(lit(far), near, "far plane at {far}");
    }
}

#[gpu_test]
fn gpu_light_from_behind_does_not_come_through(gpu: &Gpu) {
    let mut scene = scene_of(vec![thin_dielectric(0, 0.0, 2.0)], vec![matt(Vec3::splat(0.8))]);
    // The vertex normals tilt by 60 degrees towards a lamp behind the thin surface.
    scene.meshes[0].primitives[0].normals = vec![Vec3::new(0.866, 0.0, 0.5).normalize(); 4];
    let lamp = |z: f32| Light { range: Some(50.0), ..Light::point(Vec3::new(3.0, 0.0, z), Vec3::splat(20.0)) };
    for ray_culling in RayCulling::ALL {
        let settings = || Settings::direct_light().with_ray_culling(*ray_culling);
        scene.lights = vec![lamp(-0.5)];
        assert_eq!(Front::render(gpu, &scene, settings()).at(0.0, 0.0), Vec3::ZERO, "{ray_culling}");
        scene.lights = vec![lamp(0.5)];
        assert!(Front::render(gpu, &scene, settings()).at(0.0, 0.0).x > 0.1, "{ray_culling}: light from the front");
    }
}

#[gpu_test]
fn gpu_the_sun_ends_beyond_the_largest_scene(gpu: &Gpu) {
    // A glass surface a thousand kilometres behind a roof that hides the sun from it.
    let kilometre = 1e3;
    let glass = Material {
        alpha_mode: lanternfish_scene::AlphaMode::Blend,
        base_color: Vec4::new(0.8, 0.8, 0.8, 0.9),
        metallic: 0.0,
        ..Material::default()
    };
    let thin_dielectric = quad(0, Vec3::ZERO, Vec3::X * kilometre, Vec3::Y * kilometre);
    let roof = |x: f32| quad(1, Vec3::new(x, 0.0, 1e6), Vec3::X * 5.0 * kilometre, Vec3::Y * 5.0 * kilometre);
    let camera =
        Camera::look_at(Vec3::Z * 2.0 * kilometre, Vec3::ZERO, Projection::Perspective { fov_y: 0.5, near: 1.0 });
    let middle = |scene: &Scene| render(gpu, scene, &camera, (9, 9), Settings::direct_light()).radiance[40][0];
    let sun = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(3.0))];
    let materials = vec![glass, matt(Vec3::ONE)];
    let open = Scene {
        lights: sun.clone(),
        ..scene_of(vec![thin_dielectric.clone(), roof(20.0 * kilometre)], materials.clone())
    };
    let covered = Scene { lights: sun, ..scene_of(vec![thin_dielectric, roof(0.0)], materials) };
    assert!(middle(&open) > 0.1);
    assert_eq!(middle(&covered), 0.0);
}

#[gpu_test]
fn gpu_base_color_is_shown_as_it_is(gpu: &Gpu) {
    let scene = scene_of(vec![thin_dielectric(0, 0.0, 2.0)], vec![matt(Vec3::ONE)]);
    for (tone_map, exposure) in [(ToneMap::Neutral, Exposure::Auto), (ToneMap::Reinhard, Exposure::Ev(2.0))] {
        let settings = Settings::direct_light()
            .with_debug_view(Some(DebugView::BaseColor))
            .with_tone_map(tone_map)
            .with_exposure(exposure);
        assert_eq!(Front::render(gpu, &scene, settings).0.display[0], [255; 4]);
    }
}

#[gpu_test]
fn gpu_a_hole_at_the_depth_of_a_surface_shades_nothing(gpu: &Gpu) {
    let red = Vec3::new(0.8, 0.1, 0.1);
    let mut scene = scene_of(vec![thin_dielectric(0, 0.0, 2.0)], vec![matt(red)]);
    scene.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(3.0))];
    let alone = Front::render(gpu, &scene, Settings::direct_light()).at(0.0, 0.0);
    // The same surface, drawn later, green, and fully masked out.
    let hole = Material {
        base_color: Vec4::new(0.1, 0.8, 0.1, 0.0),
        alpha_mode: lanternfish_scene::AlphaMode::Mask { cutoff: 0.5 },
        ..matt(red)
    };
    scene.materials.push(hole);
    scene.meshes[0].primitives.push(thin_dielectric(1, 0.0, 2.0));
    for shadows in [Shadows::BVH, Shadows::None] {
        let settings = Settings::direct_light().with_shadows(shadows);
        assert_eq!(Front::render(gpu, &scene, settings).at(0.0, 0.0), alone, "{shadows}");
    }
}

/// The ceiling beside the lamp of the Cornell box sends more than a hundred times the light of others, and few rays hit it: one frame of draft had spots.
/// Blocks of 8 x 8 pixels of the back wall.
#[gpu_test]
fn gpu_a_ceiling_beside_a_lamp_leaves_no_spots_on_a_wall(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let blocks = |settings: Settings| -> Vec<f32> {
        let image = linear(&render(gpu, &scene, &scene.cameras[0], (128, 128), settings)).pixels;
        let block = |i: usize| -> f32 {
            let (x, y) = (30 + 8 * (i % 8), 28 + 8 * (i / 8));
            (0..64).map(|at| image[128 * (y + at / 8) + x + at % 8][1]).sum()
        };
        (0..24).map(block).collect()
    };
    let expected = blocks(Settings::of_preset(Preset::Good).with_accumulate(16));
    let actual = blocks(Settings::of_preset(Preset::Draft));
    let ratios: Vec<f32> = actual.iter().zip(&expected).map(|(actual, expected)| actual / expected).collect();
    let rms = (ratios.iter().map(|ratio| (ratio - 1.0).powi(2)).sum::<f32>() / 24.0).sqrt();
    // Measured: 0.07; without rays that are aimed at the ceiling 0.15, and a block of 1.4.
    assert!(rms < 0.1 && ratios.iter().all(|ratio| *ratio < 1.2), "{rms}: {ratios:.2?}");
}
