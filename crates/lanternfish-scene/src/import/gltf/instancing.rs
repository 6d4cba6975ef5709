//! `EXT_mesh_gpu_instancing`: many instances of a mesh at one node.

use glam::{Affine3A, Quat, Vec3};
use lanternfish_limits::memory::Budget;

use super::accessor::Accessors;
use super::fault::{Place, Result, invalid};
use super::schema::Instancing;
use crate::Instance;

/// Limit of instances in a scene: 4 Mi, about 500 MB. A few bytes of a file can request any number of instances.
pub(super) const MAX_INSTANCES: usize = 1 << 22;

/// The transforms of the node's instances, node from instance: translation, rotation and scale. Application-specific
/// attributes are not read; a node that has only those gets one instance. The memory of the instances, with names of
/// `name_length` bytes, is taken from `budget`.
pub(super) fn read(
    accessors: &Accessors,
    instancing: &Instancing,
    name_length: usize,
    budget: &Budget,
) -> Result<Vec<Affine3A>> {
    let stated = instancing.attributes.values().filter_map(|index| accessors.root.accessors.get(*index));
    let count = stated.map(|accessor| accessor.count).max().unwrap_or(0) as u64;
    let each = (size_of::<Instance>() + size_of::<Affine3A>() + 120 + name_length) as u64;
    budget.take(count.saturating_mul(each), || format!("{count} instances need"))?;
    let translations = read_attribute::<3>(accessors, instancing, "TRANSLATION")?;
    let rotations = read_attribute::<4>(accessors, instancing, "ROTATION")?;
    let scales = read_attribute::<3>(accessors, instancing, "SCALE")?;
    let counts = [&translations, &scales].map(|list| list.as_ref().map(Vec::len));
    let mut counts = counts.into_iter().chain([rotations.as_ref().map(Vec::len)]).flatten();
    let Some(count) = counts.next() else { return Ok(vec![Affine3A::IDENTITY]) };
    if let Some(other) = counts.find(|other| *other != count) {
        return Err(invalid(format!("EXT_mesh_gpu_instancing: attributes of {count} and {other} elements")));
    }
    let transform = |i: usize| {
        let rotation = rotations.as_ref().map_or(Quat::IDENTITY, |list| Quat::from_array(list[i]));
        let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { Quat::IDENTITY };
        let translation = translations.as_ref().map_or(Vec3::ZERO, |list| list[i].into());
        let scale = scales.as_ref().map_or(Vec3::ONE, |list| list[i].into());
        Affine3A::from_scale_rotation_translation(scale, rotation, translation)
    };
    Ok((0..count).map(transform).collect())
}

fn read_attribute<const N: usize>(
    accessors: &Accessors,
    instancing: &Instancing,
    name: &str,
) -> Result<Option<Vec<[f32; N]>>> {
    let Some(accessor) = instancing.attributes.get(name) else { return Ok(None) };
    accessors.vectors(*accessor).place(|| format!("EXT_mesh_gpu_instancing: {name}")).map(Some)
}
