//! A compressed wide BVH, walked in compute: exact.

use lanternfish_gpu::Feature;

use super::{Structure, TracerInfo};

pub(super) const INFO: TracerInfo = TracerInfo {
    name: "bvh",
    words: "The bounding volume hierarchy in compute: exact, on any adapter",
    feature: Feature::choosing("tracer_bvh", "tracer", "rays/bvh/tracer", &[]),
    structure: Structure::Bvh,
};
