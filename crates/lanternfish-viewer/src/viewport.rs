//! The viewport: a scene on the device, and its image in a texture that the window shows.

use std::{sync::Arc, time::Instant};

use glam::UVec2;
use lanternfish::{
    Change, Engine, FrameId, FrameMemory, FrameReport, GpuScene, RenderError, Renderer, Settings, Target, ViewRequest,
    light_culling::{clustered::GridContents, tiled::TileContents},
};
use lanternfish_gpu::{Gpu, GpuError, ShaderTexts, read_texture};
use lanternfish_scene::{Camera, Eyes, Light, Scene};

use crate::{
    stereo,
    texture::{FORMAT, texture},
};

/// Pixels across and down of the image that edited shaders are tried on.
const TRIED: UVec2 = UVec2::new(32, 32);
/// Frames whose mean an image at rest is.
pub const AT_REST: u32 = 64;

/// A scene, how it is rendered, and where the image is.
#[derive(Debug)]
pub struct Viewport {
    /// The device.
    pub gpu: Gpu,
    /// The scene, as it is now. What works beside the window has it too: it is copied where it is changed meanwhile.
    pub scene: Arc<Scene>,
    /// What the last frame that the device is done with has said.
    pub report: Option<FrameReport>,
    /// What the last change of settings cost.
    pub change: Option<Change>,
    renderer: Renderer,
    uploaded: GpuScene,
    settings: Settings,
    /// The image, or that of each of two eyes.
    renderings: Vec<wgpu::TextureView>,
    eyes: Option<Eyes>,
    size: UVec2,
    /// Frames that the image is the mean of, and where the camera was.
    averaged: (u32, Option<Camera>),
    /// All frames that were ever handed over.
    drawn: u64,
    on_their_way: Option<(FrameId, Instant)>,
}

impl Viewport {
    /// Uploads the scene.
    pub fn new(gpu: Gpu, scene: Scene, settings: &Settings) -> Result<Self, RenderError> {
        let settings = shown(settings);
        let renderer = Renderer::new(&gpu.device, &gpu.queue, settings.clone())?;
        Self::of(gpu, Arc::new(scene), settings, renderer)
    }

    /// The same scene on the same device, by settings of its own. What both need of the shaders is compiled once; the scene is uploaded again.
    pub fn comparison(&self, settings: &Settings) -> Result<Self, RenderError> {
        let settings = shown(settings);
        let renderer = Renderer::with_engine(self.renderer.engine(), settings.clone())?;
        let Gpu { device, queue, description } = &self.gpu;
        let gpu = Gpu { device: device.clone(), queue: queue.clone(), description: description.clone() };
        Self::of(gpu, Arc::clone(&self.scene), settings, renderer)
    }

    fn of(gpu: Gpu, scene: Arc<Scene>, settings: Settings, renderer: Renderer) -> Result<Self, RenderError> {
        let uploaded = renderer.upload(&scene)?;
        let (size, renderings) = (UVec2::ONE, vec![texture(&gpu.device, UVec2::ONE)]);
        let (averaged, drawn) = ((0, None), 0);
        let (report, change, on_their_way) = (None, None, None);
        Ok(Self {
            gpu,
            scene,
            report,
            change,
            renderer,
            uploaded,
            settings,
            renderings,
            eyes: None,
            size,
            averaged,
            drawn,
            on_their_way,
        })
    }

    /// Another scene in the place of this one. After an error this one stays.
    pub fn open(&mut self, scene: Scene) -> Result<(), RenderError> {
        self.uploaded = self.renderer.upload(&scene)?;
        self.scene = Arc::new(scene);
        self.begin_again();
        Ok(())
    }

    /// The scene of another rendering of it, as it is there now. After an error this one stays.
    pub fn follow(&mut self, other: &Self) -> Result<(), RenderError> {
        self.renderer.update(&mut self.uploaded, &other.scene)?;
        self.scene = Arc::clone(&other.scene);
        self.begin_again();
        Ok(())
    }

