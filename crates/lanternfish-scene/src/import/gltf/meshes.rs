//! Meshes: selection of the used meshes and materials, and reading of their primitives on all cores.

use std::collections::BTreeMap;

use lanternfish_limits::memory::Budget;
use rayon::prelude::*;

use super::accessor::Accessors;
use super::fault::{Place, Result, item};
use super::hierarchy::Placed;
use super::notes::Notes;
use super::primitive::{self, Outcome};
use super::schema::{self, Root};
use super::{thin, variants};
use crate::{Material, Mesh};

/// The meshes and materials of the file that the scene uses.
#[derive(Default)]
pub(super) struct Used {
    /// The scene's index of each used mesh of the file.
    pub meshes: BTreeMap<usize, usize>,
    /// The file's index of each material of the scene, ascending; `None`, the format's default material, is last.
    pub materials: Vec<Option<usize>>,
    /// The requested variant of the materials.
    variant: Option<usize>,
}

impl Used {
    /// Finds the meshes that visible nodes refer to, and their materials in a variant; both keep the file's order.
    pub fn find(root: &Root, nodes: &[Placed], variant: Option<usize>) -> Result<Self> {
        let mut used = Self { variant, ..Self::default() };
        for placed in nodes {
            if let Some(mesh) = placed.node.mesh {
                item(&root.meshes, mesh, "meshes").place(|| format!("nodes[{}]", placed.index))?;
                if placed.is_visible {
                    used.meshes.insert(mesh, 0);
                }
            }
        }
        for (new, (mesh, index)) in used.meshes.iter_mut().enumerate() {
            *index = new;
            for (i, primitive) in root.meshes[*mesh].primitives.iter().enumerate() {
                let material = variants::material(primitive, variant);
                if let Some(material) = material {
                    item(&root.materials, material, "materials").place(|| place(*mesh, i))?;
                }
                used.materials.push(material);
            }
        }
        used.materials.sort_unstable_by_key(material_key);
        used.materials.dedup();
        Ok(used)
    }

    /// The scene's index of a used primitive's material.
    fn material(&self, primitive: &schema::Primitive) -> usize {
        let material = variants::material(primitive, self.variant);
        let index = self.materials.binary_search_by_key(&material_key(&material), material_key);
        index.expect("all materials of used meshes are listed")
    }
}

/// Sort key that puts the default material last.
fn material_key(material: &Option<usize>) -> usize {
    material.unwrap_or(usize::MAX)
}

/// Reads the used meshes. An error, before reading, if they exceed the memory budget. `nodes` and `materials` are the
/// scene's.
pub(super) fn read_all(
    accessors: &Accessors,
    nodes: &[Placed],
    used: &Used,
    materials: &[Material],
    budget: &Budget,
    notes: &mut Notes,
) -> Result<Vec<Mesh>> {
    let root = accessors.root;
    let primitives: Vec<(usize, usize, &schema::Primitive)> = used
        .meshes
        .keys()
        .flat_map(|mesh| root.meshes[*mesh].primitives.iter().enumerate().map(|(i, primitive)| (*mesh, i, primitive)))
        .collect();
    let need = |(_, _, source): &(usize, usize, &schema::Primitive)| {
        let has_normal_map = materials[used.material(source)].tangent_uv_set().is_some();
        primitive::need(root, source, has_normal_map)
    };
    let needs: Vec<primitive::Need> = primitives.iter().map(need).collect();
    reserve(&needs, budget)?;
    let radii = thin::radii(accessors, nodes);
    let read_one = |(mesh, i, source): &(usize, usize, &schema::Primitive)| {
        let material = used.material(source);
        let uv_set = materials[material].tangent_uv_set();
        (*mesh, material, primitive::read(accessors, source, radii[mesh], uv_set).place(|| place(*mesh, *i)))
    };
    // Gather all results first, so that the same fault of several is always reported.
    let outcomes: Vec<_> = primitives.par_iter().map(read_one).collect();

    let new_mesh = |mesh: &usize| Mesh { name: root.meshes[*mesh].name.clone(), primitives: Vec::new() };
    let mut meshes: Vec<_> = used.meshes.keys().map(new_mesh).collect();
    for (mesh, material, outcome) in outcomes {
        match outcome? {
            Outcome::Read(mut primitive) => {
                primitive.material = material;
                meshes[used.meshes[&mesh]].primitives.push(primitive);
            }
            Outcome::LeftOut(what) => notes.add(what),
        }
    }
    Ok(meshes)
}

/// Takes the memory of all primitives from the budget. It must also hold the temporary memory of the primitives read in parallel.
fn reserve(needs: &[primitive::Need], budget: &Budget) -> Result<()> {
    let sum = |list: &mut dyn Iterator<Item = u64>| list.fold(0, u64::saturating_add);
    let kept = sum(&mut needs.iter().map(|need| need.kept));
    let mut transient: Vec<u64> = needs.iter().map(|need| need.transient).collect();
    transient.sort_unstable_by(|a, b| b.cmp(a));
    let transient = sum(&mut transient.into_iter().take(rayon::current_num_threads()));
    budget.check(kept.saturating_add(transient), || {
        let corners = sum(&mut needs.iter().map(|need| need.corners));
        format!("{} primitives of {corners} corners need", needs.len())
    })?;
    Ok(budget.take(kept, String::new)?)
}

fn place(mesh: usize, primitive: usize) -> String {
    format!("meshes[{mesh}].primitives[{primitive}]")
}
