//! Poses a scene at a time of an animation.

use std::collections::BTreeMap;

use glam::{Affine3A, Quat, Vec3};

use super::{Animation, Bound, BoundLight, Motion, Property, Transform, place_camera, place_light};
use crate::{Light, LightKind, Scene};

/// Transforms and weights of all nodes, and animated properties of their lights, at a time.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// Transform of each node to world space.
    pub world_from_node: Vec<Affine3A>,
    /// Morph target weights of each node.
    pub weights: Vec<Vec<f32>>,
    /// Animated properties of the lights of nodes, by node.
    pub lights: BTreeMap<usize, LightPose>,
}

/// Animated properties of point, spot and directional lights; `None`: not animated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightPose {
    /// Linear Rec. 709.
    pub color: Option<Vec3>,
    /// Brightness, cd or lx.
    pub intensity: Option<f32>,
    /// Range, m.
    pub range: Option<f32>,
}

impl LightPose {
    /// Sets the animated properties of a light. Splines may overshoot: results are limited to what a light can have.
    fn apply(&self, light: &mut Light) {
        if self.color.is_some() || self.intensity.is_some() {
            let intensity = self.color.unwrap_or(Vec3::ONE) * self.intensity.unwrap_or(1.0);
            light.intensity = intensity.clamp(Vec3::ZERO, Vec3::splat(f32::MAX));
        }
        if let Some(range) = self.range.filter(|_| light.kind != LightKind::Directional) {
            light.range = Some(range.clamp(f32::MIN_POSITIVE, f32::MAX));
        }
    }
}

impl Motion {
    /// The pose at a time within an animation, s; `None`: the pose at rest.
    pub fn pose(&self, moment: Option<(&Animation, f32)>) -> Pose {
        let mut transforms: Vec<Transform> = self.nodes.iter().map(|node| node.rest).collect();
        let mut weights: Vec<Vec<f32>> = self.nodes.iter().map(|node| node.weights.clone()).collect();
        let mut lights: BTreeMap<usize, LightPose> = BTreeMap::new();
        if let Some((animation, time)) = moment {
            for channel in &animation.channels {
                let value = channel.sampler.at(time, channel.property == Property::Rotation);
                let node = channel.node;
                match channel.property {
                    Property::Translation => *parts(&mut transforms[node]).0 = Vec3::from_slice(&value),
                    Property::Rotation => *parts(&mut transforms[node]).1 = Quat::from_slice(&value),
                    Property::Scale => *parts(&mut transforms[node]).2 = Vec3::from_slice(&value),
                    Property::Weights => weights[node] = value,
                    Property::LightColor => lights.entry(node).or_default().color = Some(Vec3::from_slice(&value)),
                    Property::LightIntensity => lights.entry(node).or_default().intensity = Some(value[0]),
                    Property::LightRange => lights.entry(node).or_default().range = Some(value[0]),
                }
            }
        }
        let mut world_from_node: Vec<Affine3A> = Vec::with_capacity(transforms.len());
        for (node, transform) in self.nodes.iter().zip(transforms) {
            let parent = node.parent.map_or(self.world_from_roots, |parent| world_from_node[parent]);
            world_from_node.push(parent * transform.to_affine());
        }
        Pose { world_from_node, weights, lights }
    }

    /// Transform of each joint of a skin, from object space at rest to world space.
    #[doc(hidden)]
    pub fn joints(&self, skin: usize, pose: &Pose) -> Vec<Affine3A> {
        let skin = &self.skins[skin];
        let joints = skin.joints.iter().zip(&skin.joint_from_object);
        joints.map(|(node, joint_from_object)| pose.world_from_node[*node] * *joint_from_object).collect()
    }

    /// Index and object-to-world transform of each instance attached to a node.
    #[doc(hidden)]
    pub fn placed_instances(&self, pose: &Pose) -> impl Iterator<Item = (usize, Affine3A)> {
        let place = |bound: &Bound| (bound.index, pose.world_from_node[bound.node] * bound.node_from_object);
        self.instances.iter().map(place)
    }

    /// Index of each light attached to a node, and the light in world space. `None`: an area light scaled to zero, which emits nothing.
    #[doc(hidden)]
    pub fn placed_lights(&self, pose: &Pose) -> impl Iterator<Item = (usize, Option<Light>)> {
        let place = |bound: &BoundLight| {
            let mut light = bound.light.clone();
            if let Some(animated) = pose.lights.get(&bound.node).filter(|_| light.area().is_none()) {
                animated.apply(&mut light);
            }
            (bound.index, place_light(&light, &pose.world_from_node[bound.node]))
        };
        self.lights.iter().map(place)
    }

    /// Sets the placement and the animated properties of lights attached to nodes at `time`, s. `animation` is an index into
    /// [`Motion::animations`].
    ///
    /// # Panics
    ///
    /// Panics if there is no such animation.
    #[doc(hidden)]
    pub fn lights_at(&self, lights: &mut [Light], animation: usize, time: f32) {
        let animation = &self.animations[animation];
        self.place_lights(lights, &self.pose(Some((animation, animation.moment(time)))));
    }

    fn place_lights(&self, lights: &mut [Light], pose: &Pose) {
        for (index, placed) in self.placed_lights(pose) {
            let light = &mut lights[index];
            *light = placed.unwrap_or_else(|| Light { intensity: Vec3::ZERO, ..light.clone() });
        }
    }
}

/// Translation, rotation and scale of a transform. A matrix is replaced by the identity.
fn parts(transform: &mut Transform) -> (&mut Vec3, &mut Quat, &mut Vec3) {
    if matches!(transform, Transform::Matrix(_)) {
        *transform = Transform::IDENTITY;
    }
    let Transform::Parts { translation, rotation, scale } = transform else { unreachable!("the identity has parts") };
    (translation, rotation, scale)
}

impl Scene {
    /// Poses the scene at `time`, s: instances, lights, cameras, and the vertices of deformed meshes. `animation` is an index into
    /// [`Motion::animations`]; the animation loops.
    ///
    /// Nodes that it does not animate return to rest, independent of earlier poses. Lights and instances that were added to the
    /// scene's lists are unchanged.
    ///
    /// # Panics
    ///
    /// Panics if there is no such animation.
    pub fn pose(&mut self, animation: usize, time: f32) {
        let animation = &self.motion.animations[animation];
        let pose = self.motion.pose(Some((animation, animation.moment(time))));
        self.apply(&pose);
    }

    /// Poses the scene at rest, as in the file.
    pub fn pose_at_rest(&mut self) {
        self.apply(&self.motion.pose(None));
    }

    fn apply(&mut self, pose: &Pose) {
        let motion = &self.motion;
        for (index, world_from_object) in motion.placed_instances(pose) {
            self.instances[index].world_from_object = world_from_object;
        }
        for bound in &motion.cameras {
            let camera = &mut self.cameras[bound.index];
            *camera = place_camera(camera, &pose.world_from_node[bound.node]);
        }
        motion.place_lights(&mut self.lights, pose);
        let joints: Vec<Vec<Affine3A>> = (0..motion.skins.len()).map(|skin| motion.joints(skin, pose)).collect();
        for deformed in &motion.meshes {
            let joints = deformed.skin.map_or(&[][..], |skin| &joints[skin]);
            for primitive in &mut self.meshes[deformed.mesh].primitives {
                if let Some(deformation) = primitive.deformation.take() {
                    deformation.apply(primitive, &pose.weights[deformed.node], joints);
                    primitive.deformation = Some(deformation);
                }
            }
        }
    }
}
