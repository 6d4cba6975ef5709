use std::f32::consts::PI;

use glam::Vec3;

use super::*;
use crate::{
    Light, LightKind,
    shading::{Attenuation, Falloff},
};

/// A generator of numbers in 0..1, equal on every machine.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn point(&mut self) -> Vec3 {
        10.0 * Vec3::new(self.unit(), self.unit(), self.unit())
    }

    fn direction(&mut self) -> Vec3 {
        (self.point() - 5.0).try_normalize().unwrap_or(Vec3::X)
    }
}

const RANGE: f32 = 4.0;

/// Points (some of them disks), spots and one-sided triangles, in alternation.
fn emitters(count: usize) -> (Vec<Emitter>, Vec<Light>) {
    let mut random = Random(7);
    let mut lights = Vec::new();
    let emitter = |i: usize| {
        let (position, direction, power) = (random.point(), random.direction(), 0.1 + random.unit());
        let kind = if i % 3 == 1 {
            LightKind::Spot { inner_angle: 0.2, outer_angle: 0.3 + random.unit() }
        } else if i % 6 == 3 {
            LightKind::Disk { radius: 0.8 }
        } else {
            LightKind::Point
        };
        let light = Light { kind, direction, range: Some(RANGE), ..Light::point(position, Vec3::splat(power)) };
        lights.push(light.clone());
        if i % 3 == 2 {
            let (right, up) = direction.any_orthonormal_pair();
            Emitter::of_triangle([position, position + 0.3 * right, position + 0.3 * up], power, Some(direction))
        } else {
            Emitter::of_light(&light, RANGE, 0.0)
        }
    };
    ((0..count).map(emitter).collect(), lights)
}

fn receivers(count: usize) -> Vec<Receiver> {
    let mut random = Random(11);
    (0..count).map(|_| Receiver { p: random.point(), normal: random.direction(), is_transmitting: false }).collect()
}

/// Light that arrives at a surface, up to a factor.
fn sent(light: &Light, receiver: &Receiver) -> f64 {
    let towards = light.position - receiver.p;
    let wi = towards.normalize();
    let cone = match light.kind {
        LightKind::Spot { inner_angle, outer_angle } => {
            let span = inner_angle.cos() - outer_angle.cos();
            ((-wi.dot(light.direction) - outer_angle.cos()) / span).clamp(0.0, 1.0).powi(2)
        }
        // A part of the disk may be visible if its centre is not.
        LightKind::Disk { radius } => {
            let height = (receiver.p - light.position).dot(light.direction);
            let rise = radius * (1.0 - receiver.normal.dot(light.direction).powi(2)).max(0.0).sqrt();
            let highest = towards.dot(receiver.normal) + rise;
            let falloff = Falloff::from(Attenuation::Gltf).factor(towards.length(), RANGE);
            return f64::from(if highest > 0.01 { light.intensity.x * falloff * height.max(0.0) } else { 0.0 });
        }
        _ => 1.0,
    };
    let falloff = Falloff::from(Attenuation::Gltf).factor(towards.length(), RANGE);
    f64::from(light.intensity.x * falloff * cone * wi.dot(receiver.normal).max(0.0))
}

/// True if light of the triangle's centre or corners arrives.
fn triangle_sends(emitter: &Emitter, light: &Light, receiver: &Receiver) -> bool {
    let wi = (light.position - receiver.p).normalize();
    emitter.power > 0.0 && wi.dot(receiver.normal) > 0.01 && wi.dot(light.direction) < -0.01
}

#[test]
fn contributing_emitters_have_a_probability_and_probabilities_sum_to_at_most_one() {
    for count in [1, 2, 3, 40, 600] {
        let (emitters, lights) = emitters(count);
        let tree = LightTree::new(&emitters);
        let (mut reached, mut complete) = (0, 0.0);
        for receiver in receivers(60) {
            let chances: Vec<f64> = (0..count as u32).map(|e| tree.chance(&receiver, e)).collect();
            let sum: f64 = chances.iter().sum();
            assert!(sum < 1.0 + 1e-9, "{count}: {sum}");
            complete += sum / 60.0;
            for (i, (emitter, light)) in emitters.iter().zip(&lights).enumerate() {
                let arrives =
                    if i % 3 == 2 { triangle_sends(emitter, light, &receiver) } else { sent(light, &receiver) > 0.0 };
                assert!(!arrives || chances[i] > 0.0, "emitter {i} of {count} at {receiver:?}");
                reached += usize::from(arrives);
            }
        }
        assert!(reached > 0, "{count}: nothing is reached");
        // Some descents end at a node of zero importance, but not many.
        println!("{count}: {complete:.3} of all descents end at an emitter");
        assert!(count < 600 || complete > 0.4, "{count}: {complete} of all descents end at an emitter");
    }
    // Without ranges and sides all descents end at an emitter.
    let all: Vec<Emitter> = emitters(300).0.iter().map(|e| Emitter { range: 1e9, cone: Cone::ALL, ..*e }).collect();
    let tree = LightTree::new(&all);
    for receiver in receivers(40) {
        let receiver = Receiver { is_transmitting: true, ..receiver };
        let sum: f64 = (0..300).map(|e| tree.chance(&receiver, e)).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    }
}

