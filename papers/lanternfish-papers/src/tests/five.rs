//! All five papers in one frame: what it loses without each of them, against the path tracer.

use glam::Vec3;
use lanternfish::{Renderer, Settings};
use lanternfish_gpu::Gpu;
use lanternfish_reference::{
    Film, Settings as TracerSettings, Tracer,
    settings::{Integrator, UNLIMITED},
};
use lanternfish_scene::{Camera, Eyes, Light, Material, Projection, Scene};

use crate::{
    Paper,
    testing::{self, engine, inside, light, quad},
};

const SIZE: [u32; 2] = [48, 36];
/// Of the lamps, m.
const RADIUS: f32 = 0.05;

/// An image, with its counters.
struct Drawn {
    radiance: Vec<Vec3>,
    counters: Vec<(String, u64)>,
}

impl Drawn {
    fn counted(&self, name: &str) -> f64 {
        let sums = self.counters.iter().filter(|(counter, _)| counter == name).map(|(_, count)| *count as f64);
        sums.sum()
    }
}

/// A room for all five: a glossy block before three lamps, a mirror that throws the light of a fourth onto a wall.
fn room() -> (Scene, Camera) {
    let mut scene = light::closed_box(light::matt(0.6));
    let metal = |perceptual_roughness| Material {
        base_color: Vec3::splat(0.9).extend(1.0),
        metallic: 1.0,
        perceptual_roughness,
        double_sided: true,
        ..Material::default()
    };
    scene.materials.extend([metal(0.3), metal(0.4)]);
    let (across, up, along) = (0.45 * Vec3::X, 0.675 * Vec3::Y, 0.35 * Vec3::Z);
    scene.meshes[0].primitives.extend([
        quad(1, Vec3::new(0.98, 0.47, 0.2), 0.15 * Vec3::Z, 0.1 * Vec3::Y),
        quad(2, Vec3::new(0.0, -0.325, 0.0), across, up),
        quad(0, Vec3::new(0.0, -0.325, -0.7), across, up),
        quad(0, Vec3::new(-0.45, -0.325, -0.35), along, up),
        quad(0, Vec3::new(0.45, -0.325, -0.35), along, up),
        quad(0, Vec3::new(0.0, 0.35, -0.35), across, along),
    ]);
    let lamp = |x, y, z, intensity| Light::point(Vec3::new(x, y, z), Vec3::splat(intensity));
    let behind = [lamp(-0.6, -0.4, -0.8, 1.5), lamp(0.6, -0.2, -0.8, 1.5), lamp(0.0, -0.3, -0.9, 1.5)];
    scene.lights = behind.into_iter().chain([lamp(0.3, 0.4, 0.5, 1.5)]).collect();
    let camera = Camera::look_at(
        Vec3::new(0.0, 0.1, 0.95),
        Vec3::new(-0.15, 0.0, -1.0),
        Projection::Perspective { fov_y: 1.2, near: 0.02 },
    );
    (scene, camera)
}

