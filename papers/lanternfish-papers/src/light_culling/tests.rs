use lanternfish::{
    settings::Culling,
    techniques::{TileSize, Tiled},
};

use crate::{
    RasterGrid,
    testing::{
        self,
        culling::{Case, SIZE, check_culling, listed},
    },
};

fn tiles(size: TileSize) -> usize {
    (SIZE.x.div_ceil(size.pixels()) * SIZE.y.div_ceil(size.pixels())) as usize
}

fn grids() -> Vec<Case> {
    let all = [(TileSize::Px8, 32), (TileSize::Px16, 32), (TileSize::Px16, 7), (TileSize::Px32, 1)];
    all.map(|(tile_size, layers)| (RasterGrid { tile_size, layers }.into(), Some(tiles(tile_size) * layers as usize)))
        .to_vec()
}

#[gpu_test]
fn gpu_a_raster_grid_loses_no_light(gpu: &Gpu) {
    check_culling(gpu, &grids());
}

/// Layers reduce the number of listed lights; a single layer equals tiled culling.
#[gpu_test]
fn gpu_more_layers_list_less(gpu: &Gpu) {
    let (grid, needed) = listed(gpu, &grids());
    let boxes = [TileSize::Px8, TileSize::Px16].map(|tile_size| Tiled { tile_size, aabb_test: true });
    let (tiled, _) = listed(gpu, &boxes.map(|tiled| (Culling::from(tiled), Some(tiles(tiled.tile_size)))));
    println!("in a grid of 8 px, 16 px, 16 px and 7 layers, 32 px and one: {grid:?}; needed {needed}");
    assert!(grid.is_sorted_by(|a, b| a < b), "{grid:?}");
    assert!(3 * grid[0] < 2 * tiled[0] && 3 * grid[1] < 2 * tiled[1], "{grid:?}, {tiled:?}");
}
