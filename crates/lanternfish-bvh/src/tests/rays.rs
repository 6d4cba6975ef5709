//! Rays find through the tree what they find without it.

use lanternfish_gpu::testing;
use rayon::prelude::*;

use super::{Device, Kind, inputs, walk};

#[gpu_test]
fn gpu_rays_hit_what_brute_force_hits(gpu: &Gpu) {
    let mut device = Device::new(gpu);
    for (what, triangles) in
        [("foliage", inputs::foliage(5_000)), ("terrain", inputs::terrain(5_000)), ("objects", inputs::objects(5_000))]
    {
        let (tree, _) = device.checked(what, Kind::Triangles, &inputs::packed(&triangles));
        let hits = (0..2_000usize).into_par_iter().filter(|i| {
            let towards = triangles[i * 7 % triangles.len()].iter().sum::<glam::Vec3>() / 3.0;
            let origin = towards + 20.0 * inputs::direction(2 * i);
            let direction = towards - origin + 0.5 * inputs::direction(2 * i + 1);
            let found = walk::closest(&tree.nodes, &tree.indices, &triangles, origin, direction);
            let distances = triangles.iter().map(|triangle| walk::distance(triangle, origin, direction));
            assert_eq!(found.t, distances.fold(f32::INFINITY, f32::min), "{what}: ray {i}");
            assert!((found.triangles as usize) < triangles.len() / 4, "{what}: ray {i}");
            found.t.is_finite()
        });
        let hits = hits.count();
        assert!((100..2_000).contains(&hits), "{what}: {hits} hits");
    }
}
