//! A compressed wide BVH over instances, each of which leads into the BVH of its mesh, walked in compute: exact.

#[cfg(test)]
mod tests;

use lanternfish_gpu::Feature;

use super::TracerInfo;
use crate::gpu_scene::Parts;

pub(crate) const INFO: TracerInfo = TracerInfo {
    name: "two-level",
    words: "A tree over instances, and one of each mesh: little memory for many copies",
    feature: Feature::choosing("tracer_two_level", "tracer", "rays/two_level/tracer", None),
    parts: Parts::INSTANCES,
    needs: wgpu::Features::empty(),
    structure: None,
};
