//! Effects of materials, alpha, sidedness and instances on an image.

use glam::{Affine3A, Vec2, Vec3, Vec4};
use lanternfish::{
    Settings,
    settings::{Anisotropy, Exposure, Materials, Shadows, ToneMap},
};
use lanternfish_gpu::{Gpu, testing};
use lanternfish_scene::{
    AlphaMode, Camera, Filter, Image, Instance, Light, Material, MipFilter, Primitive, Projection, Sampler, Scene,
    Texture, TextureRef, generate,
};

use crate::support::{Front, assert_near, bits, left_out_on_old_software, quad, render, scene_of, thin_dielectric};

fn unlit(color: Vec3) -> Material {
    Material { base_color: color.extend(1.0), unlit: true, ..Material::default() }
}

fn matt(color: Vec3) -> Material {
    Material { base_color: color.extend(1.0), metallic: 0.0, ..Material::default() }
}

/// The tracers of this adapter.
fn tracers(test: &str, gpu: &Gpu) -> Vec<Shadows> {
    if gpu.description.ray_query {
        return vec![Shadows::BVH, Shadows::RAY_QUERY];
    }
    testing::left_out(&format!("{test} by ray query"), "this adapter has none");
    vec![Shadows::BVH]
}

#[gpu_test]
fn gpu_unlit_and_emissive_surfaces_have_the_stated_radiance(gpu: &Gpu) {
    let (orange, glow) = (Vec3::new(0.8, 0.4, 0.1), Vec3::new(30.0, 20.0, 2.0));
    let mut scene = scene_of(
        vec![
            quad(0, Vec3::new(-1.0, 0.0, 0.0), Vec3::X * 0.5, Vec3::Y),
            quad(1, Vec3::new(1.0, 0.0, 0.0), Vec3::X * 0.5, Vec3::Y),
        ],
        vec![unlit(orange), Material { emissive: glow, base_color: Vec4::ZERO, ..Material::default() }],
    );
    scene.lights = vec![Light::directional(Vec3::NEG_Z, Vec3::splat(100.0))];
    scene.sky = Vec3::new(0.25, 0.5, 1.0);
    let front = Front::render(gpu, &scene, Settings::direct_light());
    assert_near(front.at(-1.0, 0.0), orange, 1.0, "unlit shows the base colour");
    assert_near(front.at(1.0, 0.0), glow, 1.0, "emission is in nits");
    assert_eq!(front.at(0.0, 0.0), scene.sky, "the sky is between them");

    // Check that the test can fail: a lit material gives another colour.
    scene.materials[0].unlit = false;
    let lit = Front::render(gpu, &scene, Settings::direct_light()).at(-1.0, 0.0);
    assert!((lit - orange).abs().max_element() > 0.05, "{lit}");

    // A display with exposure 1 is twice as bright; unlit white is white.
    scene.materials[0] = unlit(Vec3::splat(0.25));
    let settings = Settings::direct_light().with_exposure(Exposure::Ev(1.0)).with_tone_map(ToneMap::None);
    let rendering = Front::render(gpu, &scene, settings).0;
    let display = rendering.display[(32 * 64 + 16) as usize];
    // sRGB of 0.5 is 187.5.
    assert!(display[..3].iter().all(|v| (187..=188).contains(v)) && display[3] == 255, "{display:?}");
}

#[gpu_test]
fn gpu_a_white_matt_surface_reflects_what_lambert_says(gpu: &Gpu) {
    let mut scene = scene_of(vec![thin_dielectric(0, 0.0, 2.0)], vec![matt(Vec3::new(0.9, 0.5, 0.1))]);
    scene.lights = vec![Light::directional(Vec3::new(0.0, -3.0, -4.0), Vec3::splat(2.0))];
    let settings = Settings::direct_light().with_materials(Materials::Lambert);
    let front = Front::render(gpu, &scene, settings);
    // cos = 4/5.
    let expected = Vec3::new(0.9, 0.5, 0.1) * (2.0 * 0.8 / std::f32::consts::PI);
    for (x, y) in [(0.0, 0.0), (1.5, -1.5), (-1.8, 0.7)] {
        assert_near(front.at(x, y), expected, 1.0, "Lambert");
    }
}

