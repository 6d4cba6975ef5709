//! Deep images as an acceleration structure for tracers.

use std::sync::Arc;

use glam::{Quat, Vec3};
use lanternfish::{
    RenderError,
    gpu_scene::GpuScene,
    rays::{IN_CHUNKS, KeptStructure, Structure, StructureTechnique, TracedRay, TracedStructure, Tracer},
    settings::Quality,
    shaders::Shaders,
    technique::{Parameter, Technique},
};
use lanternfish_gpu::{Bindings, Feature, Frame, Growth};

use super::{
    images::DeepImages,
    kept::KeptDeepImages,
    settings::{DeepImageSettings, DeepStore},
    shaders::DECLARED,
};
use crate::rays::{across_texels, within_texel};

/// Rays are traced through deep images.
const DEEP_IMAGES: Feature = Feature::new("deep_images");

/// Traces rays along the image's axis in the texel of the deep image in which they start [Archer2019, §3.2].
pub const WITHIN_TEXEL: Tracer = Tracer::new(&within_texel::INFO);
/// Traces rays through every texel of that image that they cross [Niessner2010, §3.2].
pub const ACROSS_TEXELS: Tracer = Tracer::new(&across_texels::INFO);

impl DeepImageSettings {
    /// The structure of these settings; none for the default, which tracers use then.
    pub fn chosen(self) -> Structure {
        if self == Self::default() { Structure::NONE } else { self.into() }
    }

    /// The settings for a quality preset.
    pub fn of_quality(quality: Quality) -> Self {
        let resolution = match quality {
            Quality::Draft => 64,
            Quality::Good | Quality::Best => 128,
        };
        Self { resolution, ..Self::default() }
    }

    /// The settings in `chosen`, or the default.
    pub fn of(chosen: &Structure) -> Self {
        chosen.get().copied().unwrap_or_default()
    }
}

impl Technique for DeepImageSettings {
    const NAME: &'static str = "deep-images";
    const SUMMARY: &'static str =
        "Images of every direction of a set, each texel a list of all surfaces along its axis";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl StructureTechnique for DeepImageSettings {
    fn features(&self, with_triangles: bool) -> Vec<Feature> {
        let images = Self { payload: self.payload && with_triangles, ..*self };
        images.fragment_features().into_iter().chain([DEEP_IMAGES, IN_CHUNKS]).collect()
    }

    fn every_features(&self, with_triangles: bool) -> Vec<Vec<Feature>> {
        Self::every_kind(with_triangles).iter().map(|images| images.features(with_triangles)).collect()
    }

    fn finds_triangles(&self) -> bool {
        self.payload
    }

    fn update_frames(&self) -> u32 {
        self.slices.max(1)
    }

    fn lacks_for_shadows(&self) -> Option<&'static str> {
        (self.store != DeepStore::LinearArray).then_some("the store linear_array")
    }

    fn build(&self, device: &wgpu::Device) -> Result<Box<dyn KeptStructure>, RenderError> {
        Ok(Box::new(KeptDeepImages::new(device, *self)?))
    }
}

impl KeptStructure for KeptDeepImages {
    fn get(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        rotation: Quat,
    ) -> Result<Arc<dyn TracedStructure>, RenderError> {
        let images: Arc<DeepImages> = self.get(frame, scene, rotation)?.clone();
        Ok(images)
    }

    fn builds(&self) -> u64 {
        self.builds()
    }

    fn age(&self) -> Option<(&'static str, u64)> {
        Some(("deep_images/age", self.age()?))
    }

    fn check_growth(&self, growth: Growth) -> Result<(), RenderError> {
        self.check_growth(growth)
    }
}

impl TracedStructure for DeepImages {
    fn distance_features(&self) -> Vec<Feature> {
        self.settings.features(false)
    }

    fn ray(&self, origin: Vec3, direction: Vec3, offset: f32) -> TracedRay {
        self.ray(origin, direction, offset)
    }

    fn for_each_part(&self, bindings: &Bindings<'_>, dispatch: &mut dyn FnMut(&Bindings<'_>)) {
        for chunk in &self.chunks {
            let of_chunk = chunk.bindings(&self.frames).with(&self.direction_bindings());
            dispatch(&bindings.clone().with(&of_chunk));
        }
    }
}

impl DeepImages {
    /// A ray along `direction` (unit), traced in the image of the set's nearest direction.
    pub fn ray(&self, origin: Vec3, direction: Vec3, offset: f32) -> TracedRay {
        let (image, is_reversed) = self.directions.nearest(direction);
        TracedRay::new(origin, direction, offset, image, is_reversed)
    }
}
