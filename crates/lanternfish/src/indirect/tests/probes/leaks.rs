//! Dark rooms stay dark.

use lanternfish_scene::Projection;

use super::*;

/// Half of the view's width at a distance of 1 m; the eye and the near plane, which cuts the front wall away.
const SLOPE: f32 = 0.75 / 2.05;
const EYE: Vec3 = Vec3::new(0.2, 0.0, 3.0);
const NEAR: f32 = 2.05;

/// Two rooms with a wall between them, seen side by side, and a lamp in the left one. The wall ends this far behind the front, m.
fn rooms(thickness: f32, gap: f32) -> (Scene, Camera) {
    let mut scene = closed_box(matt(0.7));
    let half = 0.5 * thickness;
    for side in [-half, half] {
        let middle = Vec3::new(side, 0.0, -0.5 * gap);
        scene.meshes[0].primitives.push(quad(0, middle, (1.0 - 0.5 * gap) * Vec3::Z, Vec3::Y));
    }
    scene.lights.push(Light::point(Vec3::new(-0.6, 0.5, 0.2), Vec3::ONE));
    let projection = Projection::Frustum { left: -SLOPE, right: SLOPE, bottom: -0.3, top: 0.3, near: NEAR };
    (scene, Camera::look_at(EYE, EYE - Vec3::Z, projection))
}

/// Light of the dark room's pixels over the indirect light of those of the lit room.
fn leak(gpu: &Gpu, indirect: impl Into<Indirect>, thickness: f32, gap: f32) -> f64 {
    let (scene, camera) = rooms(thickness, gap);
    let of = |indirect: Indirect| rested(gpu, indirect, &scene, &camera, LARGE, 0..4);
    let (with, without) = (of(indirect.into()), of(Indirect::NONE));
    let column = |x: f32| ((x - EYE.x) / NEAR / SLOPE * 0.5 + 0.5) * LARGE.x as f32;
    let [lit_end, dark] = [column(-0.5 * thickness).floor(), column(0.5 * thickness).ceil()].map(|x| x as usize);
    let part = |image: &[Vec3], columns: std::ops::Range<usize>| {
        let within = image.iter().enumerate().filter(|(i, _)| columns.contains(&(i % LARGE.x as usize)));
        mean(&within.map(|(_, pixel)| *pixel).collect::<Vec<_>>())
    };
    part(&with, dark..LARGE.x as usize) / (part(&with, 0..lit_end) - part(&without, 0..lit_end))
}

/// Both rooms are in one view, so that probes of the lit one are beside those of the dark one in the image.
#[gpu_test]
fn gpu_probes_do_not_leak_through_a_thin_wall(gpu: &Gpu) {
    for thickness in [0.01, 0.25] {
        let [of_probes, of_pixels] =
            [Indirect::from(probes()), per_pixel()].map(|technique| leak(gpu, technique, thickness, 0.0));
        println!(
            "a wall of {thickness} m: {of_probes:.5} leaks with probes, {of_pixels:.5} with rays from every pixel"
        );
        // Entries of the radiance cache, of 3 cm, lie on the floor of both rooms.
        assert!(of_probes < if thickness < 0.03 { of_pixels } else { 0.005 }, "{thickness}: {of_probes}");
    }
    // The test can fail: light passes a wall with a slit.
    let of_gap = leak(gpu, probes(), 0.01, 0.2);
    println!("a slit: {of_gap:.3}");
    assert!(of_gap > 0.01, "{of_gap}");
}
