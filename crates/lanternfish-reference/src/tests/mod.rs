//! Tests of the complete path tracer.

mod area;
mod furnace;
mod light;
mod light_paths;
mod sampling;

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{Affine3A, Vec3, Vec3A, Vec4};
use lanternfish_scene::{Camera, Instance, Material, Mesh, Primitive, Projection, Scene};

use crate::{Film, Settings, Tracer, world::Faces};

/// A metallic-roughness material without textures.
fn material(base_color: Vec3, metallic: f32, perceptual_roughness: f32) -> Material {
    Material { base_color: base_color.extend(1.0), metallic, perceptual_roughness, ..Material::default() }
}

/// A scene of a mesh with one instance.
fn scene_of(primitives: Vec<Primitive>, materials: Vec<Material>) -> Scene {
    Scene {
        meshes: vec![Mesh { name: String::new(), primitives }],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials,
        ..Scene::default()
    }
}

/// A rectangle. On its front side, `half_right` points right and `half_up` points up.
fn quad(material: usize, center: Vec3, half_right: Vec3, half_up: Vec3) -> Primitive {
    let corner = |s: f32, t: f32| center + s * half_right + t * half_up;
    Primitive {
        material,
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![half_right.cross(half_up).normalize(); 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    }
}

/// A sphere around the origin.
fn sphere(material: usize, radius: f32, rows: u32) -> Primitive {
    let columns = 2 * rows;
    let mut primitive = Primitive { material, ..Primitive::default() };
    for row in 0..=rows {
        for column in 0..=columns {
            let (sin, cos) = (std::f32::consts::TAU * (column % columns) as f32 / columns as f32).sin_cos();
            let (height, ring) = (std::f32::consts::PI * (row as f32 / rows as f32 - 0.5)).sin_cos();
            // Exactly one point at each pole, to avoid gaps from rounding.
            let ring = if row % rows == 0 { 0.0 } else { ring };
            let normal = Vec3::new(ring * cos, height, -ring * sin).normalize();
            primitive.normals.push(normal);
            primitive.positions.push(radius * normal);
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = |r: u32, c: u32| (row + r) * (columns + 1) + column + c;
            primitive.indices.extend([at(0, 0), at(0, 1), at(1, 1), at(0, 0), at(1, 1), at(1, 0)]);
        }
    }
    primitive
}

/// An orthographic camera at z = `distance` that looks along −z, at x and y from −`half` to `half`.
fn front(distance: f32, half: f32) -> Camera {
    let projection = Projection::Orthographic { half_height: half, near: 0.0, far: 100.0 };
    Camera::look_at(Vec3::new(0.0, 0.0, distance), Vec3::ZERO, projection)
}

fn render(scene: &Scene, camera: &Camera, edge: usize, samples: u64, settings: Settings) -> Film {
    let tracer = Tracer::new(scene, settings).unwrap();
    let mut film = Film::new([edge as u32; 2]).unwrap();
    tracer.render(camera, &mut film, samples);
    assert_eq!(film.dropped(), 0);
    film
}

/// Mean of the green channel over all pixels, and its standard error.
fn mean_and_error(film: &Film) -> (f64, f64) {
    let count = film.mean().len() as f64;
    let mean = film.mean().iter().map(|p| f64::from(p[1])).sum::<f64>() / count;
    let variance = film.variance().iter().map(|p| f64::from(p[1])).sum::<f64>() / (count * count);
    (mean, variance.sqrt())
}

/// Asserts that a film's mean is `expected` within five standard errors plus `tolerance`.
fn assert_mean(film: &Film, expected: f64, tolerance: f64, what: &str) {
    let (mean, error) = mean_and_error(film);
    assert!((mean - expected).abs() <= 5.0 * error + tolerance, "{what}: {mean} ± {error}, not {expected}");
    assert!(error < 0.01 * expected.max(0.01), "{what}: too noisy to compare, {error}");
}

#[test]
fn interruptions_do_not_change_images() {
    let mut scene = scene_of(vec![sphere(0, 1.0, 8)], vec![material(Vec3::ONE, 0.0, 0.5)]);
    scene.sky = Vec3::ONE;
    let complete = render(&scene, &front(4.0, 1.2), 8, 12, Settings::default());
    let tracer = Tracer::new(&scene, Settings::default()).unwrap();
    let mut parts = Film::new([8, 8]).unwrap();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one_thread.install(|| tracer.render(&front(4.0, 1.2), &mut parts, 5));
    tracer.render(&front(4.0, 1.2), &mut parts, 7);
    assert_eq!(complete, parts);

    // Stopped within a pass: each row has all of the pass's samples or none.
    let mut cut = Film::new([8, 8]).unwrap();
    tracer.render(&front(4.0, 1.2), &mut cut, 2);
    let requested = AtomicU32::new(0);
    let pause = || requested.fetch_add(1, Ordering::Relaxed) >= 3;
    tracer.render_unless(&front(4.0, 1.2), &mut cut, 5, pause, || false);
    assert!(!cut.is_even() && complete.is_even());
    let rows = |samples| cut.row_samples().iter().filter(|row| **row == samples).count();
    assert_eq!((rows(7), rows(2), cut.samples(), cut.sample_count()), (3, 5, 2, 8 * (3 * 7 + 5 * 2)));
    for (y, row) in cut.row_samples().iter().enumerate() {
        let even = render(&scene, &front(4.0, 1.2), 8, *row, Settings::default());
        let pixels = 8 * y..8 * (y + 1);
        assert_eq!(cut.mean()[pixels.clone()], even.mean()[pixels.clone()], "row {y}");
        assert_eq!(cut.variance()[pixels.clone()], even.variance()[pixels], "row {y}");
    }
    assert_eq!(
        Film::resume(8, cut.row_samples(), &cut.mean(), &cut.variance()).unwrap().row_samples(),
        cut.row_samples()
    );
    tracer.render(&front(4.0, 1.2), &mut cut, 10);
    assert_eq!(complete, cut);
    let other = render(&scene, &front(4.0, 1.2), 8, 12, Settings { seed: 1, ..Settings::default() });
    assert_ne!(complete, other);
}

/// A row can be stopped in the middle, and its samples are discarded.
#[test]
fn a_stopped_row_is_discarded() {
    let mut scene = scene_of(vec![sphere(0, 1.0, 8)], vec![material(Vec3::ONE, 0.0, 0.5)]);
    scene.sky = Vec3::ONE;
    let (tracer, camera) = (Tracer::new(&scene, Settings::default()).unwrap(), front(4.0, 1.2));
    let film = |samples| {
        let mut film = Film::new([100, 1]).unwrap();
        tracer.render(&camera, &mut film, samples);
        film
    };
    let mut cut = film(2);
    let requested = AtomicU32::new(0);
    tracer.render_unless(&camera, &mut cut, 3, || false, || requested.fetch_add(1, Ordering::Relaxed) >= 10);
    assert_eq!((requested.into_inner(), &cut), (11, &film(2)));
    tracer.render(&camera, &mut cut, 3);
    assert_eq!(cut, film(5));
}

/// The sign of zeros in a direction does not affect hits.
#[test]
fn negative_zeros_miss_nothing() {
    let scene = scene_of(vec![quad(0, Vec3::ZERO, Vec3::X, Vec3::Y)], vec![material(Vec3::ONE, 0.0, 1.0)]);
    let tracer = Tracer::new(&scene, Settings::default()).unwrap();
    for zeros in [Vec3A::new(0.0, 0.0, -1.0), Vec3A::new(-0.0, 0.0, -1.0), Vec3A::new(-0.0, -0.0, -1.0)] {
        let start = Vec3A::new(0.3, 0.1, 2.0);
        assert!(tracer.world.closest(start, zeros, Faces::All, 0).is_some(), "{zeros:?}");
        assert_eq!(tracer.world.transmittance(start, zeros, 9.0), Vec3::ZERO, "{zeros:?}");
    }
}

/// No ray passes between triangles that share an edge or a corner.
#[test]
fn shared_edges_are_watertight() {
    let scene =
        scene_of(vec![sphere(0, 1.0, 6)], vec![Material { double_sided: true, ..material(Vec3::ONE, 0.0, 1.0) }]);
    let tracer = Tracer::new(&scene, Settings::default()).unwrap();
    let primitive = &scene.meshes[0].primitives[0];
    let mut aimed = 0;
    for corners in primitive.indices.chunks_exact(3) {
        for (i, j) in [(0, 1), (1, 2), (2, 0), (0, 0)] {
            let [a, b] = [corners[i], corners[j]].map(|c| Vec3A::from(primitive.positions[c as usize]));
            for fraction in 0..20 {
                let target = a.lerp(b, fraction as f32 / 20.0);
                let direction = target.normalize();
                assert!(tracer.world.closest(Vec3A::ZERO, direction, Faces::All, 0).is_some(), "{target}");
                aimed += 1;
            }
        }
    }
    assert!(aimed > 10_000);
}

#[test]
fn invalid_settings_and_scenes_are_refused() {
    let scene = scene_of(vec![sphere(0, 1.0, 4)], vec![Material::default()]);
    let fault = |settings| Tracer::new(&scene, settings).err().expect("it is refused").to_string();
    assert!(fault(Settings { max_depth: 0, ..Settings::default() }).contains("max depth"));
    assert!(fault(Settings { range_threshold: 0.0, ..Settings::default() }).contains("range threshold"));
    assert!(fault(Settings { light_radius: -0.1, ..Settings::default() }).contains("light radius"));
    for sun_diameter in [-0.1, 91.0, f32::NAN] {
        assert!(fault(Settings { sun_diameter, ..Settings::default() }).contains("sun diameter"));
    }
    let integrator = crate::settings::Integrator::Obscurance { max_distance: f32::NAN };
    assert!(fault(Settings { integrator, ..Settings::default() }).contains("obscurance"));
    let mut unsound = scene.clone();
    unsound.materials[0].base_color = Vec4::NAN;
    assert!(Tracer::new(&unsound, Settings::default()).is_err());
}

#[test]
fn an_empty_scene_shows_the_sky() {
    let scene = Scene { sky: Vec3::new(0.25, 0.5, 1.0), ..Scene::default() };
    let film = render(&scene, &front(4.0, 1.0), 2, 2, Settings::default());
    assert!(film.mean().iter().all(|p| *p == [0.25, 0.5, 1.0]));
}
