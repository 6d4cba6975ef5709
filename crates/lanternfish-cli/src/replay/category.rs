//! Categories of passes: the thesis' categories of a frame's time, and further ones.

use serde::{Deserialize, Serialize};

/// The category of a pass [VanGelderen2020, fig. 6.7, fig. 6.8].
///
/// The thesis has clustering, which is the first four together, shading and miscellaneous. It has no shadows and no
/// light from other surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Category {
    /// The depth pass, and marking clusters with visible fragments.
    Visibility,
    /// Counting the lights of every cluster or tile.
    LightCounting,
    /// Writing the light lists.
    LightWriting,
    /// Transforming lights to cluster space, the hierarchy over them, prefix sums, and other small work.
    ClusteringRest,
    /// Shadow rays.
    Shadows,
    /// Indirect light, from other surfaces and from the environment.
    ArrivingLight,
    /// Shading, including transparent surfaces.
    Shading,
    /// All other passes: the sky, exposure, output.
    Miscellaneous,
    /// Host time. It is not a pass and not in any sum of passes.
    Host,
}

impl Category {
    /// The categories of passes, in the stacking order of plots, with their names and colours.
    pub const OF_PASSES: [(Self, &'static str, &'static str); 8] = [
        (Self::Visibility, "visibility", "#56b4e9"),
        (Self::LightCounting, "counting lights", "#e69f00"),
        (Self::LightWriting, "writing lists", "#d55e00"),
        (Self::ClusteringRest, "rest of clustering", "#b3a369"),
        (Self::Shadows, "shadows", "#555555"),
        (Self::ArrivingLight, "arriving light", "#cc79a7"),
        (Self::Shading, "shading", "#009e73"),
        (Self::Miscellaneous, "miscellaneous", "#bbbbbb"),
    ];

    /// The name in tables and legends.
    pub fn name(self) -> &'static str {
        Self::OF_PASSES.iter().find(|(category, ..)| *category == self).map_or("host", |(_, name, _)| name)
    }

    /// True if the thesis counts it as clustering in fig. 6.7.
    pub fn is_clustering(self) -> bool {
        matches!(self, Self::Visibility | Self::LightCounting | Self::LightWriting | Self::ClusteringRest)
    }

    /// The category of a pass, by its label. The thesis counts all prefix sums as small work.
    pub fn of(pass: &str) -> Self {
        let (module, last) = (pass.split('/').next().unwrap_or(pass), pass.rsplit('/').next().unwrap_or(pass));
        match (module, last) {
            ("prepass", _) => Self::Visibility,
            ("light_culling", "mark" | "mark_drawn" | "bounds" | "mask") => Self::Visibility,
            ("light_culling", "count") if !pass.contains("/sort/") => Self::LightCounting,
            ("light_culling", "write") => Self::LightWriting,
            ("light_culling", _) => Self::ClusteringRest,
            ("shadows" | "direct_light", _) => Self::Shadows,
            ("indirect" | "occlusion" | "deep_images" | "environment_light", _) => Self::ArrivingLight,
            ("shading", _) => Self::Shading,
            _ => Self::Miscellaneous,
        }
    }
}

#[test]
fn passes_have_the_categories_of_figure_6_8() {
    for (pass, category) in [
        ("prepass", Category::Visibility),
        ("light_culling/clustered/mark", Category::Visibility),
        ("light_culling/clustered/mark_drawn", Category::Visibility),
        ("light_culling/raster_grid/mask", Category::Visibility),
        ("light_culling/clustered/count", Category::LightCounting),
        ("light_culling/clustered/sort/count", Category::ClusteringRest),
        ("light_culling/clustered/scan", Category::ClusteringRest),
        ("light_culling/clustered/keys", Category::ClusteringRest),
        ("light_culling/tiled/write", Category::LightWriting),
        ("shadows/trace", Category::Shadows),
        ("indirect/virtual_lights/scan", Category::ArrivingLight),
        ("shading/transparent", Category::Shading),
        ("sky", Category::Miscellaneous),
        ("output/count", Category::Miscellaneous),
    ] {
        assert_eq!(Category::of(pass), category, "{pass}");
        assert!(Category::OF_PASSES.iter().any(|(other, ..)| *other == category));
    }
    let clustering = Category::OF_PASSES.iter().filter(|(category, ..)| category.is_clustering());
    assert_eq!(clustering.count(), 4);
}
