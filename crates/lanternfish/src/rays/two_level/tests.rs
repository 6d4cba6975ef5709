//! Two levels against the flattened scene.

mod counts;
mod moves;

use glam::{Affine3A, Mat3A, Vec3, Vec4};
use lanternfish_gpu::{Gpu, Made, read_back, testing};
use lanternfish_scene::{
    AlphaMode, Camera, Image, Instance, Light, Material, Mesh, Sampler, Scene, Texture, TextureRef,
};

use crate::{
    GpuScene, RenderError, Renderer, Settings,
    rays::{TracedRay, tests::distances},
    settings::{Shadows, Tracer},
    techniques::{Bounces, Sampled, SampledLights},
    testing::{Random, looking, quad, scene_of},
};

/// A floor, a mesh of solid and masked leaves with `count` instances, of which some are mirrored, sheared, small, flat
/// or have no size, and one instance of another mesh.
fn copies(count: usize) -> Scene {
    let mut random = Random::new(7);
    let alpha = [0, 255, 255, 0].into_iter().flat_map(|alpha| [200, 120, 80, alpha]).collect();
    let masked = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color_texture: Some(TextureRef { texture: 0, uv_set: 0, texture_from_uv: Default::default() }),
        double_sided: true,
        ..Material::default()
    };
    let solid = Material { double_sided: true, ..Material::default() };
    let mut scene = scene_of(vec![quad(0, Vec3::ZERO, 30.0 * Vec3::X, -30.0 * Vec3::Z)], vec![solid, masked]);
    scene.images.push(Image { width: 2, height: 2, rgba: alpha, ..Image::default() });
    scene.samplers.push(Sampler::default());
    scene.textures.push(Texture { image: 0, sampler: 0 });
    let leaf = |i: usize| {
        let right = random.direction();
        let up = right.cross(random.direction()).normalize();
        quad(i % 2, random.point(), 0.3 * right, 0.3 * up)
    };
    let leaves = (0..40).map(leaf).collect();
    scene.meshes.push(Mesh { name: "leaves".to_owned(), primitives: leaves });
    scene.meshes.push(Mesh { name: "one".to_owned(), primitives: vec![quad(0, Vec3::Y, Vec3::X, Vec3::Y)] });
    for i in 0..count {
        let rotation = Mat3A::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let [x, y, z] = match i % 8 {
            1 => [-1.0, 1.0, 1.0],
            2 => [0.01, 0.01, 0.01],
            3 if i < 16 => [1.0, 0.0, 1.0],
            4 if i < 16 => [0.0, 0.0, 0.0],
            5 => [2.0, 0.5, 1.0],
            _ => [1.0, 1.0, 1.0],
        };
        let mut matrix3 = rotation * Mat3A::from_diagonal(Vec3::new(x, y, z));
        if i % 8 == 6 {
            matrix3 *= Mat3A::from_cols_array(&[1.0, 0.0, 0.0, 0.7, 1.0, 0.0, 0.2, -0.4, 1.0]);
        }
        let place = Vec3::new(20.0, 1.0, 20.0) * (random.point() - Vec3::new(0.0, -2.0, 0.0));
        let world_from_object = Affine3A { matrix3, translation: place.into() };
        scene.instances.push(Instance { name: String::new(), mesh: 1, world_from_object });
    }
    scene.instances.push(Instance { name: String::new(), mesh: 2, world_from_object: Affine3A::IDENTITY });
    scene.lights.push(Light::directional(Vec3::new(0.3, -1.0, -0.2), Vec3::splat(3.0)));
    assert_eq!(scene.validate(), Ok(()));
    scene
}

fn camera() -> Camera {
    looking([4.0, 9.0, 26.0], [0.0, 1.0, 0.0])
}

fn settings(tracer: Tracer) -> Settings {
    Settings::direct_light().with_shadows(Shadows::Traced(tracer)).with_samples(crate::settings::Samples::One)
}

fn renderer(gpu: &Gpu, tracer: Tracer) -> Renderer {
    Renderer::with_engine(&testing::engine(gpu), settings(tracer)).unwrap()
}

fn rays(count: usize) -> Vec<TracedRay> {
    let mut random = Random::new(3);
    let ray = |_| {
        let origin = Vec3::new(22.0, 3.0, 22.0) * random.point() + Vec3::new(0.0, 2.0, 0.0);
        TracedRay::new(origin, random.direction(), 0.0, 0, false)
    };
    (0..count).map(ray).collect()
}

/// Rays whose distances differ, of those that hit.
fn differing(a: &[f32], b: &[f32]) -> [usize; 2] {
    let is_other = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-4 * a.abs().max(1.0);
    [a.iter().zip(b).filter(is_other).count(), a.iter().filter(|t| **t > 0.0).count()]
}

