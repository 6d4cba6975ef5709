//! Vertex deformation: morph targets, joints and their weights.

use glam::{Vec3, Vec4};

use super::accessor::Accessors;
use super::fault::{Place, Result, invalid};
use super::primitive::read_attribute;
use super::schema;
use crate::{
    Primitive,
    motion::{Deformation, Influences, MorphTarget},
};

/// Limit of joint sets: the format states none, files have one or two.
const MOST_SETS: usize = 8;

/// Size of a vertex's deformation data, bytes, without its attributes.
pub(super) fn bytes_per_vertex(source: &schema::Primitive, has_tangents: bool) -> u64 {
    let sets = source.attributes.keys().filter(|name| name.starts_with("JOINTS_")).count() as u64;
    let targets = source.targets.iter().map(|target| 12 * target.len() as u64).sum::<u64>();
    let rest = if sets == 0 && targets == 0 { 0 } else { 24 + if has_tangents { 16 } else { 0 } };
    24 * sets + targets + rest
}

/// Reads the deformation of a primitive's vertices, in their stored order. `None`: it has none.
pub(super) fn read(
    accessors: &Accessors,
    source: &schema::Primitive,
    vertex_count: usize,
) -> Result<Option<Box<Deformation>>> {
    let mut influences = Vec::new();
    for set in 0..MOST_SETS {
        let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
        if !source.attributes.contains_key(&joints) || !source.attributes.contains_key(&weights) {
            break;
        }
        influences.push(Influences {
            joints: read_attribute::<Vec4, 4>(&source.attributes, &joints, vertex_count, |i| accessors.vectors(i))?
                .into_iter()
                .map(|four| four.to_array().map(|joint| joint as u16))
                .collect(),
            weights: read_attribute(&source.attributes, &weights, vertex_count, |i| accessors.vectors(i))?,
        });
    }
    normalise(&mut influences, vertex_count);
    let target = |(i, attributes): (usize, &std::collections::BTreeMap<String, usize>)| {
        let list = |name: &str| {
            let list: Vec<Vec3> = read_attribute(attributes, name, vertex_count, |i| accessors.vectors(i))?;
            match list.iter().position(|v| !v.is_finite()) {
                Some(at) => Err(invalid(format!("{name}: element {at} is not finite"))),
                None => Ok(list),
            }
            .place(|| format!("targets[{i}]"))
        };
        Ok(MorphTarget { positions: list("POSITION")?, normals: list("NORMAL")?, tangents: list("TANGENT")? })
    };
    let targets = source.targets.iter().enumerate().map(target).collect::<Result<Vec<_>>>()?;
    let moves = !influences.is_empty() || !targets.is_empty();
    Ok(moves.then(|| Box::new(Deformation { influences, targets, ..Deformation::default() })))
}

/// Normalises each vertex's weights to a sum of 1. If all are 0 the first joint gets weight 1: otherwise the vertex would collapse
/// to the origin.
fn normalise(influences: &mut [Influences], vertex_count: usize) {
    for vertex in 0..vertex_count {
        let clean = |weight: f32| if weight.is_finite() { weight.max(0.0) } else { 0.0 };
        let mut sum = 0.0;
        for set in influences.iter_mut() {
            set.weights[vertex] = set.weights[vertex].map(clean);
            sum += set.weights[vertex].element_sum();
        }
        for (i, set) in influences.iter_mut().enumerate() {
            if sum > 0.0 && sum.is_finite() {
                set.weights[vertex] /= sum;
            } else {
                set.weights[vertex] = if i == 0 { Vec4::X } else { Vec4::ZERO };
            }
        }
    }
}

/// Stores the current vertices as the rest pose.
pub(super) fn keep_rest(primitive: &mut Primitive, has_flat_normals: bool) {
    let Some(deformation) = &mut primitive.deformation else { return };
    deformation.positions = primitive.positions.clone();
    deformation.normals = primitive.normals.clone();
    deformation.tangents = primitive.tangents.clone();
    deformation.has_flat_normals =
        has_flat_normals && primitive.indices.iter().enumerate().all(|(i, index)| i == *index as usize);
}
