//! The compute passes of shadows, in the variants that scenes require.

use lanternfish_gpu::ComputeKernel;

use super::{
    DECLARED, SOFT_LIGHT_BITS, ShadowFeatures,
    bands::{MOST_RAYS, MOST_RAYS_OF_DISPATCH},
    features,
};
use crate::{
    error::RenderError,
    rays::{TracePass, Tracer},
    settings::Settings,
};

/// The passes for scenes with area lights or panes, or for those without.
#[derive(Debug)]
pub(super) struct Kernels {
    pub plan: ComputeKernel,
    pub trace: TracePass,
    /// Traces the rays of edges, exactly. None if no image has edges.
    pub trace_edges: Option<ComputeKernel>,
    /// Listed lights per word.
    pub lights_a_word: u32,
    /// Greatest number of words of a band whose rays can still be counted.
    pub most_words: u64,
    /// Greatest number of words of a dispatch, unless a single row of blocks has more.
    pub most_words_of_dispatch: u64,
}

impl Kernels {
    /// Compiles the passes.
    pub fn new(
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Tracer,
        has_areas: bool,
        has_panes: bool,
    ) -> Result<Self, RenderError> {
        let ShadowFeatures { plan, trace, trace_edges } = features(settings, tracer, has_areas, has_panes)?;
        let plan = DECLARED.link("shadows/plan", &plan)?;
        let trace = DECLARED.link("shadows/trace", &trace)?;
        let trace_edges = trace_edges.map(|features| DECLARED.link("shadows/trace_edges", &features)).transpose()?;
        let is_soft = settings.casts_soft_shadows();
        let lights_a_word = match (has_areas, is_soft) {
            (true, _) => 1,
            (false, true) => 32 / SOFT_LIGHT_BITS,
            (false, false) => 32,
        };
        let rays = if is_soft || has_areas { settings.shadows.rays } else { 1 };
        let rays_a_word = u64::from(rays * lights_a_word);
        Ok(Self {
            plan: ComputeKernel::new(device, &plan, "plan", "shadows/plan"),
            trace: TracePass::new(
                tracer,
                &settings.structure,
                ComputeKernel::new(device, &trace, "trace", "shadows/trace"),
            ),
            trace_edges: trace_edges
                .map(|shader| ComputeKernel::new(device, &shader, "trace_edges", "shadows/trace_edges")),
            lights_a_word,
            most_words: MOST_RAYS / rays_a_word,
            most_words_of_dispatch: MOST_RAYS_OF_DISPATCH / rays_a_word,
        })
    }
}
