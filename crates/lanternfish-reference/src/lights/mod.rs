//! Emitters: lights, emissive triangles, the environment.

mod area;
mod choice;
mod environment;
#[cfg(test)]
mod tests;

use glam::{DVec3, Vec3, Vec3A};
use lanternfish_scene::{
    Light, LightKind, Scene,
    light_tree::Emitter as BoundedEmitter,
    mean_emission,
    shading::{Falloff, Materials},
};

pub use self::area::{incidence_from, point_of_area};
use self::choice::Choice;
pub(crate) use self::choice::receiver;
pub(crate) use self::environment::Sky;
use crate::{
    light_paths::{Start, Starts},
    settings::{LightChoice, Settings},
    surface::Surface,
    world::{Hit, World},
};

/// A light sample: unshadowed light at a point from one emitter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving {
    /// Direction towards the emitter, unit.
    pub wi: DVec3,
    /// Distance to the emitter, m; infinite for the environment and directional lights.
    pub distance: f32,
    /// Unshadowed irradiance of a surface that faces the emitter, divided by the density of the sample, lx.
    pub weight: Vec3,
    /// Density over solid angle, 1/sr, including the probability of the emitter; `None` for emitters that rays cannot hit.
    pub pdf: Option<f64>,
    /// The start of light paths at the emitter, if there are any.
    pub start: Option<Start>,
}

#[derive(Clone, Copy, Debug)]
enum Emitter {
    /// Index into the scene's lights.
    Punctual(u32),
    /// Index of the triangle.
    Triangle(u32),
    Sky,
}

/// All emitters of a scene, and their selection.
pub(crate) struct Lights {
    emitters: Vec<Emitter>,
    choice: Choice,
    /// The emitter of each triangle, or `NONE`; empty without emissive triangles.
    emitter_of_triangle: Vec<u32>,
    pub sky: Sky,
    sky_emitter: Option<u32>,
    falloff: Falloff,
    range_threshold: f32,
    light_radius: f32,
    /// Tangent of the angular radius of directional lights.
    sun_radius: f64,
    materials: Materials,
}

const NONE: u32 = u32::MAX;

impl Lights {
    pub fn new(world: &World, settings: &Settings) -> Self {
        let scene = world.scene;
        let sky = Sky::new(scene);
        let mut lights = Self {
            emitters: Vec::new(),
            choice: Choice::default(),
            emitter_of_triangle: Vec::new(),
            sky,
            sky_emitter: None,
            falloff: settings.falloff(),
            range_threshold: settings.range_threshold,
            light_radius: settings.light_radius,
            sun_radius: (0.5 * f64::from(settings.sun_diameter)).to_radians().tan(),
            materials: settings.materials,
        };
        // Infinite emitters first, then bounded ones.
        let mut infinite = 0;
        for (i, light) in scene.lights.iter().enumerate() {
            if light.kind == LightKind::Directional && light.intensity != Vec3::ZERO {
                lights.emitters.push(Emitter::Punctual(i as u32));
                infinite += 1;
            }
        }
        if !lights.sky.is_dark() {
            lights.sky_emitter = Some(infinite);
            lights.emitters.push(Emitter::Sky);
            infinite += 1;
        }
        let mut bounded = Vec::new();
        for (i, light) in scene.lights.iter().enumerate() {
            if light.kind != LightKind::Directional && light.intensity != Vec3::ZERO {
                lights.emitters.push(Emitter::Punctual(i as u32));
                bounded.push(BoundedEmitter::of_light(light, lights.range(light), settings.light_radius));
            }
        }
        for triangle in 0..world.triangles.len() {
            let power = emission(world, triangle, settings.materials);
            if power > 0.0 {
                lights.emitter_of_triangle.resize(world.triangles.len(), NONE);
                lights.emitter_of_triangle[triangle] = lights.emitters.len() as u32;
                lights.emitters.push(Emitter::Triangle(triangle as u32));
                bounded.push(bounded_triangle(world, triangle, power));
            }
        }
        lights.choice = match settings.light_choice {
            LightChoice::Tree => Choice::tree(infinite, &bounded),
            LightChoice::Uniform => Choice::uniform(lights.emitters.len() as u32),
        };
        lights
    }

    fn range(&self, light: &Light) -> f32 {
        light.effective_range(self.falloff.attenuation, self.range_threshold)
    }

