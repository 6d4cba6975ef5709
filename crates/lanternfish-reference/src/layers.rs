//! Layers over a reflector: sheen, and over it a clear coat. CPU reference of `materials/sheen.wesl`, `materials/coat.wesl` and
//! `materials/iridescence.wesl` in double precision.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::brdf::{Behind, LEAST_COSINE, Reflector, ScattersThrough, cosine_direction, grazing_fraction, half_vector};

/// The layers over a reflector, from below.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layers {
    /// Fibres.
    pub sheen: Option<Sheen>,
    /// A clear coat.
    pub coat: Option<Coat>,
}

/// A clear coat with index of refraction 1.5 (`KHR_materials_clearcoat`): an additional specular layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Weight, in 0..=1.
    pub weight: f64,
    /// Perceptual roughness.
    pub perceptual_roughness: f64,
    /// Shading normal of the coat, unit.
    pub normal: DVec3,
}

/// Sheen (`KHR_materials_sheen`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Linear, in 0..=1.
    pub color: DVec3,
    /// Perceptual roughness.
    pub perceptual_roughness: f64,
}

impl Layers {
    /// Transmittance of the layers for light that the surface below scatters towards `wo`.
    pub fn fraction_below(&self, n: DVec3, wo: DVec3) -> f64 {
        let below_sheen = self.sheen.map_or(1.0, |sheen| sheen.fraction_below(n.dot(wo)));
        below_sheen * self.coat.map_or(1.0, |coat| coat.fraction_below(wo))
    }

    /// The BRDF times n·wi, 1/sr. `below` is that of the surface without its layers.
    pub(crate) fn over(&self, n: DVec3, wi: DVec3, wo: DVec3, below: DVec3) -> DVec3 {
        let sheen = self.sheen.map_or(below, |sheen| sheen.over(n, wi, wo, below));
        self.coat.map_or(sheen, |coat| coat.over(wi, wo, sheen))
    }

    /// Sampling probabilities of the coat and of the sheen.
    fn chances(&self, n: DVec3, wo: DVec3) -> [f64; 2] {
        let coat = self.coat.map_or(0.0, |coat| coat.chance(wo));
        let sheen = self.sheen.map_or(0.0, |sheen| sheen.chance(n.dot(wo)));
        [coat, (1.0 - coat) * sheen]
    }

    pub(crate) fn choose(&self, n: DVec3, wo: DVec3, u: [f64; 3], below: &Reflector) -> Option<DVec3> {
        let [of_coat, of_sheen] = self.chances(n, wo);
        if let Some(coat) = self.coat.filter(|_| u[0] < of_coat) {
            return coat.layer().choose(coat.normal, wo, [0.0, u[1], u[2]]);
        }
        if u[0] < of_coat + of_sheen {
            return Some(cosine_direction(n, u[1], u[2]));
        }
        below.choose(n, wo, [(u[0] - of_coat - of_sheen) / (1.0 - of_coat - of_sheen), u[1], u[2]])
    }

    pub(crate) fn pdf(&self, n: DVec3, wi: DVec3, wo: DVec3, below: &Reflector) -> f64 {
        let [of_coat, of_sheen] = self.chances(n, wo);
        let coat = self.coat.map_or(0.0, |coat| of_coat * coat.layer().pdf(coat.normal, wi, wo));
        coat + of_sheen * n.dot(wi).max(0.0) / PI + (1.0 - of_coat - of_sheen) * below.pdf(n, wi, wo)
    }
}

impl Coat {
    fn layer(&self) -> Reflector {
        Reflector {
            albedo: DVec3::ZERO,
            f0: DVec3::splat(0.04),
            f90: 1.0,
            perceptual_roughness: self.perceptual_roughness,
            grain: None,
            transmission: 0.0,
            behind: Behind::Thin,
            through: ScattersThrough::default(),
        }
    }

