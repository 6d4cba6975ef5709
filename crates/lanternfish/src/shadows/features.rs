//! Features of the shaders of this folder.

use lanternfish_gpu::Feature;

use super::{
    CULL_IMPROVED, CULL_RANGE, CULL_SURFACE, CULL_TRIANGLE, DEEP_SHADOWS, DEPTH_ALONE, EDGES_PLANNED, RAY_COUNTS,
    SHADOW_HISTORY, SOFT, VISIBILITY_WRITTEN, counts_rays,
};
use crate::{
    error::RenderError,
    gpu_scene::PANES,
    light_culling::LightCulling,
    lights::AREA_LIGHTS,
    settings::{History, RayCulling, RayRangeCulling, Samples, Settings, Tracer},
};

/// Features of the shaders of this folder.
#[derive(Clone, Debug)]
pub(crate) struct ShadowFeatures {
    pub plan: Vec<Feature>,
    pub trace: Vec<Feature>,
    /// None if no image has edges.
    pub trace_edges: Option<Vec<Feature>>,
}

/// Features for scenes with or without area lights and panes. An error if the tracer does not support the settings.
pub(crate) fn features(
    settings: &Settings,
    tracer: Tracer,
    has_areas: bool,
    has_panes: bool,
) -> Result<ShadowFeatures, RenderError> {
    let mut plan = vec![LightCulling::feature(&settings.culling)];
    plan.extend(settings.casts_soft_shadows().then_some(SOFT));
    plan.extend(has_areas.then_some(AREA_LIGHTS));
    let has_history = settings.history == History::On && (has_areas || settings.casts_soft_shadows());
    let mut trace = plan.clone();
    trace.extend(has_panes.then_some(PANES));
    trace.push(VISIBILITY_WRITTEN);
    trace.extend(has_history.then_some(SHADOW_HISTORY));
    let trace_edges = (settings.image.samples != Samples::One).then(|| {
        let edges = [CULL_RANGE, CULL_TRIANGLE].into_iter().chain(tracer.exact().features(&settings.structure, false));
        trace.iter().copied().chain(edges).collect()
    });
    plan.extend(trace_edges.is_some().then_some(EDGES_PLANNED));
    // Segments need no triangles.
    trace.extend(tracer.features(&settings.structure, false));
    if let Some(structure) = tracer.structure(&settings.structure).technique() {
        if let Some(needed) = structure.lacks_for_shadows() {
            return Err(RenderError::Together { setting: DEEP_SHADOWS, needed });
        }
        if counts_rays(settings) {
            return Err(RenderError::Together { setting: "`debug-view` of shadow rays", needed: "`shadows bvh`" });
        }
    }
    trace.extend((settings.shadows.ray_range_culling == RayRangeCulling::On).then_some(CULL_RANGE));
    let culling: &[Feature] = match settings.shadows.ray_culling {
        RayCulling::None => &[],
        RayCulling::Improved => &[CULL_IMPROVED],
        RayCulling::Depth => &[CULL_IMPROVED, DEPTH_ALONE],
        RayCulling::Surface => &[CULL_SURFACE],
    };
    trace.extend(culling);
    trace.extend(counts_rays(settings).then_some(RAY_COUNTS));
    Ok(ShadowFeatures { plan, trace, trace_edges })
}
