//! Partial updates: moving instances, the time of an animation, a light, a material. Their cost does not depend on the size of the scene.

use glam::Affine3A;
use lanternfish_gpu::{Frame, Profiler, checked};
#[cfg(doc)]
use lanternfish_scene::motion::Motion;
use lanternfish_scene::{Light, Material, Scene};

use super::{Renderer, flight::check_lost};
use crate::{
    error::RenderError,
    gpu_scene::{GpuScene, Sent},
};

impl Renderer {
    /// Moves instances of an uploaded scene on the device: their indices in the scene's list and their new transforms, world from object.
    /// The host uploads the transforms; the device transforms the triangles, refits the BVH and rebuilds the adapter's own structure. Other
    /// instances do not move; if an instance is named twice, the last transform applies.
    ///
    /// The BVH's topology is kept until its cost has grown too much. A thread then builds a new tree from the current transforms, which a
    /// later call installs: [`Sent::has_rebuilt`]. Call with an empty list to install it for a scene at rest; means then restart and deep
    /// images are rebuilt, as after a move. Rays return the same distances with either tree; of coincident surfaces either may be hit.
    ///
    /// With a BVH in two levels the host refits the tree over instances, or builds it again at once, without [`Sent::has_rebuilt`].
    ///
    /// Returns an error and does nothing for an instance that does not exist, a transform that is not finite, and, with indirect light, an
    /// emissive instance, and, in two levels, one that has triangles in world space or becomes flat
    /// ([`RenderError::NeedsUpdate`]): use [`Self::update`] for these.
    /// After a device error call `update`.
    pub fn move_instances(&self, gpu_scene: &mut GpuScene, moved: &[(usize, Affine3A)]) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        self.recorded(gpu_scene, |gpu_scene, frame| gpu_scene.move_instances(frame, moved))
    }

    /// Poses an uploaded scene at a time of an animation, on the device: an index of [`Motion::animations`] and a time, s, as for
    /// [`Scene::pose`]. `None` restores the rest pose of the file. `scene` is the scene that was uploaded or last passed to
    /// [`Self::update`]. It is not changed; the caller moves its cameras ([`Motion::cameras`]).
    ///
    /// The host evaluates the nodes and uploads the transforms of their instances and lights, and the joint transforms and morph weights of
    /// deforming meshes. The device deforms their vertices, transforms the triangles that moved, refits the BVH and rebuilds the adapter's
    /// own structure. Nodes that did not move upload nothing. The first call also uploads the rest vertices, skins and morph targets, in
    /// time linear in the scene; later calls assume that these do not change. Bounding boxes of draws and of the scene are computed from
    /// the joints: they are conservative and larger than necessary.
    ///
    /// Returns an error and does nothing: [`RenderError::NoAnimation`]; [`RenderError::InvalidScene`] for values that are not finite or
    /// exceed [`Scene::FARTHEST`]; [`RenderError::NeedsUpdate`] if the number of instances, meshes, primitives, vertices, indices or
    /// animated lights differs from the upload, if other meshes deform than at the first call, and, with indirect light, if lights change
    /// or emissive instances move or deform, and in two levels what [`Self::move_instances`] refuses. Use [`Scene::pose`] and
    /// [`Self::update`] for these. BVH topology: see
    /// [`Self::move_instances`]. After a device error call `update`.
    pub fn animate(
        &self,
        gpu_scene: &mut GpuScene,
        scene: &Scene,
        moment: Option<(usize, f32)>,
    ) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        self.recorded(gpu_scene, |gpu_scene, frame| gpu_scene.animate(frame, scene, moment))
    }

    /// Replaces a light of an uploaded scene, by its index in the scene's list.
    ///
    /// If a technique draws lights from a tree, the tree is rebuilt on the device: for many lights, use [`Self::update`]. Returns an error and
    /// does nothing for a light that does not exist or is not valid ([`Scene::validate`]).
    pub fn set_light(&self, gpu_scene: &mut GpuScene, index: usize, light: &Light) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        gpu_scene.set_light(&self.queue, index, light)
    }

    /// Replaces a material of an uploaded scene, by its index in the scene's list. Only the factors that [`Self::update`] lists may differ.
    ///
    /// Returns an error and does nothing for a material that does not exist or is not valid, one with other differences, and, with indirect
    /// light, one with another emission: use [`Self::update`] for these ([`RenderError::NeedsUpdate`]).
    pub fn set_material(
        &self,
        gpu_scene: &mut GpuScene,
        index: usize,
        material: &Material,
    ) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        gpu_scene.set_material(&self.queue, index, material)
    }

    /// Submits the commands of `record` in a frame of their own. After a device error the next update uploads the scene again.
    fn recorded(
        &self,
        gpu_scene: &mut GpuScene,
        record: impl FnOnce(&mut GpuScene, &mut Frame<'_>) -> Result<Sent, RenderError>,
    ) -> Result<Sent, RenderError> {
        let recorded = || {
            let mut profiler = Profiler::new(&self.device, &self.queue);
            let mut frame = Frame::new(&self.device, &self.queue, &mut profiler);
            let sent = record(gpu_scene, &mut frame)?;
            frame.submit();
            Ok(sent)
        };
        let result = checked(&self.device, "move", || self.engine.within(recorded));
        if let Err(RenderError::Gpu(_)) = result {
            gpu_scene.distrust();
        }
        result
    }
}
