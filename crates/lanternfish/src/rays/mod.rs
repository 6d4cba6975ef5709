//! What rays meet: one structure behind two questions.
//!
//! - `any_hit.wesl`: is a segment closed? Asked by shadows, and by rays to lights.
//! - `closest_hit.wesl`: which triangle does a ray from a surface meet first? Asked by indirect light.
//!
//! The host says through which structure when it links ([`Tracer::features`]), and runs a pass once for each chunk where that is deep
//! images (`dispatch`). Lists of rays, for tests and benches, are traced by [`RayTracer`].

mod list;

use lanternfish_gpu::{Bindings, ComputeKernel, Frame};

pub use self::list::{RayTracer, Structure, TracedRay};
use crate::{deep_images::DeepImages, error::RenderError, settings::DeepImageSettings};

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
    pub fn feature(self) -> Option<&'static str> {
        match self {
            Self::None | Self::Bvh => None,
            Self::RayQuery => Some("tracer_ray_query"),
            Self::WithinTexel => Some("tracer_within_texel"),
            Self::AcrossTexels => Some("tracer_across_texels"),
        }
    }

    /// The same, and what reads deep images of these settings, where it goes through those.
    pub fn features(self, images: &DeepImageSettings) -> Vec<&'static str> {
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
