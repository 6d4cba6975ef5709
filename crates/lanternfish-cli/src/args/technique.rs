//! Flags of how the picture is found.

use clap::{Args, ValueEnum};
use lanternfish::settings::{
    Assignment, ClusterShape, ClusterTest, Clustered, Culling, Grouping, RayCulling, Samples, Settings, Shadows,
    TextureBinding, TileSize, Tiled,
};

use crate::{choices::choice, parse};

#[derive(Debug, Args)]
pub struct TechniqueArgs {
    /// How shadows are found.
    ///
    /// The picture is the same but for a few pixels at silhouettes; with deep-image, for a texel around them.
    #[arg(long, value_name = "NAME", value_parser = choice::<Shadows>(), hide_short_help = true)]
    #[arg(default_value_t = Settings::default().shadows)]
    pub shadows: Shadows,
    /// Which shadow rays are not traced because the surface faces away from the light.
    #[arg(long, value_name = "NAME", value_parser = choice::<RayCulling>())]
    #[arg(default_value_t = Settings::default().ray_culling, hide_short_help = true)]
    pub ray_culling: RayCulling,
    /// Rays from a pixel to each light that has a --light-radius. More: less noise, slower.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=255), allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().shadow_rays, hide_short_help = true)]
    pub shadow_rays: u32,
    /// How the lights of a pixel are found. The picture is the same.
    #[arg(long, value_name = "NAME", value_enum, default_value_t = CullingName::default(), hide_short_help = true)]
    pub culling: CullingName,
    /// Edge of a tile, pixels, with --culling tiled. The picture is the same.
    #[arg(long, value_name = "PIXELS", value_parser = choice::<TileSize>())]
    #[arg(default_value_t = Tiled::default().tile_size, hide_short_help = true)]
    pub tile_size: TileSize,
    /// Also tests lights against a box around the tile, with --culling tiled. The picture is the same.
    #[arg(long, value_name = "on|off", value_enum, default_value_t = Switch::from(Tiled::default().aabb_test))]
    #[arg(hide_short_help = true)]
    pub aabb: Switch,
    /// Shape of the clusters, with --culling clustered: persp:P (P pixels wide, as deep as wide), ortho:S (cubes of S m) or
    /// displ:P:D (as persp, from D m behind the camera). The picture is the same.
    #[arg(long, value_name = "SHAPE", value_parser = parse::cluster_shape)]
    #[arg(default_value = "persp:32", hide_short_help = true)]
    pub clusters: ClusterShape,
    /// Whether several views share one grid of clusters. The picture is the same.
    #[arg(long, value_name = "NAME", value_parser = choice::<Grouping>())]
    #[arg(default_value_t = Clustered::default().grouping, hide_short_help = true)]
    pub cluster_views: Grouping,
    /// How the lights of a cluster are found. The picture is the same.
    #[arg(long, value_name = "NAME", value_parser = choice::<Assignment>())]
    #[arg(default_value_t = Clustered::default().assignment, hide_short_help = true)]
    pub light_assignment: Assignment,
    /// How close to a cluster a light must come to be listed. The picture is the same.
    #[arg(long, value_name = "NAME", value_parser = choice::<ClusterTest>())]
    #[arg(default_value_t = Clustered::default().test, hide_short_help = true)]
    pub cluster_test: ClusterTest,
    /// Samples a pixel at edges.
    ///
    /// Of triangles. More: smoother edges. 4 is on every adapter. Without it: 4, where they are a small part of the frame;
    /// 1 with --quality draft, --indirect none, and debug views.
    #[arg(long, value_name = "N", value_parser = choice::<Samples>())]
    pub samples: Option<Samples>,
    /// The mean of N frames: smooth edges, less noise.
    ///
    /// Each is rendered through other points of its pixels. N times as slow.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_hyphen_values = true)]
    #[arg(default_value_t = Settings::default().accumulate)]
    pub accumulate: u32,
    /// How textures reach the shader. The picture is the same.
    #[arg(long, value_name = "NAME", value_parser = choice::<TextureBinding>())]
    #[arg(default_value_t = Settings::default().textures, hide_short_help = true)]
    pub textures: TextureBinding,
}

impl TechniqueArgs {
    /// How these flags want lights to be found.
    pub fn culling(&self) -> Culling {
        match self.culling {
            CullingName::All => Culling::All,
            CullingName::Tiled => {
                Culling::Tiled(Tiled { tile_size: self.tile_size, aabb_test: self.aabb == Switch::On })
            }
            CullingName::Clustered => Culling::Clustered(Clustered {
                shape: self.clusters,
                grouping: self.cluster_views,
                assignment: self.light_assignment,
                test: self.cluster_test,
            }),
        }
    }
}

/// How the lights of a pixel are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CullingName {
    /// Every light for every pixel: the yardstick for the others
    All,
    /// A list of lights for every tile of the screen
    Tiled,
    /// A list of lights for every cluster of what is visible
    Clustered,
}

impl Default for CullingName {
    fn default() -> Self {
        match Culling::default() {
            Culling::All => Self::All,
            Culling::Tiled(_) => Self::Tiled,
            Culling::Clustered(_) => Self::Clustered,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Fewer lights a tile, slightly more work to find them
    On,
    /// Leaves the test out
    Off,
}

impl From<bool> for Switch {
    fn from(on: bool) -> Self {
        if on { Self::On } else { Self::Off }
    }
}