    /// Transmittance of the coat for light that the surface below scatters towards `wo`.
    pub fn fraction_below(&self, wo: DVec3) -> f64 {
        let layer = self.layer();
        let grazing = grazing_fraction(self.normal.dot(wo).max(LEAST_COSINE), layer.alpha());
        1.0 - self.weight * (1.0 - layer.lets_in(grazing).x)
    }

    /// The BRDF times n·wi, 1/sr, of the coated surface. `below` is that of the surface without its coat.
    pub fn over(&self, wi: DVec3, wo: DVec3, below: DVec3) -> DVec3 {
        self.fraction_below(wo) * below + self.weight * self.layer().reflect_light(self.normal, wi, wo)
    }

    fn chance(&self, wo: DVec3) -> f64 {
        // Its reflectance, but at least 0.1.
        let weight = self.weight * self.layer().fresnel(self.normal.dot(wo).max(LEAST_COSINE)).x.max(0.1);
        weight / (1.0 + weight)
    }
}

impl Sheen {
    fn alpha(&self) -> f64 {
        self.roughness().powi(2)
    }

    /// Below 0.25 the lobe is narrower than its albedo's fit.
    fn roughness(&self) -> f64 {
        self.perceptual_roughness.clamp(0.25, 1.0)
    }

    /// The BRDF of white sheen times n·wi, 1/sr `[Conty2017]`, without its softening of the terminator.
    pub fn reflect(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        let (n_dot_l, n_dot_v) = (n.dot(wi), n.dot(wo).max(LEAST_COSINE));
        if n_dot_l <= 0.0 || (wi + wo).length_squared() < 1e-12 {
            return 0.0;
        }
        let alpha = self.alpha();
        let n_dot_h = n.dot(half_vector(n, wi, wo));
        let distribution = (2.0 + 1.0 / alpha) * (1.0 - n_dot_h * n_dot_h).max(0.0).powf(0.5 / alpha) / (2.0 * PI);
        distribution / (4.0 * n_dot_v * (1.0 + shadowing(n_dot_l, alpha) + shadowing(n_dot_v, alpha)))
    }

    /// Directional albedo of white sheen. A fit to [`Self::reflect`], too high by up to 0.03, too low by at most 0.01.
    pub fn albedo(&self, cosine: f64) -> f64 {
        let r = self.roughness();
        let polynomial = |c: [f64; 4]| c[0] + r * (c[1] + r * (c[2] + r * c[3]));
        let at_grazing = polynomial([1.2692, -6.9125, 10.6389, -4.9624]);
        let linear = polynomial([-7.7712, 17.0554, -15.1239, 4.857]);
        let root = polynomial([-2.4022, 9.0733, -13.752, 6.2664]);
        ((at_grazing + linear * cosine + root * cosine.sqrt()).exp() + 0.01).min(1.0)
    }

    /// Transmittance of the sheen for light that the surface below scatters at this cosine to the normal.
    pub fn fraction_below(&self, cosine: f64) -> f64 {
        1.0 - self.color.max_element() * self.albedo(cosine.max(LEAST_COSINE))
    }

    fn over(&self, n: DVec3, wi: DVec3, wo: DVec3, below: DVec3) -> DVec3 {
        self.fraction_below(n.dot(wo)) * below + self.color * self.reflect(n, wi, wo)
    }

    fn chance(&self, cosine: f64) -> f64 {
        // Its reflectance, but at least 0.1.
        let weight = (self.color.max_element() * self.albedo(cosine.max(LEAST_COSINE))).max(0.1);
        weight / (1.0 + weight)
    }
}

/// The function Λ of the distribution of fibres, by its published fit `[Conty2017]`.
fn shadowing(cosine: f64, alpha: f64) -> f64 {
    let exponent = |x: f64| {
        let t = (1.0 - alpha).powi(2);
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let [a, b, c, d, e] = [
            mix(21.5473, 25.3245),
            mix(3.82987, 3.32435),
            mix(0.19823, 0.16801),
            mix(-1.97760, -1.27393),
            mix(-4.32054, -4.85967),
        ];
        a / (1.0 + b * x.max(1e-6).powf(c)) + d * x + e
    };
    if cosine < 0.5 { exponent(cosine).exp() } else { (2.0 * exponent(0.5) - exponent(1.0 - cosine)).exp() }
}

