//! Light paths of one segment. They reduce the noise of light reflected by surfaces close to a light. Camera paths hit such surfaces rarely,
//! and then with a large contribution.
//!
//! Two techniques sample light from a point or spot light that a surface y scatters to a path's surface x. The power heuristic weights them
//! (bidirectional path tracing with light paths of one segment) [Veach1997, §10.2, §10.3]:
//!
//! 1. BSDF sampling at x hits y, and light sampling there selects the light ([`Tracer::direct_light`]).
//! 2. A ray from the light hits y, which is connected to x.
//!
//! The irradiance of y falls with its distance d from the light as 1 / d². The density of technique 2 does too, but not that of technique 1.
//!
//! Technique 2 runs once at each surface x of a path. Both techniques cover the same paths: in both, surfaces nearer to the light than
//! [`Tracer::clearance`] do not occlude it.

use glam::{DVec3, Vec3, Vec3A};
use lanternfish_scene::{
    Light, LightKind, Scene,
    light_tree::{Cone, Emitter, LightTree},
    shading::UNBOUNDED,
};

use crate::{
    brdf::Bsdf,
    lights::{Arriving, incidence, receiver},
    path::{MAX_PASSES, PreviousSurface, is_wrong_side, power_heuristic, ray_origin},
    random::Random,
    surface::Surface,
    tracer::Tracer,
    world::{Faces, Hit},
};

/// Fraction of the light paths whose light is selected by power alone. A light with little direct effect on x may still illuminate a surface
/// that lights x.
const BY_POWER: f64 = 0.5;

/// Point and spot lights without a radius, and their selection as starts of light paths.
///
/// Half of the light paths to a surface x start at lights selected by power, and half at lights selected by power, distance from x and x's
/// normal: a surface close to a light scatters to x about as much as the light would send there, up to the albedo.
#[derive(Debug, Default)]
pub(crate) struct Starts {
    /// Indices of the light in the scene and of its emitter.
    lights: Vec<(u32, u32)>,
    /// Cumulative power, including each light, as a fraction of the total.
    sums: Vec<f64>,
    /// Light tree, with each light treated as omnidirectional and without a range.
    tree: LightTree,
}

/// A light that a light path may start at, selected by light sampling.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// Index in [`Starts`].
    index: u32,
    /// Probability with which light sampling selected it.
    chance: f64,
}

/// Hit of a ray from a light.
struct LightHit {
    hit: Hit,
    p: Vec3A,
    /// Transmittance of thin dielectrics on the way, divided by its probability.
    passes: Vec3,
}

/// Axis of a light's cone, unit.
fn axis(light: &Light) -> DVec3 {
    match light.kind {
        LightKind::Spot { .. } => light.direction.as_dvec3().normalize(),
        _ => DVec3::Z,
    }
}

/// Cosine of the half-angle of a light's cone.
fn least_cosine(light: &Light) -> f64 {
    match light.kind {
        LightKind::Spot { outer_angle, .. } => f64::from(outer_angle.cos()),
        _ => -1.0,
    }
}

/// Solid angle of a light's cone, sr.
fn cone(light: &Light) -> f64 {
    std::f64::consts::TAU * (1.0 - least_cosine(light))
}

impl Starts {
    /// From indices of lights of a scene and of their emitters. Lights without power are skipped.
    pub fn new(scene: &Scene, lights: Vec<(u32, u32)>) -> Self {
        let power = |(light, _): &(u32, u32)| {
            let light = &scene.lights[*light as usize];
            f64::from(light.intensity.max_element()) * cone(light)
        };
        let lights: Vec<(u32, u32)> = lights.into_iter().filter(|light| power(light) > 0.0).collect();
        let emitter = |(light, _): &(u32, u32)| {
            let light = &scene.lights[*light as usize];
            let emitter = Emitter::of_light(light, UNBOUNDED, 0.0);
            let fraction = (cone(light) / (2.0 * std::f64::consts::TAU)) as f32;
            Emitter { power: emitter.power * fraction, cone: Cone::ALL, ..emitter }
        };
        let tree = LightTree::new(&lights.iter().map(emitter).collect::<Vec<_>>());
        let all: f64 = lights.iter().map(power).sum();
        let sums = lights.iter().scan(0.0, |sum, light| {
            *sum += power(light) / all;
            Some(*sum)
        });
        Self { sums: sums.collect(), lights, tree }
    }

