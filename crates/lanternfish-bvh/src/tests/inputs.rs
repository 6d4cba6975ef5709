//! Triangles for tests and for `examples/compare.rs`.

use std::f32::consts::PI;

use glam::Vec3;

/// A triangle's corners.
pub type Corners = [Vec3; 3];

/// A pseudo-random number in 0..1 for each counter, by splitmix64.
pub fn unit(counter: usize) -> f32 {
    let mut z = (counter as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// A point in the unit cube.
pub fn point(counter: usize) -> Vec3 {
    Vec3::new(unit(3 * counter), unit(3 * counter + 1), unit(3 * counter + 2))
}

/// A direction, any length.
pub fn direction(counter: usize) -> Vec3 {
    (point(counter) - 0.5) + 1e-3
}

/// Small triangles at random places, most of them in clumps: leaves of trees.
pub fn foliage(count: usize) -> Vec<Corners> {
    let leaf = |i: usize| {
        let clump = 60.0 * point(1_000_000_007 + i / 2048) * Vec3::new(1.0, 0.15, 1.0);
        let offset = (point(4 * i) - 0.5) * (point(4 * i + 1) - 0.5) * 16.0;
        [2, 3, 5].map(|corner| clump + offset + 0.1 * point(4 * i + corner))
    };
    (0..count).map(leaf).collect()
}

/// A height field of about `count` triangles, exactly the greatest even square below.
pub fn terrain(count: usize) -> Vec<Corners> {
    let side = ((count / 2) as f64).sqrt() as usize;
    let place = |x: usize, z: usize| {
        let (u, v) = (x as f32 / side as f32, z as f32 / side as f32);
        let height = (9.0 * u).sin() * (7.0 * v).cos() + 0.2 * (61.0 * u + 13.0 * v).sin() + 0.02 * unit(x * 4099 + z);
        Vec3::new(100.0 * u, 6.0 * height, 100.0 * v)
    };
    let cell = |i: usize| {
        let (x, z) = (i % side, i / side);
        let [a, b, c, d] = [(x, z), (x + 1, z), (x, z + 1), (x + 1, z + 1)].map(|(x, z)| place(x, z));
        [[a, b, c], [b, d, c]]
    };
    (0..side * side).flat_map(cell).collect()
}

/// Spheres of 512 triangles on a grid, of different sizes, above a floor of two triangles.
pub fn objects(count: usize) -> Vec<Corners> {
    const RINGS: usize = 16;
    let spheres = count / (2 * RINGS * RINGS);
    let side = (spheres as f64).sqrt().ceil() as usize;
    let mut triangles = Vec::with_capacity(count + 2);
    for sphere in 0..spheres {
        let center = 3.0 * Vec3::new((sphere % side) as f32, 0.4, (sphere / side) as f32);
        let radius = 0.3 + 0.9 * unit(sphere);
        let place = |ring: usize, step: usize| {
            let (a, b) = (ring as f32 / RINGS as f32 * PI, step as f32 / RINGS as f32 * 2.0 * PI);
            center + radius * Vec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin())
        };
        for cell in 0..RINGS * RINGS {
            let (ring, step) = (cell / RINGS, cell % RINGS);
            let [a, b] = [place(ring, step), place(ring, step + 1)];
            let [c, d] = [place(ring + 1, step), place(ring + 1, step + 1)];
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    let end = 3.0 * side as f32;
    let [a, b, c, d] = [[0.0, 0.0], [end, 0.0], [0.0, end], [end, end]].map(|[x, z]| Vec3::new(x, 0.0, z));
    triangles.extend([[a, b, c], [b, d, c]]);
    triangles
}

/// Three `vec4f` a triangle.
pub fn packed(triangles: &[Corners]) -> Vec<[f32; 4]> {
    triangles.iter().flatten().map(|corner| corner.extend(0.0).into()).collect()
}
