//! Photons from area lights and emissive triangles.

use super::*;

/// Indirect light of a scene by rays from every pixel and by photons, both without the lights' direct light.
fn rays_and_photons(gpu: &Gpu, scene: &Scene, camera: &Camera, technique: PhotonSplatting) -> [f64; 2] {
    let of = |indirect| energy(&render(gpu, settings(indirect), scene, camera, SIZE));
    let direct = of(Indirect::NONE);
    let sampled =
        Sampled { diffuse_rays: 64, filter_radius: 0, clamp: IndirectClamp::Off, ..Sampled::default().one_bounce() };
    [Indirect::from(sampled), Indirect::from(technique)].map(|indirect| of(indirect) - direct)
}

/// Disks and rectangles emit pi times their area and radiance, and their bounce equals that of rays from every pixel.
#[gpu_test]
fn gpu_disks_and_rectangles_emit_their_flux(gpu: &Gpu) {
    let camera = looking([0.7, -0.3, 0.6], [-1.0, 0.0, -0.6]);
    let disk = LightKind::Disk { radius: 0.3 };
    let rectangle = LightKind::Rectangle { half_width: 0.4, half_height: 0.1, right: Vec3::X };
    for (what, kind) in [("disk", disk), ("rectangle", rectangle)] {
        let mut scene = closed_box(0.5);
        // On the ceiling, which it must not light.
        let position = Vec3::new(0.2, 1.0, -0.1);
        scene.lights[0] = Light { kind, position, direction: Vec3::NEG_Y, ..scene.lights[0].clone() };
        let rendering = render_technique(gpu, technique(), &scene, &camera);
        let sent = counter(&rendering, "flux_arrived") / f64::from(passes::FLUX_UNITS);
        assert!((sent - 1.0).abs() < 0.01, "{what}: {sent}");
        let [rays, photons] = rays_and_photons(gpu, &scene, &camera, technique());
        assert!((photons / rays - 1.0).abs() < 0.05, "{what}: {photons} of {rays}");
    }
}

/// Light from emissive triangles, direct and by one bounce, equals that of rays from every pixel: one-sided and two-sided, with and without
/// the redistribution beyond edges.
#[gpu_test]
fn gpu_emissive_triangles_light_by_photons(gpu: &Gpu) {
    let camera = looking([0.7, -0.3, 0.6], [-1.0, -0.4, -0.6]);
    for (double_sided, conserved) in [(false, false), (true, false), (true, true)] {
        let mut primitives = walls();
        primitives.push(quad(1, Vec3::new(0.1, 0.6, 0.0), 0.2 * Vec3::X, 0.2 * Vec3::Z));
        let lamp = Material { emissive: Vec3::splat(10.0), double_sided, ..matt(0.0) };
        let scene = scene_of(primitives, vec![matt(0.5), lamp]);
        let technique = PhotonSplatting { conserved, ..technique() };
        let rendering = render_technique(gpu, technique, &scene, &camera);
        let sent = counter(&rendering, "flux_arrived") / f64::from(passes::FLUX_UNITS);
        assert!((sent - 1.0).abs() < 0.01, "both sides {double_sided}: {sent}");
        let [rays, photons] = rays_and_photons(gpu, &scene, &camera, technique);
        assert!((photons / rays - 1.0).abs() < 0.06, "both sides {double_sided}, {conserved}: {photons} of {rays}");
    }
}
