//! Direct light from a fixed number of shadow rays a pixel, for any number of lights.
//!
//! 1. Each tile lists the emitters that may light it, from the light trees (`emitter_list.wesl`).
//! 2. Each pixel sums their unshadowed light, chooses some of them (`choice.wesl`) by what it remembers of their
//!    visibility (`memory.wesl`), and traces a ray to each (`trace.wesl`).
//! 3. The ratio of the light that arrives to the unshadowed light is filtered and accumulated (`ratio_filter.wesl`).

mod filters;
#[cfg(test)]
mod tests;

use glam::UVec2;
use lanternfish_gpu::{Bindings, Feature, Frame, SharedStruct, gpu_struct};
use lanternfish_scene::named_enum;

use self::filters::{Filters, RatioFilter, ratios_target};
use super::{DirectLight, DirectPasses, DirectTechnique, SHADOW_RAYS};
use crate::{
    context::ViewContext,
    denoise::{Counters, layers::layers_target},
    error::RenderError,
    gpu_scene::Parts,
    parameters,
    prepass::{PLACES_FORMAT, Surface, ViewMotion},
    rays::{self, SceneKernel, Tracer},
    settings::{History, Settings},
    shaders::{Root, Shaders},
    technique::{Parameter, Range, Technique},
    texture::{frame_layers, size_of_view},
};

/// Emissive triangles are sampled too.
pub(crate) const EMISSION: Feature = Feature::new("emission");
/// Pixels remember which emitters they saw.
const REMEMBERED: Feature = Feature::new("remembered");
/// Ratios are found along surfaces in motion.
const REPROJECTED: Feature = Feature::new("reprojected");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::computed("direct_light/sampled/trace", variants),
        Root::of("direct_light/sampled/ratio_filter", &[&[&[], &[REPROJECTED]]]),
    ],
    &[SharedStruct::of::<DirectSampling>(), SharedStruct::of::<RatioFilter>()],
);

gpu_struct! {
    /// Parameters of sampled direct light.
    pub struct DirectSampling {
        /// Shadow rays a pixel at most.
        light_samples: u32,
        /// Candidates that a pixel draws at most, from trees that are not whole in its tile's list.
        candidates: u32,
        /// Index of the frame in the sequences of a pixel's random numbers.
        frame: u32,
        /// 1: there is a memory of the previous frame.
        remembers: u32,
        /// 1: the view has not moved since then.
        rests: u32,
        /// Roughness below which surfaces have glossy rays, in the division of emission between direct light, which
        /// samples it, and rays of indirect light; below 0: it is not divided.
        emission_roughness: f32,
        /// Size of the previous frame, pixels.
        size_before: UVec2,
    }
}

named_enum! {
    /// Shadow rays a pixel.
    #[derive(Default)]
    LightSamples {
        /// One.
        One = "1": "Fastest, most noise",
        /// Two.
        Two = "2": "Less noise",
        /// Four.
        #[default]
        Four = "4": "A good balance",
        /// Eight.
        Eight = "8": "Least noise",
    }
}

impl LightSamples {
    /// The number of rays.
    pub const fn count(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }
}

named_enum! {
    /// Filter of noisy direct light.
    #[derive(Default)]
    Denoise {
        /// The mean of frames is unbiased.
        Off = "off": "No filter: for the mean of many frames",
        /// An edge-stopping filter of visibility, which fades as frames are averaged, and with `history on` temporal
        /// accumulation.
        #[default]
        On = "on": "Filters visibility along surfaces, and over frames with `history on`",
    }
}

parameters! {
    /// Direct light from a fixed number of shadow rays a pixel.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct SampledLights {
        /// Shadow rays a pixel, for any number of lights. More: less noise, slower.
        light_samples: LightSamples = LightSamples::Four, "light-samples" "N" Range::Numbers;
        /// Filter of noisy direct light.
        denoise: Denoise = Denoise::On, "denoise" "ON|OFF" Range::Names;
    }
}

/// Drawn candidates for each ray. More: fewer rays to lights that contribute little, slower.
const CANDIDATES_A_RAY: u32 = 4;
/// Least and greatest number of drawn candidates.
const CANDIDATES: [u32; 2] = [8, 32];

impl Technique for SampledLights {
    const NAME: &'static str = "sampled";
    const SUMMARY: &'static str = "A fixed number of shadow rays a pixel, to lights drawn from a tree";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl DirectTechnique for SampledLights {
    fn parts(&self, settings: &Settings) -> Parts {
        if samples_emission(settings) || settings.shares_emission().is_some() {
            Parts::HITS
        } else {
            Parts::LIGHT_TREES
        }
    }

    fn samples_emission(&self) -> bool {
        true
    }

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn DirectPasses>, RenderError> {
        Ok(Box::new(SampledPasses::new(device, *self, settings, tracer)?))
    }
}

/// True if all of the light of emissive triangles is sampled: unless indirect light brings it.
fn samples_emission(settings: &Settings) -> bool {
    !settings.indirect.brings_emission()
}

/// Features of the pass that samples lights.
fn features(settings: &Settings, tracer: Option<Tracer>) -> Vec<Feature> {
    let mut features: Vec<Feature> = samples_emission(settings).then_some(EMISSION).into_iter().collect();
    if let Some(tracer) = tracer {
        features.push(SHADOW_RAYS);
        features.extend(tracer.exact().features(&settings.structure, true));
    }
    features
}

