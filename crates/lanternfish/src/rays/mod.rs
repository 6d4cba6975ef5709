//! What rays meet: several structures behind the questions of `tracer.wesl`.
//!
//! - `any_hit`: is a segment closed? Asked by shadows, and by rays to lights.
//! - `closest_hit`: which triangle does a ray from a surface meet first? Asked by indirect light.
//! - `first_distance`: how far does a ray go? Asked of lists of rays, by tests and benches ([`RayTracer`]).
//!
//! A structure is a folder here: its `tracer.wesl` answers, its `mod.rs` says what it is (`TracerInfo`). The host chooses one when it links
//! ([`Tracer::features`]). A pass with rays is a `TracePass`, which binds what its tracer reads.

mod list;
mod trace_pass;

use lanternfish_gpu::{Feature, SharedStruct};
use lanternfish_scene::named_enum_impls;

pub use self::list::{RayTracer, TracedRay};
pub(crate) use self::trace_pass::TracePass;
use crate::{
    deep_images::settings::DeepImageSettings,
    error::RenderError,
    gpu_scene::Parts,
    shaders::{Root, Shaders},
};

/// What a tracer says of itself.
#[derive(Debug)]
pub(crate) struct TracerInfo {
    /// What flags call it.
    pub name: &'static str,
    /// One line of help.
    pub words: &'static str,
    /// Makes shaders ask it: `tracer.wesl` has a line for it.
    pub feature: Feature,
    /// What it reads of a scene.
    pub structure: Structure,
}

/// What a tracer reads of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Structure {
    /// The BVH, or its triangles.
    Bvh,
    /// The adapter's own acceleration structure.
    RayQuery,
    /// Deep images, and the BVH's triangles.
    DeepImages,
}

/// Declares the tracers, one line each: a variant, the folder that has its [`TracerInfo`], and the variant's documentation.
macro_rules! tracers {
    ($(#[$meta:meta])* $name:ident { $($(#[$attribute:meta])* $variant:ident($folder:ident): $doc:literal),+ $(,)? }) => {
        $($(#[$attribute])* mod $folder;)+

        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$attribute])* #[doc = $doc] $variant),+
        }

        impl $name {
            /// Every tracer, in the order in which help lists them.
            pub const ALL: &[Self] = &[$($(#[$attribute])* Self::$variant),+];

            pub(crate) const fn info(self) -> &'static TracerInfo {
                match self { $($(#[$attribute])* Self::$variant => &$folder::INFO),+ }
            }
        }
    };
}

tracers! {
    /// What rays are traced through.
    Tracer {
        Bvh(bvh): "A bounding volume hierarchy in compute: exact, on any adapter.",
        RayQuery(ray_query): "The adapter's own acceleration structure: exact, and fast where it is hardware.",
        WithinTexel(within_texel): "The texel of a deep image that the ray starts in, along the image's axis [Archer2019, §3.2].",
        AcrossTexels(across_texels): "Every texel of that image that the ray crosses [Niessner2010, §3.2].",
    }
}

named_enum_impls!(Tracer);

/// Which tracer rays go through: one that is named, or the adapter's fastest exact one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TracerChoice {
    /// [`Tracer::automatic`] of the renderer's device: the one that [`crate::settings::Shadows::Auto`] takes.
    #[default]
    Auto,
    /// This one.
    Fixed(Tracer),
}

impl TracerChoice {
    /// Every one, in the order in which help lists them.
    pub const ALL: &[Self] = &{
        let mut all = [Self::Auto; 1 + Tracer::ALL.len()];
        let mut i = 0;
        while i < Tracer::ALL.len() {
            all[1 + i] = Self::Fixed(Tracer::ALL[i]);
            i += 1;
        }
        all
    };

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Fixed(tracer) => tracer.name(),
        }
    }

    /// What it is, in a line of help.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Auto => "The fastest exact one of this adapter",
            Self::Fixed(tracer) => tracer.words(),
        }
    }

    /// The tracer. A renderer that is built puts its device's tracer in the place of `Auto`; where no device was asked it is the BVH.
    pub const fn fixed(self) -> Tracer {
        match self {
            Self::Auto => Tracer::Bvh,
            Self::Fixed(tracer) => tracer,
        }
    }

    /// Replaces `Auto` by the device's tracer.
    pub(crate) fn resolve(&mut self, automatic: Tracer) {
        if *self == Self::Auto {
            *self = Self::Fixed(automatic);
        }
    }
}

named_enum_impls!(TracerChoice);

impl From<Tracer> for TracerChoice {
    fn from(tracer: Tracer) -> Self {
        Self::Fixed(tracer)
    }
}

/// The answers come in parts, one for each chunk of deep images.
pub(crate) const IN_CHUNKS: Feature = Feature::new("in_chunks");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders =
    Shaders::new(&[Root::computed("rays/list", || every_tracer(false))], &[SharedStruct::of::<TracedRay>()]);

