//! Scenes on the device: uploading them, and bringing what has changed.

use std::sync::PoisonError;

use glam::Affine3A;
use lanternfish_gpu::{Frame, Profiler, checked};
use lanternfish_scene::{Light, Material, Scene};

use super::{Renderer, flight::check_lost};
use crate::{
    error::RenderError,
    gpu_scene::{GpuScene, Sent},
};

impl Renderer {
    /// Puts a scene on the device: geometry, textures with mip levels, lights, and what rays are traced through. A scene that is
    /// not valid ([`Scene::validate`]) is an error that names the fault.
    ///
    /// Renderers of one device may share it: those whose settings agree in `materials`, `textures`, `anisotropy`, `attenuation`,
    /// `range_threshold`, `light_radius` and `shadow_rays`, and which trace through nothing that it was not uploaded for
    /// (`shadows`, `indirect`, `occlusion`). Rendered by another one it is [`RenderError::OtherSettings`].
    ///
    /// A renderer holds on to a scene that it has rendered, dropped or not, until it uploads another, is dropped itself, or has
    /// rendered others for five frames.
    pub fn upload(&self, scene: &Scene) -> Result<GpuScene, RenderError> {
        check_lost(&self.device)?;
        // A scene that is gone frees its memory before the next one takes its own, as far as this renderer's frames hold it.
        self.pool.lock().unwrap_or_else(PoisonError::into_inner).forget_bind_groups();
        let upload = || GpuScene::new(&self.device, &self.queue, scene, &self.effective, self.needs);
        checked(&self.device, "upload", || self.engine.within(upload))
    }

    /// Brings whatever has changed in `scene` since it was uploaded to the device.
    ///
    /// In place go: where instances stand; positions, normals and tangents of vertices; all lights, more or fewer too; [`Scene::sky`]; the
    /// factors of materials: colour, metallic, roughness, normal scale, emission, index of refraction, specular, clear coat, unlit. Where all
    /// instances and vertices are where they were, the geometry is not touched. The BVH keeps its tree and gets new boxes: things that move
    /// far apart make its rays slower. (The adapter's own structure is always built anew.)
    ///
    /// Where anything else is other than before (more, fewer or other meshes, instances, materials, textures; an alpha mode, a mask's
    /// alpha; the environment), the scene is uploaded again, less the images and the environment that are as they were: the tree is then a
    /// new one. Images are known by their index, size and texels; of more than 1,024 texels, as of the environment, by that many of
    /// them: painting a few goes unseen. Names and cameras are not asked.
    ///
    /// All this takes time linear in the scene, as far as its vertices; [`Self::move_instances`], [`Self::set_light`] and
    /// [`Self::set_material`] bring one thing and look at no vertex. For instances that come and go often, have spare ones in the scene,
    /// scaled to nothing, and move them: what has no size is neither seen nor met.
    ///
    /// An error, and nothing is done, for a scene that is not valid ([`Scene::validate`]) and for one that was not uploaded for this
    /// renderer. After any other error update again, or upload.
    pub fn update(&self, gpu_scene: &mut GpuScene, scene: &Scene) -> Result<(), RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        let update = || gpu_scene.update(&self.device, &self.queue, scene, &self.effective);
        checked(&self.device, "update", || self.engine.within(update))
    }

    /// Moves instances of an uploaded scene, on the device: by their index in the scene's list, each to where it stands now, world from
    /// object. The host sends these transforms; the device poses their triangles, gives the BVH new boxes, and builds the adapter's own
    /// structure again. Instances that are not named stay; one that is named twice goes where it is said last.
    ///
    /// The BVH keeps its tree: see [`Self::update`]. An error, and nothing is done, for an instance that is not there, a transform that
    /// is not finite, and, where indirect light is looked for, instances that shine ([`RenderError::NeedsUpdate`]): [`Self::update`] moves
    /// these. After an error of the device call `update`.
    pub fn move_instances(&self, gpu_scene: &mut GpuScene, moved: &[(usize, Affine3A)]) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        let record = || {
            let mut profiler = Profiler::new(&self.device, &self.queue);
            let mut frame = Frame::new(&self.device, &self.queue, &mut profiler);
            let sent = gpu_scene.move_instances(&mut frame, moved)?;
            frame.submit();
            Ok(sent)
        };
        let result = checked(&self.device, "move", || self.engine.within(record));
        if result.is_err() {
            gpu_scene.is_unsure_of_triangles();
        }
        result
    }

    /// Puts another light in the place of one of an uploaded scene's, by its index in the scene's list.
    ///
    /// An error, and nothing is done, for a light that is not there or is not valid ([`Scene::validate`]), and where indirect light is
    /// looked for: lights are then in a tree that [`Self::update`] makes again ([`RenderError::NeedsUpdate`]).
    pub fn set_light(&self, gpu_scene: &mut GpuScene, index: usize, light: &Light) -> Result<Sent, RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        gpu_scene.set_light(&self.queue, index, light, &self.effective)
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
}
