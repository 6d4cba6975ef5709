//! BSDFs and their sampling. CPU reference of `materials/brdf.wesl` in double precision.
//!
//! Directions are unit vectors that point away from the surface.

use std::f64::consts::PI;

use glam::DVec3;

use crate::{
    facets::{Facets, grain_distribution},
    layers::Layers,
};

/// Minimum perceptual roughness: below it, a punctual light's highlight is smaller than a pixel. The shader's constant of the same name.
pub const LEAST_ROUGHNESS: f64 = 0.03;

/// Minimum cosine between normal and view direction, because interpolated normals may face away from the viewer.
pub(crate) const LEAST_COSINE: f64 = 1e-4;

/// Reflection and transmission parameters of a surface [Elagabani2025, §2.7; glTF 2.0, app. B].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflector {
    /// Diffuse albedo, applied to light that passes the specular layer.
    pub albedo: DVec3,
    /// Reflectance at normal incidence.
    pub f0: DVec3,
    /// Reflectance at grazing incidence.
    pub f90: f64,
    /// Perceptual roughness; the mean of all directions, if there is a grain.
    pub perceptual_roughness: f64,
    /// The direction in which the surface is rougher than across it.
    pub grain: Option<Grain>,
    /// Fraction of the light below the specular layer that is transmitted, not diffusely reflected (`KHR_materials_transmission`).
    pub transmission: f64,
    /// The kind of transmission.
    pub behind: Behind,
    /// Light that is scattered through to the other side.
    pub through: ScattersThrough,
}

/// Diffuse transmission (`KHR_materials_diffuse_transmission`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScattersThrough {
    /// Fraction of the light below the specular layer, and not otherwise transmitted, that is scattered to the other side.
    pub fraction: f64,
    /// Its albedo.
    pub albedo: DVec3,
}

/// The grain of a surface (`KHR_materials_anisotropy`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Unit, perpendicular to the shading normal.
    pub along: DVec3,
    /// GGX's alpha along the grain and across it.
    pub alpha: [f64; 2],
}

impl Grain {
    /// The grain of a surface with this perceptual roughness across it. `strength`, in 0..=1, is that of the extension.
    pub fn new(along: DVec3, perceptual_roughness: f64, strength: f64) -> Self {
        let alpha = perceptual_roughness.max(LEAST_ROUGHNESS).powi(2);
        Self { along, alpha: [alpha + (1.0 - alpha) * strength * strength, alpha] }
    }

    /// Perceptual roughness of a surface without a grain whose highlight covers as large a solid angle.
    pub fn mean_roughness(&self) -> f64 {
        (self.alpha[0] * self.alpha[1]).powf(0.25)
    }
}

/// The kind of transmission of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Behind {
    /// Thin and smooth: transmitted light continues straight. The path tracer passes rays through; the BSDF excludes this light.
    ThinDielectric,
    /// Thin: transmitted light keeps its direction, blurred by the surface's roughness.
    Thin,
    /// The boundary of a volume (`KHR_materials_volume`): light is refracted.
    Volume {
        /// Ratio of the indices of refraction behind and in front of the surface: below one inside the volume.
        eta: f64,
    },
}

/// A BSDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Diffuse only, with the base colour as albedo.
    Lambert(DVec3),
    /// glTF's metallic-roughness model.
    MetallicRoughness(Reflector),
    /// glTF's metallic-roughness model below other layers.
    Layered(Layers, Reflector),
}

/// A sampled direction of incidence.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// Direction of incidence, unit.
    pub wi: DVec3,
    /// BSDF times |n·wi|, divided by the density.
    pub weight: DVec3,
    /// Density over solid angle, 1/sr.
    pub pdf: f64,
}

impl Bsdf {
    /// The BSDF times |n·wi|, 1/sr.
    pub fn scatter(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        match self {
            Self::Lambert(albedo) => albedo * (n.dot(wi).max(0.0) / PI),
            Self::MetallicRoughness(reflector) => reflector.scatter(n, wi, wo),
            Self::Layered(layers, reflector) => layers.over(n, wi, wo, reflector.scatter(n, wi, wo)),
        }
    }

