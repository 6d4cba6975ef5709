//! Ray queries: several acceleration structures behind one interface, `tracer.wesl`.
//!
//! - `any_hit`: is a segment occluded? Shadows and rays to lights use it.
//! - `closest_hit`: the first triangle that a ray from a surface hits. Indirect light uses it.
//! - `first_distance`: the distance to a ray's first hit, for lists of rays in tests and benches ([`RayTracer`]).
//!
//! Each tracer is a folder: its `tracer.wesl` implements the queries, its `mod.rs` describes it (`TracerInfo`). The
//! host selects one at link time ([`Tracer::features`]). A pass with rays is a `TracePass`, which binds what its tracer
//! reads.

mod bvh;
mod list;
mod ray_query;
mod scene_kernel;
mod structure;
#[cfg(test)]
pub(crate) mod tests;
mod trace_pass;
mod two_level;

use std::{
    fmt,
    hash::{Hash, Hasher},
    sync::{PoisonError, RwLock},
};

use lanternfish_gpu::{Feature, SharedStruct};
use lanternfish_scene::named_type_impls;

pub use self::{
    list::{RayTracer, TracedRay},
    scene_kernel::SceneKernel,
    structure::{KeptStructure, Structure, StructureTechnique, Structures, TracedStructure},
    trace_pass::TracePass,
};
use crate::{
    error::RenderError,
    gpu_scene::{PANES, Parts},
    shaders::{Root, Shaders},
    technique::AnyTechnique,
};

/// Description of a tracer: its name, its shaders and the parts of a scene that it reads.
#[derive(Debug)]
pub struct TracerInfo {
    /// Name in flags.
    pub name: &'static str,
    /// One line of help.
    pub words: &'static str,
    /// Selects the module that implements the queries of `tracer.wesl`: `package::chosen::tracer`.
    pub feature: Feature,
    /// Parts of a scene that it reads.
    pub parts: Parts,
    /// Features of the device that it requires.
    pub needs: wgpu::Features,
    /// Default of the structure that it traverses beside the scene's own; none: it needs no such structure.
    pub structure: Option<fn() -> Structure>,
}

/// What rays are traced through. Tracers with the same name are equal.
#[derive(Clone, Copy)]
pub struct Tracer(&'static TracerInfo);

/// The library's own tracers: `techniques.rs` names them.
pub(crate) trait OwnTracers {
    /// In the order in which help lists them.
    fn own() -> Vec<Tracer>;
}

/// Tracers registered by [`Tracer::register`].
static REGISTERED: RwLock<Vec<Tracer>> = RwLock::new(Vec::new());

impl PartialEq for Tracer {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Tracer {}

impl Hash for Tracer {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name().hash(state);
    }
}

impl fmt::Debug for Tracer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

named_type_impls!(Tracer);

/// The tracer that rays use: a named one, or the adapter's fastest exact one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TracerChoice {
    /// [`Tracer::automatic`] for the renderer's device, as [`crate::settings::Shadows::Auto`].
    #[default]
    Auto,
    /// This one.
    Fixed(Tracer),
}

impl TracerChoice {
    /// All choices, in the order in which help lists them.
    #[doc(hidden)]
    pub fn all() -> Vec<Self> {
        std::iter::once(Self::Auto).chain(Tracer::all().into_iter().map(Self::Fixed)).collect()
    }

    /// The name that [`FromStr`](std::str::FromStr) reads.
    #[doc(hidden)]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Fixed(tracer) => tracer.name(),
        }
    }

    /// One line of help.
    #[doc(hidden)]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Auto => "The fastest exact tracer of this adapter",
            Self::Fixed(tracer) => tracer.words(),
        }
    }

    /// The tracer. A renderer replaces `Auto` by its device's tracer when it is built; without a device `Auto` is the
    /// BVH.
    #[doc(hidden)]
    pub const fn fixed(self) -> Tracer {
        match self {
            Self::Auto => Tracer::BVH,
            Self::Fixed(tracer) => tracer,
        }
    }

    /// Replaces `Auto` by the device's tracer.
    #[doc(hidden)]
    pub fn resolve(&mut self, automatic: Tracer) {
        if *self == Self::Auto {
            *self = Self::Fixed(automatic);
        }
    }
}

named_type_impls!(TracerChoice);

impl From<Tracer> for TracerChoice {
    fn from(tracer: Tracer) -> Self {
        Self::Fixed(tracer)
    }
}

/// The tracer answers in parts: one pass for each part of its structure.
pub const IN_CHUNKS: Feature = Feature::new("in_chunks");

/// Ids of hits may name a triangle of an instance (`gpu_scene/placed.wesl`).
pub(crate) const IN_LEVELS: Feature = Feature::new("in_levels");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders =
    Shaders::new(&[Root::computed("rays/list", || every_tracer(false))], &[SharedStruct::of::<TracedRay>()]);

/// The features of every tracer, with triangles if `with_triangles`: for shaders that use any of them.
pub fn every_tracer(with_triangles: bool) -> Vec<Vec<Feature>> {
    Tracer::all().iter().flat_map(|tracer| tracer.every_features(with_triangles)).collect()
}

/// The features of the exact tracers.
pub fn exact_tracers() -> Vec<Vec<Feature>> {
    Tracer::all().iter().filter(|tracer| tracer.is_exact()).map(|tracer| vec![tracer.0.feature]).collect()
}

/// The features of the exact tracers, for scenes without panes and with.
pub(crate) fn exact_in_scenes() -> Vec<Vec<Feature>> {
    exact_tracers().into_iter().flat_map(|tracer| [[&tracer[..], &[PANES]].concat(), tracer]).collect()
}

