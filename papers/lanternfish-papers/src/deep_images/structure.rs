//! Deep images as an acceleration structure for tracers.

use std::sync::Arc;

use glam::{Quat, Vec3};
use lanternfish::{
    RenderError,
    gpu_scene::GpuScene,
    rays::{IN_CHUNKS, KeptStructure, Structure, StructureTechnique, TracedRay, TracedStructure, Tracer},
    settings::Quality,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
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
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "deep-resolution",
            "N",
            Range::Count(4, 1024),
            "Texels across and down each deep image. More: finer, and more memory by the square. Without it: 64, or \
             the value of `quality`.",
            |images: &mut Self| &mut images.resolution,
        ),
        Parameter::new(
            "deep-directions",
            "SET",
            Range::Text,
            "Set of deep-image directions: zonal:N, stacks:AxB or cube:K. More: smoother, slower.\n\n\
             zonal: N of equal area each. stacks: A steps from the pole down, B around it. cube: K x K on each face. Each \
             direction also serves its opposite.",
            |images: &mut Self| &mut images.directions,
        )
        .with_default(),
        Parameter::new(
            "deep-slices",
            "N",
            Range::Count(1, 64),
            "Frames over which deep images are rebuilt after something moved, in a window and in replays. More: less \
             time per frame, and some directions lag by up to this many frames.",
            |images: &mut Self| &mut images.slices,
        )
        .with_default(),
        Parameter::new(
            "deep-builder",
            "NAME",
            Range::Names,
            "Builder of deep images. In windows and replays per_triangle stands for those that read counts on the host: the single passes and depth_peeling.\n\n\
             As in Archer 2019: `deep-directions stacks:13x13` `deep-resolution 64` `deep-builder single_pass_literal` \
             `deep-merge 0` `deep-sort blocks` `deep-search linear_steps`.",
            |images: &mut Self| &mut images.builder,
        )
        .with_default(),
        Parameter::new(
            "deep-sort",
            "NAME",
            Range::Names,
            "Sort of the lists of deep images. The image is the same.",
            |images: &mut Self| &mut images.sort,
        )
        .with_default(),
        Parameter::new(
            "deep-merge",
            "TEXELS",
            Range::Number(0.0, 1.0),
            "Distance below which fragments of a list are merged, texel widths; 0: none is. More: less memory, thin \
             walls get thinner.",
            |images: &mut Self| &mut images.merge_texels,
        )
        .with_default(),
        Parameter::new(
            "deep-search",
            "NAME",
            Range::Names,
            "Search in the lists of deep images. The image is the same.",
            |images: &mut Self| &mut images.search,
        )
        .with_default(),
        Parameter::new(
            "deep-store",
            "NAME",
            Range::Names,
            "Memory layout of the lists of deep images. Shadow rays need linear_array, and so do windows.",
            |images: &mut Self| &mut images.store,
        )
        .with_default(),
        Parameter::new(
            "deep-test",
            "on|off",
            Range::Switch("Triangles of near fragments are tested", "The first fragment is the hit, as in Aalund 2015"),
            "Tests of triangles for the closest hits of rays within a texel.",
            |images: &mut Self| &mut images.tests_triangles,
        )
        .with_default(),
        Parameter::new(
            "deep-tolerance",
            "TEXELS",
            Range::Number(0.0, 4.0),
            "Tolerance of rays across texels in depth. More: fewer rays slip through steep surfaces, more hit what they \
             pass.",
            |images: &mut Self| &mut images.tolerance,
        )
        .with_default(),
    ];
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
