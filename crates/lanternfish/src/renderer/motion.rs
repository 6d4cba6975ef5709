//! What changes by itself: instances that move, a moment of an animation, a light, a material; without looking at the whole scene.

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
    /// Moves instances of an uploaded scene, on the device: by their index in the scene's list, each to where it stands now, world from
    /// object. The host sends these transforms; the device poses their triangles, gives the BVH new boxes, and builds the adapter's own
    /// structure again. Instances that are not named stay; one that is named twice goes where it is said last.
    ///
    /// The BVH keeps its tree until that has become costly. Then a thread builds another, of where things stood, which takes its place in a
    /// later call: [`Sent::has_rebuilt`]. Call with nothing moved to have it where things rest; when it comes,
    /// means begin again and deep images are built again, as after a move. Rays find the same distances through
    /// either; of surfaces in one place either may be found first.
    ///
    /// An error, and nothing is done, for an instance that is not there, a transform that
    /// is not finite, and, where indirect light is looked for, instances that shine ([`RenderError::NeedsUpdate`]):
    /// [`Self::update`] moves these. After an error of the device call `update`.
    pub fn move_instances(&self, gpu_scene: &mut GpuScene, moved: &[(usize, Affine3A)]) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        self.recorded(gpu_scene, |gpu_scene, frame| gpu_scene.move_instances(frame, moved))
    }

    /// Brings an uploaded scene to a moment of an animation, on the device: an index of [`Motion::animations`] and a time, s, as
    /// [`Scene::pose`] takes them; `None`: where the file puts all that moves. `scene` is the one that was uploaded, or last brought by
    /// [`Self::update`]; it stays as it is, and its cameras are the caller's to place ([`Motion::cameras`]).
    ///
    /// The host finds where nodes stand, and sends transforms of the instances that go with them, lights that go with them, and of meshes
    /// that bend the joints' transforms and the targets' weights. The device bends their vertices, poses the triangles of all that moved or
    /// bent, gives the BVH new boxes, and builds the adapter's own structure again. What is where it was sends nothing. The first call also
    /// sends the vertices at rest and what bends them, which later calls take to be the same; it takes time linear in the scene. Boxes of
    /// draws, and of the scene, are found of the joints: they hold all vertices, and are larger than need be.
    ///
    /// An error, and nothing is done: [`RenderError::NoAnimation`]; [`RenderError::InvalidScene`] for what is not finite or beyond [`Scene::FARTHEST`];
    /// [`RenderError::NeedsUpdate`] for other numbers of instances, meshes, primitives, vertices, indices or lights that go with nodes than were
    /// uploaded, other meshes that bend than at the first call, and, where indirect light is looked for, lights that change and instances
    /// that shine and move or bend.
    /// [`Scene::pose`] and [`Self::update`] bring these, and all else back. The BVH's tree: see [`Self::move_instances`]. After an error of the device call `update`.
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

    /// Puts another light in the place of one of an uploaded scene's, by its index in the scene's list.
    ///
    /// An error, and nothing is done, for a light that is not there or is not valid ([`Scene::validate`]), and where indirect light is
    /// looked for: lights are then in a tree that [`Self::update`] makes again ([`RenderError::NeedsUpdate`]).
    pub fn set_light(&self, gpu_scene: &mut GpuScene, index: usize, light: &Light) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        gpu_scene.set_light(&self.queue, index, light)
    }

    /// Puts another material in the place of one of an uploaded scene's, by its index in the scene's list: one that differs in the factors
    /// that [`Self::update`] names.
    ///
    /// An error, and nothing is done, for a material that is not there or is not valid, one that differs in more, and, where indirect
    /// light is looked for, one that shines otherwise: [`Self::update`] brings these ([`RenderError::NeedsUpdate`]).
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

    /// Hands what `record` adds to a frame of its own to the device. After an error of the device the next update uploads the scene.
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
