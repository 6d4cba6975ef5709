//! A procedural environment.

use glam::Vec3;

use crate::Environment;

/// A blue sky that is brighter towards the horizon, a warm patch 20° wide in it, and a dark ground.
pub fn sky() -> Environment {
    let (width, height) = (128, 64);
    let mut sky = Environment { width, height, pixels: vec![Vec3::ZERO; width * height], rotation: 0.0 };
    let towards_patch = Vec3::new(0.5, 0.6, -0.4).normalize();
    for i in 0..sky.pixels.len() {
        let middle = |i: usize, count: usize| (i as f32 + 0.5) / count as f32;
        let direction = sky.direction(middle(i % width, width), middle(i / width, height));
        sky.pixels[i] = if direction.y < 0.0 {
            Vec3::splat(0.1)
        } else {
            let patch = if direction.dot(towards_patch) > 10f32.to_radians().cos() { 20.0 } else { 0.0 };
            Vec3::new(0.4, 0.6, 1.0) * (1.5 - direction.y) + Vec3::new(1.0, 0.8, 0.6) * patch
        };
    }
    sky
}