/// A thin film (`KHR_materials_iridescence`) `[Belcour2017]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinFilm {
    /// Index of refraction, at least 1.
    pub ior: f64,
    /// nm.
    pub thickness: f64,
}

impl ThinFilm {
    /// Reflectance at normal incidence for which Schlick's term is the film's reflectance at this cosine. `f0`: that of the surface without
    /// the film.
    pub fn f0(&self, f0: DVec3, cosine: f64) -> DVec3 {
        let cosine = cosine.clamp(LEAST_COSINE, 1.0);
        let grazing = (1.0 - cosine).powi(5).min(0.999);
        ((self.reflectance(f0, cosine) - grazing) / (1.0 - grazing)).clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// Light that the film's two sides reflect, with two orders of interference, averaged over the sensitivity of the eye.
    pub fn reflectance(&self, f0: DVec3, cosine: f64) -> DVec3 {
        let schlick = |f0: DVec3, cosine: f64| f0 + (1.0 - f0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5);
        // Without thickness there is no film.
        let t = (self.thickness / 0.03).clamp(0.0, 1.0);
        let ior = 1.0 + (self.ior - 1.0) * t * t * (3.0 - 2.0 * t);
        let inside = (1.0 - (1.0 - cosine * cosine) / (ior * ior)).max(0.0).sqrt();
        let r12 = schlick(DVec3::splat(((ior - 1.0) / (ior + 1.0)).powi(2)), cosine).x;
        let t121 = 1.0 - r12;
        // The surface's index follows from its reflectance in air.
        let root = f0.clamp(DVec3::ZERO, DVec3::splat(0.9999)).map(f64::sqrt);
        let below = (1.0 + root) / (1.0 - root);
        let step = (below - ior) / (below + ior);
        let r23 = schlick(step * step, inside);
        // Reflection at a denser medium shifts the phase by π.
        let shift = below.map(|below| if below < ior { 2.0 * PI } else { PI });
        let path = 2.0 * ior * self.thickness * inside;

        let r123 = (r12 * r23).clamp(DVec3::splat(1e-5), DVec3::splat(0.9999));
        let inner = t121 * t121 * r23 / (1.0 - r123);
        let first = r12 + inner;
        let orders = [1.0, 2.0].map(|m: f64| {
            let amplitude = r123.map(|r| r.sqrt().powf(m)) * (inner - t121);
            2.0 * amplitude * interference(m * path, m * shift)
        });
        (first + orders[0] + orders[1]).max(DVec3::ZERO)
    }
}

/// Linear Rec. 709 of the cosine of the phase over the spectrum: the Fourier transform of the colour matching functions. `path` in nm.
fn interference(path: f64, shift: DVec3) -> DVec3 {
    let phase = 2.0 * PI * path * 1e-9;
    let gaussian = |scale: f64, centre: f64, width: f64, shift: f64| {
        scale * (2.0 * PI * width).sqrt() * (centre * phase + shift).cos() * (-phase * phase * width).exp()
    };
    let xyz = DVec3::new(
        gaussian(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + gaussian(9.7470e-14, 2.2399e6, 4.5282e9, shift.x),
        gaussian(4.4201e-13, 1.7953e6, 9.3046e9, shift.y),
        gaussian(5.2481e-13, 2.2084e6, 6.6121e9, shift.z),
    );
    let rec_709_from_xyz = DMat3::from_cols_array(&[
        3.240_454_2,
        -0.969_266_0,
        0.055_643_4,
        -1.537_138_5,
        1.876_010_8,
        -0.204_025_9,
        -0.498_531_4,
        0.041_556_0,
        1.057_225_2,
    ]);
    rec_709_from_xyz * xyz / 1.0685e-7
}
