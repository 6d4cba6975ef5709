//! Lights at random positions, by a rule that other renderers can reproduce.

use glam::Vec3;

use crate::{Bounds, Light};

/// `count` point lights of one `radius` (their range, m) at random positions within `bounds`, in random light colours.
///
/// SplitMix64 from `seed` [Steele2014, fig. 16]; each number is u = (next >> 40) / 2²⁴, six per light in the order x y z r g b. Position:
/// low + u · (high − low); linear colour: 0.25 + 0.75 · u; luminous intensity: radius² × colour, cd. All arithmetic is in 32 bits.
pub fn random_lights(bounds: &Bounds, count: u32, radius: f32, seed: u64) -> Vec<Light> {
    let mut state = seed;
    let mut unit = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    };
    (0..count)
        .map(|_| {
            let mut three = || Vec3::new(unit(), unit(), unit());
            let (fractions, color) = (three(), three());
            let position = bounds.min + fractions * (bounds.max - bounds.min);
            Light { range: Some(radius), ..Light::point(position, radius * radius * (0.25 + 0.75 * color)) }
        })
        .collect()
}

#[test]
fn lights_follow_the_rule() {
    let bounds = Bounds { min: Vec3::new(-9.0, 0.0, -4.0), max: Vec3::new(9.0, 9.0, 4.0) };
    let lights = random_lights(&bounds, 3, 2.0, 1234567);
    // SplitMix64's published first outputs for the seed 1234567.
    let outputs: [u64; 5] = [
        6_457_827_717_110_365_317,
        3_203_168_211_198_807_973,
        9_817_491_932_198_370_423,
        4_593_380_528_125_082_431,
        16_408_922_859_458_223_821,
    ];
    let u = outputs.map(|output| (output >> 40) as f32 / 16_777_216.0);
    assert_eq!(lights[0].position, bounds.min + Vec3::new(u[0], u[1], u[2]) * bounds.size());
    assert_eq!(
        (lights[0].intensity.x, lights[0].intensity.y),
        (4.0 * (0.25 + 0.75 * u[3]), 4.0 * (0.25 + 0.75 * u[4]))
    );
    assert_eq!(lights[0].range, Some(2.0));
    assert_eq!(random_lights(&bounds, 2, 2.0, 1234567), lights[..2]);
    assert_ne!(random_lights(&bounds, 2, 2.0, 1234568), lights[..2]);
}
