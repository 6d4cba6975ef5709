//! Subpixel jitter of the frames of a mean.

use glam::{DVec2, UVec2, Vec2};

/// Digits of the sequence that are flipped. The first three were chosen among all combinations, by the errors of edges and textures in means of
/// 2, 4, 8 and 16 frames. The further digits put each point at a third of its box, at every scale: rounding moves no point to another box.
const SCRAMBLE: UVec2 = UVec2::new(0x6aaa_aaaa, 0x2aaa_aaaa);

/// Subpixel jitter of frame `frame` from the pixel centre, pixels, −½ to ½ each, x right and y down. The values are the same on every machine.
///
/// Every mean of the first frames is shown, so that each must be near the centre: a shift by a seventh of a pixel doubles the error of a fine
/// texture. Frames come in pairs about the centre. The first pair is the centre itself; of the others one is a point of Sobol's (0, 2)-sequence
/// [KolligKeller2002, §2] in the left half of the pixel, the other its mirror image. Of 2ⁿ frames after the first pair, each box of 2⁻ᵃ × 2ᵃ⁻ⁿ
/// pixels, at most half a pixel wide, contains exactly one.
pub fn jitter_of_frame(frame: u32) -> Vec2 {
    let Some(pair) = (frame / 2).checked_sub(1) else { return Vec2::ZERO };
    let fraction = sobol_point(pair) ^ SCRAMBLE;
    let left = fraction.as_dvec2() / 2f64.powi(32) * DVec2::new(0.5, 1.0) - 0.5;
    (if frame.is_multiple_of(2) { left } else { -left }).as_vec2()
}

/// Point `index` of Sobol's (0, 2)-sequence, times 2³².
pub(crate) fn sobol_point(index: u32) -> UVec2 {
    UVec2::new(index.reverse_bits(), second_dimension(index))
}

/// The second dimension of Sobol's sequence, times 2³² [KolligKeller2002, p. 559].
fn second_dimension(mut index: u32) -> u32 {
    let (mut direction, mut sum) = (1 << 31, 0);
    while index != 0 {
        sum ^= if index & 1 == 1 { direction } else { 0 };
        index >>= 1;
        direction ^= direction >> 1;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// True if each box of 2⁻ᵃ × 2ᵃ⁻ⁿ, at most half a pixel wide, has one of 2ⁿ points.
    fn fills_every_box(points: &[Vec2]) -> bool {
        let n = points.len().ilog2();
        (1..=n).all(|a| {
            let mut counts = vec![0; points.len()];
            for point in points {
                let at = ((*point + 0.5) * Vec2::new((1 << a) as f32, (1 << (n - a)) as f32)).as_uvec2();
                counts[((at.y << a) + at.x) as usize] += 1;
            }
            counts.iter().all(|count| *count == 1)
        })
    }

    #[test]
    fn jitter_is_within_the_pixel_and_uniform() {
        for frame in (0..10_000).chain([u32::MAX - 1, u32::MAX]) {
            assert!(jitter_of_frame(frame).abs().max_element() <= 0.5, "{frame}");
        }
        for n in 1..=10 {
            let points: Vec<Vec2> = (2..2 + (1 << n)).map(jitter_of_frame).collect();
            assert!(fills_every_box(&points), "{n}");
        }
        // Check that the test can fail: random points.
        let mut random = Random::new(1);
        let points: Vec<Vec2> = (0..64).map(|_| Vec2::new(random.unit(), random.unit()) - 0.5).collect();
        assert!(!fills_every_box(&points));
    }

    /// Sobol's sequence alone has a mean of a quarter of a pixel after two frames.
    #[test]
    fn means_of_few_frames_are_near_the_centre() {
        assert_eq!([0, 1].map(jitter_of_frame), [Vec2::ZERO; 2]);
        for frames in 1..=65 {
            let mean = (0..frames).map(|frame| jitter_of_frame(frame).as_dvec2()).sum::<DVec2>() / f64::from(frames);
            let most = if frames % 2 == 0 { 0.0 } else { 0.71 / f64::from(frames) };
            assert!(mean.length() <= most, "{frames}: {mean}");
        }
    }
}
