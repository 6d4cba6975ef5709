//! Counter-based random numbers.

/// The increment of SplitMix64 [Steele2014]: 2⁶⁴ over the golden ratio, odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// Output function of SplitMix64 [Steele2014].
fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// The random numbers of one sample of a pixel, in the order in which they are drawn. They depend only on seed, pixel and sample, not on
/// threads or other draws.
#[derive(Clone, Debug)]
pub struct Random {
    key: u64,
    drawn: u64,
}

impl Random {
    /// The random numbers of sample `sample` of pixel `pixel`.
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let key = mix(mix(mix(seed.wrapping_add(GAMMA)) ^ pixel).wrapping_add(GAMMA) ^ sample);
        Self { key, drawn: 0 }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.drawn += 1;
        mix(self.key.wrapping_add(self.drawn.wrapping_mul(GAMMA)))
    }

    /// The next number, uniform in 0..1, 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A random number in 0..1 for each pair of `key` and `index`. It decides if a ray passes a triangle with partial coverage.
pub(crate) fn unit_of(key: u64, index: u32) -> f32 {
    (mix(key ^ u64::from(index).wrapping_mul(GAMMA)) >> 40) as f32 / (1u64 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::chi_square;

    #[test]
    fn streams_are_uniform_and_differ() {
        // Successive draws, samples or pixels: pairs of consecutive numbers in 64 cells.
        for kind in 0..3 {
            let mut counts = [0u64; 64];
            for i in 0..65_536 {
                let (pixel, sample) = [(7, 9), (7, i), (i, 9)][kind];
                let mut random = Random::new(1, pixel, sample);
                if kind == 0 {
                    random.drawn = 2 * i;
                }
                let (a, b) = (random.unit(), random.unit());
                counts[(8.0 * a) as usize * 8 + (8.0 * b) as usize] += 1;
            }
            let p = chi_square(&counts, &[1.0 / 64.0; 64]);
            assert!(p > 1e-4, "kind {kind}: p = {p}");
        }
        assert_ne!(Random::new(1, 2, 3).bits(), Random::new(2, 2, 3).bits());
        assert_ne!(Random::new(1, 2, 3).bits(), Random::new(1, 3, 2).bits());
    }
}
