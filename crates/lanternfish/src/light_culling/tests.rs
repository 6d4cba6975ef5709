//! Culling loses no light: every light in range of a visible point is in the point's list.

use lanternfish_gpu::testing;

use crate::{
    settings::Culling,
    techniques::{Assignment, ClusterShape, Clustered, TileSize, Tiled},
    testing::culling::{Case, SIZE, check_culling, listed},
};

fn tiled() -> Vec<Case> {
    let tiles = |size: TileSize| (SIZE.x.div_ceil(size.pixels()) * SIZE.y.div_ceil(size.pixels())) as usize;
    let of = |tile_size: TileSize| {
        [false, true].map(|aabb_test| (Culling::from(Tiled { tile_size, aabb_test }), Some(tiles(tile_size))))
    };
    TileSize::ALL.iter().copied().flat_map(of).collect()
}

fn clustered() -> Vec<Case> {
    let shapes = [
        ClusterShape::Perspective { pixels: 16 },
        ClusterShape::Orthographic { side: 0.7 },
        ClusterShape::Displaced { pixels: 16, distance: 2.0 },
    ];
    let of = |shape| {
        let assignments = Assignment::ALL.iter().copied();
        assignments.map(move |assignment| (Clustered { shape, assignment, ..Clustered::default() }.into(), None))
    };
    shapes.into_iter().flat_map(of).collect()
}

#[gpu_test]
fn gpu_culling_loses_no_light(gpu: &Gpu) {
    check_culling(gpu, &tiled().into_iter().chain(clustered()).collect::<Vec<_>>());
}

/// Smaller tiles and the box test give shorter lists.
#[gpu_test]
fn gpu_smaller_tiles_and_the_box_test_list_less(gpu: &Gpu) {
    let (totals, needed) = listed(gpu, &tiled());
    println!("listed with 8 px, 8 px and boxes, 16 px, …: {totals:?}; needed {needed}");
    assert!(totals.windows(3).all(|t| t[0] < t[2]), "{totals:?}");
    assert!(totals.chunks_exact(2).all(|t| t[1] < t[0]), "{totals:?}");
    assert!(totals.iter().all(|total| *total as usize >= needed), "{totals:?}");
}
