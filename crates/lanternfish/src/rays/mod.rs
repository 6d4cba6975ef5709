//! What rays hit: several structures behind the questions of `tracer.wesl`.
//!
//! - `any_hit`: is a segment closed? Requested by shadows, and by rays to lights.
//! - `closest_hit`: which triangle does a ray from a surface meet first? Requested by indirect light.
//! - `first_distance`: how far does a ray go? Requested of lists of rays, by tests and benches ([`RayTracer`]).
//!
//! A tracer is a folder: its `tracer.wesl` answers, its `mod.rs` says what it is (`TracerInfo`). The host chooses one when it links
//! ([`Tracer::features`]). A pass with rays is a `TracePass`, which binds what its tracer reads.

mod bvh;
mod list;
mod ray_query;
mod structure;
#[cfg(test)]
mod tests;
mod trace_pass;

use std::{
    fmt,
    hash::{Hash, Hasher},
    sync::{PoisonError, RwLock},
};

use lanternfish_gpu::{Feature, SharedStruct};
use lanternfish_scene::named_type_impls;

pub use self::{
    list::{RayTracer, TracedRay},
    structure::{KeptStructure, Structure, StructureTechnique, TracedStructure},
    trace_pass::TracePass,
};
use crate::{
    error::RenderError,
    gpu_scene::Parts,
    shaders::{Root, Shaders},
    technique::AnyTechnique,
};

/// What a tracer is: its name, its shaders and what it reads.
#[derive(Debug)]
pub struct TracerInfo {
    /// What flags call it.
    pub name: &'static str,
    /// One line of help.
    pub words: &'static str,
    /// Chooses the module that answers the questions of `tracer.wesl`: `package::chosen::tracer`.
    pub feature: Feature,
    /// What it reads of a scene.
    pub parts: Parts,
    /// Features of the device that it needs.
    pub needs: wgpu::Features,
    /// The structure that it goes through beside the scene itself, with default parameters.
    pub structure: Option<fn() -> Structure>,
}

/// What rays are traced through. Two tracers are the same if their names are.
#[derive(Clone, Copy)]
pub struct Tracer(&'static TracerInfo);

/// The library's own tracers: `techniques.rs` names them.
pub(crate) trait OwnTracers {
    /// In the order in which help lists them.
    fn own() -> Vec<Tracer>;
}

/// Tracers that [`Tracer::register`] has made known by name.
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
    pub fn all() -> Vec<Self> {
        std::iter::once(Self::Auto).chain(Tracer::all().into_iter().map(Self::Fixed)).collect()
    }

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
            Self::Auto => "The fastest exact tracer of this adapter",
            Self::Fixed(tracer) => tracer.words(),
        }
    }

    /// The tracer. A renderer that is built puts its device's tracer in the place of `Auto`; where no device was asked it is the BVH.
    pub const fn fixed(self) -> Tracer {
        match self {
            Self::Auto => Tracer::BVH,
            Self::Fixed(tracer) => tracer,
        }
    }

    /// Replaces `Auto` by the device's tracer.
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

/// The answers come in parts, one for each part of a structure.
pub const IN_CHUNKS: Feature = Feature::new("in_chunks");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders =
    Shaders::new(&[Root::computed("rays/list", || every_tracer(false))], &[SharedStruct::of::<TracedRay>()]);

/// The features of every tracer, with triangles where `with_triangles` says so: for shaders that ask any of them.
pub fn every_tracer(with_triangles: bool) -> Vec<Vec<Feature>> {
    Tracer::all().iter().flat_map(|tracer| tracer.every_features(with_triangles)).collect()
}

/// The features of the exact tracers.
pub fn exact_tracers() -> Vec<Vec<Feature>> {
    Tracer::all().iter().filter(|tracer| tracer.is_exact()).map(|tracer| vec![tracer.0.feature]).collect()
}

impl Tracer {
    /// A bounding volume hierarchy in compute: exact, on any adapter.
    pub const BVH: Self = Self::new(&bvh::INFO);
    /// The adapter's own acceleration structure: exact, and fast where it is hardware.
    pub const RAY_QUERY: Self = Self::new(&ray_query::INFO);

