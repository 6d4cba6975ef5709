//! Stateless random numbers: `random.wesl` on the host, bit for bit.

use glam::{UVec2, UVec4, Vec4};

/// pcg4d: four words, each of which depends on all bits of the four inputs.
pub fn random_words(key: UVec4) -> UVec4 {
    // [Jarzynski2020].
    let mix = |[x, y, z, w]: [u32; 4]| {
        let x = x.wrapping_add(y.wrapping_mul(w));
        let y = y.wrapping_add(z.wrapping_mul(x));
        let z = z.wrapping_add(x.wrapping_mul(y));
        [x, y, z, w.wrapping_add(y.wrapping_mul(z))]
    };
    let v = key.to_array().map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(mix(v).map(|v| v ^ (v >> 16))).into()
}

/// Four numbers in 0 ≤ u < 1, of 24 bits. `pixel` below 65,536 each.
///
/// `dimension` separates the decisions of one pixel in one frame: each use has its own dimension, which `random.wesl` lists.
pub fn random_units(pixel: UVec2, frame: u32, dimension: u32, seed: u32) -> Vec4 {
    let words = random_words(UVec4::new(pixel.x | (pixel.y << 16), frame, dimension, seed));
    (words >> 8u32).as_vec4() / 16_777_216.0
}

#[cfg(test)]
mod tests {
    use lanternfish_gpu::{Bindings, Frame, Profiler, read_back, storage_buffer, storage_buffer_of, testing};

    use super::*;
    use crate::testing::probe;

    const CELLS: usize = 64;

    /// Pearson's χ² of 64 bins of pairs of numbers that should be uniform.
    fn chi_square(pairs: impl Iterator<Item = (f32, f32)>) -> f64 {
        let mut counts = [0u32; CELLS];
        for (a, b) in pairs {
            counts[(8.0 * a) as usize * 8 + (8.0 * b) as usize] += 1;
        }
        let expected = f64::from(counts.iter().sum::<u32>()) / CELLS as f64;
        counts.iter().map(|count| (f64::from(*count) - expected).powi(2) / expected).sum()
    }

    /// True if χ² with 63 degrees of freedom lies between its one-in-a-million quantiles ([WilsonHilferty1931], z = ±4.75): neither less
    /// nor more even than chance.
    fn looks_random(statistic: f64) -> bool {
        (23.0..131.7).contains(&statistic)
    }

    #[test]
    fn numbers_are_uniform_over_pixels_frames_dimensions_and_seeds() {
        const COUNT: u32 = 65_536;
        let at = |kind: u32, i: u32| match kind {
            0 => random_units(UVec2::new(i % 256, i / 256), 3, 1, 0),
            1 => random_units(UVec2::new(17, 40), i, 1, 0),
            2 => random_units(UVec2::new(17, 40), 3, i, 0),
            _ => random_units(UVec2::new(17, 40), 3, 1, i),
        };
        for kind in 0..4 {
            for (j, k) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                let pairs = (0..COUNT).map(|i| (at(kind, i)[j], at(kind, i)[k]));
                let statistic = chi_square(pairs);
                assert!(looks_random(statistic), "kind {kind}, numbers {j} and {k}: {statistic}");
            }
            // Each number with its neighbour's: successive pixels, frames, dimensions and seeds.
            for j in 0..4 {
                let statistic = chi_square((0..COUNT).map(|i| (at(kind, i)[j], at(kind, i + 1)[j])));
                assert!(looks_random(statistic), "kind {kind}, number {j} and its neighbour: {statistic}");
            }
        }
        // The test can fail: a number with itself, one that is biased by a tenth, and one on a grid.
        let pair = |i| (at(0, i)[0], at(0, i)[1]);
        assert!(!looks_random(chi_square((0..COUNT).map(|i| (pair(i).0, pair(i).0)))));
        assert!(!looks_random(chi_square((0..COUNT).map(|i| (pair(i).0.powf(1.1), pair(i).1)))));
        assert!(!looks_random(chi_square((0..COUNT).map(|i| ((i % 256) as f32 / 256.0, (i / 256) as f32 / 256.0)))));
    }

    #[gpu_test]
    fn gpu_random_numbers_are_the_hosts_bit_for_bit(gpu: &Gpu) {
        let extremes = [0, 1, 2, 255, 65_535, 65_536, 0x7fff_ffff, 0x8000_0000, u32::MAX];
        let mut queries: Vec<UVec4> =
            extremes.iter().flat_map(|x| extremes.map(|y| UVec4::new(*x, y, x ^ y, *x))).collect();
        queries.extend((0..10_000).map(|i| random_words(UVec4::splat(i))));
        let none = wgpu::BufferUsages::empty();
        let requested = storage_buffer_of(&gpu.device, "queries", &queries, none).expect("a few queries fit");
        let answers = storage_buffer(&gpu.device, "answers", 16 * queries.len() as u64).expect("a few answers fit");
        let kernel = probe(gpu, "testing/random", &[], "randoms");
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        let bindings = Bindings::new().buffer("queries", &requested).buffer("answers", &answers);
        frame.dispatch(&kernel, &bindings, [queries.len().div_ceil(64) as u32, 1, 1]);
        frame.submit();
        let answers: Vec<Vec4> = read_back(&gpu.device, &gpu.queue, &answers, queries.len()).expect("they can be read");
        for (query, answer) in queries.iter().zip(answers) {
            let expected = random_units(UVec2::new(query.x & 0xffff, query.x >> 16), query.y, query.z, query.w);
            assert_eq!(answer.to_array().map(f32::to_bits), expected.to_array().map(f32::to_bits), "{query}");
        }
    }
}
