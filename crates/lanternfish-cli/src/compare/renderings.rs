//! Images of the difference.

use std::path::Path;

use lanternfish_metrics::{ColorType, FlipMap, Pair, RgbImage, write_png};

use crate::error::CliError;

/// Cyan, which the error map does not contain: an excluded pixel.
const LEFT_OUT: [u8; 3] = [0, 255, 255];

/// Gap between the images, pixels. Its grey is unlikely to occur at their borders.
const GAP: usize = 8;
const GAP_COLOR: [u8; 3] = [96, 96, 96];

pub fn write_map(path: &Path, pair: &Pair, map: &FlipMap) -> Result<(), CliError> {
    write(path, map.width, map.height, &map_panel(pair, map).concat())
}

/// Writes A, B and the error map side by side.
pub fn write_side_by_side(path: &Path, shown: &Pair, map: &FlipMap) -> Result<(), CliError> {
    let panels = [image_panel(shown, shown.image()), image_panel(shown, shown.reference()), map_panel(shown, map)];
    let width = 3 * map.width + 2 * GAP;
    let mut bytes = Vec::with_capacity(3 * width * map.height);
    for y in 0..map.height {
        for (i, panel) in panels.iter().enumerate() {
            if i > 0 {
                bytes.extend([GAP_COLOR; GAP].concat());
            }
            bytes.extend(panel[y * map.width..][..map.width].iter().flatten());
        }
    }
    write(path, width, map.height, &bytes)
}

fn map_panel(pair: &Pair, map: &FlipMap) -> Vec<[u8; 3]> {
    let colors = map.magma();
    let colors = colors.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]);
    colors.zip(pair.is_compared()).map(|(color, is_compared)| if *is_compared { color } else { LEFT_OUT }).collect()
}

fn image_panel(shown: &Pair, rendering: &RgbImage) -> Vec<[u8; 3]> {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let pixels = rendering.pixels.iter().zip(shown.is_compared());
    pixels.map(|(pixel, is_compared)| if *is_compared { pixel.map(byte) } else { LEFT_OUT }).collect()
}

fn write(path: &Path, width: usize, height: usize, bytes: &[u8]) -> Result<(), CliError> {
    // File formats limit each side to 31 bits.
    let side = |pixels: usize| u32::try_from(pixels).expect("three images fit");
    Ok(write_png(path, [side(width), side(height)], ColorType::Rgb, bytes)?)
}
