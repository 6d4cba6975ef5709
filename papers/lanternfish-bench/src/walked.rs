//! Errors along a walk on a display, and the walk's camera.

use std::f32::consts::PI;

use lanternfish_scene::Camera;

/// Seconds of a frame.
pub const STEP: f32 = 1.0 / 30.0;

/// Sums over the frames of a walk, each compared with a reference of the same moment.
#[derive(Debug, Default)]
pub struct Walked {
    /// Mean of |difference| of every frame, 0..1.
    pub errors: Vec<f64>,
    /// Counts of |difference| in steps of 1/255.
    counts: Vec<u64>,
}

impl Walked {
    /// Adds a frame and its reference: display colours, RGB bytes of the same size.
    pub fn add(&mut self, image: &[u8], reference: &[u8]) {
        self.counts.resize(256, 0);
        let mut sum = 0u64;
        for difference in image.iter().zip(reference).map(|(a, b)| a.abs_diff(*b)) {
            self.counts[usize::from(difference)] += 1;
            sum += u64::from(difference);
        }
        self.errors.push(sum as f64 / 255.0 / image.len() as f64);
    }

    /// Mean error of all frames.
    pub fn mean(&self) -> f64 {
        self.errors.iter().sum::<f64>() / self.errors.len().max(1) as f64
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_that_of_all_values() {
        let mut half = Walked::default();
        half.add(&[51; 300], &[0; 300]);
        half.add(&[102; 300], &[51; 300]);
        assert_eq!(half.mean(), 0.2);
        let mut rare = Walked::default();
        let mut image = [0; 1000];
        image[..5].fill(255);
        rare.add(&image, &[0; 1000]);
        assert_eq!((rare.percentile(0.99), rare.percentile(0.999)), (0.0, 1.0), "5 of 1,000 values are wrong");
    }
}
