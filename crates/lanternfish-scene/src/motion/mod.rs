//! What moves in a scene, and how: nodes, what hangs on them, skins, and animations. [`crate::Scene::pose`] brings a scene to a moment of one.
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

use glam::{Affine3A, Quat, Vec3};

pub use self::deform::{Deformation, Influences, MorphTarget};

pub(crate) use self::place::{place_camera, place_light};
pub use self::pose::Pose;
pub use self::reach::Reach;
pub use self::sampler::{Interpolation, Sampler};
use crate::Light;

/// Everything of a scene that moves. Empty for scenes in which nothing does.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// The node tree, parents before their children.
    pub nodes: Vec<Node>,
    /// Bones of deformed meshes.
    pub skins: Vec<Skin>,
    /// What may be played, in the file's order.
    pub animations: Vec<Animation>,
    /// Instances that go with a node.
    pub instances: Vec<Bound>,
    /// Cameras that go with a node.
    pub cameras: Vec<Bound>,
    /// Lights that go with a node.
    pub lights: Vec<BoundLight>,
    /// Meshes whose vertices move, each of one node.
    pub meshes: Vec<DeformedMesh>,
}

impl Motion {
    /// Of each node, whether an animation moves it, or a node that it goes with.
    pub fn moving_nodes(&self) -> Vec<bool> {
        let mut moves = vec![false; self.nodes.len()];
        for channel in self.animations.iter().flat_map(|animation| &animation.channels) {
            moves[channel.node] |= channel.property != Property::Weights;
        }
        for node in 0..self.nodes.len() {
            moves[node] |= self.nodes[node].parent.is_some_and(|parent| moves[parent]);
        }
        moves
    }
}

/// A node of the tree that a file places things by.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// The file's name for it, or empty.
    pub name: String,
    /// Index of the node that it goes with, which is less than its own.
    pub parent: Option<usize>,
    /// Where it stands in its parent where no animation says otherwise.
    pub rest: Transform,
    /// Weights of its mesh's morph targets where no animation says otherwise.
    pub weights: Vec<f32>,
}

/// Where a node stands in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// Scaled, then rotated, then moved: what animations change.
    Parts {
        /// m.
        translation: Vec3,
        /// Unit length.
        rotation: Quat,
        /// Along each axis.
        scale: Vec3,
    },
    /// Any transform. An animation that changes a part of it puts the identity in its place first.
    Matrix(Affine3A),
}

impl Transform {
    /// Changes nothing.
    pub const IDENTITY: Self = Self::Parts { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// Parent from node.
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

/// The bones of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Nodes, in the order in which vertices name them.
    pub joints: Vec<usize>,
    /// Of each joint: joint from object at rest, the inverse bind matrix.
    pub joint_from_object: Vec<Affine3A>,
}

/// An instance or a camera that goes with a node.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// Index into the scene's list.
    pub index: usize,
    /// Index of the node.
    pub node: usize,
    /// Where the thing stands in the node.
    pub node_from_object: Affine3A,
}

/// A light that goes with a node.
#[derive(Clone, Debug)]
pub struct BoundLight {
    /// Index into the scene's lights.
    pub index: usize,
    /// Index of the node.
    pub node: usize,
    /// The light in the node's space.
    pub light: Light,
}

/// A mesh whose vertices move: of its primitives those that have a [`Deformation`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeformedMesh {
    /// Index into the scene's meshes.
    pub mesh: usize,
    /// The node whose weights its morph targets have.
    pub node: usize,
    /// Index of its skin. Skinned vertices are in world space, and their instance stands at the origin.
    pub skin: Option<usize>,
}

/// What is played together.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// The file's name for it, or empty.
    pub name: String,
    /// What it changes.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// When its last keyframe is, seconds.
    pub fn duration(&self) -> f32 {
        self.channels.iter().filter_map(|channel| channel.sampler.times.last()).fold(0.0, |last, time| last.max(*time))
    }

    /// The moment of it that is shown at `time`, seconds: after its end it starts again.
    pub fn moment(&self, time: f32) -> f32 {
        let duration = self.duration();
        if time > duration && duration > 0.0 { time.rem_euclid(duration) } else { time }
    }
}

/// One thing that an animation changes.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Index of the node.
    pub node: usize,
    /// What of it.
    pub property: Property,
    /// To what.
    pub sampler: Sampler,
}

/// What an animation changes of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// Three values, m.
    Translation,
    /// Four values: a quaternion.
    Rotation,
    /// Three values.
    Scale,
    /// As many values as the node's mesh has morph targets.
    Weights,
}