    /// Samples `wi` approximately in proportion to [`Bsdf::scatter`]. `None` if the sample has no contribution.
    pub fn sample(&self, n: DVec3, wo: DVec3, u: [f64; 3]) -> Option<Scattered> {
        let wi = match self {
            Self::Lambert(_) => cosine_direction(n, u[1], u[2]),
            Self::MetallicRoughness(reflector) => reflector.choose(n, wo, u)?,
            Self::Layered(layers, reflector) => layers.choose(n, wo, u, reflector)?,
        };
        let pdf = self.pdf(n, wi, wo);
        let weight = self.scatter(n, wi, wo) / pdf;
        (pdf > 0.0 && weight.is_finite() && weight != DVec3::ZERO).then_some(Scattered { wi, weight, pdf })
    }

    /// Density of [`Bsdf::sample`] at `wi`, 1/sr.
    pub fn pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        match self {
            Self::Lambert(_) => n.dot(wi).max(0.0) / PI,
            Self::MetallicRoughness(reflector) => reflector.pdf(n, wi, wo),
            Self::Layered(layers, reflector) => layers.pdf(n, wi, wo, reflector),
        }
    }
}

/// GGX [Walter2007, eq. 33], with |n × h|² in place of 1 − (n·h)², which would suffer from cancellation near the peak.
pub fn normal_distribution(n: DVec3, h: DVec3, alpha: f64) -> f64 {
    let across = n.cross(h);
    let along = n.dot(h).max(0.0) * alpha;
    let k = alpha / (across.dot(across) + along * along);
    k * k / PI
}

/// Smith shadowing with Schlick's approximation, k = alpha / 2 to match GGX [Karis2013], divided by 4 (n·l) (n·v).
fn visibility_term(n_dot_l: f64, n_dot_v: f64, alpha: f64) -> f64 {
    0.25 / (masking(n_dot_l, alpha) * masking(n_dot_v, alpha))
}

/// The cosine over the fraction of microfacets that are visible from its direction.
fn masking(cosine: f64, alpha: f64) -> f64 {
    let k = 0.5 * alpha;
    cosine * (1.0 - k) + k
}

/// Directional albedo, at this cosine to the normal, of a specular layer with reflectance 0 at normal and 1 at grazing incidence. A fit.
pub fn grazing_fraction(cosine: f64, alpha: f64) -> f64 {
    (1.0 - cosine).max(0.0).powf(grazing_power(alpha)) / (1.0 + (20.0 + 32.0 * alpha) * alpha)
}

/// Cosine-weighted mean of [`grazing_fraction`] over the hemisphere.
fn mean_grazing_fraction(alpha: f64) -> f64 {
    let power = grazing_power(alpha);
    2.0 / ((power + 1.0) * (power + 2.0) * (1.0 + (20.0 + 32.0 * alpha) * alpha))
}

fn grazing_power(alpha: f64) -> f64 {
    2.85 + 2.15 * (-38.0 * alpha).exp()
}

impl Reflector {
    /// GGX's alpha.
    pub fn alpha(&self) -> f64 {
        self.perceptual_roughness.max(LEAST_ROUGHNESS).powi(2)
    }

    /// Schlick's Fresnel term [Schlick1994, eq. 15]. Inside a volume it uses the angle of the refracted light outside, and is 1 beyond the
    /// critical angle.
    pub fn fresnel(&self, v_dot_h: f64) -> DVec3 {
        let mut cosine = v_dot_h;
        if let Behind::Volume { eta } = self.behind
            && eta < 1.0
        {
            let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
            if squared <= 0.0 {
                return DVec3::ONE;
            }
            cosine = squared.sqrt();
        }
        self.f0 + (self.f90 - self.f0) * (1.0 - cosine).clamp(0.0, 1.0).powi(5)
    }

    /// The BSDF times |n·wi|, 1/sr.
    pub(crate) fn scatter(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        match n.dot(wi) > 0.0 {
            true => self.reflect_light(n, wi, wo),
            false => self.transmit_light(n, wi, wo) + self.scatter_through(n, wi, wo),
        }
    }

    /// The diffuse BTDF times |n·wi|, 1/sr, for light from behind.
    fn scatter_through(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        self.lambertian(-n.dot(wi), n.dot(wo)) * self.through.albedo * self.through.fraction * -n.dot(wi)
    }

