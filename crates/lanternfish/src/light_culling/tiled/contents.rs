//! Light lists of a frame's tiles, read back.

use glam::UVec2;
use lanternfish_gpu::read_back;

use super::TiledCulling;
use crate::error::RenderError;

/// The tiles of a view of the last frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TileContents {
    /// Edge of a tile, pixels.
    pub tile_size: u32,
    /// Tiles across and down.
    pub dimensions: UVec2,
    /// Number of lights of each tile's list: x fastest, then y, from the top.
    pub lights: Vec<u32>,
}

impl TileContents {
    /// The tile of a pixel and the number of its lights; none if the image has no such pixel.
    pub fn at(&self, pixel: UVec2) -> Option<(UVec2, u32)> {
        let tile = pixel / self.tile_size.max(1);
        let index = tile.x + tile.y * self.dimensions.x;
        let lights = self.lights.get(index as usize).filter(|_| tile.x < self.dimensions.x);
        lights.map(|lights| (tile, *lights))
    }
}

/// The tiles of the views of the last frame, in their order.
pub(crate) fn tiles_of_views(
    passes: &TiledCulling,
    device: &wgpu::Device,
    queue: &wgpu::Queue,
) -> Result<Vec<TileContents>, RenderError> {
    let read = |(dimensions, cells): &(UVec2, wgpu::Buffer)| {
        let count = dimensions.element_product() as usize;
        let starts = read_back::<u32>(device, queue, cells, count + 1)?;
        let lights = starts.windows(2).map(|ends| ends[1].wrapping_sub(ends[0])).collect();
        Ok(TileContents { tile_size: passes.settings.tile_size.pixels(), dimensions: *dimensions, lights })
    };
    passes.cells.last().iter().map(read).collect()
}

#[test]
fn a_pixel_is_in_a_tile_of_its_image_or_in_none() {
    let tiles = TileContents { tile_size: 8, dimensions: UVec2::new(3, 2), lights: (10..16).collect() };
    assert_eq!(tiles.at(UVec2::new(23, 15)), Some((UVec2::new(2, 1), 15)));
    assert_eq!(tiles.at(UVec2::new(8, 7)), Some((UVec2::new(1, 0), 11)));
    assert_eq!([UVec2::new(24, 0), UVec2::new(0, 16)].map(|pixel| tiles.at(pixel)), [None; 2]);
}
