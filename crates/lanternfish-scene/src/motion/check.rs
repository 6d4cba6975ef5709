//! Validation of motion: posing a validated scene does not panic.

use super::{Animation, Motion};
use crate::{Primitive, Scene};

impl Motion {
    /// Checks that all node indices are in range and that animations are complete: the conditions under which [`Self::pose`],
    /// [`Self::joints`] and similar functions do not panic. Returns the first fault and its location. Does not check vertices, nor
    /// the indices of instances, cameras, lights and meshes.
    #[doc(hidden)]
    pub fn check_nodes(&self) -> Result<(), String> {
        let node_count = self.nodes.len();
        for (i, node) in self.nodes.iter().enumerate() {
            if node.parent.is_some_and(|parent| parent >= i) {
                return Err(format!("node {i} ({}): its parent is not before it", node.name));
            }
        }
        for (i, skin) in self.skins.iter().enumerate() {
            if skin.joints.len() != skin.joint_from_object.len() || skin.joints.iter().any(|joint| *joint >= node_count)
            {
                return Err(format!("skin {i}: a joint is no node, or has no matrix"));
            }
        }
        if let Some((what, index, node)) = self.bound().find(|(.., node)| *node >= node_count) {
            return Err(format!("motion of {what} {index} by node {node}: not there"));
        }
        if let Some(deformed) = self.meshes.iter().find(|deformed| deformed.node >= node_count) {
            return Err(format!("deformed mesh {} by node {}: not there", deformed.mesh, deformed.node));
        }
        match self.animations.iter().position(|animation| !animation.is_sound(node_count)) {
            Some(i) => Err(format!("animation {i} ({}): a node or keyframes are missing", self.animations[i].name)),
            None => Ok(()),
        }
    }

    /// Objects attached to nodes: kind, index, and index of the node.
    fn bound(&self) -> impl Iterator<Item = (&'static str, usize, usize)> {
        let instances = self.instances.iter().map(|bound| ("instance", bound.index, bound.node));
        let cameras = self.cameras.iter().map(|bound| ("camera", bound.index, bound.node));
        instances.chain(cameras).chain(self.lights.iter().map(|bound| ("light", bound.index, bound.node)))
    }

    /// [`Self::check_nodes`], and checks that the instances, cameras, lights and meshes attached to nodes exist in `scene`.
    #[doc(hidden)]
    pub fn check_things(&self, scene: &Scene) -> Result<(), String> {
        self.check_nodes()?;
        let counts =
            [("instance", scene.instances.len()), ("camera", scene.cameras.len()), ("light", scene.lights.len())];
        for (of, count) in counts {
            if let Some((what, index, node)) = self.bound().find(|(what, index, _)| *what == of && *index >= count) {
                return Err(format!("motion of {what} {index} by node {node}: not there"));
            }
        }
        match self.meshes.iter().find(|deformed| deformed.mesh >= scene.meshes.len()) {
            Some(deformed) => Err(format!("a deformed mesh {}: not there", deformed.mesh)),
            None => Ok(()),
        }
    }

    /// Checks that every index is in range and every list has the required length. Returns the first fault and its location.
    pub(crate) fn validate(&self, scene: &Scene) -> Result<(), String> {
        self.check_things(scene)?;
        for deformed in &self.meshes {
            let joint_count = deformed.skin.map_or(Some(0), |skin| self.skins.get(skin).map(|skin| skin.joints.len()));
            let (Some(mesh), Some(joint_count)) = (scene.meshes.get(deformed.mesh), joint_count) else {
                return Err(format!("a deformed mesh {} or its skin: not there", deformed.mesh));
            };
            let sound = mesh.primitives.iter().all(|primitive| is_sound(primitive, deformed.skin.map(|_| joint_count)));
            if !sound {
                return Err(format!(
                    "the deformation of mesh {} ({}): lists or joints are missing",
                    deformed.mesh, mesh.name
                ));
            }
        }
        Ok(())
    }
}

/// True if the deformation's lists and joints are valid. `joint_count`: of the skin; `None` without a skin.
fn is_sound(primitive: &Primitive, joint_count: Option<usize>) -> bool {
    let Some(deformation) = &primitive.deformation else { return true };
    let count = primitive.positions.len();
    let fits = |length: usize| length == count;
    let fits_or_empty = |length: usize| length == count || length == 0;
    let joint = deformation.greatest_joint().map_or(0, |joint| usize::from(joint) + 1);
    fits(deformation.positions.len())
        && fits(deformation.normals.len())
        && fits_or_empty(deformation.tangents.len())
        && deformation.influences.iter().all(|set| fits(set.joints.len()) && fits(set.weights.len()))
        && deformation.targets.iter().all(|target| {
            fits_or_empty(target.positions.len())
                && fits_or_empty(target.normals.len())
                && fits_or_empty(target.tangents.len())
        })
        && joint_count.is_none_or(|joints| joint <= joints)
}

impl Animation {
    fn is_sound(&self, node_count: usize) -> bool {
        self.channels.iter().all(|channel| {
            let width = channel.property.width();
            let sampler = &channel.sampler;
            let is_complete = sampler.values.len() == sampler.times.len() * sampler.parts() * sampler.width();
            let has_width = width.is_none_or(|width| width == sampler.width());
            channel.node < node_count && !sampler.times.is_empty() && is_complete && has_width
        })
    }
}
