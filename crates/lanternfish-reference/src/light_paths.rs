//! Paths that start at a light: what a surface close to a light sends on to others, which paths from the eye find seldom, and then too much of
//! it at once.
//!
//! Light that goes from a point or spot light to a surface y, and from there to x on a path, is found in two ways, weighted by the power
//! heuristic (bidirectional path tracing with light paths of one segment) [Veach1997, §10.2, §10.3]:
//!
//! 1. by the BSDF at x, which leads to y, and the search for light there ([`Tracer::direct_light`]);
//! 2. by a ray from the light, which leads to y, and a connection of x to y.
//!
//! Where y is at the distance d from the light, its light goes by 1 / d²: so does the density of the second way, and not that of the first.
//!
//! The second way is gone once at each surface x of a path. Both ways have the same paths: of surfaces nearer to the light than
//! [`Tracer::clearance`] neither is in the way of the light.

use glam::{DVec3, Vec3, Vec3A};
use lanternfish_scene::{
    Light, LightKind, Scene,
    light_tree::{Cone, Emitter, LightTree},
    shading::UNBOUNDED,
};

use crate::{
    Tracer,
    brdf::Bsdf,
    lights::{Arriving, incidence, receiver},
    path::{LastSearch, MOST_PASSES, leaves, passes_wrong_side, power_heuristic},
    random::Random,
    surface::Surface,
    world::{Faces, Hit},
};

/// Share of the paths whose lights are chosen by power alone: those that the tree says are of little use to a surface light others for it.
const BY_POWER: f64 = 0.5;

/// Point and spot lights without a size, and how likely a path starts at each.
///
/// One half of the paths to a surface x start at lights chosen by power, the other at lights chosen by power, distance from x and x's normal:
/// what lies close to a light sends to x about as much as the light would, if all of it were scattered.
#[derive(Debug, Default)]
pub(crate) struct Starts {
    /// Index of the light in the scene, and of its emitter.
    lights: Vec<(u32, u32)>,
    /// Sum of the powers up to each light and with it, of 1.
    sums: Vec<f64>,
    /// Over the lights as if each shone all around and had no range.
    tree: LightTree,
}

/// A light that a path may start at, as a search for light has found it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// Which of [`Starts`].
    index: u32,
    /// The chance that the search had to choose it.
    chance: f64,
}

/// Where a ray from a light ends.
struct Lit {
    hit: Hit,
    p: Vec3A,
    /// Share of the light that panes on the way let through, over its chance.
    passes: Vec3,
}

/// Middle of the directions that a light shines into, unit.
fn axis(light: &Light) -> DVec3 {
    match light.kind {
        LightKind::Spot { .. } => light.direction.as_dvec3().normalize(),
        _ => DVec3::Z,
    }
}

/// Least cosine between those and their middle.
fn least_cosine(light: &Light) -> f64 {
    match light.kind {
        LightKind::Spot { outer_angle, .. } => f64::from(outer_angle.cos()),
        _ => -1.0,
    }
}

/// Solid angle that a light shines into, sr.
fn cone(light: &Light) -> f64 {
    std::f64::consts::TAU * (1.0 - least_cosine(light))
}

impl Starts {
    /// Of the lights of a scene, each with its emitter.
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

    /// A light that was found with this chance, if a path may start at it.
    pub fn of(&self, light: u32, chance: f64) -> Option<Start> {
        // Lights are in the order of the scene.
        let index = self.lights.binary_search_by_key(&light, |(light, _)| *light).ok()?;
        Some(Start { index: index as u32, chance })
    }

    /// Chance that a path to a surface with the normal `n` at `x` starts at a light.
    fn chance(&self, x: Vec3A, n: DVec3, index: u32) -> f64 {
        let before = index.checked_sub(1).map_or(0.0, |before| self.sums[before as usize]);
        let by_power = self.sums[index as usize] - before;
        BY_POWER * by_power + (1.0 - BY_POWER) * self.tree.chance(&receiver(x, n), index)
    }

    /// A light for a path to a surface with the normal `n` at `x`.
    fn choose(&self, x: Vec3A, n: DVec3, u: f64) -> Option<u32> {
        if u >= BY_POWER {
            return self.tree.choose(&receiver(x, n), (u - BY_POWER) / (1.0 - BY_POWER)).map(|(index, _)| index);
        }
        let u = u / BY_POWER;
        Some(self.sums.partition_point(|sum| *sum <= u).min(self.sums.len() - 1) as u32)
    }

    /// A direction from a light, evenly over all that it shines into.
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
    /// Weight of light that a search at `y` has found, beside paths that start at the light.
    pub(crate) fn weight_of_search(&self, y: &Surface, light: &Arriving, last: Option<&LastSearch>) -> f32 {
        let (Some(start), Some(last)) = (light.start, last) else { return 1.0 };
        let x_to_y = y.p - last.p;
        let own = last.pdf * area_of(y, x_to_y) * start.chance;
        let chance = self.starts.chance(last.p, last.normal, start.index);
        let other = chance * self.density_of_ends(start.index, y, light.wi * f64::from(light.distance));
        power_heuristic(own, Some(other))
    }

