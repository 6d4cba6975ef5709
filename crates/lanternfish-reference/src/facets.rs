//! Sampling of GGX microfacets, with a grain or without.

use std::f64::consts::PI;

use glam::DVec3;

use crate::brdf::{Grain, Reflector, normal_distribution};

/// The microfacets of a surface.
pub(crate) struct Facets {
    /// Along the grain, across it, and the shading normal.
    axes: [DVec3; 3],
    alpha: [f64; 2],
    grain: Option<Grain>,
}

impl Facets {
    pub fn of(reflector: &Reflector, n: DVec3) -> Self {
        match reflector.grain {
            Some(grain) => {
                Self { axes: [grain.along, n.cross(grain.along), n], alpha: grain.alpha, grain: Some(grain) }
            }
            None => {
                let (x, y) = n.any_orthonormal_pair();
                Self { axes: [x, y, n], alpha: [reflector.alpha(); 2], grain: None }
            }
        }
    }

    /// Alpha along the azimuth of a direction.
    pub fn alpha_towards(&self, w: DVec3) -> f64 {
        let [x, y] = [self.axes[0].dot(w), self.axes[1].dot(w)];
        let squared = x * x + y * y;
        if squared < 1e-10 {
            return (self.alpha[0] * self.alpha[1]).sqrt();
        }
        (((self.alpha[0] * x).powi(2) + (self.alpha[1] * y).powi(2)) / squared).sqrt()
    }

    /// Samples a microfacet normal visible from `wo`, with spherical caps [Dupuy2023].
    pub fn sample(&self, wo: DVec3, u: f64, v: f64) -> DVec3 {
        let [x, y, n] = self.axes;
        let [along, across] = self.alpha;
        // In the space where microfacets form a hemisphere, the reflected directions are uniform on a spherical cap.
        let stretched = DVec3::new(along * x.dot(wo), across * y.dot(wo), n.dot(wo)).normalize();
        let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
        let (sin, cos) = (2.0 * PI * u).sin_cos();
        let ring = (1.0 - z * z).max(0.0).sqrt();
        let h = DVec3::new(ring * cos, ring * sin, z) + stretched;
        let h = DVec3::new(along * h.x, across * h.y, h.z.max(0.0)).normalize();
        h.x * x + h.y * y + h.z * n
    }

    /// Density of [`Self::sample`] over microfacet normals, 1/sr: D (wo·h) G1 / (n·wo) with Smith's exact G1 [Heitz2018, eq. 3].
    pub fn pdf(&self, wo: DVec3, h: DVec3) -> f64 {
        let [x, y, n] = self.axes;
        let stretched = DVec3::new(self.alpha[0] * x.dot(wo), self.alpha[1] * y.dot(wo), n.dot(wo));
        let shadowing = n.dot(wo) + stretched.length();
        let distribution = match &self.grain {
            Some(grain) => grain_distribution(grain, n, h),
            None => normal_distribution(n, h, self.alpha[0]),
        };
        2.0 * distribution * wo.dot(h).max(0.0) / shadowing
    }
}

/// GGX with an alpha along the grain and one across it.
pub(crate) fn grain_distribution(grain: &Grain, n: DVec3, h: DVec3) -> f64 {
    let [along, across] = grain.alpha;
    let scaled = DVec3::new(
        across * grain.along.dot(h),
        along * n.cross(grain.along).dot(h),
        along * across * n.dot(h).max(0.0),
    );
    let k = along * across / scaled.length_squared();
    k * k * along * across / PI
}
