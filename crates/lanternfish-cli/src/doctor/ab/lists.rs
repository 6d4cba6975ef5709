//! Lists of rays as the passes of a frame trace them: from the surfaces that its camera sees, in the order of its workgroups.

use glam::Vec3;
use lanternfish::rays::TracedRay;
use lanternfish_reference::Random;
use lanternfish_scene::{Light, LightKind, Scene};

/// Pixels of a workgroup, an 8 x 8 block.
const BLOCK: usize = 64;

/// Distance from its surface at which a ray begins, relative to the surface's distance from the eye.
const OFFSET: f32 = 1e-3;

/// A surface that a pixel shows.
#[derive(Clone, Copy)]
struct Surface {
    p: Vec3,
    normal: Vec3,
    offset: f32,
}

/// The rays of three kinds of pass, `count` of each. `seen` and `distances`: rays from the camera, block by block, and their first hits.
pub fn of_frame(
    scene: &Scene,
    seen: &[TracedRay],
    distances: &[f32],
    count: usize,
) -> [(&'static str, Vec<TracedRay>); 3] {
    let blocks: Vec<Vec<Surface>> = seen.chunks(BLOCK).zip(distances.chunks(BLOCK)).map(surfaces).collect();
    let blocks: Vec<_> = blocks.into_iter().filter(|block| !block.is_empty()).collect();
    let indirect: Vec<_> = hemispheres(&blocks).take(count).collect();
    let [random, sorted] = [7, 11].map(|seed| move |i: usize| Random::new(seed, i as u64, 0));
    // Entries of the radiance cache lie in a hash table: their rays begin anywhere.
    let mut cache: Vec<_> = indirect.clone();
    for i in (1..cache.len()).rev() {
        cache.swap(i, (sorted(i).unit() * (i + 1) as f64) as usize);
    }
    for (i, ray) in cache.iter_mut().enumerate() {
        // From a point inside of the scene, back and forth.
        ray.direction = (ray.direction + 0.7 * unit(&mut random(i))).normalize_or(ray.direction);
    }
    [("shadow rays", shadows(scene, &blocks, count)), ("indirect rays", indirect), ("cache rays", cache)]
}

/// The surfaces of a block, with normals from neighbouring pixels.
fn surfaces((rays, distances): (&[TracedRay], &[f32])) -> Vec<Surface> {
    let p = |i: usize| Some(rays.get(i)?.origin + *distances.get(i).filter(|t| **t > 0.0)? * rays[i].direction);
    let surface = |i: usize| {
        let (across, down) = if i % 8 < 7 { (i + 1, i ^ 8) } else { (i - 1, i ^ 8) };
        let (own, across, down) = (p(i)?, p(across)?, p(down)?);
        let normal = (across - own).cross(down - own).try_normalize()?;
        let normal = if normal.dot(rays[i].direction) > 0.0 { -normal } else { normal };
        Some(Surface { p: own, normal, offset: OFFSET * distances[i] })
    };
    (0..rays.len()).filter_map(surface).collect()
}

/// Rays to the lights in reach of each block, light by light.
fn shadows(scene: &Scene, blocks: &[Vec<Surface>], count: usize) -> Vec<TracedRay> {
    let of_block = |block: &Vec<Surface>| -> Vec<TracedRay> {
        let to = |light: &Light, surface: &Surface| {
            let towards = (light.position - surface.p).normalize_or(surface.normal);
            let is_reached = light.range.is_none_or(|range| surface.p.distance(light.position) < range);
            (is_reached && towards.dot(surface.normal) > 0.0)
                .then(|| TracedRay::new(surface.p, towards, surface.offset, 0, false))
        };
        let lights = scene.lights.iter().filter(|light| light.kind != LightKind::Directional);
        lights.flat_map(|light| block.iter().filter_map(move |surface| to(light, surface))).collect()
    };
    let once: Vec<_> = blocks.iter().flat_map(of_block).take(count).collect();
    once.iter().cycle().take(if once.is_empty() { 0 } else { count }).copied().collect()
}

/// Rays into the hemispheres of the surfaces, distributed as the cosine.
fn hemispheres(blocks: &[Vec<Surface>]) -> impl Iterator<Item = TracedRay> {
    let surfaces = blocks.iter().flatten();
    surfaces.cycle().enumerate().map(|(i, surface)| {
        let direction = surface.normal + unit(&mut Random::new(5, i as u64, 0));
        let direction = direction.normalize_or(surface.normal);
        TracedRay::new(surface.p, direction, surface.offset, 0, false)
    })
}

/// A random direction.
fn unit(random: &mut Random) -> Vec3 {
    let z = 2.0 * random.unit() as f32 - 1.0;
    let (sin, cos) = (std::f32::consts::TAU * random.unit() as f32).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}