fn variants() -> Vec<Vec<Feature>> {
    let rays = rays::exact_in_scenes().into_iter().map(|tracer| [&[SHADOW_RAYS], &tracer[..]].concat());
    let shadows: Vec<Vec<Feature>> = std::iter::once(Vec::new()).chain(rays).collect();
    let memories: [&[Feature]; 2] = [&[], &[REMEMBERED]];
    let memories = memories.iter().flat_map(|memory| [memory.to_vec(), [&[EMISSION], *memory].concat()]);
    memories.flat_map(|of| shadows.iter().map(move |shadows| [&of[..], shadows].concat()).collect::<Vec<_>>()).collect()
}

/// The passes.
#[derive(Debug)]
pub(super) struct SampledPasses {
    technique: SampledLights,
    /// Least number of frames over which an image is averaged.
    frames: u32,
    trace: SceneKernel,
    casts_shadows: bool,
    emission_roughness: f32,
    filters: Option<Filters>,
}

impl SampledPasses {
    /// Compiles the passes.
    pub fn new(
        device: &wgpu::Device,
        technique: SampledLights,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Self, RenderError> {
        let is_filtered = technique.denoise == Denoise::On;
        let has_history = settings.history == History::On;
        let mut features = features(settings, tracer);
        features.extend(settings.shares_emission().map(|_| EMISSION));
        features.extend(is_filtered.then_some(REMEMBERED));
        let (module, label) = ("direct_light/sampled/trace", "direct_light/trace");
        Ok(Self {
            technique,
            frames: settings.image.accumulate,
            trace: SceneKernel::new(device, DECLARED, module, &features, "trace", label)?,
            casts_shadows: tracer.is_some(),
            emission_roughness: settings.shares_emission().unwrap_or(-1.0),
            filters: is_filtered.then(|| Filters::new(device, has_history)).transpose()?,
        })
    }

    fn samples(&self, view: &ViewContext<'_>) -> DirectSampling {
        let light_samples = self.technique.light_samples.count();
        let [least, most] = CANDIDATES;
        DirectSampling {
            light_samples,
            candidates: (CANDIDATES_A_RAY * light_samples).clamp(least, most),
            frame: view.view.random_index,
            remembers: 0,
            rests: 0,
            emission_roughness: self.emission_roughness,
            size_before: UVec2::ONE,
        }
    }
}

impl DirectPasses for SampledPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DirectLight, RenderError> {
        let ViewContext { scene, buffer, .. } = view;
        let mut samples = self.samples(view);
        let left = self.filters.as_mut().map(|filters| filters.follow(frame, view, surface)).transpose()?;
        if let Some((left, is_next)) = &left {
            let places = surface.motion.as_ref().and_then(|motion| motion.places.as_ref());
            let rests = view.view.frame_index > 0;
            samples.remembers = u32::from(*is_next && (rests || places.is_some()));
            samples.rests = u32::from(rests);
            samples.size_before = size_of_view(&left.memory.before);
        }
        let samples = frame.uniform(&samples);
        let (unshadowed, found) = (layers_target(frame, surface.size), ratios_target(frame, surface.size));
        let counters = Counters::new(frame, "direct_light/counters", 1, &["shadows/rays", "direct_light/listed"])?;
        // Where no motion is known, this is bound, and not read: surfaces of every kind share a pipeline.
        let formats = [PLACES_FORMAT, PLACES_FORMAT, wgpu::TextureFormat::Rgba16Float];
        let unread = formats.map(|format| frame_layers(frame, "direct_light/unread", UVec2::ONE, format, 1));
        let still = frame.uniform(&ViewMotion::default());
        let bindings = Bindings::new().texture("kept_places", &unread[0]).texture("places_to_keep", &unread[1]);
        let bindings = bindings.texture("motion_texture", &unread[2]).part("view_motion", &still);
        let bindings = bindings.with(&buffer.bindings()).with(&scene.bindings()).with(&surface.bindings());
        let mut bindings = bindings
            .part("direct_sampling", &samples)
            .texture("filtered", &unshadowed)
            .texture("light_ratios", &found)
            .buffer("direct_counters", counters.buffer());
        if let Some((left, _)) = &left {
            bindings = bindings
                .texture("kept_visibility", &left.memory.before)
                .texture("visibility_to_keep", &left.memory.now);
        }
        if let Some(places) = surface.motion.as_ref().and_then(|motion| motion.places.as_ref()) {
            bindings = bindings.texture("kept_places", &places.before).texture("places_to_keep", &places.now);
        }
        let groups = [surface.size.x.div_ceil(8), surface.size.y.div_ceil(8), 1];
        if self.casts_shadows {
            self.trace.prepare(frame.device, scene)?;
        }
        frame.dispatch(self.trace.of(scene), &bindings, groups);
        let ratios = match (&self.filters, &left) {
            (Some(filters), Some((left, is_next))) => {
                let frames = self.frames.max(view.view.frame_index.saturating_add(1));
                filters.record(frame, view, surface, (left, *is_next), frames, [&unshadowed, &found])
            }
            _ => found,
        };
        Ok(DirectLight { unshadowed, ratios, counters })
    }
}