    /// Samples light from an emitter for the surface at `p` with shading normal `n`. `None` if no light arrives.
    /// `starts`: the lights that light paths start at.
    pub fn sample(&self, world: &World, starts: &Starts, p: Vec3A, n: DVec3, u: [f64; 3]) -> Option<Arriving> {
        let (emitter, chance) = self.choice.choose(p, n, u[0])?;
        match self.emitters[emitter as usize] {
            Emitter::Punctual(index) => {
                let light = &world.scene.lights[index as usize];
                let (falloff, range_threshold) = (self.falloff, self.range_threshold);
                let (incidence, (wi, distance, factor)) = if light.area().is_some() {
                    let place = point_of_area(light, [u[1], u[2]]);
                    let incidence = incidence_from(light, place, p, falloff, range_threshold);
                    (incidence, (incidence.wi, incidence.distance, 1.0))
                } else {
                    let incidence = incidence(light, p, falloff, range_threshold);
                    (incidence, self.towards_disk(&incidence, u[1], u[2]))
                };
                let weight = factor * incidence.irradiance / chance as f32;
                let start = starts.of(index, chance);
                (weight != Vec3::ZERO).then_some(Arriving { wi, distance, weight, pdf: None, start })
            }
            Emitter::Triangle(triangle) => self.sample_triangle(world, triangle, p, chance, u),
            Emitter::Sky => {
                let (wi, radiance, pdf) = self.sky.sample(world.scene, u[1], u[2])?;
                let pdf = pdf * chance;
                let weight = radiance / pdf as f32;
                Some(Arriving { wi, distance: f32::INFINITY, weight, pdf: Some(pdf), start: None })
            }
        }
    }

    /// Samples a point of a light's disk uniformly; the centre if the radius is zero. Returns its direction, its distance, m, and the factor of
    /// its irradiance. The disk of a directional light is at distance 1. A point at distance d of it is at an angle of cosine 1/d to the centre, and
    /// has a factor of d: the mean over points, times the cosine at the surface, is that of the centre.
    fn towards_disk(&self, incidence: &Incidence, u: f64, v: f64) -> (DVec3, f32, f32) {
        let Incidence { wi, distance, .. } = *incidence;
        let is_sun = distance.is_infinite();
        let radius = if is_sun { self.sun_radius } else { self.light_radius.into() };
        if radius == 0.0 {
            return (wi, distance, 1.0);
        }
        let (right, up) = wi.any_orthonormal_pair();
        let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
        let middle = if is_sun { wi } else { f64::from(distance) * wi };
        let place = middle + radius * u.sqrt() * (cos * right + sin * up);
        let reach = place.length() as f32;
        if is_sun { (place.normalize(), distance, reach) } else { (place.normalize(), reach, 1.0) }
    }

    fn sample_triangle(&self, world: &World, triangle: u32, p: Vec3A, chance: f64, u: [f64; 3]) -> Option<Arriving> {
        // Uniform over the triangle's area.
        let root = u[1].sqrt();
        let weights = [(1.0 - root) as f32, (root * (1.0 - u[2])) as f32, (root * u[2]) as f32];
        let corners = &world.triangles[triangle as usize];
        let place = corners.v0 * weights[0] + corners.v1 * weights[1] + corners.v2 * weights[2];
        let towards = (place - p).as_dvec3();
        let distance = towards.length();
        let wi = towards / distance;
        let pdf = self.triangle_density(world, triangle, distance, wi)? * chance;
        let front = world.is_front(triangle as usize, -wi.as_vec3a());
        let hit = Hit { distance: distance as f32, triangle, weights, front };
        let emissive = Surface::new(world, &hit, wi.as_vec3a(), self.materials).emissive * world.coverage(&hit);
        let weight = emissive / pdf as f32;
        (weight != Vec3::ZERO).then_some(Arriving {
            wi,
            distance: distance as f32,
            weight,
            pdf: Some(pdf),
            start: None,
        })
    }

    /// Density over solid angle of a point uniform over a triangle's area, at `distance` along `wi`, 1/sr; `None` if the triangle is edge-on.
    fn triangle_density(&self, world: &World, triangle: u32, distance: f64, wi: DVec3) -> Option<f64> {
        let t = &world.triangles[triangle as usize];
        let doubled = (t.v1 - t.v0).as_dvec3().cross((t.v2 - t.v0).as_dvec3());
        let projected = 0.5 * doubled.dot(wi).abs();
        (projected > 0.0).then(|| distance * distance / projected)
    }

