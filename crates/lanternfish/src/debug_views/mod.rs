//! Debug views: quantities of a frame as images.

mod scale;

use glam::UVec2;
use lanternfish_gpu::{
    Bindings, Feature, Frame, RasterPipeline, RasterState, SharedStruct, gpu_struct, uniform_buffer_of,
};

use crate::{
    context::ViewContext,
    error::RenderError,
    indirect::{DemodulatedIrradiance, INDIRECT},
    light_culling::Culling,
    light_culling::{LightCulling, LightLists},
    occlusion::Occlusion,
    occlusion::{self, AmbientVisibility},
    output::{DISPLAY_FORMAT, show},
    prepass::MOTION,
    settings::{DebugView, Settings},
    shaders::{Root, Shaders},
    shading::Shaded,
    shadows::VisibilityPlan,
    texture::frame_target,
};

pub use scale::Scale;

gpu_struct! {
    /// The quantity and the scale of a debug view.
    pub struct DebugParameters {
        /// The quantity: a constant of `debug.wesl`.
        quantity: u32,
        /// The value of the hottest or brightest colour; for a logarithmic heat map the number of doublings.
        hottest: f32,
    }
}

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders =
    Shaders::new(&[Root::by_settings("debug_views/debug")], &[SharedStruct::of::<DebugParameters>()]);

/// The value of the hottest colour of a linear heat map: ten, as in [Elagabani2025, fig. 5.2].
const HOTTEST: f32 = 10.0;
/// Number of doublings up to the hottest colour of a logarithmic heat map: 2¹⁰ − 1 = 1,023; each colour is a factor of
/// four.
const DOUBLINGS: f32 = 10.0;
/// Motion of the brightest colour, pixels per frame: a sixtieth of an image of 1,000 pixels.
const FASTEST: f32 = 16.0;

/// The pass that draws a debug view.
#[derive(Debug)]
pub struct DebugViews {
    pipeline: RasterPipeline,
    parameters: wgpu::Buffer,
}

/// The shader's number of a view; `None` for views that the shading pass draws.
fn quantity(view: DebugView) -> Option<u32> {
    Some(match view {
        DebugView::Depth => 0,
        DebugView::Normal => 1,
        DebugView::GeometricNormal => 2,
        DebugView::Roughness => 3,
        DebugView::LightCount => 4,
        DebugView::RayCount => 5,
        DebugView::Visibility => 6,
        DebugView::Nan => 7,
        DebugView::LightsPerPixel => 8,
        DebugView::ClusterIndex => 9,
        DebugView::ClusterLights => 10,
        DebugView::ClusterFragments => 11,
        DebugView::Occlusion => 12,
        DebugView::Motion => 13,
        DebugView::Indirect => 14,
        DebugView::BaseColor => return None,
    })
}

/// The value of the hottest or brightest colour of a view, or the number of doublings.
fn hottest(view: DebugView) -> f32 {
    match view {
        DebugView::LightsPerPixel | DebugView::ClusterLights | DebugView::ClusterFragments => DOUBLINGS,
        DebugView::Motion => FASTEST,
        _ => HOTTEST,
    }
}

/// The frame has clusters.
const CLUSTERS: Feature = Feature::new("clusters");

fn has_clusters(culling: &Culling) -> bool {
    culling.technique().is_some_and(|culling| culling.has_clusters())
}

/// Returns an error if the view shows clusters and there are none.
fn check_clusters(view: DebugView, culling: &Culling) -> Result<(), RenderError> {
    let setting = match view {
        DebugView::ClusterIndex => "`debug-view cluster-index`",
        DebugView::ClusterFragments => "`debug-view cluster-fragments`",
        _ => return Ok(()),
    };
    match has_clusters(culling) {
        true => Ok(()),
        false => Err(RenderError::Together { setting, needed: "`culling clustered`" }),
    }
}

/// Features with which the shader of the debug view is linked.
pub(crate) fn features(settings: &Settings) -> Vec<Feature> {
    let of = |view: DebugView, feature: Feature| (settings.image.debug_view == Some(view)).then_some(feature);
    let techniques =
        [LightCulling::feature(&settings.culling)].into_iter().chain(occlusion::feature(&settings.occlusion));
    techniques
        .chain(has_clusters(&settings.culling).then_some(CLUSTERS))
        .chain(of(DebugView::Motion, MOTION))
        .chain(of(DebugView::Indirect, INDIRECT))
        .collect()
}

impl DebugViews {
    /// Compiles the pass if the settings select a debug view.
    pub fn new(device: &wgpu::Device, settings: &Settings) -> Result<Option<Self>, RenderError> {
        let Some(view) = settings.image.debug_view else { return Ok(None) };
        let Some(quantity) = quantity(view) else { return Ok(None) };
        check_clusters(view, &settings.culling)?;
        if view == DebugView::Occlusion && settings.occlusion == Occlusion::NONE {
            return Err(RenderError::Together {
                setting: "`debug-view occlusion`",
                needed: "a technique for `occlusion`",
            });
        }
        if view == DebugView::Indirect && !settings.finds_indirect() {
            return Err(RenderError::Together {
                setting: "`debug-view indirect`",
                needed: "a technique for `indirect` light",
            });
        }
        let shader = DECLARED.link("debug_views/debug", &features(settings))?;
        let state = RasterState { targets: &[Some(DISPLAY_FORMAT.into())], ..Default::default() };
        Ok(Some(Self {
            pipeline: RasterPipeline::new(device, &shader, "vertex", "fragment", "debug_views", &state),
            parameters: uniform_buffer_of(device, "debug_views", &DebugParameters { quantity, hottest: hottest(view) }),
        }))
    }

    /// Draws the debug view into the display image.
    pub(crate) fn record(
        &self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, center_surface, .. }: &ViewContext<'_>,
        Shaded { radiance, visibility, ambient_visibility, indirect, lights, .. }: &Shaded,
        display: &wgpu::TextureView,
    ) {
        // Shadow rays per pixel, if shadows were traced.
        let ray_counts = visibility.as_ref().and_then(VisibilityPlan::ray_counts);
        let no_rays;
        let ray_counts = match ray_counts {
            Some(counts) => counts,
            None => {
                let usage = wgpu::TextureUsages::empty();
                no_rays = frame_target(frame, "no_rays", UVec2::ONE, wgpu::TextureFormat::R32Uint, usage, 1);
                &no_rays
            }
        };
        let own = Bindings::new()
            .buffer("debug_parameters", &self.parameters)
            .texture("radiance_texture", &radiance.target)
            .texture("ray_count_texture", ray_counts);
        let scene_bindings = scene.bindings();
        let shared = buffer.bindings().with(&scene_bindings);
        let ambient_visibility = ambient_visibility.as_ref().map(AmbientVisibility::bindings).unwrap_or_default();
        let indirect = indirect.as_ref().map(DemodulatedIrradiance::bindings).unwrap_or_default();
        let light = ambient_visibility.with(&indirect);
        let lists = lights.as_ref().map(LightLists::bindings).unwrap_or_default();
        let bindings = shared.with(&center_surface.bindings()).with(&lists).with(&light).with(&own);
        show(frame, &self.pipeline, "debug_views", &bindings, display);
    }
}

#[cfg(test)]
mod tests;
