//! Motion: the node tree, skins, and objects attached to nodes.
//!
//! A deformed mesh belongs to a single node: each further node that uses it gets its own copy.

use std::collections::{HashMap, HashSet};

use glam::{Affine3A, Mat4};
use lanternfish_limits::memory::Budget;

use super::accessor::Accessors;
use super::animations;
use super::fault::{Place, Result, invalid, item};
use super::hierarchy::{Placed, transform_of};
use super::notes::Notes;
use super::schema::{self, Root};
use crate::{
    Light, Mesh, Scene,
    motion::{Bound, BoundLight, DeformedMesh, Motion, Node, Skin},
};

/// Collects the moving parts of a scene while its nodes are placed.
pub(super) struct Collected<'c, 'a> {
    accessors: &'c Accessors<'a>,
    /// The scene's nodes, parents before their children.
    nodes: &'c [Placed<'a>],
    /// Index into `nodes` of each of the file's nodes.
    node_indices: HashMap<usize, usize>,
    budget: &'c Budget,
    /// True if anything in the file moves; otherwise no motion is stored.
    is_kept: bool,
    motion: Motion,
    /// The scene's skin for each used skin of the file.
    skins: HashMap<usize, Option<usize>>,
    /// Use of each mesh by the nodes placed so far.
    uses: HashMap<usize, Use>,
}

#[derive(Clone, Copy, PartialEq)]
enum Use {
    AsStored,
    Deformed,
}

impl<'c, 'a> Collected<'c, 'a> {
    /// Stores the node tree, if anything in the file moves. `nodes`: the scene's, parents before their children.
    pub fn new(accessors: &'c Accessors<'a>, nodes: &'c [Placed<'a>], budget: &'c Budget) -> Result<Self> {
        let root = accessors.root;
        let node_indices = node_indices(nodes);
        let has_targets = |mesh: usize| root.meshes[mesh].primitives.iter().any(|p| !p.targets.is_empty());
        let deforms = |at: &Placed| at.node.mesh.is_some_and(|mesh| at.node.skin.is_some() || has_targets(mesh));
        let is_kept = !root.animations.is_empty() || nodes.iter().any(deforms);
        let mut motion = Motion::default();
        if is_kept {
            // The weights of the nodes, and those of a pose.
            let weights = nodes.iter().map(|at| 8 * target_count(root, at.node) as u64).fold(0, u64::saturating_add);
            budget.take(weights, || "weights of morph targets need".to_owned())?;
            let mut parents = vec![None; nodes.len()];
            for (parent, at) in nodes.iter().enumerate() {
                at.node.children.iter().for_each(|child| parents[node_indices[child]] = Some(parent));
            }
            let node = |(at, parent): (&Placed, Option<usize>)| Node {
                name: at.node.name.clone(),
                parent,
                rest: transform_of(at.node),
                weights: weights_at_rest(root, at.node),
            };
            motion.nodes = nodes.iter().zip(parents).map(node).collect();
        }
        Ok(Self {
            accessors,
            nodes,
            node_indices,
            budget,
            is_kept,
            motion,
            skins: HashMap::new(),
            uses: HashMap::new(),
        })
    }

    /// True if anything moves.
    pub fn is_kept(&self) -> bool {
        self.is_kept
    }

    /// Attaches an instance to a node.
    pub fn instance(&mut self, index: usize, node: usize, node_from_object: Affine3A) {
        if self.is_kept {
            self.motion.instances.push(Bound { index, node, node_from_object });
        }
    }

    /// Attaches a camera to a node.
    pub fn camera(&mut self, index: usize, node: usize) {
        if self.is_kept {
            self.motion.cameras.push(Bound { index, node, node_from_object: Affine3A::IDENTITY });
        }
    }

    /// Attaches a light, given in the node's space, to a node.
    pub fn light(&mut self, index: usize, node: usize, light: Light) {
        if self.is_kept {
            self.motion.lights.push(BoundLight { index, node, light });
        }
    }

    /// The index of the mesh for the node at `node_index`, and true if it is skinned. It is `mesh`, or a copy of it if another node
    /// uses it with a different deformation.
    pub fn mesh(
        &mut self,
        scene: &mut Scene,
        node_index: usize,
        mesh: usize,
        notes: &mut Notes,
    ) -> Result<(usize, bool)> {
        if !self.is_kept {
            return Ok((mesh, false));
        }
        let deformations = || scene.meshes[mesh].primitives.iter().filter_map(|p| p.deformation.as_deref());
        let has_targets = deformations().any(|deformation| !deformation.targets.is_empty());
        let greatest_joint = deformations().filter_map(|deformation| deformation.greatest_joint()).max();
        let skin = match (self.nodes[node_index].node.skin, greatest_joint) {
            (Some(skin), Some(joint)) => {
                let own = self.skin(skin, notes).place(|| format!("skins[{skin}]"))?;
                if let Some(own) = own
                    && usize::from(joint) >= self.motion.skins[own].joints.len()
                {
                    let count = self.motion.skins[own].joints.len();
                    return Err(invalid(format!("joint {joint} of skins[{skin}], which has {count}")));
                }
                own
            }
            _ => None,
        };
        let kind = if has_targets || skin.is_some() { Use::Deformed } else { Use::AsStored };
        let used = self.uses.insert(mesh, kind);
        let mut own = mesh;
        if used.is_some_and(|used| used != Use::AsStored || kind != Use::AsStored) {
            self.uses.insert(mesh, used.unwrap_or(kind));
            self.budget.take(bytes_of(&scene.meshes[mesh]), || format!("a copy of mesh {mesh} needs"))?;
            scene.meshes.push(scene.meshes[mesh].clone());
            own = scene.meshes.len() - 1;
        }
        if kind == Use::Deformed {
            self.motion.meshes.push(DeformedMesh { mesh: own, node: node_index, skin });
        }
        Ok((own, skin.is_some()))
    }

    /// The scene's skin for a skin of the file. `None`, with a note, if a joint is not in the scene.
    fn skin(&mut self, index: usize, notes: &mut Notes) -> Result<Option<usize>> {
        if let Some(existing) = self.skins.get(&index) {
            return Ok(*existing);
        }
        let source = item(&self.accessors.root.skins, index, "skins")?;
        let joints: Option<Vec<usize>> =
            source.joints.iter().map(|joint| self.node_indices.get(joint).copied()).collect();
        let skin = match joints {
            Some(joints) => {
                self.budget.take(128 * joints.len() as u64, || format!("{} joints need", joints.len()))?;
                let joint_from_object = bind_matrices(self.accessors, source, joints.len())?;
                self.motion.skins.push(Skin { joints, joint_from_object });
                Some(self.motion.skins.len() - 1)
            }
            None => {
                notes.add("skins with joints that are not in the scene: their meshes are drawn undeformed");
                None
            }
        };
        self.skins.insert(index, skin);
        Ok(skin)
    }

    /// Moves the collected motion and the file's animations into the scene, and sets the rest pose.
    pub fn finish(mut self, scene: &mut Scene, notes: &mut Notes) -> Result<()> {
        // Meshes that no node deforms need no deformation data.
        let deformed: HashSet<usize> = self.motion.meshes.iter().map(|deformed| deformed.mesh).collect();
        for (_, mesh) in scene.meshes.iter_mut().enumerate().filter(|(i, _)| !deformed.contains(i)) {
            mesh.primitives.iter_mut().for_each(|primitive| primitive.deformation = None);
        }
        if self.is_kept {
            let (accessors, budget) = (self.accessors, self.budget);
            self.motion.animations = animations::read(accessors, self.nodes, &self.node_indices, budget, notes)?;
            scene.motion = self.motion;
            scene.pose_at_rest();
        }
        Ok(())
    }
}