    /// Density of [`Lights::sample`] at `p` for a hit on an emissive triangle, 1/sr; `None` if it does not sample the triangle.
    pub fn pdf_of_hit(&self, world: &World, p: Vec3A, n: DVec3, wi: DVec3, hit: &Hit) -> Option<f64> {
        let emitter = *self.emitter_of_triangle.get(hit.triangle as usize)?;
        if emitter == NONE {
            return None;
        }
        let chance = self.choice.chance(p, n, emitter);
        Some(chance * self.triangle_density(world, hit.triangle, hit.distance.into(), wi)?)
    }

    /// Number of emitters.
    pub fn count(&self) -> u32 {
        self.emitters.len() as u32
    }

    /// Probability with which light sampling at a surface selects an emitter.
    pub fn chance(&self, surface: &Surface, emitter: u32) -> f64 {
        self.choice.chance(surface.p, surface.normal, emitter)
    }

    /// Lights that light paths may start at: point and spot lights without a radius.
    pub fn starts(&self, scene: &Scene) -> Starts {
        if self.light_radius > 0.0 {
            return Starts::default();
        }
        let is_start = |light: &Light| light.kind != LightKind::Directional && light.area().is_none();
        let lights = self.emitters.iter().enumerate().filter_map(|(emitter, of)| match of {
            Emitter::Punctual(light) if is_start(&scene.lights[*light as usize]) => Some((*light, emitter as u32)),
            _ => None,
        });
        Starts::new(scene, lights.collect())
    }

    /// Density of [`Lights::sample`] at `p` for the sky along `wi`, 1/sr; `None` if the sky is dark.
    pub fn pdf_of_sky(&self, p: Vec3A, n: DVec3, wi: DVec3, scene: &Scene) -> Option<f64> {
        let chance = self.choice.chance(p, n, self.sky_emitter?);
        Some(chance * self.sky.pdf(scene, wi))
    }
}

/// The light tree's emitter for an emissive triangle of this mean radiance, nits.
fn bounded_triangle(world: &World, triangle: usize, radiance: f32) -> BoundedEmitter {
    let t = &world.triangles[triangle];
    let front = (t.v1 - t.v0).cross(t.v2 - t.v0);
    let front = if world.is_front(triangle, front) { front } else { -front };
    let is_one_sided = !world.material(&world.sources[triangle]).double_sided;
    BoundedEmitter::of_triangle([t.v0, t.v1, t.v2].map(Vec3::from), radiance, is_one_sided.then(|| front.into()))
}

/// Mean of the brightest channel of a triangle's emission over its texture, nits.
fn emission(world: &World, triangle: usize, materials: Materials) -> f32 {
    let source = &world.sources[triangle];
    let material = world.material(source);
    if material.emissive == Vec3::ZERO || (material.unlit && materials == Materials::File) {
        return 0.0;
    }
    mean_emission(world.scene, world.primitive(source), material, world.corners(source).map(|i| i as usize))
}

/// Unshadowed light at a point from a light. CPU reference of `lights/light.wesl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incidence {
    /// Direction towards the light, world space, unit.
    pub wi: DVec3,
    /// Distance from the point to the light, m; infinite for directional lights.
    pub distance: f32,
    /// Irradiance of a surface that faces the light, linear Rec. 709, lx.
    pub irradiance: Vec3,
}

/// What reaches the point `p` (world space, m) from `light`, shadows aside. KHR_lights_punctual's cone is the square of a ramp in the
/// cosine. A disk or rectangle is taken as if all of it shone from its middle ([`incidence_from`]).
pub fn incidence(light: &Light, p: Vec3A, falloff: impl Into<Falloff>, range_threshold: f32) -> Incidence {
    let falloff = falloff.into();
    if light.kind == LightKind::Directional {
        return Incidence { wi: -light.direction.as_dvec3(), distance: f32::INFINITY, irradiance: light.intensity };
    }
    if light.area().is_some() {
        return incidence_from(light, light.position.as_dvec3(), p, falloff, range_threshold);
    }
    let towards = (Vec3A::from(light.position) - p).as_dvec3();
    let distance = towards.length();
    let wi = towards / distance.max(1e-20);
    let mut factor = falloff.factor(distance as f32, light.effective_range(falloff.attenuation, range_threshold));
    if let LightKind::Spot { inner_angle, outer_angle } = light.kind {
        let span = (inner_angle.cos() - outer_angle.cos()).max(1e-4);
        let cosine = -wi.dot(light.direction.as_dvec3()) as f32;
        factor *= ((cosine - outer_angle.cos()) / span).clamp(0.0, 1.0).powi(2);
    }
    Incidence { wi, distance: distance as f32, irradiance: factor * light.intensity }
}