    /// Changes lights: those of these indices are others; and where there are more or fewer then, all of them. After an error those of before
    /// stay.
    pub fn set_lights(&mut self, lights: Vec<Light>) -> Result<(), RenderError> {
        let before = std::mem::replace(&mut Arc::make_mut(&mut self.scene).lights, lights);
        let done = self.bring_lights(&before);
        match done {
            Ok(()) => self.begin_again(),
            Err(_) => {
                Arc::make_mut(&mut self.scene).lights = before;
                // Some of them may be there by now.
                self.renderer.update(&mut self.uploaded, &self.scene)?;
            }
        }
        done
    }

    /// Where as many lights are there as before, those that are others go to the device by themselves, if they may.
    fn bring_lights(&mut self, before: &[Light]) -> Result<(), RenderError> {
        let lights = &self.scene.lights;
        if lights.len() == before.len() {
            let mut others = lights.iter().zip(before).enumerate().filter(|(_, (now, before))| now != before);
            let set = |(index, (light, _))| self.renderer.set_light(&mut self.uploaded, index, light).map(|_| ());
            match others.try_for_each(set) {
                Err(RenderError::NeedsUpdate { .. }) => {}
                done => return done,
            }
        }
        self.renderer.update(&mut self.uploaded, &self.scene).map(|_| ())
    }

    /// Brings what has changed in the scene to the device.
    pub fn update(&mut self) -> Result<(), RenderError> {
        self.renderer.update(&mut self.uploaded, &self.scene)?;
        self.begin_again();
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
        self.begin_again();
        Ok(())
    }

    /// What the last frame is shown at, EV; none for a debug view. Waits for the device.
    pub fn exposure(&self) -> Result<Option<f32>, RenderError> {
        self.renderer.exposure()
    }

    /// The image's pixels, RGBA, rows from the top: those of both eyes side by side. Waits for the device.
    pub fn pixels(&self) -> Result<Vec<[u8; 4]>, GpuError> {
        let read = |rendering: &wgpu::TextureView| read_texture(&self.gpu.device, &self.gpu.queue, rendering.texture());
        let mut renderings = self.renderings.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        if renderings.len() == 1 {
            return Ok(renderings.remove(0));
        }
        let width = self.size.x as usize;
        let rows =
            (0..self.size.y as usize).flat_map(|y| renderings.iter().map(move |pixels| &pixels[y * width..][..width]));
        Ok(rows.collect::<Vec<_>>().concat())
    }

    /// Renders with texts in the place of the library's own shaders. After an error those of before stay.
    pub fn edit_shaders(&mut self, texts: ShaderTexts, camera: &Camera) -> Result<(), RenderError> {
        // What they compile to is tried on a small image.
        let tried = texture(&self.gpu.device, TRIED);
        let request = ViewRequest::of_camera(0, camera, TRIED.into(), Target::Display(&tried, FORMAT));
        self.renderer.edit_shaders(texts, &self.uploaded, &[request])?;
        self.begin_again();
        Ok(())
    }

    /// What it has compiled.
    pub fn engine(&self) -> &Engine {
        self.renderer.engine()
    }

    /// True if the last frame is of what this camera sees.
    pub fn shows(&self, camera: &Camera) -> bool {
        self.averaged.0 > 0 && self.averaged.1.as_ref() == Some(camera)
    }

    /// What the clusters of the last frame hold. Waits for the device.
    pub fn clusters(&self) -> Result<Vec<GridContents>, RenderError> {
        self.renderer.cluster_contents()
    }

    /// What the tiles of the last frame list, for each eye. Waits for the device.
    pub fn tiles(&self) -> Result<Vec<TileContents>, RenderError> {
        self.renderer.tile_contents()
    }

    /// What its frames keep on the device.
    pub fn memory(&self) -> FrameMemory {
        self.renderer.memory()
    }

    /// How it is rendered.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Makes the image so large, pixels; whether it is another texture now. A side of 0 is one of 1.
    pub fn resize(&mut self, size: UVec2) -> bool {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        let size = size.clamp(UVec2::ONE, UVec2::splat(most));
        if size == self.size {
            return false;
        }
        self.size = size;
        self.make_images();
        true
    }

    /// Shows it to two eyes from now on, or to one.
    pub fn show_to(&mut self, eyes: Option<Eyes>) {
        if self.eyes != eyes {
            self.eyes = eyes;
            self.make_images();
        }
    }

