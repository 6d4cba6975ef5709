//! What is seen: a scene on the device, and its picture in a texture that the window shows.

use std::time::Instant;

use glam::UVec2;
use lanternfish::{Change, FrameId, FrameReport, GpuScene, RenderError, Renderer, Settings, Target, ViewRequest};
use lanternfish_gpu::Gpu;
use lanternfish_scene::{Camera, Scene};

/// Format of the picture: the picture is encoded for a display, not the texture.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Frames whose mean a picture at rest is.
pub const AT_REST: u32 = 64;

/// A scene, how it is rendered, and where the picture is.
#[derive(Debug)]
pub struct Seen {
    /// The device.
    pub gpu: Gpu,
    /// The scene, as it is now.
    pub scene: Scene,
    /// What the last frame that the device is done with has said.
    pub report: Option<FrameReport>,
    /// What the last change of settings cost.
    pub change: Option<Change>,
    renderer: Renderer,
    uploaded: GpuScene,
    settings: Settings,
    picture: wgpu::TextureView,
    size: UVec2,
    /// Frames that the picture is the mean of, and where the camera was.
    averaged: (u32, Option<Camera>),
    on_their_way: Option<(FrameId, Instant)>,
}

impl Seen {
    /// Uploads the scene.
    pub fn new(gpu: Gpu, scene: Scene, settings: &Settings) -> Result<Self, RenderError> {
        let settings = shown(settings);
        let renderer = Renderer::new(&gpu.device, &gpu.queue, settings.clone())?;
        let uploaded = renderer.upload(&scene)?;
        let (size, picture) = (UVec2::ONE, texture(&gpu.device, UVec2::ONE));
        let averaged = (0, None);
        let (report, change, on_their_way) = (None, None, None);
        Ok(Self { gpu, scene, report, change, renderer, uploaded, settings, picture, size, averaged, on_their_way })
    }

    /// Another scene in the place of this one. After an error this one stays.
    pub fn open(&mut self, scene: Scene) -> Result<(), RenderError> {
        self.uploaded = self.renderer.upload(&scene)?;
        self.scene = scene;
        self.begin_anew();
        Ok(())
    }

    /// Brings what has changed in the scene to the device.
    pub fn update(&mut self) -> Result<(), RenderError> {
        self.renderer.update(&mut self.uploaded, &self.scene)?;
        self.begin_anew();
        Ok(())
    }

    /// Renders by other settings. After an error those of before stay.
    pub fn set(&mut self, settings: &Settings) -> Result<(), RenderError> {
        let settings = shown(settings);
        if settings == self.settings {
            return Ok(());
        }
        let change = self.renderer.set(settings.clone())?;
        if change == Change::Upload {
            match self.renderer.upload(&self.scene) {
                Ok(uploaded) => self.uploaded = uploaded,
                Err(error) => {
                    self.renderer.set(self.settings.clone())?;
                    return Err(error);
                }
            }
        }
        (self.settings, self.change) = (settings, Some(change));
        self.begin_anew();
        Ok(())
    }

    /// How it is rendered.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Makes the picture so large, pixels; whether it is another texture now. A side of 0 is one of 1.
    pub fn resize(&mut self, size: UVec2) -> bool {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        let size = size.clamp(UVec2::ONE, UVec2::splat(most));
        if size == self.size {
            return false;
        }
        (self.size, self.picture) = (size, texture(&self.gpu.device, size));
        self.averaged = (0, None);
        true
    }

    /// The picture: encoded for a display.
    pub fn picture(&self) -> &wgpu::TextureView {
        &self.picture
    }

    /// Its pixels across and down.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// How many frames the picture is the mean of.
    pub fn averaged(&self) -> u32 {
        self.averaged.0
    }

    /// Whether another frame would change the picture of this camera.
    pub fn has_more(&self, camera: &Camera) -> bool {
        self.averaged.1.as_ref() != Some(camera) || (self.settings.accumulate > 1 && self.averaged.0 < AT_REST)
    }

    /// Whether the device has not yet done what it was told.
    pub fn is_busy(&self) -> bool {
        self.on_their_way.is_some()
    }

    /// Hands the next frame to the device. One at a time: what the window shows comes between.
    pub fn draw(&mut self, camera: &Camera) -> Result<(), RenderError> {
        let mut commands = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let request = ViewRequest::of_camera(0, camera, self.size.into(), Target::Display(&self.picture, FORMAT));
        let frame = self.renderer.record(&mut commands, &self.uploaded, &[request])?;
        self.gpu.queue.submit([commands.finish()]);
        self.renderer.submitted(frame);
        let goes_on = self.averaged.1.as_ref() == Some(camera);
        self.averaged = (if goes_on { self.averaged.0 + 1 } else { 1 }, Some(camera.clone()));
        self.on_their_way = Some((frame, Instant::now()));
        Ok(())
    }

