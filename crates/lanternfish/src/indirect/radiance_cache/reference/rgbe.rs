//! Three mantissas of 8 bits with a shared exponent [Ward1991].

use glam::Vec3;

/// Least and largest exponent of packed radiance, in the bits of a float.
const EXPONENTS: [u32; 2] = [8, 254];

/// 2 to the power of a float's exponent bits.
fn power(exponent: u32) -> f32 {
    f32::from_bits(exponent << 23)
}

/// Packs radiance that is not negative; never 0, which means no samples.
pub(in super::super) fn pack(radiance: Vec3) -> u32 {
    let [least, most] = EXPONENTS;
    let exponent = (radiance.max_element().to_bits() / (1 << 23)).clamp(least, most);
    let mantissa = |x: f32| (x * power(254 + 7 - exponent) + 0.5).clamp(0.0, 255.0) as u32;
    let [r, g, b] = radiance.to_array().map(mantissa);
    u32::from_le_bytes([r as u8, g as u8, b as u8, exponent as u8])
}

pub(in super::super) fn unpack(bits: u32) -> Vec3 {
    let [r, g, b, exponent] = bits.to_le_bytes();
    Vec3::new(r.into(), g.into(), b.into()) * power(u32::from(exponent).max(EXPONENTS[0]) - 7)
}
