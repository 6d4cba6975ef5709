//! Errors along a walk on a display, and the walk's camera.

use std::f32::consts::PI;

use glam::Vec3;
use lanternfish_scene::{Camera, Scene};

/// Seconds of a frame.
pub const STEP: f32 = 1.0 / 30.0;

/// Sums over the frames of a walk, each compared with a reference of the same moment.
#[derive(Debug, Default)]
pub struct Walked {
    /// Mean of |difference| of every frame, 0..1.
    pub errors: Vec<f64>,
    /// Counts of |difference| in steps of 1/255.
    counts: Vec<u64>,
    /// Sum of the mean changes of the difference from one frame to the next.
    changes: f64,
    before: Vec<i16>,
}

impl Walked {
    /// Adds a frame and its reference: display colours, RGB bytes of the same size.
    pub fn add(&mut self, image: &[u8], reference: &[u8]) {
        self.counts.resize(256, 0);
        let differences: Vec<i16> = image.iter().zip(reference).map(|(a, b)| i16::from(*a) - i16::from(*b)).collect();
        let mut sum = 0u64;
        for value in &differences {
            self.counts[usize::from(value.unsigned_abs())] += 1;
            sum += u64::from(value.unsigned_abs());
        }
        let count = differences.len() as f64;
        self.errors.push(sum as f64 / 255.0 / count);
        let changes = differences.iter().zip(&self.before);
        let changed: u64 = changes.map(|(now, before)| u64::from((now - before).unsigned_abs())).sum();
        self.changes += changed as f64 / 255.0 / count;
        self.before = differences;
    }

    /// Mean error of all frames.
    pub fn mean(&self) -> f64 {
        self.errors.iter().sum::<f64>() / self.errors.len().max(1) as f64
    }

    /// Mean change of the difference from one frame to the next.
    pub fn flicker(&self) -> f64 {
        self.changes / self.errors.len().saturating_sub(1).max(1) as f64
    }

    /// This percentile, 0..1, of |difference| over all values of all frames.
    pub fn percentile(&self, rank: f64) -> f64 {
        let total: u64 = self.counts.iter().sum();
        let mut left = ((total as f64) * (1.0 - rank)) as u64;
        for (value, count) in self.counts.iter().enumerate().rev() {
            if *count > left {
                return value as f64 / 255.0;
            }
            left -= count;
        }
        0.0
    }
}

/// The camera after a walk of so many seconds: 0.3 m forwards a second, swaying by 0.2 m.
pub fn walk(start: &Camera, time: f32) -> Camera {
    let mut camera = start.clone();
    let place = &mut camera.world_from_camera;
    let (aside, forwards) = (place.matrix3.x_axis, -place.matrix3.z_axis);
    place.translation += forwards * (0.3 * time) + aside * (0.2 * (PI * time / 2.0).sin());
    camera
}

/// Turns the brightest light off.
pub fn put_out_brightest(scene: &mut Scene) {
    let intensity = |light: &lanternfish_scene::Light| light.intensity.max_element();
    if let Some(light) = scene.lights.iter_mut().max_by(|a, b| intensity(a).total_cmp(&intensity(b))) {
        light.intensity = Vec3::ZERO;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_brightest_light_goes_out() {
        let mut scene = lanternfish_scene::generate::demo("atrium").unwrap();
        let sum = |scene: &Scene| scene.lights.iter().map(|light| light.intensity.max_element()).sum::<f32>();
        let most = scene.lights.iter().map(|light| light.intensity.max_element()).fold(0.0, f32::max);
        let before = sum(&scene);
        put_out_brightest(&mut scene);
        assert!((before - sum(&scene) - most).abs() < 1e-3 * most);
    }

    #[test]
    fn errors_and_flicker_are_told_apart() {
        let (mut constant, mut flickers) = (Walked::default(), Walked::default());
        for frame in 0..4 {
            constant.add(&[51; 300], &[0; 300]);
            flickers.add(&[if frame % 2 == 0 { 102 } else { 0 }; 300], &[0; 300]);
        }
        assert_eq!((constant.mean(), constant.flicker()), (0.2, 0.0));
        assert!((flickers.mean() - 0.2).abs() < 1e-9 && (flickers.flicker() - 0.4).abs() < 1e-9, "{flickers:?}");
        let mut rare = Walked::default();
        let mut image = [0; 1000];
        image[..5].fill(255);
        rare.add(&image, &[0; 1000]);
        assert_eq!((rare.percentile(0.99), rare.percentile(0.999)), (0.0, 1.0), "5 of 1,000 values are wrong");
    }
}
