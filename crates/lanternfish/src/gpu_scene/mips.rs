//! Mip levels: each the 2 × 2 box average of the one before, in linear light.

use std::sync::LazyLock;

/// Linear value of every sRGB byte [IEC 61966-2-1].
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let s = i as f32 / 255.0;
        if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
    })
});

/// sRGB byte of a linear value, by 4,096 steps of its square root: off by one where the exact value lies within a tenth
/// of a rounding boundary, and in the darkest few.
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

fn srgb_from_linear(l: f32) -> u8 {
    SRGB_FROM_ROOT[(l.sqrt() * 4096.0).round() as usize]
}

/// The level below an image of `width` × `height` RGBA texels, half as large along each axis (rounded down, at least
/// one). Odd edges: the last texel counts twice rather than being left out.
pub fn half(rgba: &[u8], width: u32, height: u32, srgb: bool) -> (Vec<u8>, u32, u32) {
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
}
