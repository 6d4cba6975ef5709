//! The path tracer: preparation of a scene, and rendering of images.

use glam::Vec3A;
use lanternfish_limits::memory::Budget;
use lanternfish_scene::{Camera, Scene, shading::Materials};
use rayon::prelude::*;

use crate::{
    camera,
    error::ReferenceError,
    film::{Film, Sums},
    light_paths::Starts,
    lights::Lights,
    random::Random,
    settings::{Integrator, LightPaths, Settings},
    world::{Faces, World},
};

/// Ratio of [`Tracer::clearance`] to the diagonal of the scene's bounds.
const CLEARANCE: f32 = 1e-5;

/// A path tracer for a scene.
pub struct Tracer<'a> {
    pub(crate) world: World<'a>,
    pub(crate) lights: Lights,
    /// Lights that light paths start at.
    pub(crate) starts: Starts,
    /// Surfaces nearer than this to a light do not occlude it, m, because lights are often placed on the surface that carries them.
    pub(crate) clearance: f32,
    pub(crate) settings: Settings,
}

impl<'a> Tracer<'a> {
    /// Returns an error if the process may not allocate what tracing a valid scene needs, as [`Self::new`] does. Takes time linear in
    /// primitives and instances.
    #[doc(hidden)]
    pub fn check_memory(scene: &Scene) -> Result<(), ReferenceError> {
        let placed = scene.triangle_counts().1 as u64;
        let needed = placed.saturating_mul(World::BYTES_PER_TRIANGLE);
        Ok(Budget::of_process().check(needed, || format!("{placed} placed triangles need"))?)
    }

    /// Builds the BVH and the light tree on all cores. Fails if the scene is invalid, a setting is out of range, or memory does not suffice.
    pub fn new(scene: &'a Scene, settings: Settings) -> Result<Self, ReferenceError> {
        scene.validate()?;
        let refused = |setting, got: String, remedy| ReferenceError::InvalidSetting { setting, got, remedy };
        if settings.max_depth == 0 {
            return Err(refused("max depth", "0".to_owned(), "1 shows emitters, 2 direct light, 3 one bounce"));
        }
        if !(settings.range_threshold > 0.0 && settings.range_threshold.is_finite()) {
            return Err(refused("range threshold", settings.range_threshold.to_string(), "it must be above 0"));
        }
        let falloff = settings.falloff();
        if !(falloff.near_radius > 0.0 && falloff.near_radius.is_finite()) {
            return Err(refused(
                "near radius of the attenuation",
                falloff.near_radius.to_string(),
                "it must be above 0",
            ));
        }
        if !falloff.coefficients.is_valid() {
            let remedy = "they must be at least 0 and not all 0";
            return Err(refused("attenuation coefficients", falloff.coefficients.to_string(), remedy));
        }
        if !(settings.light_radius >= 0.0 && settings.light_radius.is_finite()) {
            return Err(refused("light radius", settings.light_radius.to_string(), "it must be 0 or above"));
        }
        if !(0.0..=90.0).contains(&settings.sun_diameter) {
            return Err(refused("sun diameter", settings.sun_diameter.to_string(), "it must be 0 to 90 degrees"));
        }
        if let Integrator::Obscurance { max_distance } = settings.integrator
            && !(max_distance > 0.0 && max_distance.is_finite())
        {
            return Err(refused("distance of obscurance", max_distance.to_string(), "it must be above 0"));
        }
        Self::check_memory(scene)?;
        let world = World::new(scene, settings.materials == Materials::Lambert);
        let lights = Lights::new(&world, &settings);
        let starts = match settings.light_paths {
            LightPaths::On => lights.starts(scene),
            LightPaths::Off => Starts::default(),
        };
        let clearance = CLEARANCE * scene.bounds().size().length();
        Ok(Self { world, lights, starts, clearance, settings })
    }

    /// Adds `samples` samples to every pixel, on all cores. The result does not depend on the number of threads or on how samples are split
    /// between calls.
    pub fn render(&self, camera: &Camera, film: &mut Film, samples: u64) {
        self.render_unless(camera, film, samples, || false, || false);
    }

