//! Ray throughput of the path tracer's BVH traversal, with its alpha tests, watertight edges and padded boxes, against plain single-ray
//! traversal with obvhs: same scene, same rays, same threads, one run.
//!
//! `cargo bench -p lanternfish-reference [-- SCENE]`: a scene file or demo:NAME; the default is demo:atrium. There are two kinds of rays:
//! camera rays, and rays scattered from their hits. The table also states the fraction of rays whose hits differ.

use std::time::{Duration, Instant};

use glam::{Vec3, Vec3A};
use lanternfish_reference::{Film, Random, Settings, Tracer};
use lanternfish_scene::{Camera, Scene};
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray, RayHit},
    triangle::Triangle,
};
use rayon::prelude::*;

/// Number of rays of each kind.
const RAYS: u64 = 1 << 19;
/// Number of runs of each loop; the fastest counts.
const RUNS: u32 = 5;

type RayList = Vec<(Vec3A, Vec3A)>;

fn triangles(scene: &Scene) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for instance in &scene.instances {
        for primitive in &scene.meshes[instance.mesh].primitives {
            let corner =
                |i: u32| Vec3A::from(instance.world_from_object.transform_point3(primitive.positions[i as usize]));
            let corners = primitive.indices.as_chunks::<3>().0.iter().map(|t| t.map(corner));
            triangles.extend(corners.map(|[v0, v1, v2]| Triangle { v0, v1, v2 }));
        }
    }
    triangles
}

fn plain(tree: &CwBvh, triangles: &[Triangle], (origin, direction): (Vec3A, Vec3A)) -> Option<f32> {
    let ray = Ray::new_inf(origin, direction);
    let mut hit = RayHit::none();
    let is_hit = tree.ray_traverse(ray, &mut hit, |ray, i| triangles[i].intersect(ray));
    is_hit.then_some(hit.t)
}

/// Rays per second, and the hit distance of each ray, m.
fn time(rays: &RayList, trace: impl Fn((Vec3A, Vec3A)) -> Option<f32> + Sync) -> (f64, Vec<Option<f32>>) {
    let mut best = Duration::MAX;
    let mut hits = Vec::new();
    for _ in 0..RUNS {
        let started = Instant::now();
        hits = rays.par_iter().map(|ray| trace(*ray)).collect();
        best = best.min(started.elapsed());
    }
    (rays.len() as f64 / best.as_secs_f64(), hits)
}

fn direction(random: &mut Random) -> Vec3A {
    let z = 2.0 * random.unit() - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * random.unit()).sin_cos();
    let ring = (1.0 - z * z).sqrt();
    glam::DVec3::new(ring * cos, ring * sin, z).as_vec3a()
}

fn main() {
    let name = std::env::args().skip(1).find(|word| !word.starts_with('-')).unwrap_or_else(|| "demo:atrium".to_owned());
    let scene = lanternfish_scene::load(&name).unwrap_or_else(|error| panic!("{error}"));
    let tracer = Tracer::new(&scene, Settings::default()).expect("the scene is sound");
    let all = triangles(&scene);
    let parameters = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
    let tree = build_cwbvh_from_tris(&all, parameters, &mut Duration::default());
    let sorted: Vec<Triangle> = tree.primitive_indices.iter().map(|i| all[*i as usize]).collect();

    let bounds = scene.bounds();
    let camera = scene.cameras.first().cloned().unwrap_or_else(|| Camera::framing(&bounds, 1.0, 1.0));
    let side = (RAYS as f64).sqrt() as u64;
    let eye = camera.eye();
    let from_camera: RayList = (0..side * side)
        .map(|i| {
            let at = |i: u64| (i as f32 + 0.5) / side as f32 - 0.5;
            let local = Vec3A::new(at(i % side), -at(i / side), -0.6);
            (eye.into(), camera.world_from_camera.transform_vector3a(local).normalize())
        })
        .collect();
    let scattered: RayList = from_camera
        .iter()
        .enumerate()
        .map(|(i, (origin, towards))| {
            let mut random = Random::new(1, i as u64, 0);
            let start =
                tracer.nearest(*origin, *towards).map_or(bounds.center().into(), |t| *origin + 0.999 * t * *towards);
            (start, direction(&mut random))
        })
        .collect();

    println!("{name}: {} triangles, {} threads, best of {RUNS} runs", all.len(), rayon::current_num_threads());
    println!("| rays | path tracer, M/s | obvhs alone, M/s | ratio | different hit |");
    println!("|---|---:|---:|---:|---:|");
    for (kind, rays) in [("camera", &from_camera), ("scattered", &scattered)] {
        let (plain_rate, expected) = time(rays, |ray| plain(&tree, &sorted, ray));
        let (rate, actual) = time(rays, |(origin, direction)| tracer.nearest(origin, direction));
        let same = |(a, b): &(&Option<f32>, &Option<f32>)| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-4 * a.abs().max(b.abs()),
            (a, b) => a == b,
        };
        let other = actual.iter().zip(&expected).filter(|pair| !same(pair)).count() as f64 / actual.len() as f64;
        println!(
            "| {kind} | {:.2} | {:.2} | {:.2} | {:.4} % |",
            rate / 1e6,
            plain_rate / 1e6,
            rate / plain_rate,
            100.0 * other
        );
    }
    let mut film = Film::new([256, 256]).expect("a size");
    let started = Instant::now();
    tracer.render(&camera, &mut film, 4);
    let rate = 4.0 * 256.0 * 256.0 / started.elapsed().as_secs_f64();
    println!("complete paths, all bounces: {:.0} thousand per second, mean radiance {} nits", rate / 1e3, mean(&film));
}

/// Mean radiance, nits. Printing it keeps the compiler from removing the work.
fn mean(film: &Film) -> Vec3 {
    film.mean().iter().map(|p| Vec3::from(*p)).sum::<Vec3>() / (256.0 * 256.0)
}
