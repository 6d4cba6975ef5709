//! Path tracing with next-event estimation. Each surface samples lights, and multiple importance sampling combines this with emission
//! that paths hit, by the power heuristic [Veach1997, §9.2, §10.3].
//!
//! 1. Trace the ray to the nearest surface, or to the sky.
//! 2. Add its emission, with the MIS weight against light sampling at the previous surface.
//! 3. Sample lights: one emitter, one point on it, one shadow ray; several samples at the first surface.
//!    Connect to a light path, which adds light by way of one more surface (`light_paths.rs`).
//! 4. Sample the BSDF for the next direction, and end the path by Russian roulette.

use glam::{DVec3, Vec3, Vec3A};

use crate::{
    brdf::Bsdf,
    random::Random,
    surface::Surface,
    tracer::Tracer,
    world::{Faces, Hit, offset},
};

/// Russian roulette applies to segments after this one.
const ROULETTE_DEPTH: u32 = 5;
/// Maximum number of light samples at the first surface of a path; there are no more than emitters. A higher number reduces the noise of
/// direct light and is slower.
const FIRST_LIGHT_SAMPLES: u32 = 8;
/// Maximum number of thin dielectrics that a path passes in a row. Longer paths end; they are trapped between surfaces.
pub(crate) const MAX_PASSES: u32 = 256;

/// The previous surface of a path.
pub(crate) struct PreviousSurface {
    pub p: Vec3A,
    pub normal: DVec3,
    /// Density with which the BSDF sampled the path's direction there, 1/sr.
    pub pdf: f64,
    /// Number of light samples taken there.
    light_samples: f64,
}

