//! Settings of the raster grid.

use lanternfish::{
    RenderError,
    light_culling::{CullingTechnique, LightCullingPasses, TileSize},
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
};
use lanternfish_gpu::Feature;

use super::{CULLING_RASTER_GRID, DECLARED, RasterGridCulling};

/// Lists per screen tile and depth layer, computed by rasterizing the lights [Archer2019, §3.2].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RasterGrid {
    /// Edge of a tile, pixels. Smaller: fewer lights per pixel, more lists.
    pub tile_size: TileSize,
    /// Layers per tile, 1 to 32. More: fewer lights per pixel in tiles with surfaces far apart, more lists.
    pub layers: u32,
}

impl Default for RasterGrid {
    fn default() -> Self {
        Self { tile_size: TileSize::Px16, layers: 32 }
    }
}

impl Technique for RasterGrid {
    const NAME: &'static str = "raster-grid";
    const SUMMARY: &'static str =
        "A list of lights for every depth layer of every screen tile, computed by rasterizing the lights";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "tile-size",
            "PIXELS",
            Range::Numbers,
            "Edge of a tile, pixels, with `culling tiled` or `culling raster-grid`. The image is the same",
            |grid: &mut Self| &mut grid.tile_size,
        )
        .with_default(),
        Parameter::new(
            "grid-layers",
            "N",
            Range::Count(1, super::MOST_LAYERS),
            "Depth layers per tile, with `culling raster-grid`. The image is the same",
            |grid: &mut Self| &mut grid.layers,
        )
        .with_default(),
    ];
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
