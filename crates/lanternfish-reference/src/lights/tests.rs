use glam::{DVec3, Vec3, Vec3A};
use lanternfish_scene::{Light, LightKind, light_tree::Emitter};

use super::choice::Choice;
use crate::{Random, statistics::chi_square};

fn lights(count: u64, range: f32) -> Vec<Emitter> {
    let light = |i: u64| {
        let mut random = Random::new(4, i, 0);
        let place = 10.0 * Vec3::new(random.unit() as f32, random.unit() as f32, random.unit() as f32);
        let light = Light { kind: LightKind::Point, ..Light::point(place, Vec3::splat(0.1 + random.unit() as f32)) };
        Emitter::of_light(&light, range, 0.0)
    };
    (0..count).map(light).collect()
}

#[test]
fn emitters_are_selected_with_their_probabilities() {
    for (infinite, bounded, range) in [(0, 1, 99.0), (2, 0, 99.0), (3, 13, 99.0), (1, 40, 4.0), (0, 64, 2.5)] {
        let choice = Choice::tree(infinite, &lights(bounded, range));
        for (p, n) in
            [(Vec3A::splat(5.0), DVec3::Y), (Vec3A::new(1.0, 9.0, 3.0), DVec3::NEG_Z), (Vec3A::splat(-3.0), DVec3::X)]
        {
            let count = infinite as usize + bounded as usize;
            let mut counts = vec![0; count + 1];
            for i in 0..50_000 {
                match choice.choose(p, n, Random::new(6, i, 0).unit()) {
                    Some((emitter, chance)) => {
                        counts[emitter as usize] += 1;
                        assert!((choice.chance(p, n, emitter) / chance - 1.0).abs() < 1e-12);
                    }
                    None => counts[count] += 1,
                }
            }
            let mut expected: Vec<f64> = (0..count as u32).map(|e| choice.chance(p, n, e)).collect();
            let lost = 1.0 - expected.iter().sum::<f64>();
            expected.push(if lost > 1e-9 { lost } else { 0.0 });
            if counts.iter().filter(|c| **c > 0).count() >= 5 {
                let p_value = chi_square(&counts, &expected);
                assert!(p_value > 1e-5, "{infinite} {bounded} {range} at {p}: {p_value}");
            } else {
                for (count, fraction) in counts.iter().zip(&expected) {
                    assert!((*count as f64 / 50_000.0 - fraction).abs() < 0.015, "{counts:?}, not {expected:?}");
                }
            }
        }
    }
}