    /// What has become of frames. Of one that has ended: milliseconds since it was handed over.
    pub fn poll(&mut self) -> Option<f64> {
        let mut took = None;
        while let Some(report) = self.renderer.poll() {
            if let Some((_, since)) = self.on_their_way.take_if(|(frame, _)| *frame == report.frame) {
                took = Some(1e3 * since.elapsed().as_secs_f64());
            }
            if !report.is_whole {
                // It was not shown: the next is another first.
                self.averaged = (0, None);
            }
            self.report = Some(report);
        }
        took
    }

    fn begin_anew(&mut self) {
        self.averaged = (0, None);
        self.on_their_way = None;
        self.renderer.reset();
    }
}

/// As settings are rendered here: pictures at rest are means, but for debug views.
fn shown(settings: &Settings) -> Settings {
    let accumulate = if settings.debug_view.is_some() { 1 } else { 2 };
    Settings { accumulate, ..settings.clone() }
}

fn texture(device: &wgpu::Device, size: UVec2) -> wgpu::TextureView {
    let usage =
        wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("viewer/picture"),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

#[cfg(test)]
mod tests {
    use lanternfish::settings::{DebugView, Shadows};
    use lanternfish_gpu::{read_texture, testing};
    use lanternfish_scene::generate::demo;

    use super::*;

    fn pixels(seen: &Seen) -> Vec<[u8; 4]> {
        read_texture(&seen.gpu.device, &seen.gpu.queue, seen.picture().texture()).unwrap()
    }

    /// Draws until so many frames are averaged, as a window does, but waiting for the device.
    fn draw(seen: &mut Seen, camera: &Camera, frames: u32) {
        for _ in 0..50 {
            let is_of_camera = seen.averaged.1.as_ref() == Some(camera);
            if is_of_camera && seen.averaged() >= frames && !seen.is_busy() {
                return;
            }
            if !seen.is_busy() {
                seen.draw(camera).unwrap();
            }
            seen.gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            seen.poll();
        }
        panic!("{} frames of {frames}", seen.averaged());
    }

    #[test]
    fn gpu_a_picture_follows_sizes_settings_and_scenes() {
        let Some(gpu) = testing::gpu("gpu_a_picture_follows_sizes_settings_and_scenes") else { return };
        let gpu = Gpu { device: gpu.device.clone(), queue: gpu.queue.clone(), description: gpu.description.clone() };
        let (scene, hall) = (demo("cornell").unwrap(), demo("hall").unwrap());
        let camera = scene.default_camera(1.5);
        let settings = Settings { shadows: Shadows::BVH, ..Settings::direct_light() };
        let mut seen = Seen::new(gpu, scene, &settings).unwrap();
        assert!(seen.resize(UVec2::new(48, 32)) && !seen.resize(UVec2::new(48, 32)));
        assert!(seen.has_more(&camera));
        draw(&mut seen, &camera, 3);
        let first = pixels(&seen);
        assert!(first.iter().filter(|pixel| pixel[..3] != [0; 3]).count() > 300 && seen.report.is_some());
        // Another camera is another mean.
        let mut moved = camera.clone();
        moved.world_from_camera.translation.x += 0.3;
        assert!(seen.has_more(&moved));
        draw(&mut seen, &moved, 1);
        assert!(seen.averaged() == 1 && pixels(&seen) != first);
        seen.set(&Settings { debug_view: Some(DebugView::Normal), ..settings.clone() }).unwrap();
        draw(&mut seen, &camera, 1);
        assert!(seen.change.is_some() && !seen.has_more(&camera), "a view of a quantity has no mean");
        seen.set(&settings).unwrap();
        draw(&mut seen, &camera, 3);
        assert!(pixels(&seen) == first, "back again");
        // A window without a size, and another scene.
        assert!(seen.resize(UVec2::ZERO) && seen.size() == UVec2::ONE);
        draw(&mut seen, &camera, 1);
        seen.resize(UVec2::new(48, 32));
        let elsewhere = hall.default_camera(1.5);
        seen.open(hall).unwrap();
        draw(&mut seen, &elsewhere, 2);
        assert!(pixels(&seen) != first);
    }
}