impl Tracer<'_> {
    /// Radiance that arrives at `origin` from `direction`, nits.
    pub(crate) fn radiance(&self, mut origin: Vec3A, mut direction: Vec3A, random: &mut Random) -> Vec3 {
        let (mut radiance, mut throughput) = (Vec3::ZERO, Vec3::ONE);
        let mut last: Option<PreviousSurface> = None;
        let (mut depth, mut passes) = (1, 0);
        // Distance since the last surface that scattered, m: segments through thin dielectrics add up.
        let mut passed = 0.0;
        // The channel of a path through a surface that disperses light.
        let mut channel: Option<usize> = None;
        loop {
            let wo = -direction.as_dvec3();
            let hit = self.next_hit(origin, direction, last.is_none(), random);
            let Some(hit) = hit else {
                let scene = self.world.scene;
                let weight = last.as_ref().map_or(1.0, |last| {
                    let light_pdf = self.lights.pdf_of_sky(last.p, last.normal, -wo, scene);
                    power_heuristic(last.pdf, light_pdf.map(|pdf| pdf * last.light_samples))
                });
                return radiance + throughput * self.lights.sky.radiance(scene, -wo) * weight;
            };
            let mut surface = Surface::new(&self.world, &hit, direction, self.settings.materials);
            if surface.channel_etas.is_some() {
                let channel = *channel.get_or_insert_with(|| {
                    let chosen = ((3.0 * random.unit()) as usize).min(2);
                    throughput *= 3.0 * Vec3::AXES[chosen];
                    chosen
                });
                surface.refract_channel(channel);
            }
            if let Some(volume) = surface.volume {
                throughput *= volume.powf(passed + hit.distance);
            }

            if surface.emissive != Vec3::ZERO {
                let weight = last.as_ref().map_or(1.0, |last| {
                    // The distance from the previous surface: thin dielectrics in between do not count.
                    let distance = last.p.distance(surface.p);
                    let seen = Hit { distance, ..hit };
                    let light_pdf = self.lights.pdf_of_hit(&self.world, last.p, last.normal, -wo, &seen);
                    power_heuristic(last.pdf, light_pdf.map(|pdf| pdf * last.light_samples))
                });
                radiance += throughput * surface.emissive * weight;
            }
            let Some(bsdf) = surface.bsdf else { return radiance };

            // Stochastic straight transmission through a thin dielectric, which does not count as a segment.
            let straight = surface.passes_straight(wo);
            let chance = straight.max_element();
            if chance > 0.0 {
                if random.unit() < f64::from(chance) {
                    passes += 1;
                    if passes > MAX_PASSES {
                        return radiance;
                    }
                    throughput *= straight / chance;
                    passed += hit.distance;
                    origin = ray_origin(&surface, direction);
                    continue;
                }
                throughput /= 1.0 - chance;
            }
            if depth >= self.settings.max_depth {
                return radiance;
            }

            // The first surface takes several light samples per path; all of them share the path's continuation.
            let light_samples = if depth == 1 { self.lights.count().min(FIRST_LIGHT_SAMPLES) } else { 1 };
            for _ in 0..light_samples {
                let direct = self.direct_light(&surface, &bsdf, wo, (last.as_ref(), light_samples.into()), random);
                radiance += throughput * direct / light_samples as f32;
            }
            if depth + 1 < self.settings.max_depth {
                radiance += throughput * self.light_by_light_path(&surface, &bsdf, wo, random);
            }

            let Some(scattered) = bsdf.sample(surface.normal, wo, [random.unit(), random.unit(), random.unit()]) else {
                return radiance;
            };
            let wi = scattered.wi.as_vec3a().normalize();
            if is_wrong_side(&surface, scattered.wi) {
                return radiance;
            }
            throughput *= scattered.weight.as_vec3();
            depth += 1;
            if depth > ROULETTE_DEPTH {
                let survives = throughput.max_element().clamp(0.05, 0.95);
                if random.unit() as f32 >= survives {
                    return radiance;
                }
                throughput /= survives;
            }
            last = Some(PreviousSurface {
                p: surface.p,
                normal: surface.normal,
                pdf: scattered.pdf,
                light_samples: light_samples.into(),
            });
            passed = 0.0;
            origin = ray_origin(&surface, wi);
            direction = wi;
        }
    }

    /// The next hit of a path. Camera rays skip backs of single-sided surfaces, like the rasteriser.
    fn next_hit(&self, origin: Vec3A, direction: Vec3A, from_camera: bool, random: &mut Random) -> Option<Hit> {
        let lambert = self.settings.materials == lanternfish_scene::shading::Materials::Lambert;
        let faces = if from_camera && !lambert { Faces::FrontsOnly } else { Faces::All };
        self.world.closest(origin, direction, faces, random.bits())
    }

    /// Estimate of direct light that the surface scatters towards `wo`, from one of `light_samples` light samples, with its MIS weight.
    fn direct_light(
        &self,
        surface: &Surface,
        bsdf: &Bsdf,
        wo: DVec3,
        (last, light_samples): (Option<&PreviousSurface>, f64),
        random: &mut Random,
    ) -> Vec3 {
        let u = [random.unit(), random.unit(), random.unit()];
        let Some(light) = self.lights.sample(&self.world, &self.starts, surface.p, surface.normal, u) else {
            return Vec3::ZERO;
        };
        let scatter = bsdf.scatter(surface.normal, light.wi, wo);
        if scatter == DVec3::ZERO || is_wrong_side(surface, light.wi) {
            return Vec3::ZERO;
        }
        let weight = match light.pdf {
            Some(pdf) => power_heuristic(light_samples * pdf, Some(bsdf.pdf(surface.normal, light.wi, wo))),
            None => self.light_sampling_weight(surface, &light, last),
        };
        let direction = light.wi.as_vec3a();
        let origin = ray_origin(surface, direction);
        if light.distance.is_infinite() {
            return self.world.transmittance(origin, direction, f32::INFINITY)
                * light.weight
                * scatter.as_vec3()
                * weight;
        }
        let towards = surface.p + light.distance * direction - origin;
        // The shadow ray ends before the emitter, which may be a surface or lie on one.
        let reach = match light.pdf {
            Some(_) => towards.length() * (1.0 - 1e-4),
            None => towards.length() - self.clearance,
        };
        let passes = if reach > 0.0 { self.world.transmittance(origin, towards.normalize(), reach) } else { Vec3::ONE };
        passes * light.weight * scatter.as_vec3() * weight
    }
}

/// Origin of a ray along `direction` from a surface.
pub(crate) fn ray_origin(surface: &Surface, direction: Vec3A) -> Vec3A {
    let side = if surface.geometric_normal.dot(direction) >= 0.0 { 1.0 } else { -1.0 };
    offset(surface.p, side * surface.geometric_normal)
}

/// True if `wi` is on different sides of the shading normal and of the triangle. Such light is lost, so that no light leaks through the
/// triangle [Veach1997, §5.3].
pub(crate) fn is_wrong_side(surface: &Surface, wi: DVec3) -> bool {
    (surface.normal.dot(wi) > 0.0) != (surface.geometric_normal.as_dvec3().dot(wi) > 0.0)
}

/// MIS weight of a sample with density `own`, given the density `other` of the alternative technique [Veach1997, §9.2.3.1]; 1 without one.
pub(crate) fn power_heuristic(own: f64, other: Option<f64>) -> f32 {
    let Some(other) = other else { return 1.0 };
    let ratio = other / own;
    (1.0 / (1.0 + ratio * ratio)) as f32
}
