//! Settings of tiled light culling.

use lanternfish_gpu::Feature;

use super::{CULLING_TILED, DECLARED, TiledCulling};
use crate::{
    error::RenderError,
    light_culling::{CullingTechnique, LightCullingPasses, TileSize},
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};

/// Lists per screen tile [Elagabani2025, §4.2].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiled {
    /// Edge of a tile, pixels. Smaller: fewer lights a pixel, more lists.
    pub tile_size: TileSize,
    /// Also tests lights against the box around the tile's frustum. On: fewer lights a tile, slightly more work per
    /// tile [Elagabani2025, §4.2.3].
    pub aabb_test: bool,
}

impl Default for Tiled {
    fn default() -> Self {
        Self { tile_size: TileSize::Px16, aabb_test: true }
    }
}

impl Technique for Tiled {
    const NAME: &'static str = "tiled";
    const SUMMARY: &'static str = "A list of lights for every tile of the screen";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "tile-size",
            "PIXELS",
            Range::Numbers,
            "Edge of a tile, pixels, with `culling tiled` or `culling raster-grid`. The image is the same",
            |tiled: &mut Self| &mut tiled.tile_size,
        )
        .with_default(),
        Parameter::new(
            "aabb",
            "on|off",
            Range::Switch("Fewer lights a tile, slightly more work to find them", "No test against the box"),
            "Also tests lights against a box around the tile, with `culling tiled`. The image is the same",
            |tiled: &mut Self| &mut tiled.aabb_test,
        )
        .with_default(),
    ];
    const SHADERS: Shaders = DECLARED;
}

impl CullingTechnique for Tiled {
    fn feature(&self) -> Feature {
        CULLING_TILED
    }

    fn build(&self, device: &wgpu::Device, samples: u32) -> Result<Box<dyn LightCullingPasses>, RenderError> {
        Ok(Box::new(TiledCulling::new(device, *self, samples)?))
    }
}
