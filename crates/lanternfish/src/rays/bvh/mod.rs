//! A compressed wide BVH, walked in compute: exact.

use lanternfish_gpu::Feature;

use super::TracerInfo;
use crate::gpu_scene::Parts;

pub(crate) const INFO: TracerInfo = TracerInfo {
    name: "bvh",
    words: "The bounding volume hierarchy in compute: exact, on any adapter",
    feature: Feature::choosing("tracer_bvh", "tracer", "rays/bvh/tracer", None),
    parts: Parts::BVH,
    needs: wgpu::Features::empty(),
    structure: None,
};