    /// Like [`Tracer::render`], but can be interrupted. Once `pause` returns true, no further row starts. Once `stop` returns true, which is
    /// checked at every pixel, rows in progress are discarded too. Rows may then differ in their [`Film::row_samples`]. The next call evens
    /// them out: it brings each row to [`Film::samples`] plus `samples`.
    pub fn render_unless(
        &self,
        camera: &Camera,
        film: &mut Film,
        samples: u64,
        pause: impl Fn() -> bool + Sync,
        stop: impl Fn() -> bool + Sync,
    ) {
        let (size, wanted, first) = ((film.width, film.height), film.samples() + samples, film.first);
        let dropped: u64 = film
            .pixels
            .par_chunks_mut(size.0)
            .zip(&mut film.samples)
            .enumerate()
            .map(|(y, (row, row_samples))| {
                if *row_samples >= wanted || pause() {
                    return 0;
                }
                // A copy, because the film must contain only complete rows.
                let (mut traced, mut dropped) = (row.to_vec(), 0);
                for (x, sums) in traced.iter_mut().enumerate() {
                    if stop() {
                        return 0;
                    }
                    for sample in *row_samples..wanted {
                        dropped += self.add_sample(camera, (x, y), size, first + sample, sums);
                    }
                }
                row.copy_from_slice(&traced);
                *row_samples = wanted;
                dropped
            })
            .sum();
        film.dropped += dropped;
    }

    /// Adds a sample to `sums`. Returns the number of dropped samples, which were not finite: 0 or 1.
    fn add_sample(
        &self,
        camera: &Camera,
        pixel: (usize, usize),
        size: (usize, usize),
        sample: u64,
        sums: &mut Sums,
    ) -> u64 {
        let mut random = Random::new(self.settings.seed, (pixel.1 * size.0 + pixel.0) as u64, sample);
        let (x, y) = (pixel.0 as f64 + random.unit(), pixel.1 as f64 + random.unit());
        let (origin, direction) = camera::ray(camera, x, y, size.0, size.1);
        let value = match self.settings.integrator {
            Integrator::Path => self.radiance(origin, direction, &mut random),
            _ => self.local(origin, direction, &mut random),
        };
        if value.is_finite() {
            sums.add(value.to_array());
            0
        } else {
            1
        }
    }

    /// Coverage of an image: 1 for pixels with a surface at their centre, 0 for the environment. Rows from the top.
    #[doc(hidden)]
    pub fn coverage(&self, camera: &Camera, width: usize, height: usize) -> Vec<f32> {
        let is_hit = |(origin, direction)| f32::from(u8::from(self.nearest(origin, direction).is_some()));
        rays(camera, width, height, [0.5; 2]).map(is_hit).collect()
    }

    /// Instance, material and distance, m, of the surface that a rasteriser shows at a point of each pixel, from its top left corner. Rows from
    /// the top.
    #[doc(hidden)]
    pub fn first_hits(
        &self,
        camera: &Camera,
        width: usize,
        height: usize,
        point: [f64; 2],
    ) -> Vec<Option<(u32, u32, f32)>> {
        let first = |(origin, direction)| {
            let hit = self.world.closest(origin, direction, Faces::FrontsOnly, 0)?;
            let source = &self.world.sources[hit.triangle as usize];
            Some((source.instance, self.world.primitive(source).material as u32, hit.distance))
        };
        rays(camera, width, height, point).map(first).collect()
    }

    /// Distance to the nearest surface along a ray (`direction` of unit length), m. Holes of alpha masks are skipped; transparent surfaces
    /// count if their alpha exceeds a fixed random number per triangle. `None` if there is no surface.
    #[doc(hidden)]
    pub fn nearest(&self, origin: Vec3A, direction: Vec3A) -> Option<f32> {
        self.world.closest(origin, direction, Faces::All, 0).map(|hit| hit.distance)
    }

    /// Number of triangles that rays can hit.
    pub fn triangle_count(&self) -> usize {
        self.world.triangles.len()
    }
}

/// Origin and direction of the ray through a point of each pixel.
fn rays(
    camera: &Camera,
    width: usize,
    height: usize,
    [x, y]: [f64; 2],
) -> impl IndexedParallelIterator<Item = (Vec3A, Vec3A)> {
    (0..width * height)
        .into_par_iter()
        .map(move |i| camera::ray(camera, (i % width) as f64 + x, (i / width) as f64 + y, width, height))
}
