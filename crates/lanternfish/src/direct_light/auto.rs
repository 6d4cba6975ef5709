//! The choice between every light and samples, for each scene.

use glam::Vec3;
use lanternfish_scene::Bounds;

use super::{
    DirectPasses, DirectTechnique,
    sampled::{LightSamples, SampledLights, SampledPasses},
};
use crate::{
    error::RenderError,
    gpu_scene::{GpuScene, Parts},
    lights::Light,
    rays::Tracer,
    settings::Settings,
    shaders::Shaders,
    technique::{Parameter, Technique},
};

/// [`SampledLights`] in scenes in which many lights reach a point; in others, every listed light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AutoLights(pub SampledLights);

/// Lights in reach of a point above which they are sampled, by rays per pixel: there, a ray to each light makes a frame
/// about twice as long as sampling. First row: software adapters. Second: graphics cards (not measured, the same).
const MOST_IN_REACH: [[f32; 4]; 2] = [[16.0, 20.0, 28.0, 44.0], [16.0, 20.0, 28.0, 44.0]];
/// Factor on these without shadow rays: a light then costs a tenth.
const WITHOUT_SHADOWS: f32 = 10.0;
/// Points at which lights are counted.
const POINTS: usize = 64;
/// Lights that are counted, at equal distances in the list; each then stands for several.
const MOST_COUNTED: usize = 4096;

impl Technique for AutoLights {
    const NAME: &'static str = "auto";
    const SUMMARY: &'static str = "sampled where many lights reach a point, otherwise all";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter { info: SampledLights::ROWS[0].info, of: |auto| &mut auto.0.light_samples },
        Parameter { info: SampledLights::ROWS[1].info, of: |auto| &mut auto.0.denoise },
    ];
    const SHADERS: Shaders = Shaders::new(&[], &[]);
}

impl DirectTechnique for AutoLights {
    fn parts(&self, settings: &Settings) -> Parts {
        self.0.parts(settings)
    }

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn DirectPasses>, RenderError> {
        let is_hardware = device.adapter_info().device_type != wgpu::DeviceType::Cpu;
        let by_shadows = if tracer.is_some() { 1.0 } else { WITHOUT_SHADOWS };
        let most = by_shadows * most_in_reach(self.0.light_samples, is_hardware);
        Ok(Box::new(SampledPasses::new(device, self.0, settings, tracer)?.beyond(most)))
    }
}

/// Entry of the table.
fn most_in_reach(rays: LightSamples, is_hardware: bool) -> f32 {
    MOST_IN_REACH[usize::from(is_hardware)][rays as usize]
}

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
    use crate::{direct_light::Direct, lights::LightStorage};

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

    #[test]
    fn more_rays_need_more_lights() {
        for is_hardware in [false, true] {
            let most: Vec<f32> = LightSamples::ALL.iter().map(|rays| most_in_reach(*rays, is_hardware)).collect();
            assert!(most.is_sorted(), "{most:?}");
        }
        assert!(Direct::all().iter().any(|direct| direct.name() == AutoLights::NAME));
    }

    #[test]
    fn a_parameter_is_the_samples_parameter_of_its_name() {
        let mut auto = AutoLights::default();
        for parameter in AutoLights::PARAMETERS {
            let row = SampledLights::ROWS.iter().find(|row| row.info.name == parameter.info.name).unwrap();
            let own = std::ptr::from_mut((parameter.of)(&mut auto)).cast::<()>();
            assert_eq!(own, std::ptr::from_mut((row.of)(&mut auto.0)).cast::<()>(), "{}", row.info.name);
        }
    }
}
