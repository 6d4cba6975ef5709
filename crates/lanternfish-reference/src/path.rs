//! Path tracing: every surface on the way looks for light by itself, and what a path runs into counts as far
//! as that search would have missed it (multiple importance sampling by the power heuristic) [Veach1997, §9.2, §10.3].
//!
//! 1. Follow the ray to the nearest surface, or to the sky.
//! 2. Add what shines there, weighted by how likely the last surface was to have found it by itself.
//! 3. Look for light: one emitter, one point of it, one shadow ray; at the first surface some of them.
//!    And for light that comes by way of one surface more, from one of the lights (`light_paths.rs`).
//! 4. Choose where the path goes on by the BSDF, and by Russian roulette whether it does.

use glam::{DVec3, Vec3, Vec3A};

use crate::{
    Tracer,
    brdf::Bsdf,
    random::Random,
    surface::Surface,
    world::{Faces, Hit, offset},
};

/// From this segment on, paths that carry little end at random.
const ROULETTE_DEPTH: u32 = 5;
/// Searches for light at the first surface of a path, where there are as many emitters. More: less noise of direct light, slower.
const FIRST_SEARCHES: u32 = 8;
/// A path that passes this many panes and holes in a row is caught between them.
pub(crate) const MOST_PASSES: u32 = 256;

/// Where the last search for light took place.
pub(crate) struct LastSearch {
    pub p: Vec3A,
    pub normal: DVec3,
    /// Density of the direction that the path took from there, 1/sr.
    pub pdf: f64,
    /// Emitters that were looked for.
    searches: f64,
}

