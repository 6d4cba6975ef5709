//! Mip levels: each is the box average of the previous one, in linear light. A box is two texels wide if the size is even; if it is odd, a
//! box covers n / ⌊n/2⌋ texels, so that no texel is left out and the image does not shift.

use std::sync::LazyLock;

use glam::Vec3;
use lanternfish_scene::{Image, LINEAR_FROM_SRGB, linear_from_srgb};
use rayon::prelude::*;

/// sRGB byte of a linear value, tabulated in 4,096 steps of its square root: off by one if the exact value lies within a tenth of a
/// rounding boundary, and in the darkest few.
static SRGB_FROM_ROOT: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=4096)
        .map(|i| {
            let root = i as f32 / 4096.0;
            let l = root * root;
            let s = if l <= 0.003_130_8 { 12.92 * l } else { 1.055 * l.powf(1.0 / 2.4) - 0.055 };
            (s * 255.0).round() as u8
        })
        .collect()
});

/// sRGB byte of a linear value, 0 to 1.
pub fn srgb_from_linear(l: f32) -> u8 {
    SRGB_FROM_ROOT[(l.sqrt() * 4096.0).round() as usize]
}

/// Mean of the alpha channel, 0 to 1.
pub fn mean_alpha(image: &Image) -> f32 {
    let sum: u64 = image.rgba.par_chunks(4).map(|texel| u64::from(texel[3])).sum();
    (sum as f64 / 255.0 / f64::from(image.width) / f64::from(image.height)) as f32
}

/// Mean of the colour channels, 0 to 1; in linear light where they are sRGB.
pub fn mean(image: &Image, srgb: bool) -> Vec3 {
    let value = |byte: u8| if srgb { linear_from_srgb(byte) } else { f32::from(byte) / 255.0 };
    let sum: glam::DVec3 = image
        .rgba
        .par_chunks(4)
        .map(|texel| Vec3::new(value(texel[0]), value(texel[1]), value(texel[2])).as_dvec3())
        .sum();
    (sum / f64::from(image.width) / f64::from(image.height)).as_vec3()
}

/// The next mip level of an image of `width` × `height` RGBA texels, half as large along each axis (rounded down, at least one).
pub fn half(rgba: &[u8], width: u32, height: u32, srgb: bool) -> (Vec<u8>, u32, u32) {
    let is_paired = |n: u32| n == 1 || n.is_multiple_of(2);
    if is_paired(width) && is_paired(height) {
        half_of_pairs(rgba, width, height, srgb)
    } else {
        half_of_any::<4>(rgba, width, height, |channel| srgb && channel < 3)
    }
}

/// [`half`] of an image with one linear channel.
pub fn half_alpha(alpha: &[u8], width: u32, height: u32) -> (Vec<u8>, u32, u32) {
    half_of_any::<1>(alpha, width, height, |_| false)
}

/// [`half`] of an image whose size along each axis is even or one.
fn half_of_pairs(rgba: &[u8], width: u32, height: u32, srgb: bool) -> (Vec<u8>, u32, u32) {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let mut out = Vec::with_capacity((w * h * 4) as usize);
    let linear = &*LINEAR_FROM_SRGB;
    for y in 0..h {
        let rows = [(2 * y).min(height - 1), (2 * y + 1).min(height - 1)];
        for x in 0..w {
            let columns = [(2 * x).min(width - 1), (2 * x + 1).min(width - 1)];
            let texels = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(r, c)| (4 * (rows[r] * width + columns[c])) as usize);
            for channel in 0..4 {
                let bytes = texels.map(|t| rgba[t + channel]);
                out.push(if srgb && channel < 3 {
                    srgb_from_linear(0.25 * bytes.map(|b| linear[b as usize]).iter().sum::<f32>())
                } else {
                    ((bytes.iter().map(|b| u32::from(*b)).sum::<u32>() + 2) / 4) as u8
                });
            }
        }
    }
    (out, w, h)
}

/// Weights with which texels 2i, 2i + 1 and 2i + 2 of `n` contribute to texel i of the next level. If n = 2m + 1, texel i covers the n / m
/// texels from i n / m on; if n is even, two texels.
fn box_weights(n: u32, i: u32) -> [f32; 3] {
    let m = n / 2;
    if n == 1 {
        [1.0, 0.0, 0.0]
    } else if n.is_multiple_of(2) {
        [0.5, 0.5, 0.0]
    } else {
        [m - i, m, i + 1].map(|overlap| overlap as f32 / n as f32)
    }
}