    /// The start for a light that light sampling selected with probability `chance`, if light paths may start at it.
    pub fn of(&self, light: u32, chance: f64) -> Option<Start> {
        // Lights are sorted by index in the scene.
        let index = self.lights.binary_search_by_key(&light, |(light, _)| *light).ok()?;
        Some(Start { index: index as u32, chance })
    }

    /// Probability that a light path to a surface with normal `n` at `x` starts at light `index`.
    fn chance(&self, x: Vec3A, n: DVec3, index: u32) -> f64 {
        let before = index.checked_sub(1).map_or(0.0, |before| self.sums[before as usize]);
        let by_power = self.sums[index as usize] - before;
        BY_POWER * by_power + (1.0 - BY_POWER) * self.tree.chance(&receiver(x, n), index)
    }

    /// Selects a light for a light path to a surface with normal `n` at `x`.
    fn choose(&self, x: Vec3A, n: DVec3, u: f64) -> Option<u32> {
        if u >= BY_POWER {
            return self.tree.choose(&receiver(x, n), (u - BY_POWER) / (1.0 - BY_POWER)).map(|(index, _)| index);
        }
        let u = u / BY_POWER;
        Some(self.sums.partition_point(|sum| *sum <= u).min(self.sums.len() - 1) as u32)
    }

    /// Samples a direction uniformly in a light's cone.
    fn direction(&self, scene: &Scene, index: u32, u: [f64; 2]) -> Vec3A {
        let light = &scene.lights[self.lights[index as usize].0 as usize];
        let axis = axis(light);
        let cosine = 1.0 - u[0] * (1.0 - least_cosine(light));
        let (right, up) = axis.any_orthonormal_pair();
        let (sin, cos) = (std::f64::consts::TAU * u[1]).sin_cos();
        let direction = cosine * axis + (1.0 - cosine * cosine).max(0.0).sqrt() * (cos * right + sin * up);
        direction.as_vec3a().normalize()
    }
}