/// A texture of two texels: opaque on the left, a hole on the right.
fn half_a_hole(scene: &mut Scene) -> TextureRef {
    scene.images.push(Image {
        name: String::new(),
        width: 2,
        height: 1,
        rgba: vec![255, 255, 255, 255, 255, 255, 255, 0],
    });
    scene.samplers.push(Sampler {
        mag: Filter::Nearest,
        min: Filter::Nearest,
        mip: MipFilter::None,
        ..Default::default()
    });
    scene.textures.push(Texture { image: scene.images.len() - 1, sampler: scene.samplers.len() - 1 });
    TextureRef::new(scene.textures.len() - 1)
}

#[gpu_test]
fn gpu_masks_have_holes_for_the_camera_and_for_shadow_rays(gpu: &Gpu) {
    let test = "gpu_masks_have_holes_for_the_camera_and_for_shadow_rays";
    let red = Vec3::new(0.7, 0.1, 0.05);
    let mut scene = scene_of(vec![thin_dielectric(0, 0.0, 2.0)], vec![matt(Vec3::splat(0.8))]);
    // The shadow of the masked square from a light at twice the distance: from -1.5 to 1.5 on the wall, beyond the part that the square
    // hides from the eye.
    scene.lights = vec![Light { range: Some(50.0), ..Light::point(Vec3::new(0.0, 0.0, 3.0), Vec3::splat(20.0)) }];
    let mut masked = scene.clone();
    let texture = half_a_hole(&mut masked);
    masked.materials.push(Material {
        base_color_texture: Some(texture),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        ..unlit(red)
    });
    masked.meshes[0].primitives.push(thin_dielectric(1, 1.0, 1.0));
    for shadows in tracers(test, gpu) {
        for materials in Materials::ALL.iter().copied() {
            let settings = || Settings::direct_light().with_shadows(shadows).with_materials(materials);
            let wall = Front::render(gpu, &scene, settings());
            let front = Front::render(gpu, &masked, settings());
            let what = format!("{shadows}, {materials}");
            if materials == Materials::File {
                assert_near(front.at(-0.5, 0.0), red, 1.0, &format!("{what}: the opaque half"));
            }
            assert_eq!(front.at(0.5, 0.0), wall.at(0.5, 0.0), "{what}: the wall behind the hole");
            assert_eq!(front.at(-1.3, 0.0), Vec3::ZERO, "{what}: the shadow of the opaque half");
            assert_eq!(front.at(1.3, 0.0), wall.at(1.3, 0.0), "{what}: no shadow of the hole");
            assert_eq!(front.at(-1.3, 1.8), wall.at(-1.3, 1.8), "{what}: beside the shadow");
            assert!(wall.at(-1.3, 0.0).min_element() > 0.1, "{what}: the wall is lit");
        }
    }
}

fn glass(color: Vec3, alpha: f32) -> Material {
    Material { base_color: color.extend(alpha), alpha_mode: AlphaMode::Blend, ..unlit(color) }
}

#[gpu_test]
fn gpu_transparent_surfaces_blend_far_to_near_in_any_draw_order(gpu: &Gpu) {
    let materials = vec![unlit(Vec3::ONE), glass(Vec3::X, 0.5), glass(Vec3::Y, 0.25)];
    let (wall, red, green) =
        (thin_dielectric(0, -1.0, 1.8), thin_dielectric(1, 2.0, 1.0), thin_dielectric(2, 1.0, 1.5));
    // Over white: a quarter of green, then half of red.
    let behind = 0.25 * Vec3::Y + 0.75 * Vec3::ONE;
    let expected = 0.5 * Vec3::X + 0.5 * behind;
    let mut renderings = Vec::new();
    for primitives in [[&wall, &red, &green], [&green, &red, &wall], [&red, &wall, &green]] {
        let scene = scene_of(primitives.into_iter().cloned().collect(), materials.clone());
        let front = Front::render(gpu, &scene, Settings::direct_light());
        // Each blend rounds.
        assert_near(front.at(0.0, 0.0), expected, 2.0, "both surfaces");
        assert_near(front.at(1.25, 0.0), behind, 1.0, "the far surface alone");
        assert_near(front.at(1.7, 0.0), Vec3::ONE, 1.0, "the wall alone");
        renderings.push(bits(&front.0));
    }
    assert!(renderings.iter().all(|rendering| *rendering == renderings[0]), "the image depends on the draw order");

    // Check that the test can fail: swapped surfaces give another colour.
    let swapped = scene_of(vec![wall, thin_dielectric(1, 1.0, 1.0), thin_dielectric(2, 2.0, 1.5)], materials.clone());
    let swapped = Front::render(gpu, &swapped, Settings::direct_light()).at(0.0, 0.0);
    assert!((swapped - expected).abs().max_element() > 0.1, "{swapped}");

    // Over the sky, alpha is the coverage of the surfaces; behind an opaque surface they are invisible.
    let scene = scene_of(vec![thin_dielectric(1, 2.0, 1.0)], materials.clone());
    let sky = Scene { sky: Vec3::splat(0.5), ..scene };
    let front = Front::render(gpu, &sky, Settings::direct_light());
    assert_near(front.at(0.0, 0.0), Vec3::new(0.75, 0.25, 0.25), 1.0, "a transparent surface over the sky");
    let hidden = scene_of(vec![thin_dielectric(1, -2.0, 1.0), thin_dielectric(0, 0.0, 1.5)], materials);
    assert_near(
        Front::render(gpu, &hidden, Settings::direct_light()).at(0.0, 0.0),
        Vec3::ONE,
        1.0,
        "a hidden transparent surface",
    );
}