/// [`half`] of an image of any size: averages rows first, then columns. `CHANNELS` bytes a texel.
fn half_of_any<const CHANNELS: usize>(
    texels: &[u8],
    width: u32,
    height: u32,
    is_srgb: impl Fn(usize) -> bool,
) -> (Vec<u8>, u32, u32) {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let srgb: [bool; CHANNELS] = std::array::from_fn(is_srgb);
    // The value of every byte, for each channel: linear light for sRGB, else the byte itself.
    let bytes: [f32; 256] = std::array::from_fn(|i| i as f32);
    let values: [&[f32; 256]; CHANNELS] = srgb.map(|srgb| if srgb { &*LINEAR_FROM_SRGB } else { &bytes });
    let columns: Vec<[f32; 3]> = (0..w).map(|x| box_weights(width, x)).collect();

    let mut out = Vec::with_capacity((w * h) as usize * CHANNELS);
    let mut row = vec![[0.0f32; CHANNELS]; width as usize];
    for y in 0..h {
        row.fill([0.0; CHANNELS]);
        for (tap, weight) in box_weights(height, y).into_iter().enumerate().filter(|(_, weight)| *weight > 0.0) {
            let first = (2 * y as usize + tap) * width as usize * CHANNELS;
            let source = texels[first..first + width as usize * CHANNELS].as_chunks::<CHANNELS>().0;
            for (sum, texel) in row.iter_mut().zip(source) {
                for channel in 0..CHANNELS {
                    sum[channel] += weight * values[channel][texel[channel] as usize];
                }
            }
        }
        for (x, weights) in columns.iter().enumerate() {
            let mut sum = [0.0; CHANNELS];
            for (weight, texel) in weights.iter().zip(&row[2 * x..]) {
                for channel in 0..CHANNELS {
                    sum[channel] += weight * texel[channel];
                }
            }
            for channel in 0..CHANNELS {
                let value = sum[channel];
                out.push(if srgb[channel] { srgb_from_linear(value) } else { (value + 0.5) as u8 });
            }
        }
    }
    (out, w, h)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_image_stays_flat_at_every_byte_and_both_encodings() {
        for value in 0..=255u8 {
            for srgb in [false, true] {
                let (level, w, h) = half(&[value; 3 * 5 * 4], 3, 5, srgb);
                assert_eq!((w, h), (1, 2));
                assert!(level.iter().all(|v| v.abs_diff(value) <= u8::from(srgb && value < 8)), "{value} {level:?}");
            }
        }
    }

    #[test]
    fn srgb_averages_light_not_bytes() {
        let board = [0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 255];
        // Half the light is byte 187.52, so the table may round either way; the bytes' average is 128.
        let level = half(&board, 2, 2, true).0;
        assert!(level[..3].iter().all(|v| (187..=188).contains(v)) && level[3] == 255, "{level:?}");
        assert_eq!(half(&board, 2, 2, false).0, [128, 128, 128, 255]);
    }

    /// A row of texels and all its mip levels.
    fn levels_of_row(row: &[u8]) -> Vec<Vec<u8>> {
        let mut levels = vec![row.to_vec()];
        while levels[levels.len() - 1].len() > 1 {
            let last = &levels[levels.len() - 1];
            let rgba: Vec<u8> = last.iter().flat_map(|v| [*v; 4]).collect();
            let (next, ..) = half(&rgba, last.len() as u32, 1, false);
            // One channel alone gives the same values as among four.
            assert_eq!(half_alpha(last, last.len() as u32, 1).0, next.iter().step_by(4).copied().collect::<Vec<_>>());
            levels.push(next.into_iter().step_by(4).collect());
        }
        levels
    }

    #[test]
    fn every_texel_counts_the_same_at_odd_sizes() {
        for (width, height) in [(3, 1), (5, 1), (1, 7), (3, 3), (5, 4), (6, 9), (9, 7)] {
            for lit in 0..width * height {
                let mut rgba = vec![0; (4 * width * height) as usize];
                rgba[4 * lit as usize..][..4].fill(255);
                for srgb in [false, true] {
                    let (level, w, h) = half(&rgba, width, height, srgb);
                    // Half a byte. A step of sRGB is up to 2.3 times as much light, and the table may be off by one.
                    let byte = 1.0 / 255.0;
                    let color_bytes = if srgb { 1.5 * 2.3 } else { 0.5 };
                    for (channel, tolerance) in [(0, color_bytes * byte), (3, 0.5 * byte)] {
                        let light = |v: u8| match srgb && channel == 0 {
                            true => LINEAR_FROM_SRGB[v as usize],
                            false => byte * f32::from(v),
                        };
                        let sum: f32 = level.iter().skip(channel).step_by(4).map(|v| light(*v)).sum();
                        let (mean, expected) = (sum / (w * h) as f32, 1.0 / (width * height) as f32);
                        assert!((mean - expected).abs() <= tolerance, "{width} x {height}, texel {lit}: {mean}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_gradient_stays_centred_down_to_one_texel() {
        for n in [3u32, 5, 7, 31, 33, 60, 63] {
            let row: Vec<u8> = (0..n).map(|x| (4 * x) as u8).collect();
            let levels = levels_of_row(&row);
            for (below, level) in levels.iter().enumerate() {
                // Mirrored pairs add up to first plus last, except half a byte per level on each side.
                let off = level.iter().zip(level.iter().rev()).map(|(a, b)| u32::from(*a) + u32::from(*b));
                let worst = off.map(|sum| sum.abs_diff(4 * (n - 1))).max().unwrap();
                assert!(worst as usize <= below, "{n} texels, level {below}: off by {worst}, {level:?}");
            }
        }
    }
}
