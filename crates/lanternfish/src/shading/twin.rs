//! `brdf.wesl` as plain Rust, in double precision: its specification and its oracle.

use std::f64::consts::PI;

use glam::DVec3;

/// Of an index of refraction of 1.5, glTF's default; and the shader's `LEAST_ROUGHNESS`.
pub(crate) const DIELECTRIC_F0: f64 = 0.04;
pub(crate) const LEAST_ROUGHNESS: f64 = 0.03;

/// A surface whose normal is +z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub base_color: DVec3,
    pub metallic: f64,
    pub perceptual_roughness: f64,
}

impl Surface {
    /// GGX's alpha.
    pub fn alpha(&self) -> f64 {
        self.perceptual_roughness.max(LEAST_ROUGHNESS).powi(2)
    }

    /// Schlick's Fresnel term.
    fn fresnel(&self, v_dot_h: f64) -> DVec3 {
        let f0 = DVec3::splat(DIELECTRIC_F0).lerp(self.base_color, self.metallic);
        f0 + (1.0 - f0) * (1.0 - v_dot_h).clamp(0.0, 1.0).powi(5)
    }

    /// GGX [Walter2007, eq. 33].
    pub fn normal_distribution(&self, n_dot_h: f64) -> f64 {
        let a2 = self.alpha().powi(2);
        a2 / (PI * (n_dot_h * n_dot_h * (a2 - 1.0) + 1.0).powi(2))
    }

    /// The specular BRDF, 1/sr; without the cosine.
    pub fn specular(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let h = (wi + wo).normalize();
        let k = 0.5 * self.alpha();
        let g1 = |cosine: f64| cosine / (cosine * (1.0 - k) + k);
        let (l, v) = (wi.z, wo.z.max(1e-4));
        self.fresnel(wo.dot(h)) * (self.normal_distribution(h.z.max(0.0)) * g1(l) * g1(v) / (4.0 * l * v))
    }

    /// The diffuse BRDF, 1/sr: what the specular part lets through.
    pub fn diffuse(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let h = (wi + wo).normalize();
        (1.0 - self.fresnel(wo.dot(h))) * (1.0 - self.metallic) * self.base_color / PI
    }

    /// The BRDF times n·wi, 1/sr.
    pub fn reflect_light(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 { DVec3::ZERO } else { (self.specular(wi, wo) + self.diffuse(wi, wo)) * wi.z }
    }

    /// Share of the light from all sides that goes towards `wo`: ∫ f cos dω, by `n` × `n` strata. The specular part is
    /// sampled by GGX's own half vectors, the diffuse part by the cosine.
    pub fn reflectance(&self, wo: DVec3, n: u32) -> DVec3 {
        let a2 = self.alpha().powi(2);
        let mut sum = DVec3::ZERO;
        for i in 0..n * n {
            let u = (f64::from(i / n) + 0.5) / f64::from(n);
            let (sin_phi, cos_phi) = (2.0 * PI * (f64::from(i % n) + 0.5) / f64::from(n)).sin_cos();

            let cosine = ((1.0 - u) / (1.0 + (a2 - 1.0) * u)).sqrt();
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            let h = DVec3::new(sine * cos_phi, sine * sin_phi, cosine);
            let wi = 2.0 * wo.dot(h) * h - wo;
            if wi.z > 0.0 && wo.dot(h) > 0.0 {
                let pdf = self.normal_distribution(cosine) * cosine / (4.0 * wo.dot(h));
                sum += self.specular(wi, wo) * wi.z / pdf;
            }

            let wi = DVec3::new(u.sqrt() * cos_phi, u.sqrt() * sin_phi, (1.0 - u).sqrt());
            sum += self.diffuse(wi, wo) * PI;
        }
        sum / f64::from(n * n)
    }
}