/// The index into `nodes` of each of the file's nodes.
fn node_indices(nodes: &[Placed]) -> HashMap<usize, usize> {
    nodes.iter().enumerate().map(|(node_index, at)| (at.index, node_index)).collect()
}

/// Morph target weights at rest: those of the node, else of its mesh, else zero.
fn weights_at_rest(root: &Root, node: &schema::Node) -> Vec<f32> {
    let Some(mesh) = node.mesh.and_then(|mesh| root.meshes.get(mesh)) else { return Vec::new() };
    let stated = if node.weights.is_empty() { &mesh.weights } else { &node.weights };
    let finite = |weight: f32| if weight.is_finite() { weight } else { 0.0 };
    let mut weights: Vec<f32> = stated.iter().map(|weight| finite(*weight)).collect();
    weights.resize(target_count(root, node), 0.0);
    weights
}

/// Number of morph targets of a node's mesh.
pub(super) fn target_count(root: &Root, node: &schema::Node) -> usize {
    let mesh = node.mesh.and_then(|mesh| root.meshes.get(mesh));
    mesh.and_then(|mesh| mesh.primitives.iter().map(|primitive| primitive.targets.len()).max()).unwrap_or(0)
}

fn bind_matrices(accessors: &Accessors, skin: &schema::Skin, count: usize) -> Result<Vec<Affine3A>> {
    let Some(accessor) = skin.inverse_bind_matrices else { return Ok(vec![Affine3A::IDENTITY; count]) };
    let matrices = accessors.vectors::<16>(accessor).place(|| "inverseBindMatrices".into())?;
    if matrices.len() < count {
        return Err(invalid(format!("{} inverse bind matrices, but there are {count} joints", matrices.len())));
    }
    let affine = |columns: &[f32; 16]| Affine3A::from_mat4(Mat4::from_cols_array(columns));
    let matrices: Vec<_> = matrices[..count].iter().map(affine).collect();
    match matrices.iter().position(|matrix| !matrix.is_finite()) {
        Some(at) => Err(invalid(format!("inverse bind matrix {at} is not finite"))),
        None => Ok(matrices),
    }
}

/// Upper bound of the memory of a copy of a mesh, bytes.
fn bytes_of(mesh: &Mesh) -> u64 {
    let vertex = |primitive: &crate::Primitive| {
        let deformation = primitive.deformation.as_deref();
        72 + deformation.map_or(0, |d| 40 + 24 * d.influences.len() + 36 * d.targets.len())
    };
    mesh.primitives.iter().map(|p| (p.positions.len() * vertex(p) + 4 * p.indices.len()) as u64).sum()
}
