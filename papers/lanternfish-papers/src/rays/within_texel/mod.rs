//! Traces rays along the image's axis in the texel in which they start of the nearest direction's deep image [Archer2019, §3.2].

use lanternfish::{gpu_scene::Parts, rays::TracerInfo};
use lanternfish_gpu::Feature;

use crate::deep_images::settings::DeepImageSettings;

pub(crate) const INFO: TracerInfo = TracerInfo {
    name: "within-texel",
    words: "The texel of a deep image that a ray starts in, along the image's axis; fastest, but coarse",
    feature: Feature::choosing(
        "tracer_within_texel",
        "tracer",
        "rays/within_texel/tracer",
        Some(crate::shaders::SHADERS.library()),
    ),
    parts: Parts::BVH,
    needs: wgpu::Features::empty(),
    structure: Some(|| DeepImageSettings::default().into()),
};
