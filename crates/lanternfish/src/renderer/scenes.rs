//! Upload and update of scenes.

use std::sync::PoisonError;

use lanternfish_gpu::checked;
use lanternfish_scene::Scene;

use super::{Renderer, flight::check_lost};
use crate::{error::RenderError, gpu_scene::GpuScene};

impl Renderer {
    /// Uploads a scene: geometry, textures with mip levels, lights, and acceleration structures. A scene that is not valid
    /// ([`Scene::validate`]) is an error that names the cause.
    ///
    /// A scene of very many copies takes less memory and time with [`Settings::for_scene`](crate::Settings::for_scene).
    ///
    /// Renderers of one device may share the scene if their settings agree in all of `materials` and `lights` and in
    /// `shadows.rays`, and if they trace only through structures that it was uploaded with (`shadows.technique`,
    /// `indirect`, `occlusion`). Other renderers return [`RenderError::OtherSettings`].
    ///
    /// A renderer keeps the resources of a rendered scene alive, even if the scene is dropped, until it uploads another scene, is dropped,
    /// or has rendered other scenes for five frames.
    pub fn upload(&self, scene: &Scene) -> Result<GpuScene, RenderError> {
        check_lost(&self.device)?;
        // A dropped scene frees its memory before the next one allocates, as far as this renderer's frames hold it.
        self.pool.lock().unwrap_or_else(PoisonError::into_inner).forget_bind_groups();
        let upload = || GpuScene::new(&self.device, &self.queue, scene, self.needs);
        checked(&self.device, "upload", || self.engine.within(upload))
    }

    /// Returns an error if the process may not allocate what uploading a valid scene needs, as [`Self::upload`] does. Takes time linear in
    /// primitives and instances.
    #[doc(hidden)]
    pub fn check_memory(&self, scene: &Scene) -> Result<(), RenderError> {
        GpuScene::check_memory(scene, &self.needs)
    }

    /// Uploads the changes of `scene` since its upload.
    ///
    /// Updated in place: transforms of instances; positions, normals and tangents of vertices; all lights, also if their number changes;
    /// [`Scene::sky`]; the factors of materials: colour, metallic, roughness, normal scale, emission, index of refraction, specular, clear
    /// coat, unlit; the environment, if there was one and there is one. If no instance and no vertex has moved, the geometry is not
    /// touched. The BVH is refitted with the same topology, so rays become slower if objects move far apart.
    /// ([`Self::move_instances`] builds a new tree then. `update` does not, so that the frames of a sequence do not depend on their
    /// order.) The adapter's own structure is always rebuilt.
    ///
    /// After any other change (more, fewer or other meshes, instances, materials, textures; an alpha mode, a mask's alpha; an environment
    /// that appears or disappears) the scene is uploaded again with a new BVH, except for unchanged images and an unchanged environment.
    /// In two levels it is also uploaded again when a mesh's only instance moves for the first time, whenever a mesh with several
    /// bends, when one bends that has moved, when a surface begins or ends to emit and hits are shaded, and when an instance becomes flat.
    /// Images are compared by index, size and texels. Above 1,024 texels, and for the environment, only 1,024 of the texels are compared,
    /// so a change of a few texels is not detected. Names and cameras are ignored.
    ///
    /// The time is linear in the number of vertices of the scene. [`Self::move_instances`], [`Self::animate`], [`Self::set_light`] and
    /// [`Self::set_material`] read no vertices. If instances appear and disappear often, keep spare ones in the scene, scaled to zero
    /// within the scene's box, and move them: an instance of zero size is invisible to the camera and to rays. During a new upload the
    /// device also holds the old scene.
    ///
    /// Returns an error and does nothing for a scene that is not valid ([`Scene::validate`]) and for one that was not uploaded for this
    /// renderer. After any other error call `update` again: it uploads the complete scene.
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
