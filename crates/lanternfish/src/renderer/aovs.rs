//! Arbitrary output variables ([`crate::aovs`]) of a renderer's views.

use lanternfish_gpu::{Frame, Profiler, read_texture};
use lanternfish_limits::memory::Budget;
use lanternfish_scene::Camera;

use super::Renderer;
use crate::{
    aovs::{Aovs, Moment},
    error::RenderError,
    gpu_scene::{GeometryAt, GpuScene},
    view::View,
};

impl Renderer {
    /// What the nearest surface at each pixel's centre is, aligned with the image of [`Self::render`] to the pixel,
    /// whatever the settings. Draws the scene again, and waits for the device. `next`: the next frame, for motion; it
    /// has the same meshes and instances.
    pub fn aovs(
        &mut self,
        scene: &GpuScene,
        camera: &Camera,
        size: [u32; 2],
        next: Option<&Moment>,
    ) -> Result<Aovs, RenderError> {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        Budget::of_process()
            .check(pixels * Aovs::BYTES_PER_PIXEL, || format!("output variables of {pixels} pixels need"))
            .map_err(RenderError::ImageTooLarge)?;
        let single = |view: &View| View { samples: 1, ..*view };
        let view = single(&self.views(scene, &[(camera, size)])?[0]);
        let other_view = match next {
            Some(next) => single(&self.views(scene, &[(&next.camera, size)])?[0]),
            None => view,
        };
        // A surface that is mirrored since then has another place in the order of draws.
        let alike = |next: &&Moment| {
            next.order == scene.geometry.order() && next.positions.size() == scene.geometry.positions.size()
        };
        let other_frame = match next.filter(alike) {
            Some(Moment { instances, positions, .. }) => GeometryAt { instances, positions },
            None => scene.geometry_now(),
        };
        self.check_device()?;
        let [identity, place] = self.checked_work(|this| {
            let Self { device, queue, engine, aovs, .. } = this;
            let mut profiler = Profiler::new(device, queue);
            let mut frame = Frame::new(device, queue, &mut profiler);
            let targets = engine.within(|| aovs.record(&mut frame, scene, &view, (&other_view, other_frame)))?;
            frame.submit();
            Ok(targets)
        })?;
        let identity = read_texture::<[u32; 4]>(&self.device, &self.queue, identity.texture())?;
        let place = read_texture::<[f32; 4]>(&self.device, &self.queue, place.texture())?;
        Ok(Aovs::of_texels(scene, &view, &identity, &place))
    }

    /// A copy of what [`Self::aovs`] needs of a frame that is next.
    pub fn moment(&self, scene: &GpuScene, camera: &Camera) -> Moment {
        let [instances, positions] = scene.copied_geometry(&self.queue);
        Moment { camera: camera.clone(), instances, positions, order: scene.geometry.order() }
    }
}
