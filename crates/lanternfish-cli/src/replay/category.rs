//! What a pass is for: the thesis' categories of a frame's time, and ours beside them.

use serde::{Deserialize, Serialize};

/// What a pass is for [VanGelderen2020, fig. 6.7, fig. 6.8].
///
/// The thesis has clustering, which is the first four together, shading and miscellaneous. Shadows and light from other surfaces it does
/// not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Category {
    /// The depth pass, and finding which clusters have visible fragments.
    Visibility,
    /// Counting the lights of every cluster or tile.
    LightCounting,
    /// Writing their lists.
    LightWriting,
    /// Bringing lights into the clusters' space, the tree over them, prefix sums, and other small work.
    ClusteringRest,
    /// Rays to lights.
    Shadows,
    /// What arrives from other surfaces and from the environment.
    ArrivingLight,
    /// Shading, of blended surfaces too.
    Shading,
    /// All other passes: the sky, exposure, output.
    Miscellaneous,
    /// Seconds of the host, and not a pass: in no sum of passes.
    Host,
}

impl Category {
    /// Those of passes, in the order in which plots stack them, with their colours.
    pub const OF_PASSES: [(Self, &'static str); 8] = [
        (Self::Visibility, "#56b4e9"),
        (Self::LightCounting, "#e69f00"),
        (Self::LightWriting, "#d55e00"),
        (Self::ClusteringRest, "#b3a369"),
        (Self::Shadows, "#555555"),
        (Self::ArrivingLight, "#cc79a7"),
        (Self::Shading, "#009e73"),
        (Self::Miscellaneous, "#bbbbbb"),
    ];

    /// As it is written in tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::Visibility => "visibility",
            Self::LightCounting => "counting lights",
            Self::LightWriting => "writing lists",
            Self::ClusteringRest => "rest of clustering",
            Self::Shadows => "shadows",
            Self::ArrivingLight => "arriving light",
            Self::Shading => "shading",
            Self::Miscellaneous => "miscellaneous",
            Self::Host => "host",
        }
    }

    /// Whether the thesis counts it as clustering in fig. 6.7.
    pub fn is_clustering(self) -> bool {
        matches!(self, Self::Visibility | Self::LightCounting | Self::LightWriting | Self::ClusteringRest)
    }

    /// That of a pass, by its label. Prefix sums are small work in the thesis, whatever they are of.
    pub fn of(pass: &str) -> Self {
        let (room, last) = (pass.split('/').next().unwrap_or(pass), pass.rsplit('/').next().unwrap_or(pass));
        match (room, last) {
            ("prepass", _) => Self::Visibility,
            ("light_culling", "mark" | "mark_drawn" | "bounds" | "mask") => Self::Visibility,
            ("light_culling", "count") if !pass.contains("/sort/") => Self::LightCounting,
            ("light_culling", "write") => Self::LightWriting,
            ("light_culling", _) => Self::ClusteringRest,
            ("shadows", _) => Self::Shadows,
            ("indirect" | "occlusion" | "deep_images" | "environment_light", _) => Self::ArrivingLight,
            ("shading", _) => Self::Shading,
            _ => Self::Miscellaneous,
        }
    }
}

#[test]
fn passes_are_counted_as_figure_6_8_counts_them() {
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
        assert!(Category::OF_PASSES.iter().any(|(known, _)| *known == category));
    }
    let clustering = Category::OF_PASSES.iter().filter(|(category, _)| category.is_clustering());
    assert_eq!(clustering.count(), 4);
}
