//! What rays meet: one structure behind two questions.
//!
//! - `any_hit.wesl`: is a segment closed? Asked by shadows, and by rays to lights.
//! - `closest_hit.wesl`: which triangle does a ray from a surface meet first? Asked by indirect light.
//!
//! The host says through which structure when it links ([`Tracer::features`]), and runs a pass once for each chunk where that is deep
//! images (`dispatch`). Lists of rays, for tests and benches, are traced by [`RayTracer`].

mod list;

use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, SharedStruct};

pub use self::list::{RayTracer, Structure, TracedRay};
use crate::{
    deep_images::{DEPTH_16, DeepImages, LINKED_LIST, SORTED_LINKED_LIST},
    error::RenderError,
    settings::DeepImageSettings,
    shaders::{Root, Shaders},
};

/// The adapter's own structure answers.
pub(crate) const TRACER_RAY_QUERY: Feature = Feature("tracer_ray_query");
/// The texel of a deep image that a ray starts in answers.
pub(crate) const TRACER_WITHIN_TEXEL: Feature = Feature("tracer_within_texel");
/// The texels of a deep image that a ray crosses answer.
pub(crate) const TRACER_ACROSS_TEXELS: Feature = Feature("tracer_across_texels");

/// The exact structures: the BVH, and the adapter's own.
pub(crate) const EXACT_TRACERS: &[&[Feature]] = &[&[], &[TRACER_RAY_QUERY]];

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders {
    roots: &[Root::of(
        "rays/list",
        &[&[
            &[],
            &[TRACER_RAY_QUERY],
            &[TRACER_WITHIN_TEXEL],
            &[TRACER_ACROSS_TEXELS],
            &[LINKED_LIST, TRACER_WITHIN_TEXEL],
            &[LINKED_LIST, TRACER_ACROSS_TEXELS],
            &[SORTED_LINKED_LIST, TRACER_WITHIN_TEXEL],
            &[SORTED_LINKED_LIST, TRACER_ACROSS_TEXELS],
            &[DEPTH_16, TRACER_WITHIN_TEXEL],
            &[DEPTH_16, TRACER_ACROSS_TEXELS],
        ]],
    )],
    structs: &[SharedStruct::of::<TracedRay>()],
};

/// What answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tracer {
    /// Nothing does: no ray is traced.
    None,
    /// A compressed wide BVH, walked in compute.
    Bvh,
    /// The adapter's own acceleration structure.
    RayQuery,
    /// The texel of the nearest direction's deep image that a ray starts in, along the image's axis: closest hits alone.
    WithinTexel,
    /// Every texel of that image that a ray crosses.
    AcrossTexels,
}

impl Tracer {
    /// The feature that makes the shaders of this room use it; none for the BVH.
    pub fn feature(self) -> Option<Feature> {
        match self {
            Self::None | Self::Bvh => None,
            Self::RayQuery => Some(TRACER_RAY_QUERY),
            Self::WithinTexel => Some(TRACER_WITHIN_TEXEL),
            Self::AcrossTexels => Some(TRACER_ACROSS_TEXELS),
        }
    }

    /// The same, and what reads deep images of these settings, where it goes through those.
    pub fn features(self, images: &DeepImageSettings) -> Vec<Feature> {
        let mut features = if self.uses_deep_images() { images.fragment_features() } else { Vec::new() };
        features.extend(self.feature());
        features
    }

    /// Whether it goes through deep images.
    pub fn uses_deep_images(self) -> bool {
        matches!(self, Self::WithinTexel | Self::AcrossTexels)
    }

    /// What traces rays from where deep images are not asked: from blended surfaces, samples of a pixel, ends of other rays.
    pub fn exact(self) -> Self {
        if self.uses_deep_images() { Self::Bvh } else { self }
    }

    /// An error where the device does not have it. `setting`: what asks for it; `instead`: what to ask for.
    pub(crate) fn check(
        self,
        device: &wgpu::Device,
        setting: &'static str,
        instead: &'static str,
    ) -> Result<Self, RenderError> {
        if self == Self::RayQuery && !has_ray_query(device) {
            return Err(RenderError::MissingFeature { setting, feature: "ray queries", instead });
        }
        Ok(self)
    }
}

/// Whether the device has ray queries.
pub(crate) fn has_ray_query(device: &wgpu::Device) -> bool {
    device.features().contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY)
}

/// Adds the pass of a kernel that asks one of the two questions: one dispatch, or through deep images one for each chunk of them, each
/// of which answers for its own images.
pub(crate) fn dispatch(
    frame: &mut Frame<'_>,
    kernel: &ComputeKernel,
    bindings: &Bindings<'_>,
    workgroups: [u32; 3],
    images: Option<&DeepImages>,
) {
    let Some(images) = images else { return frame.dispatch(kernel, bindings, workgroups) };
    for chunk in &images.chunks {
        let of_chunk = chunk.bindings(&images.frames).with(&images.direction_bindings());
        frame.dispatch(kernel, &bindings.clone().with(&of_chunk), workgroups);
    }
}
