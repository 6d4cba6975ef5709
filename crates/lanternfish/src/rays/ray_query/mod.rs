//! The adapter's own acceleration structure: exact, and fast where it is hardware.

use lanternfish_gpu::Feature;

use super::{Structure, TracerInfo};

pub(super) const INFO: TracerInfo = TracerInfo {
    name: "ray-query",
    words: "The adapter's own acceleration structure: exact",
    feature: Feature::choosing("tracer_ray_query", "tracer", "rays/ray_query/tracer", &[]),
    structure: Structure::RayQuery,
};
