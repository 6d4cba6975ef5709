//! Parameters of indirect light from screen probes.

use super::{DECLARED, LEAST_ROUGHNESS, ProbeLight};
use crate::{
    error::RenderError,
    gpu_scene::Parts,
    indirect::{
        IndirectPasses, IndirectTechnique, Quality,
        radiance_cache::Bounces,
        sampled::{Sampled, SampledLight},
    },
    rays::Tracer,
    settings::{Materials, Settings},
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};

/// Limits of the edge of a probe's tile, pixels, and of the rays of a probe.
pub(super) const LEAST_SIZE: u32 = 4;
pub(super) const MOST_SIZE: u32 = 32;
pub(super) const LEAST_RAYS: u32 = 4;
pub(super) const MOST_RAYS: u32 = 256;

/// Indirect light from screen probes: rays from a few pixels, whose radiance serves the pixels around. Further frames of a mean have rays from every pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Probes {
    /// Edge of a tile of pixels with one probe, 4 to 32 pixels. More: fewer rays, coarser light.
    pub probe_size: u32,
    /// Rays per probe, 4 to 256. More: less noise, slower.
    pub probe_rays: u32,
    /// Rays from every pixel, in all frames of a mean but the first; and the parameters of the tracer, the cache and the filter in each frame.
    pub per_pixel: Sampled,
    /// Every frame has rays from every pixel: set for transparent surfaces.
    pub is_per_pixel: bool,
}

impl Default for Probes {
    fn default() -> Self {
        Self::of(Quality::default())
    }
}

impl Probes {
    /// The parameters of a quality.
    pub const fn of(quality: Quality) -> Self {
        let probe_rays = match quality {
            Quality::Draft | Quality::Good => 32,
            Quality::Best => 128,
        };
        Self { probe_size: 8, probe_rays, per_pixel: quality.sampled(), is_per_pixel: false }
    }
}

/// A parameter of the rays from every pixel.
const fn per_pixel(index: usize, of: fn(&mut Probes) -> &mut dyn lanternfish_scene::Setting) -> Parameter<Probes> {
    Parameter { info: Sampled::PARAMETERS[index].info, of }
}

impl Technique for Probes {
    const NAME: &'static str = "probes";
    const SUMMARY: &'static str = "About one ray per pixel, from screen probes";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "probe-size",
            "PIXELS",
            Range::Count(LEAST_SIZE, MOST_SIZE),
            "Edge of a tile of pixels with one screen probe. More: fewer rays, coarser light",
            |probes| &mut probes.probe_size,
        ),
        Parameter::new(
            "probe-rays",
            "N",
            Range::Count(LEAST_RAYS, MOST_RAYS),
            "Rays per screen probe. More: less noise, slower",
            |probes| &mut probes.probe_rays,
        ),
        per_pixel(0, |probes| &mut probes.per_pixel.diffuse_rays),
        per_pixel(1, |probes| &mut probes.per_pixel.first_rays),
        per_pixel(2, |probes| &mut probes.per_pixel.glossy_rays),
        per_pixel(3, |probes| &mut probes.per_pixel.tracer),
        per_pixel(4, |probes| &mut probes.per_pixel.resolution),
        per_pixel(5, |probes| &mut probes.per_pixel.filter_radius),
        per_pixel(6, |probes| &mut probes.per_pixel.clamp),
        per_pixel(8, |probes| &mut probes.per_pixel.bounces),
        per_pixel(9, |probes| &mut probes.per_pixel.cache_entries),
        per_pixel(10, |probes| &mut probes.per_pixel.cache_samples),
    ];
    const SHADERS: Shaders = DECLARED;
}

impl IndirectTechnique for Probes {
    fn bounces(&self) -> Option<Bounces> {
        Some(self.per_pixel.bounces)
    }

    fn spend(&mut self, quality: Quality) {
        *self = Self::of(quality);
    }

    fn parts(&self) -> Parts {
        Parts::HITS
    }

    fn tracers(&self) -> Vec<Tracer> {
        vec![self.per_pixel.tracer.fixed()]
    }

    fn resolve_tracer(&mut self, automatic: Tracer) {
        self.per_pixel.tracer.resolve(automatic);
    }

    fn shares_emission(&self) -> Option<f32> {
        let most_roughness = self.per_pixel.shares_emission()?;
        Some(if self.is_per_pixel { most_roughness } else { most_roughness.min(LEAST_ROUGHNESS) })
    }

    fn for_transparent(&mut self) {
        self.is_per_pixel = true;
        self.per_pixel.for_transparent();
    }

    fn for_coats(&mut self) {
        self.is_per_pixel = true;
        self.per_pixel.for_coats();
    }

    fn for_other_sides(&mut self) {
        self.is_per_pixel = true;
        self.per_pixel.for_other_sides();
    }

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        if self.is_per_pixel {
            return self.per_pixel.build(device, settings, tracer);
        }
        // Lambertian surfaces have no glossy lobe.
        let glossy_rays = if settings.materials.model == Materials::Lambert { 0 } else { self.per_pixel.glossy_rays };
        let sampled = Sampled { glossy_rays, ..self.per_pixel };
        let light = SampledLight::new(device, sampled, settings, tracer)?;
        Ok(Box::new(ProbeLight::new(device, *self, light, settings, tracer)?))
    }
}

#[cfg(test)]
#[test]
fn parameters_of_rays_from_pixels_have_their_own_names() {
    use crate::technique::AnyTechnique;

    let text = |own: &str| match own.parse::<u32>() {
        Ok(number) => Some((number + 1).to_string()),
        Err(_) => ["half", "off", "bvh", "2"].map(str::to_owned).into_iter().find(|text| text != own),
    };
    let mut changed = 0;
    for name in Probes::PARAMETERS.iter().map(|parameter| parameter.info.name) {
        let mut probes = Probes::default();
        let Some(own) = AnyTechnique::get(&probes.per_pixel, name) else { continue };
        assert_eq!(AnyTechnique::get(&probes, name), Some(own.clone()), "{name}");
        for text in text(&own).into_iter().chain(["half", "off", "bvh", "2"].map(str::to_owned)) {
            if text != own && AnyTechnique::set(&mut probes, name, &text).is_ok() {
                assert_eq!(AnyTechnique::get(&probes.per_pixel, name), Some(text), "{name}");
                changed += 1;
                break;
            }
        }
    }
    assert_eq!(changed, 10);
}