    /// The specular BRDF without the cosine, 1/sr.
    pub fn specular(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        let h = half_vector(n, wi, wo);
        let (n_dot_l, n_dot_v) = (n.dot(wi), n.dot(wo).max(LEAST_COSINE));
        let lobe = match &self.grain {
            None => normal_distribution(n, h, self.alpha()) * visibility_term(n_dot_l, n_dot_v, self.alpha()),
            Some(grain) => {
                let masking = |w: DVec3, cosine| masking(cosine, Facets::of(self, n).alpha_towards(w));
                grain_distribution(grain, n, h) * 0.25 / (masking(wi, n_dot_l) * masking(wo, n_dot_v))
            }
        };
        self.fresnel(wo.dot(h)) * lobe
    }

    /// Transmittance of the specular layer under uniform illumination, at an angle with this [`grazing_fraction`].
    pub fn lets_in(&self, grazing: f64) -> DVec3 {
        // Directional albedo for a reflectance of 1 at all angles: an upper bound.
        let all = 1.0 - 0.39 * self.alpha() * self.alpha();
        1.0 - self.f0 * all - (self.f90 - self.f0) * grazing
    }

    /// The diffuse BRDF, 1/sr, of light that enters and leaves through the specular layer `[Kelemen2001]` and is not transmitted.
    ///
    /// Under uniform illumination, a white surface scatters towards `wo` the light that the specular layer does not.
    pub fn diffuse(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        self.lambertian(n.dot(wi), n.dot(wo)) * self.albedo * (1.0 - self.through.fraction)
    }

    /// White diffuse light through the specular layer, 1/sr, at these cosines to the normal.
    fn lambertian(&self, at_light: f64, at_viewer: f64) -> DVec3 {
        let let_in =
            [at_light, at_viewer.max(LEAST_COSINE)].map(|cosine| self.lets_in(grazing_fraction(cosine, self.alpha())));
        let mean = self.lets_in(mean_grazing_fraction(self.alpha())).max(DVec3::splat(1e-4));
        let_in[0] * let_in[1] / mean * ((1.0 - self.transmission) / PI)
    }

    /// The BRDF times n·wi, 1/sr; zero for light from behind.
    pub fn reflect_light(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        if n.dot(wi) <= 0.0 { DVec3::ZERO } else { (self.specular(n, wi, wo) + self.diffuse(n, wi, wo)) * n.dot(wi) }
    }

    /// The BTDF times |n·wi|, 1/sr, for light from behind.
    ///
    /// For thin surfaces, the tinted specular lobe, mirrored through the surface (glTF's `specular_btdf`). For volumes, refracting
    /// microfacets [Walter2007, eq. 21].
    pub fn transmit_light(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        let n_dot_l = -n.dot(wi);
        if self.transmission == 0.0 || n_dot_l <= 0.0 || self.behind == Behind::ThinDielectric {
            return DVec3::ZERO;
        }
        let n_dot_v = n.dot(wo).max(LEAST_COSINE);
        let alpha = self.alpha();
        let Behind::Volume { eta } = self.behind else {
            let mirrored = wi + 2.0 * n_dot_l * n;
            let h = half_vector(n, mirrored, wo);
            let lobe = normal_distribution(n, h, alpha) * visibility_term(n_dot_l, n_dot_v, alpha) * n_dot_l;
            return (1.0 - self.fresnel(wo.dot(h))) * self.albedo * (self.transmission * lobe);
        };
        let Some((h, jacobian)) = refracting_half_vector(n, wi, wo, eta) else { return DVec3::ZERO };
        // G / (n·v) is 4 (n·l) times the visibility term. Radiance scales by 1 / η² across the boundary.
        let lobe = 4.0 * visibility_term(n_dot_l, n_dot_v, alpha) * normal_distribution(n, h, alpha);
        let v_dot_h = wo.dot(h);
        (1.0 - self.fresnel(v_dot_h))
            * self.albedo
            * (self.transmission * lobe * n_dot_l * v_dot_h * jacobian / (eta * eta))
    }

    /// Sampling probabilities of the specular, the diffuse and the transmitting lobe, and of that which scatters through.
    fn chances(&self, n: DVec3, wo: DVec3) -> [f64; 4] {
        let fresnel = self.fresnel(n.dot(wo).max(LEAST_COSINE));
        // At least 0.1, because microfacets may transmit light that a plane would reflect: each contributing lobe needs a probability.
        let lets_in = |albedo: DVec3| ((1.0 - fresnel).max(DVec3::splat(0.1)) * albedo).max_element();
        let stays = 1.0 - self.transmission;
        let passes = if self.behind == Behind::ThinDielectric { 0.0 } else { self.transmission };
        let weights = [
            fresnel.max_element().max(0.1),
            lets_in(self.albedo * (1.0 - self.through.fraction)) * stays,
            lets_in(self.albedo) * passes,
            lets_in(self.through.albedo * self.through.fraction) * stays,
        ];
        let sum: f64 = weights.iter().sum();
        weights.map(|w| w / sum)
    }