#[gpu_test]
fn gpu_rays_hit_the_same_in_two_levels(gpu: &Gpu) {
    let (scene, rays) = (copies(300), rays(20_000));
    let uploaded = [Tracer::BVH, Tracer::TWO_LEVEL].map(|tracer| renderer(gpu, tracer).upload(&scene).unwrap());
    let count = |name: &str| {
        uploaded[1].counters().iter().find(|(own, _)| own == name).map(|(_, count)| *count as usize).unwrap()
    };
    // All but two flat ones.
    assert_eq!(count("scene/traced_instances"), 298);
    assert!(count("scene/traced_triangles") < 700, "{}", count("scene/traced_triangles"));
    let [flat, two] = [(&uploaded[0], Tracer::BVH), (&uploaded[1], Tracer::TWO_LEVEL)]
        .map(|(uploaded, tracer)| distances(gpu, uploaded, tracer, &rays));
    let [wrong, hits] = differing(&flat, &two);
    println!("{wrong} of {hits} hits differ");
    assert!(wrong <= hits / 2000 && hits > 5000, "{wrong} of {hits}");
    // The comparison sees an instance that is missing.
    let mut less = scene.clone();
    less.instances.remove(10);
    let uploaded = renderer(gpu, Tracer::TWO_LEVEL).upload(&less).unwrap();
    assert!(differing(&flat, &distances(gpu, &uploaded, Tracer::TWO_LEVEL, &rays))[0] > wrong + 10);
}

/// Words of the nodes.
fn read_nodes(gpu: &Gpu, uploaded: &GpuScene) -> Vec<u32> {
    let nodes = uploaded.bvh_nodes().unwrap();
    read_back(&gpu.device, &gpu.queue, nodes, nodes.size() as usize / 4).unwrap()
}

/// Copies with an emissive leaf, under a sky.
fn glowing(count: usize) -> Scene {
    let mut scene = copies(count);
    scene.sky = Vec3::new(0.2, 0.3, 0.5);
    scene.materials.push(Material { emissive: Vec3::new(9.0, 5.0, 2.0), ..Material::default() });
    scene.meshes[1].primitives.push(quad(2, Vec3::Y, 0.4 * Vec3::X, 0.4 * Vec3::Z));
    scene
}

fn all_light(gpu: &Gpu, tracer: Tracer, bounces: Bounces) -> Renderer {
    let all = Sampled { bounces, ..Sampled::default() };
    let few = Sampled { diffuse_rays: 4, first_rays: 4, glossy_rays: 2, ..all };
    let indirect = if bounces == Bounces::ONE { few } else { all };
    Renderer::with_engine(&testing::engine(gpu), settings(tracer).with_indirect(indirect)).unwrap()
}

/// Relative difference of the means of two images, and the fraction of pixels that differ by over a tenth.
fn apart(a: &[[f32; 4]], b: &[[f32; 4]]) -> [f64; 2] {
    let sum = |image: &[[f32; 4]]| image.iter().map(|p| f64::from(p[0] + p[1] + p[2])).sum::<f64>();
    let is_other = |(a, b): &(&[f32; 4], &[f32; 4])| (0..3).any(|i| (a[i] - b[i]).abs() > 0.1 * a[i].abs().max(0.02));
    let others = a.iter().zip(b).filter(is_other).count();
    [(sum(b) / sum(a) - 1.0).abs(), others as f64 / a.len() as f64]
}

#[gpu_test]
fn gpu_hits_are_lit_the_same_in_two_levels_at_rest_and_in_motion(gpu: &Gpu) {
    check_hits(gpu, Bounces::ONE, [36, 24]);
}

/// Noise depends on the order of triangles, the mean does not.
#[gpu_test]
fn gpu_emission_that_direct_light_samples_is_the_same_in_two_levels(gpu: &Gpu) {
    let image = |tracer| {
        let indirect = Sampled { bounces: Bounces::ONE, ..Sampled::default() };
        let settings = settings(tracer).with_direct(SampledLights::default()).with_indirect(indirect);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings.with_accumulate(16)).unwrap();
        let uploaded = renderer.upload(&glowing(200)).unwrap();
        renderer.render(&uploaded, &camera(), [36, 24]).unwrap().radiance
    };
    let [mean, _] = apart(&image(Tracer::BVH), &image(Tracer::TWO_LEVEL));
    assert!(mean < 5e-3, "{mean}");
}

#[gpu_test(full)]
fn gpu_hits_of_every_bounce_are_lit_the_same_in_two_levels(gpu: &Gpu) {
    check_hits(gpu, Bounces::All, [60, 40]);
}

