//! Traces rays through every texel that they cross of the nearest direction's deep image [Niessner2010, §3.2].

use lanternfish::{gpu_scene::Parts, rays::TracerInfo};
use lanternfish_gpu::Feature;

use crate::deep_images::settings::DeepImageSettings;

pub(crate) const INFO: TracerInfo = TracerInfo {
    name: "across-texels",
    words: "Every texel of a deep image that a ray crosses",
    feature: Feature::choosing(
        "tracer_across_texels",
        "tracer",
        "rays/across_texels/tracer",
        Some(crate::shaders::SHADERS.library()),
    ),
    parts: Parts::BVH,
    needs: wgpu::Features::empty(),
    structure: Some(|| DeepImageSettings::default().into()),
};