    fn make_images(&mut self) {
        let count = if self.eyes.is_some() { 2 } else { 1 };
        self.renderings = (0..count).map(|_| texture(&self.gpu.device, self.size)).collect();
        self.averaged = (0, None);
    }

    /// The eyes that it is shown to; none: one.
    pub fn eyes(&self) -> Option<Eyes> {
        self.eyes
    }

    /// The camera of each eye, or the camera itself.
    pub fn cameras(&self, camera: &Camera) -> Vec<Camera> {
        stereo::cameras(self.eyes, camera, self.size.x as f32 / self.size.y as f32)
    }

    /// The image, that of the left eye: encoded for a display.
    pub fn rendering(&self) -> &wgpu::TextureView {
        &self.renderings[0]
    }

    /// That of the right eye, where there are two.
    pub fn right_image(&self) -> Option<&wgpu::TextureView> {
        self.renderings.get(1)
    }

    /// Pixels across and down of one eye's image.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Number of frames the image is the mean of.
    pub fn averaged(&self) -> u32 {
        self.averaged.0
    }

    /// Which mean of frames the image is: each has a number of its own. None while it is none.
    pub fn mean(&self) -> Option<u64> {
        (self.averaged.0 > 0).then(|| self.drawn - u64::from(self.averaged.0))
    }

    /// Number of frames drawn so far: it differs for different images.
    pub fn drawn(&self) -> u64 {
        self.drawn
    }

    /// True if another frame would change the image of this camera.
    pub fn has_more(&self, camera: &Camera) -> bool {
        self.averaged.1.as_ref() != Some(camera) || (self.settings.accumulate > 1 && self.averaged.0 < AT_REST)
    }

    /// True if the device has not yet done what it was told.
    pub fn is_busy(&self) -> bool {
        self.on_their_way.is_some()
    }

    /// Hands the next frame to the device. One at a time: what the window shows comes between.
    pub fn draw(&mut self, camera: &Camera) -> Result<(), RenderError> {
        let begun = Instant::now();
        let mut commands = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let cameras = self.cameras(camera);
        let request = |(key, (camera, rendering))| {
            ViewRequest::of_camera(key, camera, self.size.into(), Target::Display(rendering, FORMAT))
        };
        let requests: Vec<_> = (0..).zip(cameras.iter().zip(&self.renderings)).map(request).collect();
        let frame = self.renderer.record(&mut commands, &self.uploaded, &requests)?;
        self.gpu.queue.submit([commands.finish()]);
        self.renderer.submitted(frame);
        let goes_on = self.averaged.1.as_ref() == Some(camera);
        self.averaged = (if goes_on { self.averaged.0 + 1 } else { 1 }, Some(camera.clone()));
        self.drawn += 1;
        self.on_their_way = Some((frame, begun));
        Ok(())
    }

    /// What has become of frames. Of one that has ended: milliseconds since it was begun to be recorded.
    pub fn poll(&mut self) -> Option<f64> {
        let mut took = None;
        while let Some(report) = self.renderer.poll() {
            if let Some((_, since)) = self.on_their_way.take_if(|(frame, _)| *frame == report.frame) {
                took = Some(1e3 * since.elapsed().as_secs_f64());
            }
            if !report.is_complete {
                // It was not shown: the next is another first.
                self.averaged = (0, None);
            }
            self.report = Some(report);
        }
        took
    }

    fn begin_again(&mut self) {
        self.averaged = (0, None);
        self.on_their_way = None;
    }
}

/// What renders the image that is seen once no more frames come.
pub fn at_rest(settings: &Settings) -> Settings {
    let accumulate = if settings.debug_view.is_some() { 1 } else { AT_REST };
    Settings { accumulate, ..settings.clone() }
}

/// As settings are rendered here: images at rest are means, but for debug views.
fn shown(settings: &Settings) -> Settings {
    let accumulate = if settings.debug_view.is_some() { 1 } else { 2 };
    Settings { accumulate, ..settings.clone() }
}

#[cfg(test)]
mod soak;
#[cfg(test)]
mod steady;
#[cfg(test)]
mod tests;