impl Tracer {
    /// A bounding volume hierarchy in compute: exact, on any adapter.
    pub const BVH: Self = Self::new(&bvh::INFO);
    /// The adapter's own acceleration structure: exact, and fast where it is hardware.
    pub const RAY_QUERY: Self = Self::new(&ray_query::INFO);

    /// A tree over instances, and one of each mesh, in compute: exact, with little memory for scenes of many copies. A
    /// scene has its triangles in one level or in two, so the techniques of one image use no other tracer beside it.
    pub const TWO_LEVEL: Self = Self::new(&two_level::INFO);

    /// A tracer.
    #[doc(hidden)]
    pub const fn new(info: &'static TracerInfo) -> Self {
        Self(info)
    }

    /// All registered tracers, in the order in which help lists them.
    #[doc(hidden)]
    pub fn all() -> Vec<Self> {
        let registered = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
        Self::own().into_iter().chain(registered.iter().copied()).collect()
    }

    /// Those that find a scene's triangles in one level, so that they can share an upload.
    #[doc(hidden)]
    pub fn in_one_level() -> Vec<Self> {
        Self::all().into_iter().filter(|tracer| !tracer.parts().instances).collect()
    }

    /// Registers the tracer: [`Self::all`] lists it from then on.
    ///
    /// Panics if another tracer has the name, which is a bug.
    #[doc(hidden)]
    pub fn register(self) {
        assert!(!Self::all().contains(&self), "two tracers are called {}", self.name());
        REGISTERED.write().unwrap_or_else(PoisonError::into_inner).push(self);
    }

    /// The name that [`FromStr`](std::str::FromStr) reads.
    #[doc(hidden)]
    pub const fn name(self) -> &'static str {
        self.0.name
    }

    /// One line of help.
    #[doc(hidden)]
    pub const fn words(self) -> &'static str {
        self.0.words
    }

    /// Selects its shaders.
    pub(crate) const fn feature(self) -> Feature {
        self.0.feature
    }

    /// True if it intersects the scene itself, not a structure that approximates it.
    #[doc(hidden)]
    pub const fn is_exact(self) -> bool {
        self.0.structure.is_none()
    }

    /// The structure that it traverses beside the scene: the chosen one if that is of the tracer's kind, else its
    /// default; none if it needs none.
    #[doc(hidden)]
    pub fn structure(self, chosen: &Structure) -> Structure {
        let name = |structure: &Structure| structure.technique().map(AnyTechnique::name);
        let default = self.0.structure.map_or(Structure::NONE, |default| default());
        if name(chosen) == name(&default) { chosen.clone() } else { default }
    }

    /// The features that link shaders with it and with the chosen structure. `with_triangles`: shaders also query which
    /// triangle a ray hits.
    #[doc(hidden)]
    pub fn features(self, chosen: &Structure, with_triangles: bool) -> Vec<Feature> {
        let structure = self.structure(chosen);
        let features = structure.technique().map(|structure| structure.features(with_triangles));
        features.unwrap_or_default().into_iter().chain([self.0.feature]).collect()
    }

    /// The same features for structures of every kind.
    fn every_features(self, with_triangles: bool) -> Vec<Vec<Feature>> {
        let structure = self.structure(&Structure::NONE);
        let all = structure.technique().map_or(vec![Vec::new()], |structure| structure.every_features(with_triangles));
        all.into_iter().map(|features| [features, vec![self.0.feature]].concat()).collect()
    }

    /// The fastest exact tracer for a kind of adapter with these features; shadows and indirect light use it unless one
    /// is named.
    ///
    /// On hardware with ray queries it is the ray query. A software adapter's ray query is slower than the BVH in
    /// compute: on Mesa 25.0.7, 0.24 to 0.47 million rays per second and core, the BVH 1.1 to 3.1.
    #[doc(hidden)]
    pub fn automatic(kind: wgpu::DeviceType, features: wgpu::Features) -> Self {
        let has_ray_query = features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY);
        if has_ray_query && kind != wgpu::DeviceType::Cpu { Self::RAY_QUERY } else { Self::BVH }
    }

    /// Features of shaders that look up its hits.
    pub(crate) fn features_of_ids(self) -> &'static [Feature] {
        if self.parts().instances { &[IN_LEVELS] } else { &[] }
    }

    /// Parts of a scene that it reads.
    #[doc(hidden)]
    pub const fn parts(self) -> Parts {
        self.0.parts
    }

    /// True if it reports the triangle that a ray hits, through the chosen structure.
    #[doc(hidden)]
    pub fn finds_triangles(self, chosen: &Structure) -> bool {
        self.structure(chosen).technique().is_none_or(|structure| structure.finds_triangles())
    }

    /// Number of frames after a change of the scene until it traces no outdated structure.
    #[doc(hidden)]
    pub fn update_frames(self, chosen: &Structure) -> u32 {
        self.structure(chosen).technique().map_or(1, |structure| structure.update_frames())
    }

    /// The exact tracer for rays that do not use structures: from transparent surfaces, from samples of a pixel, from
    /// hit points of other rays.
    #[doc(hidden)]
    pub fn exact(self) -> Self {
        if self.is_exact() { self } else { Self::BVH }
    }

    /// True if the device supports it.
    #[doc(hidden)]
    pub fn is_supported(self, device: &wgpu::Device) -> bool {
        device.features().contains(self.0.needs)
    }

    /// An error if the device does not support it. `setting`: the setting that requires it; `instead`: the alternative.
    #[doc(hidden)]
    pub fn check(
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
