//! The unit in which a scene's light is stored on the device: half floats end at 65,504 and lose precision below 6·10⁻⁵.

use std::borrow::Cow;

use glam::Vec3;
use lanternfish_scene::{Bounds, Environment, Light, LightKind, Material, Scene};

/// Illuminance of the brightest lights, in the unit: a 64th of the largest half float, since highlights are brighter.
const BRIGHT: f64 = 1024.0;
/// Nearest distance at which a light's whole illuminance fits into the unit with the room for highlights, m: diffuse light fits to 8 mm.
const NEAR: f64 = 1.0 / 16.0;
/// Room for highlights that emitted radiance does not need: nothing reflects more of it.
const EMITTED: f64 = 16.0;
/// Stops by which light may be dimmer or brighter than [`BRIGHT`] before a unit other than 1 is chosen.
const USUAL: std::ops::RangeInclusive<f64> = -8.0..=2.0;
/// Factor by which light may become brighter or darker in updates until it is stored in another unit.
const MOST_CHANGE: [f64; 2] = [8.0, 4096.0];

/// How a scene's light is stored.
#[derive(Clone, Copy, Debug)]
pub(in crate::gpu_scene) struct StoredLight {
    /// Nits that are stored as 1.
    pub light_unit: f32,
    /// [`of_environment`], so that updates need not sum it again.
    pub environment: f64,
    /// Box of the scene's geometry when it was uploaded: lamps far from it light it as from there, m.
    pub bounds: Bounds,
}

impl StoredLight {
    /// For a new upload.
    pub fn of(scene: &Scene) -> Self {
        let environment = scene.environment.as_ref().map_or(0.0, of_environment);
        let mut stored = Self { light_unit: 1.0, environment, bounds: scene.bounds() };
        stored.light_unit = stored.unit_for(scene);
        stored
    }

    /// For an update; `is_same`: the environment has not changed.
    pub fn next(self, scene: &Scene, is_same: bool) -> Self {
        let environment = match &scene.environment {
            Some(_) if is_same => self.environment,
            environment => environment.as_ref().map_or(0.0, of_environment),
        };
        let next = Self { environment, ..self };
        Self { light_unit: next.next_unit(scene), ..next }
    }

    /// Illuminance that stands for a light, lx.
    fn of_light(&self, light: &Light) -> f64 {
        let intensity = f64::from(light.intensity.max_element());
        match light.kind {
            LightKind::Directional => intensity,
            LightKind::Point | LightKind::Spot { .. } => {
                let outside = (self.bounds.min - light.position).max(light.position - self.bounds.max).max(Vec3::ZERO);
                let outside = if self.bounds.is_empty() { Vec3::ZERO } else { outside };
                let distance = f64::from(outside.length()).max(NEAR);
                intensity / (distance * distance)
            }
            LightKind::Disk { .. } | LightKind::Rectangle { .. } => intensity / EMITTED,
        }
    }

    /// Illuminance that stands for a scene's brightest light, lx; 0 for a scene without light.
    fn brightest(&self, scene: &Scene) -> f64 {
        let of_light = |light| self.of_light(light);
        let suns = scene.lights.iter().filter(|light| light.kind == LightKind::Directional).map(of_light).sum();
        let all = scene.lights.iter().map(of_light).chain(scene.materials.iter().map(of_material));
        all.fold(self.environment.max(f64::from(scene.sky.max_element())).max(suns), f64::max)
    }

    /// Nits (and cd, lx) that are stored as 1: a power of two, so that other units give the same images to the bit but for what overflowed or
    /// lost precision.
    fn unit_for(&self, scene: &Scene) -> f32 {
        let stops = (self.brightest(scene) / BRIGHT).log2().ceil();
        if !stops.is_finite() || USUAL.contains(&stops) { 1.0 } else { stops.clamp(-60.0, 60.0).exp2() as f32 }
    }

    /// The unit after an update: another one only after a large change. Without any light it stays.
    fn next_unit(&self, scene: &Scene) -> f32 {
        let (unit, now) = (self.light_unit, self.unit_for(scene));
        let may_stay = (1.0 / MOST_CHANGE[1]..=MOST_CHANGE[0]).contains(&(f64::from(now) / f64::from(unit)));
        if may_stay || self.brightest(scene) == 0.0 { unit } else { now }
    }

