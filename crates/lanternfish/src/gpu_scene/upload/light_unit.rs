//! The unit in which a scene's light is stored on the device: half floats end at 65,504 and lose precision below 6·10⁻⁵.

use std::borrow::Cow;

use lanternfish_scene::{Environment, LightKind, Scene};

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

/// Illuminance that stands for a scene's brightest light, lx; 0 for a scene without light.
fn brightest(scene: &Scene) -> f64 {
    let mut suns = 0.0;
    let mut most = f64::from(scene.sky.max_element());
    for light in &scene.lights {
        let intensity = f64::from(light.intensity.max_element());
        match light.kind {
            LightKind::Directional => suns += intensity,
            LightKind::Point | LightKind::Spot { .. } => most = most.max(intensity / (NEAR * NEAR)),
            LightKind::Disk { .. } | LightKind::Rectangle { .. } => most = most.max(intensity / EMITTED),
        }
    }
    for material in &scene.materials {
        let unlit = if material.unlit { material.base_color.truncate().max_element() } else { 0.0 };
        most = most.max(f64::from(material.emissive.max_element().max(unlit)) / EMITTED);
    }
    if let Some(Environment { pixels, .. }) = &scene.environment {
        let sum: f64 = pixels.iter().map(|pixel| f64::from(pixel.max_element())).sum();
        most = most.max(4.0 * std::f64::consts::PI * sum / pixels.len().max(1) as f64);
    }
    most.max(suns)
}

/// Nits (and cd, lx) that are stored as 1: a power of two, so that other units give the same images to the bit but for what overflowed or
/// lost precision.
pub(in crate::gpu_scene) fn light_unit(scene: &Scene) -> f32 {
    let stops = (brightest(scene) / BRIGHT).log2().ceil();
    if !stops.is_finite() || USUAL.contains(&stops) { 1.0 } else { stops.clamp(-60.0, 60.0).exp2() as f32 }
}

/// True if light that was stored in `unit` needs another one.
pub(in crate::gpu_scene) fn is_outgrown(unit: f32, scene: &Scene) -> bool {
    let ratio = f64::from(light_unit(scene)) / f64::from(unit);
    !(1.0 / MOST_CHANGE[1]..=MOST_CHANGE[0]).contains(&ratio)
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
    use glam::Vec3;
    use lanternfish_scene::{Light, Material};

    use super::*;

    #[test]
    fn the_unit_follows_the_brightest_light_and_is_a_power_of_two() {
        let lit = |lights: Vec<Light>| light_unit(&Scene { lights, ..Scene::default() });
        assert_eq!(lit(vec![]), 1.0);
        assert_eq!(lit(vec![Light::point(Vec3::ZERO, Vec3::splat(8.0))]), 1.0);
        let sun = |lux: f32| Light { kind: LightKind::Directional, ..Light::point(Vec3::ZERO, Vec3::splat(lux)) };
        assert_eq!(lit(vec![sun(120_000.0)]), 128.0);
        assert_eq!(lit(vec![sun(120_000.0), sun(120_000.0)]), 256.0);
        // A lamp of 100 cd at 1 cm: 10⁶ lx, over π.
        let unit = lit(vec![Light::point(Vec3::ZERO, Vec3::splat(100.0))]);
        assert!(1e6 / std::f32::consts::PI / unit < 65504.0 / 4.0, "{unit}");
        let glowing = Material { emissive: Vec3::splat(1e-6), ..Material::default() };
        let unit = light_unit(&Scene { materials: vec![glowing], ..Scene::default() });
        assert!(unit < 1e-9 && unit.log2().fract() == 0.0, "{unit}");
    }

    #[test]
    fn light_is_stored_anew_only_if_it_changes_by_much() {
        let scene = |intensity: f32| Scene {
            lights: vec![Light::point(Vec3::ZERO, Vec3::splat(intensity))],
            ..Scene::default()
        };
        assert!(!is_outgrown(1.0, &scene(20.0)) && is_outgrown(1.0, &scene(1000.0)));
        assert!(!is_outgrown(128.0, &scene(10.0)) && is_outgrown(128.0, &scene(0.001)));
    }
}
