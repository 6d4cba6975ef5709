//! Test support: the library's test utilities, and kernels that evaluate one shader function for many inputs.

mod every_shader;

use std::sync::OnceLock;

pub(crate) use lanternfish::testing::*;
pub(crate) use lanternfish_gpu::testing::{engine, left_out};
use lanternfish_gpu::{ComputeKernel, Feature, Gpu, ShaderLibrary, ShaderSource};

use crate::shaders::SHADERS;

const PROBES: [ShaderSource; 5] = [
    ("testing/closest_hits", include_str!("closest_hits.wesl")),
    ("testing/deep_hits", include_str!("deep_hits.wesl")),
    ("testing/directions", include_str!("directions.wesl")),
    ("testing/photon_differentials", include_str!("photon_differentials.wesl")),
    ("testing/put_fragments", include_str!("put_fragments.wesl")),
];

/// The adapter, after the techniques are registered; none if the test is skipped.
pub(crate) fn gpu(test: &str) -> Option<&'static Gpu> {
    crate::register();
    lanternfish_gpu::testing::gpu(test)
}

/// One entry point of a probe.
pub(crate) fn probe(gpu: &Gpu, module: &str, features: &[Feature], entry: &str) -> ComputeKernel {
    probe_of(&library(), gpu, module, features, entry)
}

/// The shaders of the library and of this crate, and the probes of both.
pub(crate) fn library() -> ShaderLibrary {
    static SOURCES: OnceLock<&'static [ShaderSource]> = OnceLock::new();
    ShaderLibrary::new(SOURCES.get_or_init(|| {
        let all: Vec<_> = sources().into_iter().chain(SHADERS.sources().iter().copied()).chain(PROBES).collect();
        all.leak()
    }))
}

/// [`library`] with an edit of one file, which must contain `text`; all occurrences are replaced.
pub(crate) fn edited_library(module: &str, text: &str, by: &str) -> ShaderLibrary {
    edited(library().sources(), (module, text, by))
}
