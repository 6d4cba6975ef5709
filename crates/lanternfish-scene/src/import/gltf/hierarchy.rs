//! The node tree, resolved to world space.

use glam::{Affine3A, Mat4, Quat, Vec3};

use super::fault::{Result, invalid, item};
use super::schema::{Node, Root};
use crate::motion::Transform;

/// A node of the selected scene.
pub(super) struct Placed<'a> {
    /// Its index in the file.
    pub index: usize,
    pub node: &'a Node,
    pub world_from_node: Affine3A,
    /// False if the node or an ancestor is hidden (`KHR_node_visibility`): its mesh and lights are left out. It still
    /// moves joints and cameras.
    pub is_visible: bool,
    /// The semantic class: its own, else that of the nearest ancestor that has one, else 0.
    pub semantic: u32,
}

/// The nodes of `scene` (`None`: all nodes), parents before children, in the file's order.
///
/// An error if the nodes of the file do not form a set of trees.
pub(super) fn resolve<'a>(root: &'a Root, scene: Option<usize>, world_from_roots: Affine3A) -> Result<Vec<Placed<'a>>> {
    let has_parent = check_trees(root)?;
    let roots = match scene {
        Some(scene) => item(&root.scenes, scene, "scenes")?.nodes.clone(),
        None => (0..root.nodes.len()).filter(|i| !has_parent[*i]).collect(),
    };
    let mut is_placed = vec![false; root.nodes.len()];
    for index in &roots {
        item(&root.nodes, *index, "nodes")?;
        if has_parent[*index] {
            return Err(invalid(format!("nodes[{index}]: a root of a scene, and a child")));
        }
        if std::mem::replace(&mut is_placed[*index], true) {
            return Err(invalid(format!("nodes[{index}]: twice in a scene")));
        }
    }
    // An explicit stack: recursion on a deep tree could overflow the call stack.
    let mut placed = Vec::new();
    let mut pending: Vec<_> = roots.iter().rev().map(|root| (*root, world_from_roots, true, 0)).collect();
    while let Some((index, world_from_parent, is_parent_visible, inherited)) = pending.pop() {
        let node = &root.nodes[index];
        let world_from_node = world_from_parent * transform_of(node).to_affine();
        if !world_from_node.is_finite() {
            return Err(invalid(format!("nodes[{index}]: its transform is not finite")));
        }
        let is_visible = is_parent_visible && node.extensions.visibility.visible;
        let semantic = node.extras.semantic.unwrap_or(inherited);
        pending.extend(node.children.iter().rev().map(|child| (*child, world_from_node, is_visible, semantic)));
        placed.push(Placed { index, node, world_from_node, is_visible, semantic });
    }
    Ok(placed)
}

/// For each node, true if it has a parent. An error if a node has several parents or there is a cycle.
fn check_trees(root: &Root) -> Result<Vec<bool>> {
    let mut has_parent = vec![false; root.nodes.len()];
    for (parent, node) in root.nodes.iter().enumerate() {
        for child in &node.children {
            item(&root.nodes, *child, "nodes")?;
            if std::mem::replace(&mut has_parent[*child], true) {
                return Err(invalid(format!("nodes[{parent}]: its child nodes[{child}] has another parent")));
            }
        }
    }
    // As each node has at most one parent, the nodes that no root reaches are on or below a cycle.
    let mut is_reached = vec![false; root.nodes.len()];
    let mut pending: Vec<_> = (0..root.nodes.len()).filter(|i| !has_parent[*i]).collect();
    while let Some(index) = pending.pop() {
        is_reached[index] = true;
        pending.extend(&root.nodes[index].children);
    }
    match is_reached.iter().position(|reached| !reached) {
        Some(index) => Err(invalid(format!("nodes[{index}]: within a cycle, or below one"))),
        None => Ok(has_parent),
    }
}

/// The node's local transform: parent from node. A matrix takes precedence over translation, rotation and scale; its last row is
/// assumed to be 0 0 0 1.
pub(super) fn transform_of(node: &Node) -> Transform {
    if let Some(matrix) = &node.matrix {
        return Transform::Matrix(Affine3A::from_mat4(Mat4::from_cols_array(matrix)));
    }
    let rotation = node.rotation.map_or(Quat::IDENTITY, Quat::from_array);
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { Quat::IDENTITY };
    Transform::Parts {
        translation: node.translation.map_or(Vec3::ZERO, Vec3::from),
        rotation,
        scale: node.scale.map_or(Vec3::ONE, Vec3::from),
    }
}
