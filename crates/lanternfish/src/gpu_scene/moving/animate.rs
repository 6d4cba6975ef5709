//! Animation on the device at a given time: deforms vertices, transforms instances and moves lights.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec3};
use lanternfish_gpu::Frame;
use lanternfish_scene::{Bounds, Light, Scene, SceneFault, motion::Pose};

use super::{
    super::scene::GpuScene,
    bending::{Bend, Bending, bends},
    sent::Sent,
};
use crate::{error::RenderError, lights::Light as PackedLight};

/// Changes of the scene at a time of an animation.
struct Step {
    /// Transforms of all instances that have moved or been deformed; by index, ascending.
    moved: Vec<(usize, Affine3A)>,
    /// None: the device's vertices are up to date.
    bend: Option<Bend>,
    lights: Vec<(usize, PackedLight)>,
}

/// The transforms of nodes at a time: an animation's index and seconds; `None`: the file's rest pose.
fn pose_at(scene: &Scene, moment: Option<(usize, f32)>) -> Result<Pose, RenderError> {
    let motion = &scene.motion;
    motion.check_things(scene).map_err(|what| SceneFault::Motion { what })?;
    let Some((number, time)) = moment else { return Ok(motion.pose(None)) };
    let count = motion.animations.len();
    let animation = motion.animations.get(number).ok_or(RenderError::NoAnimation { number, count })?;
    Ok(motion.pose(Some((animation, animation.moment(time)))))
}

impl GpuScene {
    /// See [`crate::Renderer::animate`].
    pub(crate) fn animate(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &Scene,
        moment: Option<(usize, f32)>,
    ) -> Result<Sent, RenderError> {
        self.placed.check_counts(scene)?;
        let pose = pose_at(scene, moment)?;
        let mut sent = Sent::default();
        if self.bending.is_none() && bends(scene) {
            scene.validate()?;
            self.check_bindings()?;
            let bending = Bending::new(&self.device, &self.geometry, scene)?;
            sent.bytes += bending.bytes;
            self.bending = Some(bending);
        }
        let Step { moved, bend, lights } = self.step(scene, &pose)?;
        if moved.is_empty() && bend.is_none() && lights.is_empty() {
            let stayed = self.stay(frame)?;
            return Ok(Sent { bytes: sent.bytes + stayed.bytes, ..stayed });
        }
        let bounds = bend.as_ref().zip(self.bending.as_ref()).map(|(bend, bending)| bending.bounds(bend));
        let bounds = bounds.unwrap_or_default();
        // False for NaN, too.
        let is_within = |p: Vec3| p.abs().cmple(Vec3::splat(Scene::FARTHEST)).all();
        if bounds.iter().any(|(_, b)| *b != Bounds::EMPTY && !(is_within(b.min) && is_within(b.max))) {
            let what = format!("vertices are deformed beyond {:e} m", Scene::FARTHEST);
            return Err(SceneFault::Motion { what }.into());
        }
        let bends = bend.is_some();
        if bends {
            self.before_vertices_bend(frame.queue);
        }
        if let (Some(bend), Some(bending)) = (bend, &mut self.bending) {
            // The frame may fail after this.
            self.placed.forget_vertices(bending.meshes());
            sent.bytes += bending.record(frame, &self.geometry, bend)?;
            sent.dispatches += 1;
            self.geometry.set_bounds(&bounds);
        }
        if bends || !moved.is_empty() {
            let posed = self.put(frame, &moved)?;
            let (bytes, dispatches) = (sent.bytes + posed.bytes, sent.dispatches + posed.dispatches);
            sent = Sent { bytes, dispatches, ..posed };
        }
        sent.bytes += self.write_lights(frame.queue, &lights)?;
        Ok(sent)
    }

    /// The changes from the device's state to a pose. An error, before anything is changed, if the device cannot make a change alone.
    fn step(&self, scene: &Scene, pose: &Pose) -> Result<Step, RenderError> {
        let bound: Vec<(usize, Affine3A)> = scene.motion.placed_instances(pose).collect();
        self.placed.check_moves(&bound)?;
        // The last entry for an instance counts.
        let mut moved: BTreeMap<usize, Affine3A> = bound.into_iter().collect();
        moved.retain(|instance, transform| self.placed.may_have_moved(*instance, transform));
        let bend = self.bending.as_ref().map(|bending| bending.bend(scene, pose)).transpose()?;
        let bend = bend.zip(self.bending.as_ref()).and_then(|(bend, bending)| {
            let is_other = bending.is_other(&bend) || self.placed.may_have_bent(bending.meshes());
            is_other.then_some(bend)
        });
        if let (Some(_), Some(bending)) = (&bend, &self.bending) {
            for (instance, transform) in self.placed.instances_of(bending.meshes()) {
                moved.entry(instance).or_insert(transform);
            }
        }
        let moved: Vec<(usize, Affine3A)> = moved.into_iter().collect();
        self.check_shining(&moved)?;
        self.check_levels(&moved)?;
        let lights = self.changed_lights(scene, pose)?;
        Ok(Step { moved, bend, lights })
    }

    /// The lights whose placement in a pose differs from the device's.
    fn changed_lights(&self, scene: &Scene, pose: &Pose) -> Result<Vec<(usize, PackedLight)>, RenderError> {
        let mut changed = Vec::new();
        for (index, placed) in scene.motion.placed_lights(pose) {
            self.check_light(index, placed.as_ref())?;
            // A light whose area has shrunk to zero emits nothing.
            let light = placed.unwrap_or_else(|| Light { intensity: Vec3::ZERO, ..scene.lights[index].clone() });
            let packed = PackedLight::new(&light, &self.needs.lights).in_unit(self.light_unit());
            if self.lights.on_host[index] != packed {
                changed.push((index, packed));
            }
        }
        Ok(changed)
    }
}
