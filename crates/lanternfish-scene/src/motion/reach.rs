//! Bounding boxes of deformed vertices, without deforming them.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec3, Vec3A};

use super::Deformation;
use crate::Bounds;

/// Bound of a coordinate's rounding error, relative to the sum of its terms' magnitudes: 32 roundings of 2⁻²⁴ each. Blending eight
/// joints and transforming a vertex takes 12.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

/// Bounds of a primitive's deformed vertices: built once from a [`Deformation`], evaluated for every pose.
///
/// A skinned vertex is a weighted mean of its positions under each joint. The union of all joints' transformed boxes therefore
/// contains it.
#[derive(Clone, Debug)]
pub struct Reach {
    /// Each joint and the box of its vertices at rest. Without a skin: `None` and one box.
    boxes: Vec<(Option<usize>, Bounds)>,
    /// The box of each morph target's displacements at weight 1.
    targets: Vec<Bounds>,
    /// The least and the greatest sum of a vertex's joint weights: 1 up to rounding.
    sums: [f32; 2],
}

impl Reach {
    /// Computes the bounds from all vertices and morph targets. `joint_count`: of the skin; 0 without a skin.
    pub fn new(deformation: &Deformation, joint_count: usize) -> Self {
        let box_of = |points: &[Vec3]| {
            let mut bounds = Bounds::EMPTY;
            points.iter().for_each(|point| bounds.add_point(*point));
            bounds
        };
        let displacements = |positions: &[Vec3]| match positions {
            [] => Bounds { min: Vec3::ZERO, max: Vec3::ZERO },
            _ => box_of(positions),
        };
        let targets = deformation.targets.iter().map(|target| displacements(&target.positions)).collect();
        if deformation.influences.is_empty() || joint_count == 0 {
            return Self { boxes: vec![(None, box_of(&deformation.positions))], targets, sums: [1.0; 2] };
        }
        let mut boxes = BTreeMap::new();
        let mut sums = [f64::INFINITY, f64::NEG_INFINITY];
        for (i, position) in deformation.positions.iter().enumerate() {
            let mut sum = 0.0;
            for set in &deformation.influences {
                let pairs = set.joints[i].iter().zip(set.weights[i].to_array());
                for (joint, weight) in pairs.filter(|(_, weight)| *weight > 0.0) {
                    boxes.entry(usize::from(*joint)).or_insert(Bounds::EMPTY).add_point(*position);
                    sum += f64::from(weight);
                }
            }
            sums = [sums[0].min(sum), sums[1].max(sum)];
        }
        let boxes = boxes.into_iter().map(|(joint, bounds)| (Some(joint), bounds)).collect();
        Self { boxes, targets, sums: sums.map(|sum| sum as f32) }
    }

