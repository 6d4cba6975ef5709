//! The debug view that shows a pass's output.

use lanternfish::{
    Settings,
    settings::{Culling, DebugView},
};
use lanternfish_gpu::PassTime;

/// A pass whose writing is shown in the place of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// Its name.
    pub pass: String,
    /// The debug view of before.
    pub before: Option<DebugView>,
    /// The passes as they were then: under a debug view there are others.
    pub passes: Vec<PassTime>,
}

/// Debug views of what a pass writes; none where there is no such view.
pub fn views_of(pass: &str, settings: &Settings) -> &'static [DebugView] {
    let starts = |part: &str| pass == part || pass.strip_prefix(part).is_some_and(|rest| rest.starts_with('/'));
    let after = |room: &str| pass.strip_prefix(room).and_then(|rest| rest.strip_prefix('/')).unwrap_or_default();
    // Of the nearest blended surfaces, which no view shows.
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
    fn passes_have_the_views_of_what_they_write() {
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
        let all = Settings { culling: Culling::NONE, ..settings };
        assert!(views_of("light_culling/anything", &all).is_empty());
    }
}
