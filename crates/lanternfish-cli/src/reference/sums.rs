//! The exact sums of a part, as layers of its file.
//!
//! A sum has 128 bits, in two's complement. Each layer holds 24 of them as an integer, which 32-bit floats represent exactly. A
//! sum takes six layers, `sum.0` (the lowest bits) to `sum.5`, and the sum of squares six more, `square.0` to `square.5`.

use std::path::Path;

use lanternfish_metrics::{MetricsError, RgbImage, read_exr_layer};
use lanternfish_reference::Film;

/// Prefixes of the layer names of a pixel's two sums.
const NAMES: [&str; 2] = ["sum", "square"];
/// Bits per layer.
const BITS: usize = 24;
/// Layers per sum.
const LAYERS: usize = (u128::BITS as usize).div_ceil(BITS);
/// Layers of all sums.
pub const LAYER_COUNT: u64 = (NAMES.len() * LAYERS) as u64;

/// The film's sums as named images.
pub fn layers(film: &Film) -> Result<Vec<(String, RgbImage)>, MetricsError> {
    let [width, height] = film.size().map(|side| side as usize);
    let mut layers = Vec::new();
    for (kind, name) in NAMES.into_iter().enumerate() {
        for layer in 0..LAYERS {
            let bits = |sum: i128| (sum as u128 >> (layer * BITS)) as u32 & ((1 << BITS) - 1);
            let pixels = film.exact_sums().map(|sums| sums[kind].map(|sum| bits(sum) as f32)).collect();
            layers.push((format!("{name}.{layer}"), RgbImage::new(width, height, pixels)?));
        }
    }
    Ok(layers)
}

/// Reads every pixel's sums, in the format of [`Film::exact_sums`], from the file's layers.
pub fn read(path: &Path) -> Result<Vec<[[i128; 3]; 2]>, MetricsError> {
    let mut sums = Vec::new();
    for (kind, name) in NAMES.into_iter().enumerate() {
        for layer in 0..LAYERS {
            let image = read_exr_layer(path, &format!("{name}.{layer}"))?;
            sums.resize(image.pixels.len(), [[0_i128; 3]; 2]);
            for (sums, pixel) in sums.iter_mut().zip(&image.pixels) {
                for (sum, bits) in sums[kind].iter_mut().zip(pixel) {
                    *sum |= ((*bits as u128) << (layer * BITS)) as i128;
                }
            }
        }
    }
    Ok(sums)
}

#[cfg(test)]
mod tests {
    use lanternfish_metrics::write_exr_layers;

    use super::*;

    #[test]
    fn sums_survive_a_round_trip_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("part.exr");
        let sums = vec![
            [[0, 1, -1], [i128::MAX, i128::MIN, 1 << 24]],
            [[0x1234_5678_9abc_def0_1122_3344_5566_7788, (1 << 24) - 1, 1 << 120], [7; 3]],
        ];
        let film = Film::resume_part(2, &[3], 5, sums.clone().into_iter()).unwrap();
        let layers = layers(&film).unwrap();
        assert_eq!(layers.len(), 12);
        let layers: Vec<_> = layers.iter().map(|(name, image)| (name.as_str(), image)).collect();
        write_exr_layers(&path, &layers, &[]).unwrap();
        assert_eq!(read(&path).unwrap(), sums);
    }
}