impl Tracer<'_> {
    /// MIS weight of light sampling at `y`, against light paths.
    pub(crate) fn light_sampling_weight(&self, y: &Surface, light: &Arriving, last: Option<&PreviousSurface>) -> f32 {
        let (Some(start), Some(last)) = (light.start, last) else { return 1.0 };
        let x_to_y = y.p - last.p;
        let own = last.pdf * solid_angle_per_area(y, x_to_y) * start.chance;
        let chance = self.starts.chance(last.p, last.normal, start.index);
        let other = chance * self.hit_density(start.index, y, light.wi * f64::from(light.distance));
        power_heuristic(own, Some(other))
    }

    /// Density of hits of rays from a light over the surface `y`, 1/m². `away` is the vector from `y` to the light.
    fn hit_density(&self, index: u32, y: &Surface, away: DVec3) -> f64 {
        let distance = away.length();
        if distance <= f64::from(self.clearance) {
            return 0.0;
        }
        let light = &self.world.scene.lights[self.starts.lights[index as usize].0 as usize];
        let is_within = axis(light).dot(-away / distance) >= least_cosine(light);
        if is_within { solid_angle_per_area(y, away.as_vec3a()) / cone(light) } else { 0.0 }
    }

    /// Estimate of light that reaches `x` by way of one other surface and is scattered towards `wo`, from a light path, with its MIS weight.
    pub(crate) fn light_by_light_path(&self, x: &Surface, bsdf: &Bsdf, wo: DVec3, random: &mut Random) -> Vec3 {
        if self.starts.lights.is_empty() {
            return Vec3::ZERO;
        }
        let scene = self.world.scene;
        let Some(index) = self.starts.choose(x.p, x.normal, random.unit()) else { return Vec3::ZERO };
        let direction = self.starts.direction(scene, index, [random.unit(), random.unit()]);
        let (light, emitter) = self.starts.lights[index as usize];
        let light = &scene.lights[light as usize];
        let Some(lit) = self.first_hit(Vec3A::from(light.position) + self.clearance * direction, direction, random)
        else {
            return Vec3::ZERO;
        };

        let x_to_y = lit.p - x.p;
        let distance = x_to_y.length();
        let towards = x_to_y / distance;
        let wi = towards.as_dvec3();
        let at_x = bsdf.scatter(x.normal, wi, wo);
        if distance == 0.0 || at_x == DVec3::ZERO || is_wrong_side(x, wi) {
            return Vec3::ZERO;
        }
        // The surface as hit by a ray from x.
        let front = self.world.is_front(lit.hit.triangle as usize, -towards);
        let y = Surface::new(&self.world, &Hit { distance, front, ..lit.hit }, towards, self.settings.materials);
        let Some(bsdf_of_y) = &y.bsdf else { return Vec3::ZERO };
        let arriving = incidence(light, y.p, self.settings.falloff(), self.settings.range_threshold);
        let at_y = bsdf_of_y.scatter(y.normal, arriving.wi, -wi);
        if at_y == DVec3::ZERO || arriving.irradiance == Vec3::ZERO || is_wrong_side(&y, arriving.wi) {
            return Vec3::ZERO;
        }
        let chance = self.starts.chance(x.p, x.normal, index);
        let own = chance * self.hit_density(index, &y, arriving.wi * f64::from(arriving.distance));
        if own <= 0.0 {
            return Vec3::ZERO;
        }
        let seen = solid_angle_per_area(&y, x_to_y);
        let other = bsdf.pdf(x.normal, wi, wo) * seen * self.lights.chance(&y, emitter);
        let weight = power_heuristic(own, Some(other)) * (seen / own) as f32;
        // Both ends are offset from their surfaces, so that neither occludes itself.
        let (from, to) = (ray_origin(x, towards), ray_origin(&y, -towards));
        let transmittance = self.world.transmittance(from, (to - from).normalize(), from.distance(to));
        let volume = y.volume.map_or(Vec3::ONE, |volume| volume.powf(distance));
        lit.passes * transmittance * volume * arriving.irradiance * at_y.as_vec3() * at_x.as_vec3() * weight
    }

    /// The first hit of a ray from a light that does not pass straight through the surface.
    fn first_hit(&self, mut origin: Vec3A, direction: Vec3A, random: &mut Random) -> Option<LightHit> {
        let mut passes = Vec3::ONE;
        for _ in 0..MAX_PASSES {
            let hit = self.world.closest(origin, direction, Faces::All, random.bits())?;
            let surface = Surface::new(&self.world, &hit, direction, self.settings.materials);
            let straight = surface.passes_straight(-direction.as_dvec3());
            let chance = straight.max_element();
            if chance <= 0.0 {
                return Some(LightHit { hit, p: surface.p, passes });
            }
            if random.unit() >= f64::from(chance) {
                return Some(LightHit { hit, p: surface.p, passes: passes / (1.0 - chance) });
            }
            passes *= straight / chance;
            origin = ray_origin(&surface, direction);
        }
        None
    }
}

/// Solid angle per area of a surface, seen from a point at the offset `away`, sr/m².
fn solid_angle_per_area(y: &Surface, away: Vec3A) -> f64 {
    let away = away.as_dvec3();
    let squared = away.length_squared();
    y.geometric_normal.as_dvec3().dot(away).abs() / (squared * squared.sqrt())
}