fn check_hits(gpu: &Gpu, bounces: Bounces, size: [u32; 2]) {
    let mut scene = glowing(200);
    let [mut flat, mut two] = [Tracer::BVH, Tracer::TWO_LEVEL].map(|tracer| all_light(gpu, tracer, bounces));
    let image =
        |renderer: &mut Renderer, uploaded: &GpuScene| renderer.render(uploaded, &camera(), size).unwrap().radiance;
    let uploaded_flat = flat.upload(&scene).unwrap();
    let mut uploaded = two.upload(&scene).unwrap();
    let (one, other) = (image(&mut flat, &uploaded_flat), image(&mut two, &uploaded));
    let [mean, others] = apart(&one, &other);
    println!("{bounces:?}: means differ by {mean:.1e}, {others:.4} of the pixels");
    // Noise of the cache's first samples depends on the last bit of their positions.
    assert!(mean < 2e-3 && others < 0.1, "{bounces:?}: {mean}, {others}");
    // Emissive leaves are in the upper tree: an update poses them there, and all light follows.
    let shift = Affine3A::from_translation(Vec3::new(0.0, 1.0, 2.0));
    let moved = [(30, shift * scene.instances[30].world_from_object)];
    assert!(matches!(two.move_instances(&mut uploaded, &moved), Err(RenderError::NeedsUpdate { .. })));
    scene.instances[30].world_from_object = moved[0].1;
    let order = uploaded.triangle_order();
    two.update(&mut uploaded, &scene).unwrap();
    assert_eq!(uploaded.triangle_order(), order, "the scene was uploaded again");
    let fresh = two.upload(&scene).unwrap();
    let [mean, others] = apart(&image(&mut two, &fresh), &image(&mut two, &uploaded));
    assert!(mean < 1e-4 && others < 0.002, "{bounces:?}: not what was updated: {mean}, {others}");
    // Without light of their own they move.
    scene.materials[2].emissive = Vec3::ZERO;
    let mut uploaded = two.upload(&scene).unwrap();
    let moved: Vec<_> = (20..200).step_by(3).map(|i| (i, shift * scene.instances[i].world_from_object)).collect();
    two.move_instances(&mut uploaded, &moved).unwrap();
    moved.iter().for_each(|(i, transform)| scene.instances[*i].world_from_object = *transform);
    let fresh = two.upload(&scene).unwrap();
    let shown = image(&mut two, &uploaded);
    let again = image(&mut two, &fresh);
    // Which of two triangles a ray hits at a common edge depends on the tree.
    let [mean, others] = apart(&again, &shown);
    assert!(mean < 1e-4 && others < 0.002, "{bounces:?}: not what was moved: {mean}, {others}");
    assert!(apart(&other, &shown)[1] > 0.1, "blind to what moves");
}

#[gpu_test]
fn gpu_a_scene_has_its_triangles_in_one_form(gpu: &Gpu) {
    let with = |settings: Settings| Renderer::with_engine(&testing::engine(gpu), settings).err();
    let other = Sampled { tracer: Tracer::BVH.into(), ..Sampled::default() };
    assert!(matches!(with(settings(Tracer::TWO_LEVEL).with_indirect(other)), Some(RenderError::Together { .. })));
    assert!(with(settings(Tracer::TWO_LEVEL).with_indirect(Sampled::default())).is_none());
}

#[test]
fn auto_takes_two_levels_for_many_copies_and_where_nothing_else_needs_one() {
    let mut scene = lanternfish_scene::generate::demo("street").unwrap();
    let settings = Settings::default();
    let chosen = |settings: &Settings, scene: &Scene| settings.for_scene(scene).shadows.technique;
    assert_eq!(chosen(&settings, &scene), Shadows::Auto);
    scene.instances = vec![scene.instances; 3].concat();
    assert_eq!(chosen(&settings, &scene), Shadows::Traced(Tracer::TWO_LEVEL));
    assert_eq!(chosen(&settings.clone().with_shadows(Shadows::BVH), &scene), Shadows::BVH);
    let own = settings.with_indirect(Sampled { tracer: Tracer::BVH.into(), ..Sampled::default() });
    assert_eq!(chosen(&own, &scene), Shadows::Auto);
    let mut damaged = scene.clone();
    damaged.instances[0].mesh = 1 << 20;
    assert_eq!(chosen(&Settings::default(), &damaged), Shadows::Auto);
    // Copies that are flattened anyway are none.
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ONE);
    assert_eq!(chosen(&Settings::default(), &scene), Shadows::Auto);
}
