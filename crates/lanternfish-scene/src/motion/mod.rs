//! Motion in a scene: nodes, the objects attached to them, skins, and animations. [`crate::Scene::pose`] sets the scene to a time of one.
//!
//! ```text
//! Animation ─▶ nodes' transforms, weights of morph targets ─▶ world from node ─┬─▶ instances, lights, cameras
//!   sampler.rs                                        pose.rs                  └─▶ skins ─▶ vertices of deformed meshes
//!                                                                                             deform.rs
//! ```

mod check;
mod deform;
mod place;
mod pose;
mod reach;
mod sampler;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::{Affine3A, Quat, Vec3};

pub use self::deform::{Deformation, Influences, MorphTarget};

pub(crate) use self::place::{place_camera, place_light};
pub use self::pose::{LightPose, Pose};
#[doc(hidden)]
pub use self::reach::Reach;
pub use self::sampler::{Interpolation, Sampler};
use crate::Light;

/// A point in time of the animation and light rain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Index of the animation. `None` leaves everything except light rain as the file has it.
    pub animation: Option<usize>,
    /// Time, s.
    pub time: f32,
}

/// The node hierarchy, skins and animations of a scene. Empty for static scenes.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Transform of the nodes without a parent: of the file's up axis.
    pub world_from_roots: Affine3A,
    /// The node hierarchy, parents before their children.
    pub nodes: Vec<Node>,
    /// Skins of deformed meshes.
    pub skins: Vec<Skin>,
    /// Animations, in the file's order.
    pub animations: Vec<Animation>,
    /// Instances attached to a node.
    pub instances: Vec<Bound>,
    /// Cameras attached to a node.
    pub cameras: Vec<Bound>,
    /// Lights attached to a node.
    pub lights: Vec<BoundLight>,
    /// Deformed meshes, each attached to one node.
    pub meshes: Vec<DeformedMesh>,
}

impl Motion {
    /// True for each node that an animation moves, directly or through an ancestor.
    #[doc(hidden)]
    pub fn moving_nodes(&self) -> Vec<bool> {
        let mut moves = vec![false; self.nodes.len()];
        for channel in self.animations.iter().flat_map(|animation| &animation.channels) {
            let moves_node = matches!(channel.property, Property::Translation | Property::Rotation | Property::Scale);
            moves[channel.node] |= moves_node;
        }
        for node in 0..self.nodes.len() {
            moves[node] |= self.nodes[node].parent.is_some_and(|parent| moves[parent]);
        }
        moves
    }
}

/// A node of the hierarchy.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Name in the file, or empty.
    pub name: String,
    /// Index of the parent node, which is less than the node's own.
    pub parent: Option<usize>,
    /// Transform relative to the parent, unless animated.
    pub rest: Transform,
    /// Weights of the mesh's morph targets, unless animated.
    pub weights: Vec<f32>,
}

/// Transform of a node relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// Scale, then rotation, then translation. Animations change these components.
    Parts {
        /// Translation, m.
        translation: Vec3,
        /// Rotation, unit length.
        rotation: Quat,
        /// Scale along each axis.
        scale: Vec3,
    },
    /// Any affine transform. An animation of one component first replaces it by the identity.
    Matrix(Affine3A),
}

impl Transform {
    /// The identity transform.
    pub const IDENTITY: Self = Self::Parts { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// The transform from the node's space to its parent's.
    pub fn to_affine(self) -> Affine3A {
        match self {
            Self::Parts { translation, rotation, scale } => {
                Affine3A::from_scale_rotation_translation(scale, rotation, translation)
            }
            Self::Matrix(matrix) => matrix,
        }
    }
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// The joints of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Node indices, in the order in which vertices refer to them.
    pub joints: Vec<usize>,
    /// Inverse bind matrix of each joint: from object space at rest to the joint's space.
    pub joint_from_object: Vec<Affine3A>,
}

/// An instance or a camera attached to a node.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// Index into the scene's list.
    pub index: usize,
    /// Index of the node.
    pub node: usize,
    /// Transform of the object relative to the node.
    pub node_from_object: Affine3A,
}

/// A light attached to a node.
#[derive(Clone, Debug)]
pub struct BoundLight {
    /// Index into the scene's lights.
    pub index: usize,
    /// Index of the node.
    pub node: usize,
    /// The light in the node's space.
    pub light: Light,
}

/// A deformed mesh: at least one of its primitives has a [`Deformation`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeformedMesh {
    /// Index into the scene's meshes.
    pub mesh: usize,
    /// Index of the node that has the morph targets' weights.
    pub node: usize,
    /// Index of its skin. Skinned vertices are in world space, and their instance has the identity transform.
    pub skin: Option<usize>,
}

/// An animation: channels that are played together.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// Name in the file, or empty.
    pub name: String,
    /// Animated properties.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// Time of the last keyframe, s.
    pub fn duration(&self) -> f32 {
        self.channels.iter().filter_map(|channel| channel.sampler.times.last()).fold(0.0, |last, time| last.max(*time))
    }

    /// The time within the animation at `time`, s: the animation loops.
    #[doc(hidden)]
    pub fn moment(&self, time: f32) -> f32 {
        let duration = self.duration();
        if time > duration && duration > 0.0 { time.rem_euclid(duration) } else { time }
    }
}

/// An animated property of a node.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Index of the node.
    pub node: usize,
    /// Animated property.
    pub property: Property,
    /// Keyframes, which channels may share.
    pub sampler: Arc<Sampler>,
}

/// A property of a node that can be animated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// Translation: three values, m.
    Translation,
    /// Rotation: four values, a quaternion.
    Rotation,
    /// Scale: three values.
    Scale,
    /// Weights: one value per morph target of the node's mesh.
    Weights,
    /// Linear Rec. 709 colour of the node's point, spot and directional lights: three values. A light's intensity is
    /// its colour times its brightness. Where only one of them is animated, the other is 1.
    LightColor,
    /// Brightness of these lights: one value, cd or, for a directional light, lx.
    LightIntensity,
    /// Range of these lights: one value, m. Directional lights have none.
    LightRange,
}

impl Property {
    /// Number of components of a value; `None` for weights, whose number is that of the morph targets.
    pub(crate) fn width(self) -> Option<usize> {
        match self {
            Self::Translation | Self::Scale | Self::LightColor => Some(3),
            Self::Rotation => Some(4),
            Self::LightIntensity | Self::LightRange => Some(1),
            Self::Weights => None,
        }
    }
}
