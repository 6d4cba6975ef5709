//! The layers of a deep image as one image [Archer2019, fig. 6]: the first five, and all as transparent surfaces.

use lanternfish::RenderError;
use lanternfish_gpu::Gpu;
use lanternfish_papers::deep_images::{DeepImages, Fragment};

/// What the image shows.
pub const TEXT: &str = "`layers.png`: of the first image of the first row, its first five layers, and all of them as \
                        transparent surfaces [Archer2019, fig. 6]. Lighter is nearer, dark blue: no fragment.";

/// Panels beside each other, and layers with a panel of their own.
const COLUMNS: usize = 3;
const LAYERS: usize = 5;
/// Pixels of a texel's edge, and of the gap between two panels.
const UPSCALE: usize = 3;
const GAP: usize = 8;
/// Light of the farthest fragment; the nearest has 1.
const FARTHEST: f32 = 0.15;
/// Opacity of a surface where all are shown.
const OPACITY: f32 = 0.3;
/// Colour of a texel without a fragment.
const EMPTY: [u8; 3] = [20, 26, 71];

/// Size and RGB bytes of the layers of the first of these images, whose lists are sorted.
pub fn sheet(gpu: &Gpu, images: &DeepImages) -> Result<([u32; 2], Vec<u8>), RenderError> {
    let chunk = &images.chunks[0];
    let resolution = chunk.grid.resolution as usize;
    let mut lists = images.read_lists(&gpu.device, &gpu.queue, chunk)?;
    lists.truncate(resolution * resolution);
    // Rows follow the image's y, seen along z with x to the right: downwards.
    if images.directions.frame(0).y_axis.y > 0.0 {
        lists.reverse();
    }
    Ok(side_by_side(&panels(&lists), resolution))
}

/// The light of each texel in each panel, 0 to 1; none without a fragment.
fn panels(lists: &[Vec<Fragment>]) -> Vec<Vec<Option<f32>>> {
    let depths = || lists.iter().flatten().map(|fragment| fragment.depth);
    let (nearest, farthest) = (depths().fold(f32::MAX, f32::min), depths().fold(f32::MIN, f32::max));
    let light = |fragment: &Fragment| {
        let part = (fragment.depth - nearest) / (farthest - nearest).max(f32::MIN_POSITIVE);
        1.0 + (FARTHEST - 1.0) * part
    };
    let blended = |list: &Vec<Fragment>| {
        let over = |behind, fragment: &Fragment| behind + OPACITY * (light(fragment) - behind);
        (!list.is_empty()).then(|| list.iter().rev().fold(0.0, over))
    };
    let layer = |layer: usize| lists.iter().map(|list| list.get(layer).map(light)).collect();
    (0..LAYERS).map(layer).chain([lists.iter().map(blended).collect()]).collect()
}

/// Square panels of `resolution` texels an edge in rows, with white between them.
fn side_by_side(panels: &[Vec<Option<f32>>], resolution: usize) -> ([u32; 2], Vec<u8>) {
    let pitch = UPSCALE * resolution + GAP;
    let (width, height) = (COLUMNS * pitch - GAP, panels.len().div_ceil(COLUMNS) * pitch - GAP);
    let mut rgb = vec![255; 3 * width * height];
    for (i, pixel) in rgb.as_chunks_mut::<3>().0.iter_mut().enumerate() {
        let (x, y) = (i % width, i / width);
        let (column, row) = (x % pitch / UPSCALE, y % pitch / UPSCALE);
        if column < resolution && row < resolution {
            let light = panels[y / pitch * COLUMNS + x / pitch][row * resolution + column];
            *pixel = light.map_or(EMPTY, |light| [(255.0 * light).round() as u8; 3]);
        }
    }
    ([width as u32, height as u32], rgb)
}

#[test]
fn layers_are_those_of_the_lists() {
    let list = |depths: &[f32]| depths.iter().map(|depth| Fragment { depth: *depth, triangle: None }).collect();
    let lists: [Vec<Fragment>; 4] = [list(&[]), list(&[-1.0]), list(&[-1.0, 1.0]), list(&[0.0, 1.0, 1.0])];
    let panels = panels(&lists);
    let middle = 0.5 * (1.0 + FARTHEST);
    assert_eq!(panels[0], [None, Some(1.0), Some(1.0), Some(middle)]);
    assert_eq!(panels[1], [None, None, Some(1.0 + (FARTHEST - 1.0)), Some(1.0 + (FARTHEST - 1.0))]);
    assert!(panels[LAYERS - 1].iter().all(Option::is_none));
    let all = &panels[LAYERS];
    assert!(all[0].is_none() && all[1] == Some(OPACITY) && all[2] > all[1]);
    let (size, rgb) = side_by_side(&panels, 2);
    assert_eq!(size, [3 * 6 + 2 * 8, 2 * 6 + 8]);
    let at = |x: usize, y: usize| &rgb[3 * (y * size[0] as usize + x)..][..3];
    assert_eq!([at(0, 0), at(3, 0), at(6, 0)], [&EMPTY[..], &[255; 3], &[255; 3]]);
    let farthest = (255.0 * FARTHEST).round() as u8;
    assert_eq!([at(14, 2), at(14, 3), at(17, 5)], [&EMPTY[..], &[farthest; 3], &[farthest; 3]]);
}