#[test]
fn emitters_out_of_range_are_not_selected() {
    let (emitters, _) = emitters(300);
    let tree = LightTree::new(&emitters);
    for receiver in receivers(40) {
        for (i, emitter) in emitters.iter().enumerate() {
            let away = receiver.p.distance(receiver.p.clamp(emitter.bounds.min, emitter.bounds.max));
            if away >= emitter.range {
                assert_eq!(tree.chance(&receiver, i as u32), 0.0);
            }
        }
    }
}

#[test]
fn the_estimate_is_unbiased() {
    let (emitters, lights) = emitters(200);
    let points: Vec<usize> = (0..200).filter(|i| i % 3 != 2).collect();
    let tree = LightTree::new(&points.iter().map(|i| emitters[*i]).collect::<Vec<_>>());
    let lights: Vec<&Light> = points.iter().map(|i| &lights[*i]).collect();
    let count = 4000;
    let mut lit = 0;
    for receiver in receivers(12) {
        let expected: f64 = lights.iter().map(|light| sent(light, &receiver)).sum();
        // Stratified numbers: the frequency of each emitter is exact to one sample.
        let of = |i: usize| {
            let chosen = tree.choose(&receiver, (i as f64 + 0.5) / f64::from(count))?;
            assert!((tree.chance(&receiver, chosen.0) / chosen.1 - 1.0).abs() < 1e-9);
            Some(sent(lights[chosen.0 as usize], &receiver) / chosen.1)
        };
        let mean = (0..count as usize).filter_map(of).sum::<f64>() / f64::from(count);
        assert!((mean - expected).abs() < 0.02 * expected + 1e-6, "{mean}, not {expected}");
        lit += usize::from(expected > 0.01);
    }
    assert!(lit > 6, "{lit} lit");
}

#[test]
fn a_million_coincident_emitters_give_a_shallow_tree() {
    let light = Light::point(Vec3::ONE, Vec3::ONE);
    let emitters = vec![Emitter::of_light(&light, 5.0, 0.0); 1 << 20];
    let tree = LightTree::new(&emitters);
    assert_eq!((tree.depth(), tree.nodes().len()), (20, (1 << 21) - 1));
    assert_eq!(tree, LightTree::new(&emitters));
}

#[test]
fn joined_cones_contain_their_parts() {
    let mut random = Random(3);
    for _ in 0..500 {
        let mut cone =
            || Cone { axis: random.direction(), cos_spread: (0.6 * random.unit() * PI).cos(), cos_reach: 0.5 };
        let (a, b) = (cone(), cone());
        let both = Emitter { cone: a, ..emitters(1).0[0] }.joined(&Emitter { cone: b, ..emitters(1).0[0] }).cone;
        for part in [a, b] {
            let between = part.axis.dot(both.axis).clamp(-1.0, 1.0).acos();
            let holds = both.cos_spread == -1.0 || between + part.cos_spread.acos() <= both.cos_spread.acos() + 2e-3;
            assert!(holds, "{part:?} not in {both:?}");
        }
    }
}

#[test]
fn a_nodes_bound_contains_all_emitters_below_it() {
    for count in [1, 2, 3, 5, 33, 600] {
        let (emitters, _) = emitters(count);
        let tree = LightTree::new(&emitters);
        for (emitter, leaf) in emitters.iter().zip(tree.leaves()) {
            let mut index = *leaf as usize;
            loop {
                let node = tree.nodes()[index].bound;
                let beyond = (node.center - emitter.bounds.center()).abs() + 0.5 * emitter.bounds.size() - node.half;
                assert!(beyond.max_element() < 1e-5, "{count}: {node:?}");
                assert!(node.power >= emitter.power && node.inverse_range * emitter.range <= 1.00001, "{node:?}");
                assert!(node.cos_reach <= emitter.cone.cos_reach, "{count}: {node:?}");
                let aside = node.axis.cross(emitter.cone.axis).length();
                assert!(node.sin_spread == 1.0 || aside <= node.sin_spread + 1e-5, "{count}: {node:?}");
                if index == 0 {
                    break;
                }
                index = (index - 1) / 2;
            }
        }
        // The precision of the GPU's copy.
        let is_short = |v: f32| v.to_bits() & 0xffff == 0;
        assert!(tree.nodes().iter().all(|n| is_short(n.bound.power) && is_short(n.bound.inverse_range)));
    }
}