    /// A box that contains all vertices of [`Deformation::apply`] for the same weights and joints, in the same space, m. It reads no
    /// vertex. The box is not tight if a joint rotates, or if a morph target moves only some of a joint's vertices.
    pub fn bounds(&self, weights: &[f32], world_from_object: &[Affine3A]) -> Bounds {
        let mut added = Bounds { min: Vec3::ZERO, max: Vec3::ZERO };
        let mut magnitude = Vec3::ZERO;
        for (target, weight) in self.targets.iter().zip(weights) {
            let (a, b) = (*weight * target.min, *weight * target.max);
            added.min += a.min(b);
            added.max += a.max(b);
            magnitude += a.abs().max(b.abs());
        }
        let mut bounds = Bounds::EMPTY;
        for (joint, rest) in self.boxes.iter().filter(|(_, rest)| !rest.is_empty()) {
            let (min, max) = (rest.min + added.min, rest.max + added.max);
            let (center, half) = (Vec3A::from(0.5 * (min + max)), Vec3A::from(0.5 * (max - min)));
            let farthest = Vec3A::from(rest.min.abs().max(rest.max.abs()) + magnitude);
            let world_from_object = joint.map_or(Affine3A::IDENTITY, |joint| world_from_object[joint]);
            let spread = world_from_object.matrix3.abs();
            let center = world_from_object.transform_point3a(center);
            let half = spread * half + ROUNDING * (spread * farthest + world_from_object.translation.abs());
            bounds.add_bounds(&Bounds { min: (center - half).into(), max: (center + half).into() });
        }
        match (self.sums, bounds.is_empty()) {
            ([1.0, 1.0], _) => bounds,
            // No vertex has a joint.
            ([least, greatest], true) if least <= greatest => Bounds { min: Vec3::ZERO, max: Vec3::ZERO },
            (_, true) => bounds,
            ([least, greatest], false) => Bounds {
                min: (least * bounds.min).min(greatest * bounds.min),
                max: (least * bounds.max).max(greatest * bounds.max),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec4};

    use super::*;
    use crate::{
        Primitive,
        motion::{Influences, MorphTarget},
    };

    /// A tube along x whose vertices are influenced by five joints, and a morph target that lifts some of them.
    fn tube(scale: f32) -> Deformation {
        let ring = |i: usize| {
            let angle = i as f32;
            scale * Vec3::new(0.01 * i as f32, 0.3 * angle.sin(), 0.3 * angle.cos())
        };
        let positions: Vec<Vec3> = (0..400).map(ring).collect();
        let joint = |i: usize, k: usize| ((i / 100 + k) % 5) as u16;
        let set = |first: usize, weights: Vec4| Influences {
            joints: (0..400).map(|i| std::array::from_fn(|k| joint(i, first + k))).collect(),
            weights: vec![weights; 400],
        };
        Deformation {
            normals: vec![Vec3::Z; 400],
            influences: vec![set(0, Vec4::new(0.6, 0.3, 0.0, 0.05)), set(4, Vec4::new(0.05, 0.0, 0.0, 0.0))],
            targets: vec![MorphTarget {
                positions: (0..400).map(|i| scale * Vec3::Y * (i % 7) as f32 * 0.1).collect(),
                ..MorphTarget::default()
            }],
            positions,
            ..Deformation::default()
        }
    }

    fn joints(step: f32) -> Vec<Affine3A> {
        let joint = |i: u32| {
            let rotation = Quat::from_scaled_axis(step * Vec3::new(0.3, -0.2, 0.5) * i as f32);
            Affine3A::from_rotation_translation(rotation, 5.0 * step * Vec3::new(0.1, 0.2, -0.1) * i as f32)
        };
        (0..5).map(joint).collect()
    }

    #[test]
    fn bounds_contain_every_vertex_and_are_nearly_tight() {
        let mut told_apart = 0;
        for (scale, is_skinned, weights_sum_to_one) in
            [(1.0, true, true), (1.0, true, false), (1e4, true, true), (1e-3, false, true)]
        {
            let mut deformation = tube(scale);
            if !weights_sum_to_one {
                deformation.influences[0].weights.iter_mut().step_by(2).for_each(|weights| *weights *= 0.5);
                deformation.influences.iter_mut().for_each(|set| set.weights[7] = Vec4::ZERO);
            }
            let reach = Reach::new(&deformation, if is_skinned { 5 } else { 0 });
            for step in 0..8 {
                let joints = if is_skinned { joints(0.3 * step as f32) } else { Vec::new() };
                let weights = [0.4 * step as f32 - 1.0];
                let mut primitive = Primitive::default();
                deformation.apply(&mut primitive, &weights, &joints);
                let (actual, exact) = (reach.bounds(&weights, &joints), primitive.bounds());
                let holds = actual.min.cmple(exact.min).all() && actual.max.cmpge(exact.max).all();
                assert!(holds, "{scale}, {is_skinned}, {step}: {actual:?} and {exact:?}");
                let ratio = actual.size().length() / exact.size().length();
                // Blending rotated joints shrinks the mesh but not the joints' boxes: a ratio of at most 2.25 here.
                assert!(ratio < 3.0 || !weights_sum_to_one, "{scale}, {is_skinned}, {step}: {ratio} times as large");
                let other = reach.bounds(&[weights[0] + 3.0], &joints);
                told_apart += usize::from(!other.min.cmple(exact.min).all());
            }
        }
        // The test can fail: boxes of other poses do not contain these vertices.
        assert!(told_apart > 8, "{told_apart}");
        let nothing = Reach::new(&Deformation::default(), 0).bounds(&[1.0], &[]);
        assert!(nothing.is_empty(), "{nothing:?}");
    }
}