#[gpu_test]
fn gpu_a_transparent_surface_has_its_own_lights_and_shadows(gpu: &Gpu) {
    let test = "gpu_a_transparent_surface_has_its_own_lights_and_shadows";
    // The wall is six metres behind the surface and out of the light's range: only the surface's own list contains the light.
    let glass = Material { base_color: Vec4::new(1.0, 1.0, 1.0, 0.5), alpha_mode: AlphaMode::Blend, ..matt(Vec3::ONE) };
    let mut scene =
        scene_of(vec![thin_dielectric(0, -4.0, 2.0), thin_dielectric(1, 2.0, 1.0)], vec![matt(Vec3::ONE), glass]);
    scene.lights = vec![Light { range: Some(2.0), ..Light::point(Vec3::new(0.5, 0.0, 2.5), Vec3::splat(3.0)) }];
    for shadows in tracers(test, gpu) {
        let settings = || Settings::direct_light().with_shadows(shadows);
        let lit = Front::render(gpu, &scene, settings());
        assert!(lit.at(0.0, 0.0).min_element() > 0.1 && lit.at(0.0, 0.5).min_element() > 0.05, "{shadows}: not lit");
        assert_eq!(lit.at(1.5, 0.0), Vec3::ZERO, "{shadows}: the wall is out of reach");

        // A small blocker half way from the light to the centre of the surface.
        let mut blocked = scene.clone();
        let along = Vec3::new(0.5, 0.0, 0.5).normalize();
        let right = Vec3::Y.cross(along);
        let blocker = quad(2, Vec3::new(0.25, 0.0, 2.25), right * 0.1, Vec3::Y * 0.1);
        blocked.materials.push(Material { double_sided: true, ..matt(Vec3::ONE) });
        blocked.meshes[0].primitives.push(blocker);
        let blocked = Front::render(gpu, &blocked, settings());
        assert_eq!(blocked.at(0.0, 0.0), Vec3::ZERO, "{shadows}: not shadowed");
        assert_eq!(blocked.at(0.0, 0.5), lit.at(0.0, 0.5), "{shadows}: shadowed beside the blocker");
    }
    // Without shadows the blocker has no effect.
    let open = Front::render(gpu, &scene, Settings::direct_light().with_shadows(Shadows::None));
    assert!(open.at(0.0, 0.0).min_element() > 0.1);
}

#[gpu_test]
fn gpu_back_faces_show_where_a_material_is_double_sided(gpu: &Gpu) {
    // Faces away from the viewer.
    let back = quad(0, Vec3::ZERO, Vec3::NEG_X, Vec3::Y);
    let towards = thin_dielectric(0, 0.0, 1.0);
    let render = |primitive: &Primitive, double_sided, settings| {
        let material = Material { double_sided, ..matt(Vec3::new(0.9, 0.6, 0.3)) };
        let mut scene = scene_of(vec![primitive.clone()], vec![material]);
        scene.lights = vec![Light::directional(Vec3::new(0.3, -0.2, -1.0), Vec3::splat(3.0))];
        scene.sky = Vec3::Z;
        Front::render(gpu, &scene, settings).at(0.0, 0.0)
    };
    let front = render(&towards, false, Settings::direct_light());
    assert!(front.min_element() > 0.1);
    assert_eq!(render(&back, false, Settings::direct_light()), Vec3::Z, "a back face shows");
    // Lit as if it faced the viewer: its normal is flipped.
    assert_near(render(&back, true, Settings::direct_light()), front, 1.0, "the back of a double-sided surface");
    // `lambert` is two-sided.
    let lambert = || Settings::direct_light().with_materials(Materials::Lambert);
    assert_near(render(&back, false, lambert()), render(&towards, false, lambert()), 1.0, "the back under lambert");
}