    /// True if a single light or material is too bright for the unit.
    pub fn is_outshone(&self, light: Option<&Light>, material: Option<&Material>) -> bool {
        let illuminance = light.map_or(0.0, |light| self.of_light(light)).max(material.map_or(0.0, of_material));
        illuminance > MOST_CHANGE[0] * BRIGHT * f64::from(self.light_unit).max(USUAL.end().exp2())
    }
}

/// Illuminance that stands for what a material emits, lx.
fn of_material(material: &Material) -> f64 {
    let unlit = if material.unlit { material.base_color.truncate().max_element() } else { 0.0 };
    f64::from(material.emissive.max_element().max(unlit)) / EMITTED
}

/// The same for an environment: the sum of its light from all around.
fn of_environment(environment: &Environment) -> f64 {
    let sum: f64 = environment.pixels.iter().map(|pixel| f64::from(pixel.max_element())).sum();
    4.0 * std::f64::consts::PI * sum / environment.pixels.len().max(1) as f64
}

/// The environment in the unit.
pub(in crate::gpu_scene) fn stored_environment(environment: &Environment, unit: f32) -> Cow<'_, Environment> {
    if unit == 1.0 {
        return Cow::Borrowed(environment);
    }
    let pixels = environment.pixels.iter().map(|pixel| *pixel / unit).collect();
    Cow::Owned(Environment { pixels, ..environment.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_follows_the_brightest_light_and_is_a_power_of_two() {
        let lit = |lights: Vec<Light>| StoredLight::of(&Scene { lights, ..Scene::default() }).light_unit;
        assert_eq!(lit(vec![]), 1.0);
        assert_eq!(lit(vec![Light::point(Vec3::ZERO, Vec3::splat(8.0))]), 1.0);
        let sun = |lux: f32| Light { kind: LightKind::Directional, ..Light::point(Vec3::ZERO, Vec3::splat(lux)) };
        assert_eq!(lit(vec![sun(120_000.0)]), 128.0);
        assert_eq!(lit(vec![sun(120_000.0), sun(120_000.0)]), 256.0);
        // From far away.
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ONE };
        let stored = StoredLight { bounds, ..StoredLight::of(&Scene::default()) };
        let lux = stored.of_light(&Light::point(Vec3::new(1e5, 0.0, 0.0), Vec3::splat(1e11)));
        assert!((lux - 10.0).abs() < 0.1, "{lux}");
        // A lamp of 100 cd at 1 cm: 10⁶ lx, over π.
        let unit = lit(vec![Light::point(Vec3::ZERO, Vec3::splat(100.0))]);
        assert!(1e6 / std::f32::consts::PI / unit < 65504.0 / 4.0, "{unit}");
        let glowing = Material { emissive: Vec3::splat(1e-6), ..Material::default() };
        let unit = StoredLight::of(&Scene { materials: vec![glowing], ..Scene::default() }).light_unit;
        assert!(unit < 1e-9 && unit.log2().fract() == 0.0, "{unit}");
    }

    #[test]
    fn light_changes_its_unit_only_after_a_large_change() {
        let scene = |intensity: f32| Scene {
            lights: vec![Light::point(Vec3::ZERO, Vec3::splat(intensity))],
            ..Scene::default()
        };
        let at = |light_unit| StoredLight { light_unit, ..StoredLight::of(&scene(1.0)) };
        let next = |unit, intensity| at(unit).next(&scene(intensity), true).light_unit;
        assert!(next(1.0, 20.0) == 1.0 && next(1.0, 1000.0) > 1.0);
        assert!(next(128.0, 10.0) == 128.0 && next(128.0, 0.001) < 1.0);
        assert_eq!(next(4096.0 * 64.0, 0.0), 4096.0 * 64.0);
        let lamp = |intensity| Light::point(Vec3::ZERO, Vec3::splat(intensity));
        assert!(at(1e-6).is_outshone(Some(&lamp(1000.0)), None) && !at(1e-6).is_outshone(Some(&lamp(10.0)), None));
    }
}