impl Tracer<'_> {
    /// Radiance that arrives at `origin` from `direction`, nits.
    pub(crate) fn radiance(&self, mut origin: Vec3A, mut direction: Vec3A, random: &mut Random) -> Vec3 {
        let (mut radiance, mut throughput) = (Vec3::ZERO, Vec3::ONE);
        let mut last: Option<LastSearch> = None;
        let (mut depth, mut passes) = (1, 0);
        // The way since the last surface that was not passed straight, m.
        let mut passed = 0.0;
        loop {
            let wo = -direction.as_dvec3();
            let hit = self.next_hit(origin, direction, last.is_none(), random);
            let Some(hit) = hit else {
                let scene = self.world.scene;
                let weight = last.as_ref().map_or(1.0, |last| {
                    let found = self.lights.pdf_of_sky(last.p, last.normal, -wo, scene);
                    power_heuristic(last.pdf, found.map(|found| found * last.searches))
                });
                return radiance + throughput * self.lights.sky.radiance(scene, -wo) * weight;
            };
            let surface = Surface::new(&self.world, &hit, direction, self.settings.materials);
            if let Some(volume) = surface.volume {
                throughput *= volume.powf(passed + hit.distance);
            }

            if surface.emissive != Vec3::ZERO {
                let weight = last.as_ref().map_or(1.0, |last| {
                    // The distance from the last search: panes in between do not count.
                    let distance = last.p.distance(surface.p);
                    let seen = Hit { distance, ..hit };
                    let found = self.lights.pdf_of_hit(&self.world, last.p, last.normal, -wo, &seen);
                    power_heuristic(last.pdf, found.map(|found| found * last.searches))
                });
                radiance += throughput * surface.emissive * weight;
            }
            let Some(bsdf) = surface.bsdf else { return radiance };

            // Light that goes straight through a pane: no segment of the path ends there.
            let straight = surface.passes_straight(wo);
            let chance = straight.max_element();
            if chance > 0.0 {
                if random.unit() < f64::from(chance) {
                    passes += 1;
                    if passes > MOST_PASSES {
                        return radiance;
                    }
                    throughput *= straight / chance;
                    passed += hit.distance;
                    origin = leaves(&surface, direction);
                    continue;
                }
                throughput /= 1.0 - chance;
            }
            if depth >= self.settings.max_depth {
                return radiance;
            }

            // Paths that begin here share all that follows: light that arrives straight is looked for more often than they go on.
            let searches = if depth == 1 { self.lights.count().min(FIRST_SEARCHES) } else { 1 };
            for _ in 0..searches {
                let found = self.direct_light(&surface, &bsdf, wo, (last.as_ref(), searches.into()), random);
                radiance += throughput * found / searches as f32;
            }
            if depth + 1 < self.settings.max_depth {
                radiance += throughput * self.light_by_starts(&surface, &bsdf, wo, random);
            }

            let Some(scattered) = bsdf.sample(surface.normal, wo, [random.unit(), random.unit(), random.unit()]) else {
                return radiance;
            };
            let wi = scattered.wi.as_vec3a().normalize();
            if passes_wrong_side(&surface, scattered.wi) {
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
            last = Some(LastSearch {
                p: surface.p,
                normal: surface.normal,
                pdf: scattered.pdf,
                searches: searches.into(),
            });
            passed = 0.0;
            origin = leaves(&surface, wi);
            direction = wi;
        }
    }

    /// Camera rays see no backs of single-sided surfaces, as the rasteriser draws none.
    fn next_hit(&self, origin: Vec3A, direction: Vec3A, from_camera: bool, random: &mut Random) -> Option<Hit> {
        let lambert = self.settings.materials == lanternfish_scene::shading::Materials::Lambert;
        let faces = if from_camera && !lambert { Faces::FrontsOnly } else { Faces::All };
        self.world.closest(origin, direction, faces, random.bits())
    }

    /// What one emitter sends by way of the surface towards `wo`, over its chance, as one of so many searches there.
    fn direct_light(
        &self,
        surface: &Surface,
        bsdf: &Bsdf,
        wo: DVec3,
        (last, searches): (Option<&LastSearch>, f64),
        random: &mut Random,
    ) -> Vec3 {
        let u = [random.unit(), random.unit(), random.unit()];
        let Some(light) = self.lights.sample(&self.world, &self.starts, surface.p, surface.normal, u) else {
            return Vec3::ZERO;
        };
        let scatter = bsdf.scatter(surface.normal, light.wi, wo);
        if scatter == DVec3::ZERO || passes_wrong_side(surface, light.wi) {
            return Vec3::ZERO;
        }
        let weight = match light.pdf {
            Some(pdf) => power_heuristic(searches * pdf, Some(bsdf.pdf(surface.normal, light.wi, wo))),
            None => self.weight_of_search(surface, &light, last),
        };
        let direction = light.wi.as_vec3a();
        let origin = leaves(surface, direction);
        if light.distance.is_infinite() {
            return self.world.transmittance(origin, direction, f32::INFINITY)
                * light.weight
                * scatter.as_vec3()
                * weight;
        }
        let towards = surface.p + light.distance * direction - origin;
        // Short of the emitter, which may be a surface, or be on one.
        let reach = match light.pdf {
            Some(_) => towards.length() * (1.0 - 1e-4),
            None => towards.length() - self.clearance,
        };
        let passes = if reach > 0.0 { self.world.transmittance(origin, towards.normalize(), reach) } else { Vec3::ONE };
        passes * light.weight * scatter.as_vec3() * weight
    }
}

/// Where a ray along `direction` leaves a surface.
pub(crate) fn leaves(surface: &Surface, direction: Vec3A) -> Vec3A {
    let side = if surface.geometric_normal.dot(direction) >= 0.0 { 1.0 } else { -1.0 };
    offset(surface.p, side * surface.geometric_normal)
}

/// Light does not come through a triangle whichever way its shading normal leans, unless the surface lets it: what shading
/// normal and triangle disagree about is lost [Veach1997, §5.3].
pub(crate) fn passes_wrong_side(surface: &Surface, wi: DVec3) -> bool {
    (surface.normal.dot(wi) > 0.0) != (surface.geometric_normal.as_dvec3().dot(wi) > 0.0)
}

/// Weight of a sample of density `own` beside another way of density `other` [Veach1997, §9.2.3.1]; 1 without another.
pub(crate) fn power_heuristic(own: f64, other: Option<f64>) -> f32 {
    let Some(other) = other else { return 1.0 };
    let ratio = other / own;
    (1.0 / (1.0 + ratio * ratio)) as f32
}