/// A crumpled sheet with a normal map: nothing about it is symmetric.
fn crumpled() -> Scene {
    let n = 12u32;
    let mut sheet = Primitive::default();
    let height = |s: f32, t: f32| 0.3 * (5.0 * s + 2.0 * t).sin() + 0.2 * (3.0 * t * t + s).cos();
    for y in 0..=n {
        for x in 0..=n {
            let (s, t) = (x as f32 / n as f32, y as f32 / n as f32);
            let p = |s: f32, t: f32| Vec3::new(3.0 * s - 1.3, 3.0 * t - 1.6, height(s, t));
            let (along_s, along_t) = (p(s + 1e-2, t) - p(s - 1e-2, t), p(s, t + 1e-2) - p(s, t - 1e-2));
            sheet.positions.push(p(s, t));
            sheet.normals.push(along_s.cross(along_t).normalize());
            let tangent = along_s.reject_from_normalized(*sheet.normals.last().unwrap()).normalize();
            sheet.tangents.push(tangent.extend(1.0));
            sheet.uv0.push(Vec2::new(s, 1.0 - t));
        }
    }
    for y in 0..n {
        for x in 0..n {
            let a = y * (n + 1) + x;
            sheet.indices.extend([a, a + 1, a + n + 2, a, a + n + 2, a + n + 1]);
        }
    }
    let mut scene =
        scene_of(vec![sheet], vec![Material { perceptual_roughness: 0.4, ..matt(Vec3::new(0.8, 0.7, 0.5)) }]);
    let texel = |i: u32| {
        let bent = |k: u32| (128.0 + 90.0 * ((i * k) as f32 * 1.7).sin()) as u8;
        [bent(3), bent(5), 220, 255]
    };
    scene.images.push(Image { name: String::new(), width: 8, height: 8, rgba: (0..64).flat_map(texel).collect() });
    scene.samplers.push(Sampler::default());
    scene.textures.push(Texture { image: 0, sampler: 0 });
    scene.materials[0].normal_texture = Some(TextureRef::new(0));
    scene.lights = vec![
        Light { range: Some(20.0), ..Light::point(Vec3::new(1.5, 1.0, 1.6), Vec3::splat(6.0)) },
        Light::directional(Vec3::new(-0.6, -0.5, -0.7), Vec3::splat(1.0)),
    ];
    scene
}

#[gpu_test]
fn gpu_a_mirrored_instance_is_the_image_in_a_mirror(gpu: &Gpu) {
    let test = "gpu_a_mirrored_instance_is_the_image_in_a_mirror";
    if left_out_on_old_software(test, gpu, "702 of 4,096 pixels differ there; the cause is not known") {
        return;
    }
    let scene = crumpled();
    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let mut mirrored = scene.clone();
    mirrored.instances[0].world_from_object = mirror;
    for light in &mut mirrored.lights {
        light.position = mirror.transform_point3(light.position);
        light.direction = mirror.transform_vector3(light.direction);
    }
    for materials in Materials::ALL.iter().copied() {
        let settings = || Settings::direct_light().with_materials(materials);
        let plain = Front::render(gpu, &scene, settings()).0;
        let other = Front::render(gpu, &mirrored, settings()).0;
        let width = plain.width as usize;
        let flipped = other.radiance.chunks_exact(width).flat_map(|row| row.iter().rev());
        // Rounding moves edges and shadows across pixel centres: a few pixels may differ.
        let differ = plain
            .radiance
            .iter()
            .zip(flipped)
            .filter(|(a, b)| (0..3).any(|i| (a[i] - b[i]).abs() > 0.01 * a[i].max(b[i]) + 1e-4));
        let (differ, pixels) = (differ.count(), plain.radiance.len());
        println!("{materials}: {differ} of {pixels} pixels differ from the mirror's");
        assert!(differ <= pixels / 200, "{materials}: {differ} of {pixels}");
        // Check that the test can fail: without the flip most pixels differ.
        let unflipped = plain.radiance.iter().zip(&other.radiance).filter(|(a, b)| a != b).count();
        assert!(unflipped > pixels / 2, "the image is its own mirror");
        let lit = plain.radiance.iter().filter(|texel| texel[1] > 0.05).count();
        assert!(lit > pixels / 4, "{lit} pixels are lit");
    }
}

