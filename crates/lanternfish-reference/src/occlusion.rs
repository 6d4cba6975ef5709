//! Integrators for ambient occlusion, obscurance [Aalund2015, §3.3] and the normal.

use glam::{Vec3, Vec3A};

use crate::{
    Tracer,
    brdf::cosine_direction,
    random::Random,
    settings::Integrator,
    surface::Surface,
    world::{Faces, offset},
};

impl Tracer<'_> {
    /// One sample of an integrator that evaluates only the first hit and nearby geometry: occlusion, obscurance or normal.
    pub(crate) fn local(&self, origin: Vec3A, direction: Vec3A, random: &mut Random) -> Vec3 {
        let value_without_surface = if self.settings.integrator == Integrator::Normal { 0.0 } else { 1.0 };
        let Some(hit) = self.world.closest(origin, direction, Faces::FrontsOnly, random.bits()) else {
            return Vec3::splat(value_without_surface);
        };
        let surface = Surface::new(&self.world, &hit, direction, self.settings.materials);
        if self.settings.integrator == Integrator::Normal {
            return 0.5 + 0.5 * surface.normal.as_vec3();
        }
        let wi = cosine_direction(surface.normal, random.unit(), random.unit()).as_vec3a();
        // Directions below the triangle are occluded by the surface itself.
        if surface.geometric_normal.dot(wi) <= 0.0 {
            return Vec3::ZERO;
        }
        let start = offset(surface.p, surface.geometric_normal);
        let visibility = match self.settings.integrator {
            Integrator::Obscurance { max_distance } => {
                let occluder = self.world.closest(start, wi, Faces::All, random.bits());
                occluder.map_or(1.0, |hit| (hit.distance / max_distance).min(1.0).powi(2))
            }
            _ => self.world.closest(start, wi, Faces::All, random.bits()).map_or(1.0, |_| 0.0),
        };
        Vec3::splat(visibility)
    }
}
