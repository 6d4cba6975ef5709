//! What a surface does with light: `materials/brdf.wesl` as plain Rust in double precision, and how it is sampled.
//!
//! Directions are unit and point away from the surface.

use std::f64::consts::PI;

use glam::DVec3;

/// Below this a punctual light's highlight is smaller than any pixel. The shader's constant of this name.
pub const LEAST_ROUGHNESS: f64 = 0.03;

/// Least cosine towards the viewer: interpolated normals may lean away from it.
const LEAST_COSINE: f64 = 1e-4;

/// What a surface reflects and lets through [Elagabani2025, §2.7; glTF 2.0, app. B].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflector {
    /// Diffuse albedo of what the surface lets in.
    pub albedo: DVec3,
    /// Reflectance at normal incidence.
    pub f0: DVec3,
    /// Reflectance at grazing incidence.
    pub f90: f64,
    /// The artist's roughness.
    pub perceptual_roughness: f64,
    /// Share of what the surface lets in that passes instead of being scattered (`KHR_materials_transmission`).
    pub transmission: f64,
    /// What becomes of that share.
    pub behind: Behind,
}

/// What lies behind a surface that lets light through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Behind {
    /// Thin and smooth: light that passes goes straight on. The path tracer lets rays through; the BSDF does not know it.
    ThinDielectric,
    /// Thin: light goes on as it came, spread by the surface's roughness.
    Thin,
    /// A body (`KHR_materials_volume`): light is refracted.
    Volume {
        /// Index of refraction behind the surface over that before it: below one inside the body.
        eta: f64,
    },
}

/// A surface that scatters light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Base colour as a diffuse albedo, and that is all.
    Lambert(DVec3),
    /// glTF's metallic-roughness model.
    MetallicRoughness(Reflector),
    /// The same below a clear coat.
    Coated(Coat, Reflector),
}

/// A clear coat of index 1.5 over a surface (`KHR_materials_clearcoat`): a specular layer of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// How much of it there is, in 0..=1.
    pub weight: f64,
    /// The artist's roughness.
    pub perceptual_roughness: f64,
    /// Unit: as the shading normal, without a normal map.
    pub normal: DVec3,
}

impl Coat {
    fn layer(&self) -> Reflector {
        Reflector {
            albedo: DVec3::ZERO,
            f0: DVec3::splat(0.04),
            f90: 1.0,
            perceptual_roughness: self.perceptual_roughness,
            transmission: 0.0,
            behind: Behind::Thin,
        }
    }

    /// Share of what the surface below sends towards `wo` that it lets through.
    pub fn fraction_below(&self, wo: DVec3) -> f64 {
        let layer = self.layer();
        let grazing = grazing_fraction(self.normal.dot(wo).max(LEAST_COSINE), layer.alpha());
        1.0 - self.weight * (1.0 - layer.lets_in(grazing).x)
    }

    /// The BRDF times n·wi, 1/sr, of a surface that sends `below`, with its coat.
    pub fn over(&self, wi: DVec3, wo: DVec3, below: DVec3) -> DVec3 {
        self.fraction_below(wo) * below + self.weight * self.layer().reflect_light(self.normal, wi, wo)
    }

    /// Chance that a direction is chosen by the coat.
    fn chance(&self, wo: DVec3) -> f64 {
        // As much as it mirrors, and a tenth where that is nearly nothing.
        let weight = self.weight * self.layer().fresnel(self.normal.dot(wo).max(LEAST_COSINE)).x.max(0.1);
        weight / (1.0 + weight)
    }
}

/// A direction chosen for light to come from.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// Where from.
    pub wi: DVec3,
    /// BSDF times |n·wi| over the density.
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
            Self::Coated(coat, reflector) => coat.over(wi, wo, reflector.scatter(n, wi, wo)),
        }
    }

    /// Chooses `wi` much as [`Bsdf::scatter`] weighs it. `None`: the light is lost.
    pub fn sample(&self, n: DVec3, wo: DVec3, u: [f64; 3]) -> Option<Scattered> {
        let wi = match self {
            Self::Lambert(_) => cosine_direction(n, u[1], u[2]),
            Self::MetallicRoughness(reflector) => reflector.choose(n, wo, u)?,
            Self::Coated(coat, reflector) => {
                let chance = coat.chance(wo);
                if u[0] < chance {
                    coat.layer().choose(coat.normal, wo, [0.0, u[1], u[2]])?
                } else {
                    reflector.choose(n, wo, [(u[0] - chance) / (1.0 - chance), u[1], u[2]])?
                }
            }
        };
        let pdf = self.pdf(n, wi, wo);
        let weight = self.scatter(n, wi, wo) / pdf;
        (pdf > 0.0 && weight.is_finite() && weight != DVec3::ZERO).then_some(Scattered { wi, weight, pdf })
    }

    /// Density with which [`Bsdf::sample`] chooses `wi`, 1/sr.
    pub fn pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        match self {
            Self::Lambert(_) => n.dot(wi).max(0.0) / PI,
            Self::MetallicRoughness(reflector) => reflector.pdf(n, wi, wo),
            Self::Coated(coat, reflector) => {
                let chance = coat.chance(wo);
                chance * coat.layer().pdf(coat.normal, wi, wo) + (1.0 - chance) * reflector.pdf(n, wi, wo)
            }
        }
    }
}

