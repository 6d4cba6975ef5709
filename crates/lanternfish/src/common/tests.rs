use std::collections::HashSet;

use glam::{UVec2, Vec4};
use lanternfish_gpu::testing;

use crate::testing::evaluate;

/// The dispatch visits every tile of an image once, whatever the image's size, and successive tiles are neighbours.
#[gpu_test]
fn gpu_strips_of_tiles_cover_the_image(gpu: &Gpu) {
    for (width, height) in [(1, 1), (8, 3), (7, 5), (9, 4), (16, 1), (30, 17), (3, 40)] {
        let workgroups = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let query = |[x, y]: [u32; 2]| Vec4::new(x as f32, y as f32, width as f32, height as f32);
        let tiles: Vec<_> = evaluate(gpu, "tiles", &workgroups.map(query).collect::<Vec<_>>(), 1)
            .iter()
            .map(|answer| UVec2::new(answer.x as u32, answer.y as u32))
            .collect();
        assert!(tiles.iter().all(|tile| tile.x < width && tile.y < height), "{width} x {height}: {tiles:?}");
        assert_eq!(tiles.iter().collect::<HashSet<_>>().len(), (width * height) as usize, "{width} x {height}");
        // A strip is eight tiles wide: the row above is at most eight tiles before.
        let far = |tile: &UVec2| {
            tile.y > 0 && {
                let index = |at: UVec2| tiles.iter().position(|other| *other == at).expect("every tile is there");
                index(*tile) - index(UVec2::new(tile.x, tile.y - 1)) > 8
            }
        };
        assert!(!tiles.iter().any(far), "{width} x {height}: {tiles:?}");
    }
}
