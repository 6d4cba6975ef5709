//! Scenes on the device: uploading them, and bringing what has changed.

use std::sync::PoisonError;

use lanternfish_gpu::checked;
use lanternfish_scene::Scene;

use super::{Renderer, flight::check_lost};
use crate::{error::RenderError, gpu_scene::GpuScene};

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
        let upload = || GpuScene::new(&self.device, &self.queue, scene, self.needs);
        checked(&self.device, "upload", || self.engine.within(upload))
    }

    /// Brings whatever has changed in `scene` since it was uploaded to the device.
    ///
    /// In place go: where instances stand; positions, normals and tangents of vertices; all lights, more or fewer too; [`Scene::sky`]; the
    /// factors of materials: colour, metallic, roughness, normal scale, emission, index of refraction, specular, clear coat, unlit. Where all
    /// instances and vertices are where they were, the geometry is not touched. The BVH keeps its tree and gets new boxes: things that move
    /// far apart make its rays slower. ([`Self::move_instances`] builds another tree then; `update` does not, so that frames of sequences are
    /// the same in any order.) (The adapter's own structure is always built again.)
    ///
    /// Where anything else is other than before (more, fewer or other meshes, instances, materials, textures; an alpha mode, a mask's
    /// alpha; the environment), the scene is uploaded again, less the images and the environment that are as they were: the tree is then a
    /// new one. Images are known by their index, size and texels; of more than 1,024 texels, as of the environment, by that many of
    /// them: painting a few goes unseen. Names and cameras are not asked.
    ///
    /// All this takes time linear in the scene, as far as its vertices; [`Self::move_instances`], [`Self::animate`],
    /// [`Self::set_light`] and [`Self::set_material`] look at no vertex. For instances that come and go often, have spare ones in the scene,
    /// scaled to nothing within the scene's box, and move them: what has no size is neither seen nor met. While a scene is uploaded again the
    /// device holds the old one too.
    ///
    /// An error, and nothing is done, for a scene that is not valid ([`Scene::validate`]) and for one that was not uploaded for this
    /// renderer. After any other error update again: that uploads all of the scene.
    pub fn update(&self, gpu_scene: &mut GpuScene, scene: &Scene) -> Result<(), RenderError> {
        check_lost(&self.device)?;
        gpu_scene.check(&self.device, &self.needs)?;
        let update = || gpu_scene.update(&self.device, &self.queue, scene);
        let result = checked(&self.device, "update", || self.engine.within(update));
        if let Err(RenderError::Gpu(_)) = result {
            gpu_scene.distrust();
        }
        result
    }
}
