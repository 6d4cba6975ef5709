//! Scenes, lights and cameras for light culling.

use glam::Vec3;
use lanternfish_scene::{Camera, Light, LightKind, Material, Projection, Scene};
use proptest::prelude::*;

use crate::testing::{Random, quad, scene_of};

/// Boxes of every size scattered in depth, with sky between them.
pub fn scattered() -> Scene {
    let mut random = Random::new(7);
    let thin_dielectrics = (0..40).map(|_| {
        let right = random.direction() * random.between(0.05, 0.8);
        let up = right.cross(random.direction()) * 0.7;
        let center = random.point() * Vec3::new(3.0, 2.0, 6.0);
        quad(0, center, right, up)
    });
    scene_of(thin_dielectrics.collect(), vec![Material { double_sided: true, ..Material::default() }])
}

pub fn light() -> impl Strategy<Value = Light> {
    let position = prop::array::uniform3(-6.0f32..6.0).prop_map(Vec3::from);
    let direction = prop::array::uniform3(-1.0f32..1.0).prop_map(|d| (Vec3::from(d) + Vec3::splat(1e-3)).normalize());
    // From one centimetre to thirty metres, or given by the threshold.
    let range = prop::option::weighted(0.8, (-2.0f32..1.5).prop_map(|exponent| 10f32.powf(exponent)));
    // From almost a point to larger than the view.
    let half = || (-2.0f32..1.0).prop_map(|exponent| 10f32.powf(exponent));
    let angles = (0.01f32..std::f32::consts::FRAC_PI_2, 0.0f32..0.99);
    let kind = prop_oneof![
        4 => Just(LightKind::Point),
        4 => angles.prop_map(|(outer, fraction)| LightKind::Spot { inner_angle: outer * fraction, outer_angle: outer }),
        1 => Just(LightKind::Directional),
        2 => half().prop_map(|radius| LightKind::Disk { radius }),
        2 => (half(), half()).prop_map(|(half_width, half_height)| LightKind::Rectangle {
            half_width,
            half_height,
            right: Vec3::X,
        }),
    ];
    (position, direction, range, kind, 0.001f32..100.0).prop_map(|(position, direction, range, mut kind, intensity)| {
        if let LightKind::Rectangle { right, .. } = &mut kind {
            *right = direction.any_orthonormal_vector();
        }
        Light { kind, direction, range, ..Light::point(position, Vec3::splat(intensity)) }
    })
}

pub fn camera() -> impl Strategy<Value = Camera> {
    let point = || prop::array::uniform3(-4.0f32..4.0).prop_map(Vec3::from);
    let perspective = (0.3f32..2.2).prop_map(|fov_y| Projection::Perspective { fov_y, near: 0.01 });
    let orthographic =
        (0.3f32..5.0).prop_map(|half_height| Projection::Orthographic { half_height, near: 0.0, far: 12.0 });
    let frustum = (-1.5f32..0.2, 0.3f32..1.5, -1.5f32..0.2, 0.3f32..1.5)
        .prop_map(|(left, right, bottom, top)| Projection::Frustum { left, right, bottom, top, near: 0.01 });
    let projection = prop_oneof![3 => perspective, 1 => frustum, 1 => orthographic];
    (point(), point(), projection).prop_map(|(eye, target, projection)| {
        // Neither coincident nor vertical.
        Camera::look_at(eye, target + Vec3::new(0.0, 0.0, -0.013), projection)
    })
}

/// Lights at positions where plane tests are most likely to fail.
pub fn special(camera: &Camera) -> Vec<Light> {
    let at = |p: Vec3| camera.world_from_camera.transform_point3(p);
    let forward = camera.world_from_camera.transform_vector3(Vec3::NEG_Z);
    let light = |position, range| Light { range: Some(range), ..Light::point(position, Vec3::ONE) };
    let spot = |light: Light, direction, outer_angle| Light {
        kind: LightKind::Spot { inner_angle: 0.0, outer_angle },
        direction,
        ..light
    };
    let disk = |light: Light, direction| Light { kind: LightKind::Disk { radius: 0.5 }, direction, ..light };
    vec![
        disk(light(at(Vec3::ZERO), 8.0), forward),
        disk(light(at(Vec3::new(0.0, 0.0, -4.0)), 8.0), -forward),
        disk(light(at(Vec3::new(0.0, 0.0, 1.0)), 8.0), forward),
        disk(light(at(Vec3::new(2.0, 1.0, -3.0)), 4.0), forward.any_orthonormal_vector()),
        light(at(Vec3::ZERO), 3.0),
        light(at(Vec3::new(0.0, 0.0, 2.0)), 6.0),
        light(at(Vec3::new(0.0, 0.0, 2.0)), 1.9),
        light(at(Vec3::new(5.0, 0.0, -1.0)), 5.5),
        spot(light(at(Vec3::ZERO), 8.0), forward, 0.3),
        spot(light(at(Vec3::new(0.0, 0.0, 1.0)), 8.0), forward, 0.2),
        spot(light(at(Vec3::new(0.0, 0.0, -4.0)), 8.0), -forward, 0.5),
        spot(light(at(Vec3::new(2.0, 1.0, -3.0)), 4.0), forward, 1.4),
    ]
}
