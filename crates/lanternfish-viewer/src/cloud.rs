//! The scene's deep images, rendered as points [Archer2019, fig. 6].

use std::sync::Arc;

use glam::UVec2;
use lanternfish::{GpuScene, RenderError, Renderer, Settings, settings::Shadows, view::View};
use lanternfish_gpu::{Frame, Profiler};
use lanternfish_papers::{
    DeepImageSettings, DeepStore,
    deep_images::{
        DeepImageBuilder, DeepImages,
        view::{PointCloud, PointSize},
    },
};
use lanternfish_scene::{Camera, Scene};

use crate::viewport::Viewport;

/// Deep images of a scene, and their last rendered image.
#[derive(Debug)]
pub struct Cloud {
    scene: Arc<Scene>,
    settings: DeepImageSettings,
    uploaded: GpuScene,
    images: DeepImages,
    points: PointCloud,
    profiler: Profiler,
    rendering: Option<(wgpu::TextureView, Camera, UVec2)>,
}

impl Cloud {
    /// Builds deep images of the first viewport's scene with its settings, whether or not its renderer uses them.
    pub fn new(first: &Viewport) -> Result<Self, RenderError> {
        let gpu = &first.gpu;
        // The builders rasterise the BVH's triangles.
        let with_bvh = Settings::direct_light().with_shadows(Shadows::BVH);
        let uploaded = Renderer::with_engine(first.engine(), with_bvh)?.upload(&first.scene)?;
        let settings = DeepImageSettings::of(&first.settings().structure);
        let shown = DeepImageSettings { store: DeepStore::LinearArray, payload: true, ..settings };
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let (images, points) = first.engine().within(|| {
            let mut builder = DeepImageBuilder::new(&gpu.device, shown)?;
            let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
            let images = builder.record(&mut frame, &uploaded)?;
            frame.submit();
            Ok::<_, RenderError>((images, PointCloud::new(&gpu.device, &shown)?))
        })?;
        Ok(Self { scene: Arc::clone(&first.scene), settings, uploaded, images, points, profiler, rendering: None })
    }

    /// True if the deep images match the first viewport's scene and settings.
    pub fn is_of(&self, first: &Viewport) -> bool {
        Arc::ptr_eq(&self.scene, &first.scene) && self.settings == DeepImageSettings::of(&first.settings().structure)
    }

    /// True if the last image shows this camera's view in this size, pixels.
    pub fn is_drawn(&self, camera: &Camera, size: UVec2) -> bool {
        self.rendering.as_ref().is_some_and(|(_, of, at)| of == camera && *at == size)
    }

    /// Draws the points for a camera.
    pub fn draw(&mut self, first: &Viewport, camera: &Camera) -> Result<(), RenderError> {
        let (gpu, size) = (&first.gpu, first.size());
        let view = View::new(camera, size, glam::Vec3::ZERO, &self.scene.bounds());
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut self.profiler);
        let point = PointSize::for_images(self.images.directions.len());
        let drawn = self.points.record(&mut frame, &self.uploaded, &self.images, None, &view, point)?;
        frame.submit();
        // Pass times are discarded.
        let _ = self.profiler.finished();
        self.rendering = Some((first.on_interface(drawn.display)?, camera.clone(), size));
        Ok(())
    }

    /// The last image, on the device that paints the window.
    pub fn rendering(&self) -> Option<&wgpu::TextureView> {
        self.rendering.as_ref().map(|(rendering, ..)| rendering)
    }
}
