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

/// The error of each channel is within 0.4 % of the largest one, over the complete range, and its mean is zero; black is not "no samples".
#[test]
fn packed_radiance_is_close() {
    let mut random = crate::testing::Random::new(9);
    let mut sum = 0.0;
    for _ in 0..4000 {
        let radiance = (random.unit() * 200.0 - 100.0).exp2() * 0.5 * (random.point() + 1.0);
        let (off, most) = (unpack(pack(radiance)) - radiance, radiance.max_element());
        assert!(off.abs().max_element() <= 0.004 * most, "{radiance}: off by {off}");
        sum += off.element_sum() / most;
    }
    assert!((sum / 4000.0).abs() < 2e-4, "{sum}");
    assert!([Vec3::ZERO, Vec3::splat(1e-44), Vec3::splat(3e38)].iter().all(|radiance| pack(*radiance) != 0));
}