/// GGX [Walter2007, eq. 33], with 1 − (n·h)² as |n × h|²: near the peak the difference would lose its digits.
pub fn normal_distribution(n: DVec3, h: DVec3, alpha: f64) -> f64 {
    let across = n.cross(h);
    let along = n.dot(h).max(0.0) * alpha;
    let k = alpha / (across.dot(across) + along * along);
    k * k / PI
}

/// Smith's shadowing with Schlick's approximation, k = alpha / 2 to match GGX [Karis2013], over 4 (n·l) (n·v).
fn visibility_term(n_dot_l: f64, n_dot_v: f64, alpha: f64) -> f64 {
    let k = 0.5 * alpha;
    0.25 / ((n_dot_l * (1.0 - k) + k) * (n_dot_v * (1.0 - k) + k))
}

/// Share of even light that a specular layer reflects at this cosine to the normal which reflects nothing at normal and
/// everything at grazing incidence: a fit.
pub fn grazing_fraction(cosine: f64, alpha: f64) -> f64 {
    (1.0 - cosine).max(0.0).powf(grazing_power(alpha)) / (1.0 + (20.0 + 32.0 * alpha) * alpha)
}

/// The mean of [`grazing_fraction`] over the hemisphere, by the cosine.
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

    /// Schlick's Fresnel term [Schlick1994, eq. 15]: inside a volume the angle is that of the light outside, and past the critical
    /// angle everything is reflected.
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
    fn scatter(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        if n.dot(wi) > 0.0 { self.reflect_light(n, wi, wo) } else { self.transmit_light(n, wi, wo) }
    }

    /// The specular BRDF, 1/sr; without the cosine.
    pub fn specular(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        let h = half_vector(n, wi, wo);
        let (n_dot_l, n_dot_v) = (n.dot(wi), n.dot(wo).max(LEAST_COSINE));
        self.fresnel(wo.dot(h))
            * (normal_distribution(n, h, self.alpha()) * visibility_term(n_dot_l, n_dot_v, self.alpha()))
    }

    /// Share of even light that the specular layer lets in at an angle of this [`grazing_fraction`].
    pub fn lets_in(&self, grazing: f64) -> DVec3 {
        // What would be reflected if everything were, at every angle: no less than it is.
        let all = 1.0 - 0.39 * self.alpha() * self.alpha();
        1.0 - self.f0 * all - (self.f90 - self.f0) * grazing
    }

    /// The diffuse BRDF, 1/sr: what the specular layer lets in and out again `[Kelemen2001]`, and transmission leaves.
    ///
    /// With even light from all sides, it sends towards `wo` what the specular layer does not.
    pub fn diffuse(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        let [at_light, at_viewer] =
            [n.dot(wi), n.dot(wo).max(LEAST_COSINE)].map(|cosine| self.lets_in(grazing_fraction(cosine, self.alpha())));
        let mean = self.lets_in(mean_grazing_fraction(self.alpha())).max(DVec3::splat(1e-4));
        at_light * at_viewer / mean * self.albedo * ((1.0 - self.transmission) / PI)
    }

    /// The BRDF times n·wi, 1/sr; zero for light from behind.
    pub fn reflect_light(&self, n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
        if n.dot(wi) <= 0.0 { DVec3::ZERO } else { (self.specular(n, wi, wo) + self.diffuse(n, wi, wo)) * n.dot(wi) }
    }

    /// The transmitting part times |n·wi|, 1/sr, for light from behind.
    ///
    /// Thin: the specular lobe mirrored through the surface, tinted (glTF's `specular_btdf`). A volume: microfacets that
    /// refract [Walter2007, eq. 21].
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
        // G / (n·v) is 4 (n·l) times the visibility term; radiance thins by η² on its way out of the denser side.
        let lobe = 4.0 * visibility_term(n_dot_l, n_dot_v, alpha) * normal_distribution(n, h, alpha);
        let v_dot_h = wo.dot(h);
        (1.0 - self.fresnel(v_dot_h))
            * self.albedo
            * (self.transmission * lobe * n_dot_l * v_dot_h * jacobian / (eta * eta))
    }

    /// Chances of the specular, the diffuse and the transmitting lobe.
    fn chances(&self, n: DVec3, wo: DVec3) -> [f64; 3] {
        let fresnel = self.fresnel(n.dot(wo).max(LEAST_COSINE));
        // Facets let in what the plane would reflect: no lobe that scatters is left without a chance.
        let lets_in = ((1.0 - fresnel).max(DVec3::splat(0.1)) * self.albedo).max_element();
        let passes = if self.behind == Behind::ThinDielectric { 0.0 } else { self.transmission };
        let weights = [fresnel.max_element().max(0.1), lets_in * (1.0 - self.transmission), lets_in * passes];
        let sum: f64 = weights.iter().sum();
        weights.map(|w| w / sum)
    }

    fn choose(&self, n: DVec3, wo: DVec3, u: [f64; 3]) -> Option<DVec3> {
        let wo = towards_normal(n, wo);
        let [specular, diffuse, _] = self.chances(n, wo);
        if u[0] >= specular && u[0] < specular + diffuse {
            return Some(cosine_direction(n, u[1], u[2]));
        }
        let h = visible_normal(n, wo, self.alpha(), u[1], u[2]);
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

    fn pdf(&self, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        let wo = towards_normal(n, wo);
        let [specular, diffuse, transmitting] = self.chances(n, wo);
        let n_dot_l = n.dot(wi);
        let facet = |h: DVec3| visible_normal_pdf(n, wo, h, self.alpha());
        if n_dot_l > 0.0 {
            let h = half_vector(n, wi, wo);
            return specular * facet(h) / (4.0 * wo.dot(h).max(1e-12)) + diffuse * n_dot_l / PI;
        }
        if transmitting == 0.0 {
            return 0.0;
        }
        if let Behind::Volume { eta } = self.behind {
            let facets = refracting_half_vector(n, wi, wo, eta);
            return facets.map_or(0.0, |(h, jacobian)| transmitting * facet(h) * jacobian);
        }
        let h = half_vector(n, wi - 2.0 * n_dot_l * n, wo);
        transmitting * facet(h) / (4.0 * wo.dot(h).max(1e-12))
    }
}