    pub(crate) fn choose(&self, n: DVec3, wo: DVec3, u: [f64; 3]) -> Option<DVec3> {
        let wo = towards_normal(n, wo);
        let [specular, diffuse, transmitting, _] = self.chances(n, wo);
        if u[0] >= specular && u[0] < specular + diffuse {
            return Some(cosine_direction(n, u[1], u[2]));
        }
        if u[0] >= specular + diffuse + transmitting {
            return Some(cosine_direction(-n, u[1], u[2]));
        }
        let h = Facets::of(self, n).sample(wo, u[1], u[2]);
        let mirrored = 2.0 * wo.dot(h) * h - wo;
        if u[0] < specular {
            return (n.dot(mirrored) > 0.0).then_some(mirrored);
        }
        let Behind::Volume { eta } = self.behind else {
            return (n.dot(mirrored) > 0.0).then(|| mirrored - 2.0 * n.dot(mirrored) * n);
        };
        let refracted = refract(wo, h, eta)?;
        (n.dot(refracted) < 0.0).then_some(refracted)
    }

    pub(crate) fn pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        let wo = towards_normal(n, wo);
        let [specular, diffuse, transmitting, through] = self.chances(n, wo);
        let n_dot_l = n.dot(wi);
        let facet = |h: DVec3| Facets::of(self, n).pdf(wo, h);
        if n_dot_l > 0.0 {
            let h = half_vector(n, wi, wo);
            return specular * facet(h) / (4.0 * wo.dot(h).max(1e-12)) + diffuse * n_dot_l / PI;
        }
        let scattered = through * -n_dot_l / PI;
        if transmitting == 0.0 {
            return scattered;
        }
        if let Behind::Volume { eta } = self.behind {
            let facets = refracting_half_vector(n, wi, wo, eta);
            return scattered + facets.map_or(0.0, |(h, jacobian)| transmitting * facet(h) * jacobian);
        }
        let h = half_vector(n, wi - 2.0 * n_dot_l * n, wo);
        scattered + transmitting * facet(h) / (4.0 * wo.dot(h).max(1e-12))
    }
}

/// The half vector of two directions; the normal if they are opposite.
pub(crate) fn half_vector(n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
    let both = wi + wo;
    if both.dot(both) > 1e-12 { both.normalize() } else { n }
}

/// `wo`, moved into the hemisphere of the normal if it is outside.
fn towards_normal(n: DVec3, wo: DVec3) -> DVec3 {
    let cosine = n.dot(wo);
    if cosine >= LEAST_COSINE { wo } else { (wo + (LEAST_COSINE - cosine) * n).normalize() }
}

/// The direction of incidence that refracts to `wo` at a microfacet `h`; `None` for total internal reflection. `eta`: ratio of the indices
/// of refraction behind and in front of the microfacet.
fn refract(wo: DVec3, h: DVec3, eta: f64) -> Option<DVec3> {
    let cosine = wo.dot(h);
    let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    (squared > 0.0).then(|| (-wo / eta + (cosine / eta - squared.sqrt()) * h).normalize())
}

/// The microfacet normal that refracts `wi` to `wo`, and the Jacobian from microfacet normals to `wi` [Walter2007, eq. 16, 17].
fn refracting_half_vector(n: DVec3, wi: DVec3, wo: DVec3, eta: f64) -> Option<(DVec3, f64)> {
    let sum = wo + eta * wi;
    let h = -sum.normalize_or_zero();
    let h = if n.dot(h) < 0.0 { -h } else { h };
    let (o, i) = (wo.dot(h), wi.dot(h));
    if o <= 0.0 || i >= 0.0 {
        return None;
    }
    let denominator = o + eta * i;
    Some((h, eta * eta * -i / (denominator * denominator)))
}

/// Samples a direction around `n` with a cosine-weighted density.
pub(crate) fn cosine_direction(n: DVec3, u: f64, v: f64) -> DVec3 {
    let (x, y) = n.any_orthonormal_pair();
    let (sin, cos) = (2.0 * PI * v).sin_cos();
    u.sqrt() * (cos * x + sin * y) + (1.0 - u).sqrt() * n
}
