//! Reordering of a primitive's vertices.

use crate::Primitive;

/// Replaces the vertices of `primitive` by those at the indices `sources`, in that order. An index may occur several times
/// or not at all. The primitive's own indices are left unchanged.
pub(super) fn select(primitive: &mut Primitive, sources: &[u32]) {
    fn select_list<T: Copy>(list: &mut Vec<T>, sources: &[u32]) {
        if !list.is_empty() {
            *list = sources.iter().map(|source| list[*source as usize]).collect();
        }
    }
    select_list(&mut primitive.positions, sources);
    select_list(&mut primitive.normals, sources);
    select_list(&mut primitive.tangents, sources);
    select_list(&mut primitive.uv0, sources);
    select_list(&mut primitive.uv1, sources);
    select_list(&mut primitive.colors, sources);
    if let Some(deformation) = &mut primitive.deformation {
        for set in &mut deformation.influences {
            select_list(&mut set.joints, sources);
            select_list(&mut set.weights, sources);
        }
        for target in &mut deformation.targets {
            select_list(&mut target.positions, sources);
            select_list(&mut target.normals, sources);
            select_list(&mut target.tangents, sources);
        }
    }
}

/// Gives every corner of every triangle its own vertex.
pub(super) fn unshare(primitive: &mut Primitive) {
    let sources = std::mem::take(&mut primitive.indices);
    select(primitive, &sources);
    primitive.indices = (0..sources.len() as u32).collect();
}

/// Drops unused vertices and keeps the order. Several primitives of a file may share one long vertex list.
pub(super) fn drop_unused(primitive: &mut Primitive) {
    const UNUSED: u32 = u32::MAX;
    let mut new_from_old = vec![UNUSED; primitive.positions.len()];
    for index in &primitive.indices {
        new_from_old[*index as usize] = 0;
    }
    if !new_from_old.contains(&UNUSED) {
        return;
    }
    let mut kept = Vec::new();
    for (old, new) in new_from_old.iter_mut().enumerate().filter(|(_, new)| **new != UNUSED) {
        *new = kept.len() as u32;
        kept.push(old as u32);
    }
    for index in &mut primitive.indices {
        *index = new_from_old[*index as usize];
    }
    select(primitive, &kept);
}