/// Between the two; the normal, where they are opposite.
fn half_vector(n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
    let both = wi + wo;
    if both.dot(both) > 1e-12 { both.normalize() } else { n }
}

/// `wo`, or what is nearest to it among the directions that the normal faces.
fn towards_normal(n: DVec3, wo: DVec3) -> DVec3 {
    let cosine = n.dot(wo);
    if cosine >= LEAST_COSINE { wo } else { (wo + (LEAST_COSINE - cosine) * n).normalize() }
}

/// Where light comes from that leaves along `wo` through a facet `h`; `None`: total reflection. `eta`: index behind the facet
/// over that before it.
fn refract(wo: DVec3, h: DVec3, eta: f64) -> Option<DVec3> {
    let cosine = wo.dot(h);
    let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    (squared > 0.0).then(|| (-wo / eta + (cosine / eta - squared.sqrt()) * h).normalize())
}

/// The facet that refracts `wi` to `wo`, and the density of `wi` for a unit density of facets [Walter2007, eq. 16, 17].
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

/// A facet seen from `wo`, by the share of it that is seen: spherical caps [Dupuy2023].
fn visible_normal(n: DVec3, wo: DVec3, alpha: f64, u: f64, v: f64) -> DVec3 {
    let (x, y) = n.any_orthonormal_pair();
    let local = DVec3::new(x.dot(wo), y.dot(wo), n.dot(wo));
    // In the space where facets are a hemisphere, the mirrored directions are uniform on a cap.
    let stretched = DVec3::new(alpha * local.x, alpha * local.y, local.z).normalize();
    let z = (1.0 - v) * (1.0 + stretched.z) - stretched.z;
    let (sin, cos) = (2.0 * PI * u).sin_cos();
    let ring = (1.0 - z * z).max(0.0).sqrt();
    let h = DVec3::new(ring * cos, ring * sin, z) + stretched;
    let h = DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize();
    h.x * x + h.y * y + h.z * n
}

/// Density of [`visible_normal`], 1/sr of facets: D (wo·h) G1 / (n·wo) with Smith's exact G1 [Heitz2018, eq. 3].
fn visible_normal_pdf(n: DVec3, wo: DVec3, h: DVec3, alpha: f64) -> f64 {
    let cosine = n.dot(wo);
    let shadowing = cosine + (alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine).sqrt();
    2.0 * normal_distribution(n, h, alpha) * wo.dot(h).max(0.0) / shadowing
}

/// A direction around `n`, by the cosine.
pub(crate) fn cosine_direction(n: DVec3, u: f64, v: f64) -> DVec3 {
    let (x, y) = n.any_orthonormal_pair();
    let (sin, cos) = (2.0 * PI * v).sin_cos();
    u.sqrt() * (cos * x + sin * y) + (1.0 - u).sqrt() * n
}
