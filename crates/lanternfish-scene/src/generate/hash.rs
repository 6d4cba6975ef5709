//! Counter-based random numbers and tileable noise: a value depends only on its coordinates.

/// PCG's output permutation as a hash of 32 bits [Jarzynski2020].
pub(crate) fn pcg(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A hash of all `parts`, in order.
pub(crate) fn hash(parts: &[u32]) -> u32 {
    parts.iter().fold(0x9e37_79b9, |state, part| pcg(state ^ pcg(*part)))
}

/// The hash of `parts` as a number in 0..1.
pub(crate) fn unit(parts: &[u32]) -> f32 {
    // An f32 between 0.5 and 1 has 24 bits of precision.
    (hash(parts) >> 8) as f32 / (1 << 24) as f32
}

/// The hash of `parts` as a number in -1..1.
pub(crate) fn signed(parts: &[u32]) -> f32 {
    2.0 * unit(parts) - 1.0
}

/// Smooth noise in 0..1 that repeats after `period` lattice cells in x and y.
pub(crate) fn noise(x: f32, y: f32, period: u32, seed: u32) -> f32 {
    let (cell_x, cell_y) = (x.floor(), y.floor());
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (s, t) = (smooth(x - cell_x), smooth(y - cell_y));
    let column = |offset: i32| (cell_x as i32 + offset).rem_euclid(period as i32) as u32;
    let row = |offset: i32| (cell_y as i32 + offset).rem_euclid(period as i32) as u32;
    let (x0, x1, y0, y1) = (column(0), column(1), row(0) * 4096, row(1) * 4096);
    // Lattice values need less mixing than random numbers; this is the inner loop of every texture.
    let value = |index: u32| (pcg(index + seed * 0x0101_0101) >> 16) as f32 / 65535.0;
    let top = value(x0 + y0) + s * (value(x1 + y0) - value(x0 + y0));
    let bottom = value(x0 + y1) + s * (value(x1 + y1) - value(x0 + y1));
    top + t * (bottom - top)
}

/// Octaves of [`noise`], each twice as fine and half as strong as the one before; 0..1, mean 0.5. `x` and `y` run
/// over 0..1, in which the first octave has `period` cells.
pub(crate) fn fractal(x: f32, y: f32, period: u32, octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..octaves {
        let cells = period << octave;
        sum += weight * noise(x * cells as f32, y * cells as f32, cells, seed + octave);
        total += weight;
        weight *= 0.5;
    }
    sum / total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_is_uniform() {
        let values: Vec<f32> = (0..10_000).map(|i| unit(&[i, 7])).collect();
        assert!(values.iter().all(|v| (0.0..1.0).contains(v)));
        let mean = values.iter().sum::<f32>() / 10_000.0;
        // Standard error of the mean of 10,000 uniform numbers: 1 / sqrt(12 * 10,000) = 0.0029; five of them.
        assert!((mean - 0.5).abs() < 0.0145, "mean {mean}");
    }

    #[test]
    fn noise_tiles_and_varies() {
        for i in 0..50 {
            let (x, y) = (0.37 * i as f32, 0.61 * i as f32);
            // 1e-4: adding 8 to x rounds its fraction by up to 2^-20, and the slope is below 2 per cell.
            assert!((noise(x, y, 8, 1) - noise(x + 8.0, y - 8.0, 8, 1)).abs() < 1e-4);
        }
        let values: Vec<f32> = (0..100).map(|i| fractal(0.013 * i as f32, 0.3, 4, 4, 2)).collect();
        let (least, greatest) = values.iter().fold((1.0f32, 0.0f32), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(least >= 0.0 && greatest <= 1.0 && greatest - least > 0.2, "{least}..{greatest}");
    }
}
