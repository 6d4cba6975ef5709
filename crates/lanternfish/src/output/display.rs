//! Exposure, tone mapping and sRGB encoding on the CPU: the CPU reference of `output/tone_map.wesl`. A test of the command line renders
//! both.

use crate::settings::ToneMap;
use glam::{Mat3, Vec3};

/// Bytes of a PNG, three per pixel, of display-referred values.
pub fn raw(pixels: &[[f32; 3]]) -> Vec<u8> {
    pixels.iter().flatten().map(|value| byte(value.clamp(0.0, 1.0))).collect()
}

/// Bytes of a PNG, three per pixel: scaled by 2^`ev`, tone-mapped, sRGB-encoded.
pub fn encoded(pixels: &[[f32; 3]], ev: f32, curve: ToneMap) -> Vec<u8> {
    let scale = ev.exp2();
    let shown = |pixel: &[f32; 3]| tone_map(curve, Vec3::from_array(*pixel).max(Vec3::ZERO) * scale).to_array();
    pixels.iter().flat_map(shown).map(|value| byte(srgb_from_linear(value.clamp(0.0, 1.0)))).collect()
}

fn byte(value: f32) -> u8 {
    (value * 255.0 + 0.5) as u8
}

/// Exposed radiance to display-linear 0..1.
fn tone_map(curve: ToneMap, color: Vec3) -> Vec3 {
    match curve {
        ToneMap::None => color,
        ToneMap::Neutral => neutral(color),
        ToneMap::Reinhard => color / (1.0 + color.dot(Vec3::new(0.2126, 0.7152, 0.0722))),
        ToneMap::Aces => aces(color),
    }
}

/// Khronos PBR Neutral.
fn neutral(color: Vec3) -> Vec3 {
    let (start_compression, desaturation) = (0.8 - 0.04, 0.15);
    let low = color.min_element();
    let shifted = color - if low < 0.08 { low - 6.25 * low * low } else { 0.04 };
    let peak = shifted.max_element();
    if peak < start_compression {
        return shifted;
    }
    let d = 1.0 - start_compression;
    let new_peak = 1.0 - d * d / (peak + d - start_compression);
    let g = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    (shifted * (new_peak / peak)).lerp(Vec3::splat(new_peak), g)
}

/// Stephen Hill's fit of ACES' RRT and ODT for sRGB.
fn aces(color: Vec3) -> Vec3 {
    let input =
        Mat3::from_cols_array(&[0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777]);
    let output =
        Mat3::from_cols_array(&[1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602]);
    let v = input * color;
    let fitted = (v * (v + 0.0245786) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    output * fitted
}

/// Display-linear value of an sRGB-encoded byte.
pub(super) fn linear_of(byte: u8) -> f32 {
    let encoded = f32::from(byte) / 255.0;
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// [IEC 61966-2-1]
fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
