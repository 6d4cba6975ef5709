//! Results of different tracers agree within their accuracy.

use super::*;

/// The inside of a closed box is dark, however bright its outside. Deep images may leak light through walls thinner than their tolerance.
#[gpu_test]
fn gpu_light_leaks_are_small(gpu: &Gpu) {
    let mut scene = closed_box(matt(0.5));
    // Light from above, outside: 1000 lx on the roof.
    scene.lights.push(Light::directional(Vec3::new(0.1, -1.0, 0.2), Vec3::splat(1000.0)));
    let camera = looking([0.0, 0.0, 0.9], [0.3, 0.2, -1.0]);
    for tracer in tracers(gpu) {
        let actual = rendering(gpu, settings(sampled(tracer)), &scene, &camera);
        // Radiance to irradiance of surfaces of albedo 0.5.
        let inside = mean(&actual) * std::f64::consts::PI / 0.5;
        println!("{tracer}: {inside:.3} lx inside of 1000 outside");
        assert!(inside <= 10.0, "{tracer}: {inside}");
    }
    // The test can fail: without the roof.
    scene.meshes[0].primitives.retain(|side| side.positions.iter().any(|corner| corner.y < 0.99));
    assert_eq!(scene.meshes[0].primitives.len(), 5);
    let actual = rendering(gpu, settings(sampled(Tracer::BVH)), &scene, &camera);
    let ground_truth = traced(&scene, &camera, 3, 64);
    let inside = mean(&actual) * std::f64::consts::PI / 0.5;
    println!("{inside:.2} lx without a roof, energy {:.3}", mean(&actual) / mean(&ground_truth));
    assert!(
        inside > 10.0 && (mean(&actual) / mean(&ground_truth) - 1.0).abs() < 0.05,
        "{inside}, {}",
        mean(&ground_truth)
    );
}

/// Ray queries hit the same triangles as the BVH: images differ only where rays graze an edge. With masked triangles, solid ones, and both.
#[gpu_test]
fn gpu_ray_query_hits_the_triangles_of_the_bvh(gpu: &Gpu) {
    let test = "gpu_ray_query_hits_the_triangles_of_the_bvh";
    if !gpu.description.ray_query {
        return testing::left_out(test, "this adapter has no ray query");
    }
    let masked = |mut scene: Scene| {
        scene.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 });
        scene
    };
    let half_masked = |mut scene: Scene| {
        let odd = scene.materials.iter_mut().skip(1).step_by(2);
        odd.for_each(|material| material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 });
        scene
    };
    for (name, scene) in [("solid", cornell()), ("masked", masked(cornell())), ("both", half_masked(cornell()))] {
        let of = |tracer| {
            let sampled = Sampled { diffuse_rays: 8, glossy_rays: 4, ..sampled(tracer) };
            rendering(gpu, settings(sampled), &scene, &scene.cameras[0])
        };
        let [bvh, ray_query] = [Tracer::BVH, Tracer::RAY_QUERY].map(of);
        let apart = off(&ray_query, &bvh);
        println!("{name}: apart by {apart:.5} of the mean");
        assert!(apart < 0.005 && mean(&bvh) > 0.0, "{name}: {apart}");
    }
}