/// The views of cameras by all five, with some settings changed.
fn draw(gpu: &Gpu, scene: &Scene, cameras: &[Camera], changes: &[(&str, &str)]) -> Drawn {
    let mut settings: Settings = Paper::Five.settings();
    for (name, value) in [("samples", "1")].iter().chain(changes) {
        settings.set(name, value).unwrap();
    }
    let mut renderer = Renderer::with_engine(&engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(scene).unwrap();
    let views: Vec<_> = cameras.iter().map(|camera| (camera, SIZE)).collect();
    let images = renderer.render_views(&uploaded, &views).unwrap();
    let radiance = images[0].radiance.iter().map(|[r, g, b, _]| Vec3::new(*r, *g, *b)).collect();
    Drawn { radiance, counters: images.into_iter().flat_map(|image| image.report.counters).collect() }
}

/// The path tracer's image, with paths of up to `max_depth` segments.
fn trace(scene: &Scene, camera: &Camera, integrator: Integrator, max_depth: u32) -> Vec<Vec3> {
    trace_of(scene, camera, integrator, max_depth, 256)
}

fn trace_of(scene: &Scene, camera: &Camera, integrator: Integrator, max_depth: u32, samples: u64) -> Vec<Vec3> {
    let settings = TracerSettings { integrator, max_depth, light_radius: RADIUS, ..TracerSettings::default() };
    let mut film = Film::new(SIZE).unwrap();
    Tracer::new(scene, settings).unwrap().render(camera, &mut film, samples);
    film.mean().iter().map(|pixel| Vec3::from(*pixel)).collect()
}

/// The difference of two images.
fn less(a: &[Vec3], b: &[Vec3]) -> Vec<Vec3> {
    a.iter().zip(b).map(|(a, b)| *a - *b).collect()
}

/// Error of a part of the light over that part, in pixels of which this is true.
fn error(found: &[Vec3], truth: &[Vec3], is_in: &[bool]) -> f64 {
    let only = |image: &[Vec3]| image.iter().zip(is_in).filter(|(_, is_in)| **is_in).map(|(pixel, _)| *pixel).collect();
    let [found, truth]: [Vec<Vec3>; 2] = [only(found), only(truth)];
    light::off(&found, &truth)
}

const DIRECT: [(&str, &str); 3] = [("indirect", "none"), ("caustics", "none"), ("occlusion", "none")];
/// The frame without a ray left out.
const EVERY_RAY: [(&str, &str); 2] = [("ray-culling", "none"), ("ray-range-culling", "off")];

/// Shadow rays over those without the tests of [Elagabani2025, §4.3.1], and the light over that with every ray.
fn rays_and_light(gpu: &Gpu, scene: &Scene, camera: &Camera) -> [f64; 2] {
    let of = |more: &[(&str, &str)]| draw(gpu, scene, std::slice::from_ref(camera), &[&DIRECT, more].concat());
    let [culled, all] = [of(&[]), of(&EVERY_RAY)];
    [
        culled.counted("shadows/rays") / all.counted("shadows/rays"),
        light::mean(&culled.radiance) / light::mean(&all.radiance),
    ]
}

/// Visible clusters of two eyes, in one grid around both over those of one for each [VanGelderen2020, §4.1].
fn clusters(gpu: &Gpu, scene: &Scene, camera: &Camera) -> f64 {
    let eyes = Eyes::Vive.cameras(camera, 1.0).unwrap();
    let of = |views| draw(gpu, scene, &eyes, &[&DIRECT[..], &[("cluster-views", views)]].concat());
    let [one, two] = ["enclosed", "individual"].map(|views| of(views).counted("light_culling/visible_clusters"));
    one / two
}

/// Elagabani's tests leave out a fifth of the rays and no light; van Gelderen's grid has less than 0.6 of the clusters.
#[gpu_test]
fn gpu_five_need_fewer_rays_and_clusters(gpu: &Gpu) {
    let (scene, camera) = room();
    let ([rays, light], clusters) = (rays_and_light(gpu, &scene, &camera), clusters(gpu, &scene, &camera));
    println!("rays {rays:.3}, light {light:.4}, clusters {clusters:.3}");
    assert!(rays <= 0.8 && (light - 1.0).abs() < 0.01, "{rays} of the rays, {light} of the light");
    assert!(clusters <= 0.6, "{clusters} of the clusters");
}

/// Errors of parts of the light with a paper and without it, each over that part.
fn parts(gpu: &Gpu, scene: &Scene, camera: &Camera, has_metal: bool) -> Vec<(&'static str, [f64; 2])> {
    let of = |changes: &[(&str, &str)]| draw(gpu, scene, std::slice::from_ref(camera), changes).radiance;
    let path = |depth| trace(scene, camera, Integrator::Path, depth);
    let all = vec![true; (SIZE[0] * SIZE[1]) as usize];
    let (five, direct, one) = (of(&[("occlusion", "none")]), path(2), path(3));
    let own_direct = of(&DIRECT);
    let bounce = less(&one, &direct);
    let mut found = vec![
        (
            "shadows",
            [
                error(&own_direct, &direct, &all),
                error(&of(&[&DIRECT[..], &[("shadows", "none")]].concat()), &direct, &all),
            ],
        ),
        (
            "one bounce",
            [error(&less(&five, &own_direct), &bounce, &all), error(&vec![Vec3::ZERO; all.len()], &bounce, &all)],
        ),
    ];
    // Constant ambient light: its obscurance within the scene's radius, times what surfaces reflect.
    let ambient = less(&of(&[]), &five);
    let radius = 0.5 * scene.bounds().size().length();
    let open = trace(scene, camera, Integrator::Obscurance { max_distance: radius }, UNLIMITED);
    let white = draw_white(gpu, scene, camera);
    let expected: Vec<Vec3> = open.iter().zip(&white).map(|(open, white)| *open * *white).collect();
    let is_lit: Vec<bool> = white.iter().map(|white| white.max_element() > 0.0).collect();
    found.push(("ambient light", [error(&ambient, &expected, &is_lit), error(&white, &expected, &is_lit)]));
    // Metal has glossy light alone.
    let is_glossy: Vec<bool> = is_lit.iter().map(|is_lit| !is_lit).collect();
    if has_metal {
        let without = of(&[("occlusion", "none"), ("vpl-glossy-rays", "0")]);
        let [with, without] = [&five, &without].map(|image| error(&less(image, &own_direct), &bounce, &is_glossy));
        found.push(("glossy light", [with, without]));
    }
    // Light that metal throws onto diffuse surfaces: what is missing where metal is black.
    if has_metal {
        let mut black = scene.clone();
        black
            .materials
            .iter_mut()
            .filter(|material| material.metallic == 1.0)
            .for_each(|metal| *metal = light::matt(0.0));
        let path = |scene| trace_of(scene, camera, Integrator::Path, 3, 4096);
        let thrown = less(&path(scene), &path(&black));
        // Pixels of the path tracer at the outline of metal show some of it.
        let is_inside = |i: usize| {
            let rows = [i.wrapping_sub(SIZE[0] as usize), i, i + SIZE[0] as usize];
            rows.iter().all(|row| {
                (row.wrapping_sub(1)..=row.wrapping_add(1)).all(|i| is_lit.get(i).is_none_or(|is_lit| *is_lit))
            })
        };
        let on_walls = |i: usize| if is_inside(i) { thrown[i] } else { Vec3::ZERO };
        let on_walls: Vec<Vec3> = (0..thrown.len()).map(on_walls).collect();
        let mean = light::mean(&on_walls);
        let is_caustic: Vec<bool> =
            on_walls.iter().map(|pixel| f64::from(pixel.element_sum()) / 3.0 > 2.0 * mean).collect();
        let photons = less(&of(&[("indirect", "none"), ("occlusion", "none")]), &own_direct);
        let none = vec![Vec3::ZERO; all.len()];
        found.push(("caustic", [&photons, &none].map(|image| error(image, &thrown, &is_caustic))));
    }
    found
}

/// The ambient light of the frame without occlusion.
fn draw_white(gpu: &Gpu, scene: &Scene, camera: &Camera) -> Vec<Vec3> {
    let of = |changes: &[(&str, &str)]| draw(gpu, scene, std::slice::from_ref(camera), changes).radiance;
    let near = ("occlusion-distance", "0.0001");
    less(&of(&[near, ("indirect", "none"), ("caustics", "none")]), &of(&DIRECT))
}

/// Fails if a part's error with its paper is above `most` of that without.
fn check(parts: &[(&str, [f64; 2])], most: f64) {
    for (part, [with, without]) in parts {
        println!("{part}: {with:.3}, without {without:.3}");
    }
    let lost: Vec<_> = parts.iter().filter(|(_, [with, without])| with.is_nan() || *with > most * without).collect();
    assert!(lost.is_empty(), "with the paper, without: {lost:?}");
}

/// In a room made for it, without a paper the frame loses most of what the paper carries.
#[gpu_test(full)]
fn gpu_five_lose_light_without_each_paper(gpu: &Gpu) {
    let (scene, camera) = room();
    check(&parts(gpu, &scene, &camera, true), 0.6);
}

/// The same in Sponza, which has no mirror.
#[gpu_test(full)]
fn gpu_five_lose_light_without_each_paper_in_sponza(gpu: &Gpu) {
    let test = "gpu_five_lose_light_without_each_paper_in_sponza";
    let Some(file) = lanternfish_gpu::testing::shared(test, "assets/sponza/Sponza.glb") else { return };
    let mut scene = lanternfish_scene::load(file.to_str().unwrap()).unwrap();
    let lamps =
        [[6.5, 2.0, -2.2], [5.0, 1.2, 1.8], [2.5, 5.2, -3.8], [-1.0, 1.5, -1.5], [-4.0, 6.5, 3.5], [0.5, 8.0, 0.0]];
    let lamp = |position: &[f32; 3]| Light { range: Some(8.0), ..Light::point((*position).into(), Vec3::splat(50.0)) };
    scene.lights = lamps.iter().map(lamp).collect();
    let camera = light::looking([6.6, 2.6, -0.6], [-4.0, 3.2, 0.4]);
    let ([rays, light], clusters) = (rays_and_light(gpu, &scene, &camera), clusters(gpu, &scene, &camera));
    println!("rays {rays:.3}, light {light:.4}, clusters {clusters:.3}");
    assert!(rays <= 0.8 && (light - 1.0).abs() < 0.01 && clusters <= 0.6, "{rays} {light} {clusters}");
    check(&parts(gpu, &scene, &camera, false), 0.8);
}

/// One cube for shadows, glossy rays and virtual lights; one set for ranges and ambient visibility.
#[gpu_test]
fn gpu_five_has_two_sets_of_images(gpu: &Gpu) {
    let structures = |changes: &[(&str, &str)]| {
        let mut settings = Paper::Five.settings();
        changes.iter().for_each(|(name, value)| settings.set(name, value).unwrap());
        inside::structures(&Renderer::with_engine(&engine(gpu), settings).unwrap())
    };
    assert_eq!(structures(&[]), 2);
    assert_eq!(structures(&[("vpl-images", "shared")]), 1);
}
