//! How many lights reach a point, by which the command line advises samples.

use lanternfish_scene::Bounds;

use glam::Vec3;

use crate::{gpu_scene::GpuScene, lights::Light};

/// Points at which lights are counted.
const POINTS: usize = 64;
/// Lights that are counted, at equal distances in the list; each then stands for several.
const MOST_COUNTED: usize = 4096;

/// Mean number of lights whose range holds a point of the scene's box, at 64 points.
pub fn lights_in_reach(scene: &GpuScene) -> f32 {
    in_reach(scene.bounds(), &scene.lights().on_host)
}

fn in_reach(bounds: &Bounds, lights: &[Light]) -> f32 {
    let stride = lights.len().div_ceil(MOST_COUNTED).max(1);
    let mut reached = 0u32;
    for index in 0..POINTS {
        // The R3 sequence [Roberts2018].
        let steps = Vec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5);
        let point = bounds.min + (0.5 + index as f32 * steps).fract() * bounds.size();
        let reaches = |light: &&Light| {
            light.intensity != Vec3::ZERO && (light.is_directional() || light.position().distance(point) < light.range)
        };
        reached += lights.iter().step_by(stride).filter(reaches).count() as u32;
    }
    (stride as u32 * reached) as f32 / POINTS as f32
}

#[cfg(test)]
mod tests {
    use lanternfish_scene::generate::light_rain;

    use super::*;
    use crate::{Settings, lights::LightStorage};

    fn counted(count: u32, radius: Option<f32>) -> f32 {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(20.0, 10.0, 30.0) };
        let settings: LightStorage = Settings::direct_light().light_storage();
        let rain = light_rain(&bounds, count, radius, 0, 0.0);
        let lights: Vec<Light> = rain.iter().map(|light| Light::new(light, &settings)).collect();
        in_reach(&bounds, &lights)
    }

    #[test]
    fn lights_are_counted_where_they_reach() {
        assert_eq!(counted(0, None), 0.0);
        // Every light reaches everywhere.
        assert_eq!(counted(300, Some(100.0)), 300.0);
        // A part of them is counted.
        assert!((counted(100_000, Some(100.0)) - 100_000.0).abs() < 4096.0);
        // The rain's own radius: 12 lights at an inner point, fewer at the box's sides.
        for count in [500, 5_000, 50_000] {
            let reached = counted(count, None);
            assert!((7.0..13.0).contains(&reached), "{count}: {reached}");
        }
    }
}
