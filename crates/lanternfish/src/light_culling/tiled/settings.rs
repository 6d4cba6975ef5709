//! Settings of tiled light culling.

use lanternfish_gpu::Feature;

use super::{CULLING_TILED, DECLARED, TiledCulling};
use crate::{
    error::RenderError,
    light_culling::{CullingTechnique, LightCullingPasses, TileSize},
    parameters,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};

parameters! {
    /// Lists per screen tile [Elagabani2025, §4.2].
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Tiled {
        /// Edge of a tile, pixels, with `culling tiled` or `culling raster-grid`. The image is the same.
        tile_size: TileSize = TileSize::Px16, "tile-size" "PIXELS" Range::Numbers, with_default;
        /// Also tests lights against a box around the tile, with `culling tiled`. The image is the same
        /// [Elagabani2025, §4.2.3].
        aabb_test: bool = true, "aabb" "on|off"
            Range::Switch("Fewer lights a tile, slightly more work to find them", "No test against the box"), with_default;
    }
}

impl Technique for Tiled {
    const NAME: &'static str = "tiled";
    const SUMMARY: &'static str = "A list of lights for every tile of the screen";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
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