/// The features of every tracer, through deep images of every kind that have triangles or have none: for shaders that ask any of them.
pub(crate) fn every_tracer(with_triangles: bool) -> Vec<Vec<Feature>> {
    Tracer::ALL.iter().flat_map(|tracer| tracer.every_features(with_triangles)).collect()
}

/// The features of the tracers that need no deep images.
pub(crate) fn exact_tracers() -> Vec<Vec<Feature>> {
    let exact = Tracer::ALL.iter().filter(|tracer| !tracer.uses_deep_images());
    exact.map(|tracer| vec![tracer.info().feature]).collect()
}

impl Tracer {
    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        self.info().name
    }

    /// What it is, in a line.
    pub const fn words(self) -> &'static str {
        self.info().words
    }

    /// The features that make shaders ask it; `images`: what deep images are read, where it goes through those.
    pub fn features(self, images: &DeepImageSettings) -> Vec<Feature> {
        let mut features = if self.uses_deep_images() { images.fragment_features() } else { Vec::new() };
        features.extend(self.uses_deep_images().then_some(IN_CHUNKS));
        features.push(self.info().feature);
        features
    }

    /// Those features through deep images of every kind.
    fn every_features(self, with_triangles: bool) -> Vec<Vec<Feature>> {
        if !self.uses_deep_images() {
            return vec![self.features(&DeepImageSettings::default())];
        }
        DeepImageSettings::every_kind(with_triangles).iter().map(|images| self.features(images)).collect()
    }

    /// The fastest exact tracer of a kind of adapter with these features: shadows and indirect light take it where none is named.
    ///
    /// Ray queries on hardware that has them. A software adapter's ray query is slower than the BVH in compute: 0.24 to 0.47 million rays
    /// a second and core on Mesa 25.0.7, the BVH 1.1 to 3.1.
    pub fn automatic(kind: wgpu::DeviceType, features: wgpu::Features) -> Self {
        let has_ray_query = features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY);
        if has_ray_query && kind != wgpu::DeviceType::Cpu { Self::RayQuery } else { Self::Bvh }
    }

    /// What it reads of a scene.
    pub(crate) const fn parts(self) -> Parts {
        match self.info().structure {
            Structure::Bvh => Parts::BVH,
            Structure::RayQuery => Parts::RAY_QUERY,
            Structure::DeepImages => Parts::DEEP_IMAGES,
        }
    }

    /// Whether it goes through deep images.
    pub fn uses_deep_images(self) -> bool {
        self.info().structure == Structure::DeepImages
    }

    /// Whether it finds the triangle that a ray hits: through deep images of these settings, where it goes through those.
    pub(crate) fn finds_triangles(self, images: &DeepImageSettings) -> bool {
        !self.uses_deep_images() || images.payload
    }

    /// Frames after a change of the scene until it traces through nothing older: several for deep images that are built in slices.
    pub(crate) fn update_frames(self, images: &DeepImageSettings) -> u32 {
        if self.uses_deep_images() { images.slices.max(1) } else { 1 }
    }

    /// What traces rays from where deep images are not asked: from blended surfaces, samples of a pixel, ends of other rays.
    pub fn exact(self) -> Self {
        if self.uses_deep_images() { Self::Bvh } else { self }
    }

    /// Whether the device has what it needs.
    pub fn is_supported(self, device: &wgpu::Device) -> bool {
        self.info().structure != Structure::RayQuery
            || device.features().contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY)
    }

    /// An error where the device does not have it. `setting`: what asks for it; `instead`: what to ask for.
    pub(crate) fn check(
        self,
        device: &wgpu::Device,
        setting: &'static str,
        instead: &'static str,
    ) -> Result<Self, RenderError> {
        if self.is_supported(device) {
            return Ok(self);
        }
        Err(RenderError::MissingFeature { setting, feature: "ray queries", instead })
    }
}

#[cfg(test)]
mod tests {
    use wgpu::{DeviceType, Features};

    use super::*;

    #[test]
    fn the_automatic_tracer_is_decided_by_the_kind_of_adapter_and_can_be_overridden() {
        let ray_query = Features::EXPERIMENTAL_RAY_QUERY;
        for (kind, features, expected) in [
            (DeviceType::DiscreteGpu, ray_query, Tracer::RayQuery),
            (DeviceType::IntegratedGpu, ray_query, Tracer::RayQuery),
            (DeviceType::DiscreteGpu, Features::empty(), Tracer::Bvh),
            (DeviceType::Cpu, ray_query, Tracer::Bvh),
        ] {
            assert_eq!(Tracer::automatic(kind, features), expected, "{kind:?}");
            let resolved = |mut choice: TracerChoice| {
                choice.resolve(expected);
                choice.fixed()
            };
            assert_eq!(resolved(TracerChoice::Auto), expected);
            assert_eq!(resolved(Tracer::WithinTexel.into()), Tracer::WithinTexel, "what is named is kept");
        }
        for choice in TracerChoice::ALL {
            assert_eq!(choice.name().parse(), Ok(*choice));
        }
    }
}
