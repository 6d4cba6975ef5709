//! Settings of the raster grid.

use lanternfish::{
    RenderError,
    light_culling::{CullingTechnique, LightCullingPasses, TileSize},
    parameters,
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};
use lanternfish_gpu::Feature;

use super::{CULLING_RASTER_GRID, DECLARED, RasterGridCulling};

parameters! {
    /// Lists per screen tile and depth layer, computed by rasterizing the lights [Archer2019, §3.2].
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct RasterGrid {
        /// Edge of a tile, pixels, with `culling tiled` or `culling raster-grid`. The image is the same.
        tile_size: TileSize = TileSize::Px16, "tile-size" "PIXELS" Range::Numbers, with_default;
        /// Depth layers per tile, with `culling raster-grid`. The image is the same.
        layers: u32 = 32, "grid-layers" "N" Range::Count(1, super::MOST_LAYERS), with_default;
    }
}

impl Technique for RasterGrid {
    const NAME: &'static str = "raster-grid";
    const SUMMARY: &'static str =
        "A list of lights for every depth layer of every screen tile, computed by rasterizing the lights";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl CullingTechnique for RasterGrid {
    fn feature(&self) -> Feature {
        CULLING_RASTER_GRID
    }

    fn build(&self, device: &wgpu::Device, _samples: u32) -> Result<Box<dyn LightCullingPasses>, RenderError> {
        Ok(Box::new(RasterGridCulling::new(device, *self)?))
    }
}