    /// A tracer.
    pub const fn new(info: &'static TracerInfo) -> Self {
        Self(info)
    }

    /// Every tracer that is known by name, in the order in which help lists them.
    pub fn all() -> Vec<Self> {
        let registered = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
        Self::own().into_iter().chain(registered.iter().copied()).collect()
    }

    /// Makes it known by name: [`Self::all`] has it from now on.
    ///
    /// Panics where another tracer has the name: a bug.
    pub fn register(self) {
        assert!(!Self::all().contains(&self), "two tracers are called {}", self.name());
        REGISTERED.write().unwrap_or_else(PoisonError::into_inner).push(self);
    }

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        self.0.name
    }

    /// What it is, in a line.
    pub const fn words(self) -> &'static str {
        self.0.words
    }

    /// Chooses its shaders.
    pub(crate) const fn feature(self) -> Feature {
        self.0.feature
    }

    /// Whether it goes through the scene itself, and not through a structure that stands for it.
    pub const fn is_exact(self) -> bool {
        self.0.structure.is_none()
    }

    /// What it goes through beside the scene itself: what the settings choose, where that is a structure of its kind, else its default; none
    /// where it needs nothing.
    pub fn structure(self, chosen: &Structure) -> Structure {
        let name = |structure: &Structure| structure.technique().map(AnyTechnique::name);
        let usual = self.0.structure.map_or(Structure::NONE, |usual| usual());
        if name(chosen) == name(&usual) { chosen.clone() } else { usual }
    }

    /// The features that make shaders ask it, through the structure that the settings choose. `with_triangles`: which triangle a ray hits is
    /// asked, too.
    pub fn features(self, chosen: &Structure, with_triangles: bool) -> Vec<Feature> {
        let structure = self.structure(chosen);
        let features = structure.technique().map(|structure| structure.features(with_triangles));
        features.unwrap_or_default().into_iter().chain([self.0.feature]).collect()
    }

    /// Those features through structures of every kind.
    fn every_features(self, with_triangles: bool) -> Vec<Vec<Feature>> {
        let structure = self.structure(&Structure::NONE);
        let all = structure.technique().map_or(vec![Vec::new()], |structure| structure.every_features(with_triangles));
        all.into_iter().map(|features| [features, vec![self.0.feature]].concat()).collect()
    }

    /// The fastest exact tracer of a kind of adapter with these features: shadows and indirect light take it where none is named.
    ///
    /// Ray queries on hardware that has them. A software adapter's ray query is slower than the BVH in compute: 0.24 to 0.47 million rays
    /// a second and core on Mesa 25.0.7, the BVH 1.1 to 3.1.
    pub fn automatic(kind: wgpu::DeviceType, features: wgpu::Features) -> Self {
        let has_ray_query = features.contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY);
        if has_ray_query && kind != wgpu::DeviceType::Cpu { Self::RAY_QUERY } else { Self::BVH }
    }

    /// What it reads of a scene.
    pub const fn parts(self) -> Parts {
        self.0.parts
    }

    /// True if it finds the triangle that a ray hits, through the structure that the settings choose.
    pub fn finds_triangles(self, chosen: &Structure) -> bool {
        self.structure(chosen).technique().is_none_or(|structure| structure.finds_triangles())
    }

    /// Frames after a change of the scene until it traces through nothing older.
    pub fn update_frames(self, chosen: &Structure) -> u32 {
        self.structure(chosen).technique().map_or(1, |structure| structure.update_frames())
    }

    /// What traces rays from where structures are not asked: from blended surfaces, samples of a pixel, ends of other rays.
    pub fn exact(self) -> Self {
        if self.is_exact() { self } else { Self::BVH }
    }

    /// True if the device has what it needs.
    pub fn is_supported(self, device: &wgpu::Device) -> bool {
        device.features().contains(self.0.needs)
    }

    /// An error where the device does not have it. `setting`: what asks for it; `instead`: what to ask for.
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
