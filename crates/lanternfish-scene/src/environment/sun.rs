//! The sun of an environment map, as a directional light.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::Environment;
use crate::Light;

/// Radius of a possible sun with its glare around the brightest pixel, rad.
const RADIUS: f32 = 0.05;
/// Outer radius of the ring whose mean radiance takes the sun's place, rad.
const RING: f32 = 0.1;
/// Least fraction of all light that a sun emits.
const LEAST_FRACTION: f64 = 0.05;

impl Environment {
    /// Removes the sun from the image and returns it as a directional light of the same illuminance (lx); `None`, and no change, without one. A
    /// sun is a small area that sends more than a twentieth of all light. Its pixels get at most the mean radiance around it. The fields' rules must
    /// hold, as they do after [`Self::load`].
    ///
    /// Few rays see a sun as a wide blur: as a light it casts sharp shadows from the first frame on.
    pub fn take_sun(&mut self) -> Option<Light> {
        let solid_angles: Vec<f64> = (0..self.height).map(|y| self.solid_angle_of_row(y)).collect();
        let brightness = |pixel: &Vec3| f64::from(pixel.element_sum());
        let all: f64 = self.pixels.iter().enumerate().map(|(i, p)| brightness(p) * solid_angles[i / self.width]).sum();
        let brightest = (0..self.pixels.len())
            .max_by(|a, b| self.pixels[*a].element_sum().total_cmp(&self.pixels[*b].element_sum()).then(b.cmp(a)))?;
        let center = self.direction_of(brightest);
        let near: Vec<(usize, f32)> = (0..self.pixels.len())
            .map(|i| (i, self.direction_of(i).dot(center)))
            .filter(|(_, cosine)| *cosine > RING.cos())
            .collect();
        let (mut around, mut of_ring) = (DVec3::ZERO, 0.0);
        for (i, _) in near.iter().filter(|(_, cosine)| *cosine <= RADIUS.cos()) {
            let solid_angle = solid_angles[i / self.width];
            around += self.pixels[*i].as_dvec3() * solid_angle;
            of_ring += solid_angle;
        }
        // Pixels may be wider than the ring.
        if of_ring == 0.0 {
            return None;
        }
        let around = (around / of_ring).as_vec3();
        let (mut illuminance, mut towards) = (DVec3::ZERO, DVec3::ZERO);
        let disk: Vec<usize> = near.iter().filter(|(_, cosine)| *cosine > RADIUS.cos()).map(|(i, _)| *i).collect();
        for i in &disk {
            let excess = (self.pixels[*i] - around).max(Vec3::ZERO).as_dvec3() * solid_angles[i / self.width];
            illuminance += excess;
            towards += excess.element_sum() * self.direction_of(*i).as_dvec3();
        }
        if illuminance.element_sum() <= LEAST_FRACTION * all || !illuminance.as_vec3().is_finite() {
            return None;
        }
        disk.into_iter().for_each(|i| self.pixels[i] = self.pixels[i].min(around));
        let towards = towards.normalize_or(center.as_dvec3()).as_vec3();
        Some(Light { name: "sun of the environment".to_owned(), ..Light::directional(-towards, illuminance.as_vec3()) })
    }

    /// Direction of a pixel's centre.
    fn direction_of(&self, pixel: usize) -> Vec3 {
        let (x, y) = (pixel % self.width, pixel / self.width);
        self.direction((x as f32 + 0.5) / self.width as f32, (y as f32 + 0.5) / self.height as f32)
    }

    /// Solid angle of each pixel of a row, sr.
    fn solid_angle_of_row(&self, y: usize) -> f64 {
        let cosine = |y: usize| (PI * y as f64 / self.height as f64).cos();
        TAU / self.width as f64 * (cosine(y) - cosine(y + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LightKind;

    /// A sky of 1 nit with a disk of this radius (rad) and radiance (nits).
    fn sky(towards: Vec3, radius: f32, radiance: f32) -> Environment {
        let mut sky = Environment { width: 512, height: 256, pixels: vec![Vec3::ONE; 512 * 256], rotation: 0.4 };
        for i in 0..sky.pixels.len() {
            if sky.direction_of(i).dot(towards) > radius.cos() {
                sky.pixels[i] = Vec3::new(radiance, 0.8 * radiance, 0.5 * radiance);
            }
        }
        sky
    }

    /// Illuminance of a surface that faces up, lx.
    fn illuminance(sky: &Environment) -> Vec3 {
        let part = |i: usize| {
            let cosine = f64::from(sky.direction_of(i).y.max(0.0));
            sky.pixels[i].as_dvec3() * sky.solid_angle_of_row(i / sky.width) * cosine
        };
        (0..sky.pixels.len()).map(part).sum::<DVec3>().as_vec3()
    }

    #[test]
    fn a_sun_leaves_the_image_and_keeps_its_light() {
        let towards = Vec3::new(0.3, 0.8, -0.4).normalize();
        let mut sky = sky(towards, 0.02, 20_000.0);
        let before = illuminance(&sky);
        let sun = sky.take_sun().unwrap();
        assert!(sun.kind == LightKind::Directional && sun.direction.dot(-towards) > 0.002f32.cos(), "{sun:?}");
        let after = illuminance(&sky) + sun.intensity * -sun.direction.y;
        assert!((after / before - 1.0).abs().max_element() < 1e-3, "{after} instead of {before}");
        assert!(sky.pixels.iter().all(|pixel| *pixel == Vec3::ONE), "the sky is even");
        assert_eq!(sky.take_sun(), None, "once only");
    }

    #[test]
    fn an_image_without_a_sun_stays_as_it_is() {
        let towards = Vec3::Y;
        // A bright window is too wide; a dim sun too weak.
        let coarse = |width, height| {
            let mut pixels = vec![Vec3::ONE; width * height];
            pixels[0] = Vec3::splat(100.0);
            Environment { width, height, pixels, rotation: 0.0 }
        };
        let skies = [sky(towards, 0.4, 100.0), sky(towards, 0.02, 50.0), sky(towards, 0.0, 1.0)];
        for mut sky in skies.into_iter().chain([coarse(1, 1), coarse(2, 1), coarse(32, 16)]) {
            let before = sky.clone();
            assert_eq!(sky.take_sun(), None);
            assert_eq!(sky, before);
        }
    }
}