    /// Density over a surface, 1/m², of where rays from a light end, which is `away` from it.
    fn density_of_ends(&self, index: u32, y: &Surface, away: DVec3) -> f64 {
        let distance = away.length();
        if distance <= f64::from(self.clearance) {
            return 0.0;
        }
        let light = &self.world.scene.lights[self.starts.lights[index as usize].0 as usize];
        let is_within = axis(light).dot(-away / distance) >= least_cosine(light);
        if is_within { area_of(y, away.as_vec3a()) / cone(light) } else { 0.0 }
    }

    /// What one light sends to `x` by way of one other surface, and from there towards `wo`, as far as a path from the light finds it.
    pub(crate) fn light_by_starts(&self, x: &Surface, bsdf: &Bsdf, wo: DVec3, random: &mut Random) -> Vec3 {
        if self.starts.lights.is_empty() {
            return Vec3::ZERO;
        }
        let scene = self.world.scene;
        let Some(index) = self.starts.choose(x.p, x.normal, random.unit()) else { return Vec3::ZERO };
        let direction = self.starts.direction(scene, index, [random.unit(), random.unit()]);
        let (light, emitter) = self.starts.lights[index as usize];
        let light = &scene.lights[light as usize];
        let Some(lit) = self.first_lit(Vec3A::from(light.position) + self.clearance * direction, direction, random)
        else {
            return Vec3::ZERO;
        };

        let x_to_y = lit.p - x.p;
        let distance = x_to_y.length();
        let towards = x_to_y / distance;
        let wi = towards.as_dvec3();
        let at_x = bsdf.scatter(x.normal, wi, wo);
        if distance == 0.0 || at_x == DVec3::ZERO || passes_wrong_side(x, wi) {
            return Vec3::ZERO;
        }
        // As a path from x meets it.
        let front = self.world.is_front(lit.hit.triangle as usize, -towards);
        let y = Surface::new(&self.world, &Hit { distance, front, ..lit.hit }, towards, self.settings.materials);
        let Some(bsdf_of_y) = &y.bsdf else { return Vec3::ZERO };
        let arriving = incidence(light, y.p, self.settings.falloff(), self.settings.range_threshold);
        let at_y = bsdf_of_y.scatter(y.normal, arriving.wi, -wi);
        if at_y == DVec3::ZERO || arriving.irradiance == Vec3::ZERO || passes_wrong_side(&y, arriving.wi) {
            return Vec3::ZERO;
        }
        let chance = self.starts.chance(x.p, x.normal, index);
        let own = chance * self.density_of_ends(index, &y, arriving.wi * f64::from(arriving.distance));
        if own <= 0.0 {
            return Vec3::ZERO;
        }
        let seen = area_of(&y, x_to_y);
        let other = bsdf.pdf(x.normal, wi, wo) * seen * self.lights.chance(&y, emitter);
        let weight = power_heuristic(own, Some(other)) * (seen / own) as f32;
        // From before the one surface to before the other: neither hides itself.
        let (from, to) = (leaves(x, towards), leaves(&y, -towards));
        let open = self.world.transmittance(from, (to - from).normalize(), from.distance(to));
        let volume = y.volume.map_or(Vec3::ONE, |volume| volume.powf(distance));
        lit.passes * open * volume * arriving.irradiance * at_y.as_vec3() * at_x.as_vec3() * weight
    }

    /// The first surface that a ray from a light meets and does not pass.
    fn first_lit(&self, mut origin: Vec3A, direction: Vec3A, random: &mut Random) -> Option<Lit> {
        let mut passes = Vec3::ONE;
        for _ in 0..MOST_PASSES {
            let hit = self.world.closest(origin, direction, Faces::All, random.bits())?;
            let surface = Surface::new(&self.world, &hit, direction, self.settings.materials);
            let straight = surface.passes_straight(-direction.as_dvec3());
            let chance = straight.max_element();
            if chance <= 0.0 {
                return Some(Lit { hit, p: surface.p, passes });
            }
            if random.unit() >= f64::from(chance) {
                return Some(Lit { hit, p: surface.p, passes: passes / (1.0 - chance) });
            }
            passes *= straight / chance;
            origin = leaves(&surface, direction);
        }
        None
    }
}

/// Steradians of a surface's square metre, seen from a point that is `away` from it, 1/m².
fn area_of(y: &Surface, away: Vec3A) -> f64 {
    let away = away.as_dvec3();
    let squared = away.length_squared();
    y.geometric_normal.as_dvec3().dot(away).abs() / (squared * squared.sqrt())
}