#[gpu_test]
fn gpu_two_instances_of_a_mesh_stand_where_they_are_placed(gpu: &Gpu) {
    let mut scene = scene_of(vec![thin_dielectric(0, 0.0, 0.3)], vec![unlit(Vec3::ONE)]);
    let instance = |x: f32, scale: f32| Instance {
        name: String::new(),
        mesh: 0,
        world_from_object: Affine3A::from_scale_rotation_translation(
            Vec3::new(scale, 1.0, 1.0),
            glam::Quat::IDENTITY,
            Vec3::new(x, 0.5, 0.0),
        ),
    };
    scene.instances = vec![instance(-1.0, 1.0), instance(1.0, -1.0), instance(0.0, 0.4)];
    let front = Front::render(gpu, &scene, Settings::direct_light());
    for (x, y, there) in [(-1.0, 0.5, 1.0), (1.0, 0.5, 1.0), (0.0, 0.5, 1.0), (0.2, 0.5, 0.0), (-1.0, 0.0, 0.0)] {
        assert_eq!(front.at(x, y), Vec3::splat(there), "at {x}, {y}");
    }
}

#[gpu_test]
fn gpu_orthographic_and_perspective_views_show_the_same_scene(gpu: &Gpu) {
    let scene = generate::demo("cornell").unwrap();
    let rendering = |projection| {
        // From far away the two projections are almost equal.
        let camera = Camera::look_at(Vec3::new(0.0, 1.0, 400.0), Vec3::Y, projection);
        render(gpu, &scene, &camera, (60, 60), Settings::direct_light().with_materials(Materials::Lambert))
    };
    let half_height = 1.2f32;
    let parallel = rendering(Projection::Orthographic { half_height, near: 390.0, far: 410.0 });
    let central = rendering(Projection::Perspective { fov_y: 2.0 * (half_height / 400.0).atan(), near: 390.0 });
    // Silhouettes of the blocks and shadow edges move by up to one metre in four hundred: 1/7 of a pixel.
    let differ = parallel
        .radiance
        .iter()
        .zip(&central.radiance)
        .filter(|(a, b)| (0..3).any(|i| (a[i] - b[i]).abs() > 0.02 * a[i].max(b[i]) + 1e-3));
    let differ = differ.count();
    println!("{differ} of 3600 pixels differ between projections");
    assert!(differ < 3600 / 20, "{differ} pixels differ");
    assert!(parallel.radiance.iter().filter(|texel| texel[0] > 0.01).count() > 1000);
}

#[gpu_test]
fn gpu_anisotropy_keeps_stripes_at_grazing_angles(gpu: &Gpu) {
    let test = "gpu_anisotropy_keeps_stripes_at_grazing_angles";
    if left_out_on_old_software(test, gpu, "it stalls") {
        return;
    }
    // Stripes two texels wide; a pixel covers one texel across them and eight along them.
    let slope = quad(0, Vec3::ZERO, Vec3::X * 2.0, Vec3::new(0.0, 0.25, -2.0));
    let mut scene = scene_of(vec![slope], vec![unlit(Vec3::ONE)]);
    let texel = |i: u32| if i & 2 == 0 { [255; 4] } else { [0, 0, 0, 255] };
    let rgba = (0..64 * 64).flat_map(texel).collect();
    scene.images.push(Image { name: String::new(), width: 64, height: 64, rgba });
    scene.samplers.push(Sampler::default());
    scene.textures.push(Texture { image: 0, sampler: 0 });
    scene.materials[0].base_color_texture = Some(TextureRef::new(0));
    let contrast = |anisotropy| {
        let front = Front::render(gpu, &scene, Settings::direct_light().with_anisotropy(anisotropy));
        (0..62).map(|i| (front.at(-1.97 + i as f32 / 16.0, 0.0).x - 0.5).abs()).sum::<f32>() / 62.0
    };
    let contrasts = [Anisotropy::X1, Anisotropy::X2, Anisotropy::X4, Anisotropy::X8].map(contrast);
    println!("contrast at 1, 2, 4, 8 samples: {contrasts:?}");
    assert!(contrasts.is_sorted() && contrasts[0] < 0.1 && contrasts[3] > 0.4, "{contrasts:?}");
    // More samples than the footprint's length change nothing; `auto` is among them.
    assert_eq!(contrast(Anisotropy::X16), contrasts[3]);
    assert!(contrast(Anisotropy::Auto) >= contrasts[2]);
}
