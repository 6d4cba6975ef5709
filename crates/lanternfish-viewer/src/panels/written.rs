//! Debug views that show a pass's output.

use lanternfish::{
    Settings,
    settings::{Culling, DebugView},
};
use lanternfish_gpu::PassTime;

/// A pass whose output is shown in place of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The pass's name.
    pub pass: String,
    /// The previous debug view.
    pub before: Option<DebugView>,
    /// The passes before the click. A debug view runs other passes.
    pub passes: Vec<PassTime>,
}

/// Debug views of a pass's output; empty if there are none.
pub fn views_of(pass: &str, settings: &Settings) -> &'static [DebugView] {
    let starts = |part: &str| pass == part || pass.strip_prefix(part).is_some_and(|rest| rest.starts_with('/'));
    let after = |module: &str| pass.strip_prefix(module).and_then(|rest| rest.strip_prefix('/')).unwrap_or_default();
    // No debug view shows the prepass of transparent surfaces, or the absence of culling.
    if starts("prepass/transparent") || settings.culling == Culling::NONE && starts("light_culling") {
        return &[];
    }
    if starts("prepass") {
        return &[DebugView::Depth, DebugView::Normal, DebugView::GeometricNormal, DebugView::Roughness];
    }
    if starts("light_culling") {
        return match after("light_culling/clustered") {
            "mark" | "mark_drawn" | "flag" | "compact" => &[DebugView::ClusterFragments, DebugView::ClusterIndex],
            _ => &[DebugView::ClusterLights, DebugView::LightCount, DebugView::LightsPerPixel],
        };
    }
    if starts("shadows") {
        return &[DebugView::Visibility, DebugView::RayCount];
    }
    if starts("occlusion") {
        return &[DebugView::Occlusion];
    }
    if starts("indirect") {
        return &[DebugView::Indirect];
    }
    if starts("shading/forward") {
        return &[DebugView::BaseColor, DebugView::Nan];
    }
    if starts("shading") || starts("sky") {
        return &[DebugView::Nan];
    }
    &[]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_have_views_of_their_output() {
        let settings = Settings::default();
        let first = |pass: &str| views_of(pass, &settings).first().copied();
        for (pass, view) in [
            ("prepass", Some(DebugView::Depth)),
            ("prepass/transparent", None),
            ("light_culling/clustered/mark", Some(DebugView::ClusterFragments)),
            ("light_culling/clustered/count", Some(DebugView::ClusterLights)),
            ("shadows/trace", Some(DebugView::Visibility)),
            ("indirect/sampled/trace", Some(DebugView::Indirect)),
            ("occlusion/hbao/horizons", Some(DebugView::Occlusion)),
            ("shading/forward", Some(DebugView::BaseColor)),
            ("sky", Some(DebugView::Nan)),
            ("skylight", None),
            ("deep_images/build", None),
            ("output", None),
        ] {
            assert_eq!(first(pass), view, "{pass}");
        }
        let all = settings.with_culling(Culling::NONE);
        assert!(views_of("light_culling/anything", &all).is_empty());
    }
}
