//! The adapter's own acceleration structure: exact, and fast where it is hardware.

use lanternfish_gpu::Feature;

use super::TracerInfo;
use crate::gpu_scene::Parts;

pub(crate) const INFO: TracerInfo = TracerInfo {
    name: "ray-query",
    words: "The adapter's own acceleration structure: exact",
    feature: Feature::choosing("tracer_ray_query", "tracer", "rays/ray_query/tracer", None),
    parts: Parts::RAY_QUERY,
    needs: wgpu::Features::EXPERIMENTAL_RAY_QUERY,
    structure: None,
};
