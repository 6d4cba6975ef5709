//! Every texel of the nearest direction's deep image that a ray crosses [Niessner2010, §3.2].

use lanternfish_gpu::Feature;

use super::{Structure, TracerInfo};

pub(super) const INFO: TracerInfo = TracerInfo {
    name: "across-texels",
    words: "Every texel of a deep image that a ray crosses",
    feature: Feature::choosing("tracer_across_texels", "tracer", "rays/across_texels/tracer", &[]),
    structure: Structure::DeepImages,
};
