//! The viewport: a scene on the device, and its image in a texture that the window shows.

mod shown;
mod slices;

use std::{sync::Arc, time::Instant};

use glam::UVec2;
use lanternfish::{
    Change, FrameId, FrameMemory, FrameReport, GpuScene, PendingFrame, RenderError, Renderer, Settings, Target,
    ViewRequest,
    light_culling::{clustered::GridContents, tiled::TileContents},
    techniques::{HitLight, Probes, Sampled},
};
use lanternfish_gpu::{Gpu, GpuError, ShaderTexts, read_texture};
use lanternfish_scene::{Camera, Eyes, Light, Scene};

use self::{shown::ShownImage, slices::Slices};
use crate::{
    slice_scheduler::SliceScheduler,
    stereo,
    texture::{FORMAT, texture},
};

/// Size of the image for which edited shaders are compiled, pixels.
const TRIAL_SIZE: UVec2 = UVec2::new(32, 32);
/// Number of frames that an image at rest averages.
pub const AT_REST: u32 = 64;

/// A scene, its renderer, and its image.
#[derive(Debug)]
pub struct Viewport {
    /// The device.
    pub gpu: Gpu,
    /// The current scene, shared with other threads. A change copies it if another thread still uses it.
    pub scene: Arc<Scene>,
    /// The report of the last completed frame.
    pub report: Option<FrameReport>,
    /// The cost class of the last change of settings.
    pub change: Option<Change>,
    renderer: Renderer,
    uploaded: GpuScene,
    /// The settings that were asked for, and what they are for this scene.
    requested: Settings,
    settings: Settings,
    /// The target of frames, or the target for each eye.
    renderings: Vec<wgpu::TextureView>,
    /// The last complete image.
    shown: ShownImage,
    eyes: Option<Eyes>,
    size: UVec2,
    /// Number of averaged frames, and their camera.
    averaged: (u32, Option<Camera>),
    /// Number of frames submitted so far.
    drawn: u64,
    in_flight: Option<(FrameId, Instant)>,
    /// The frame in flight until all of its commands are submitted.
    pending: Option<PendingFrame>,
    /// Command buffers of the frame in flight that were not submitted.
    slices: Slices,
    /// True if slow frames are submitted in slices ([`Self::submit`]); otherwise [`Self::draw`] submits all of a frame.
    slices_frames: bool,
    /// Time of the last frame, ms.
    last_ms: Option<f64>,
}

impl Viewport {
    /// Creates a viewport and uploads the scene.
    pub fn new(gpu: Gpu, scene: Scene, settings: &Settings) -> Result<Self, RenderError> {
        let renderer = Renderer::new(&gpu.device, &gpu.queue, shown(settings, &scene))?;
        Self::of(gpu, Arc::new(scene), settings, renderer)
    }

    /// Configures presentation in a window. `interface`: the device that paints the window, if it is not the
    /// renderer's. If it is the renderer's, slow frames are submitted in slices, so that paints do not wait for them.
    pub fn of_window(mut self, interface: Option<Arc<Gpu>>) -> Self {
        self.slices_frames = interface.is_none();
        self.shown = ShownImage::new(&self.gpu, interface);
        self
    }

    /// The device that paints the window.
    pub fn interface(&self) -> &Gpu {
        self.shown.interface().map_or(&self.gpu, |interface| interface)
    }

    /// True if another device than the renderer's paints the window, so paints do not wait for frames.
    pub fn paints_apart(&self) -> bool {
        self.shown.interface().is_some()
    }

    /// Creates a second viewport of the same scene and device with other settings. It shares compiled shaders, and
    /// uploads the scene again.
    pub fn comparison(&self, settings: &Settings) -> Result<Self, RenderError> {
        let renderer = Renderer::with_engine(self.renderer.engine(), shown(settings, &self.scene))?;
        let Gpu { device, queue, description } = &self.gpu;
        let gpu = Gpu { device: device.clone(), queue: queue.clone(), description: description.clone() };
        let mut second = Self::of(gpu, Arc::clone(&self.scene), settings, renderer)?;
        if self.slices_frames || self.paints_apart() {
            second = second.of_window(self.shown.interface().cloned());
        }
        Ok(second)
    }

    fn of(gpu: Gpu, scene: Arc<Scene>, settings: &Settings, renderer: Renderer) -> Result<Self, RenderError> {
        let uploaded = renderer.upload(&scene)?;
        let (size, renderings) = (UVec2::ONE, vec![texture(&gpu.device, UVec2::ONE)]);
        let (averaged, drawn) = ((0, None), 0);
        let (report, change, in_flight) = (None, None, None);
        Ok(Self {
            requested: settings.clone(),
            settings: shown(settings, &scene),
            shown: ShownImage::new(&gpu, None),
            gpu,
            scene,
            report,
            change,
            renderer,
            uploaded,
            renderings,
            eyes: None,
            size,
            averaged,
            drawn,
            in_flight,
            pending: None,
            slices: Slices::default(),
            slices_frames: false,
            last_ms: None,
        })
    }

    /// Replaces the scene. After an error the current scene stays.
    pub fn open(&mut self, scene: Scene) -> Result<(), RenderError> {
        self.flush();
        let settings = shown(&self.requested, &scene);
        if settings != self.settings {
            self.renderer.set(settings.clone())?;
        }
        self.upload(&scene)?;
        (self.scene, self.settings) = (Arc::new(scene), settings);
        self.restart();
        Ok(())
    }

    /// Uploads a scene for the renderer's settings. After an error these are the previous ones.
    fn upload(&mut self, scene: &Scene) -> Result<(), RenderError> {
        match self.renderer.upload(scene) {
            Ok(uploaded) => self.uploaded = uploaded,
            Err(error) => {
                self.averaged = (0, None);
                self.renderer.set(self.settings.clone())?;
                return Err(error);
            }
        }
        Ok(())
    }

    /// Takes over the current scene of another viewport. After an error the current scene stays.
    pub fn follow(&mut self, other: &Self) -> Result<(), RenderError> {
        self.flush();
        let settings = shown(&self.requested, &other.scene);
        if settings == self.settings {
            self.renderer.update(&mut self.uploaded, &other.scene)?;
        } else {
            self.renderer.set(settings.clone())?;
            self.upload(&other.scene)?;
        }
        (self.scene, self.settings) = (Arc::clone(&other.scene), settings);
        self.restart();
        Ok(())
    }

    /// Replaces the lights. Only changed lights are uploaded if their number stays the same. After an error the
    /// previous lights stay.
    pub fn set_lights(&mut self, lights: Vec<Light>) -> Result<(), RenderError> {
        self.flush();
        let before = std::mem::replace(&mut Arc::make_mut(&mut self.scene).lights, lights);
        let done = self.upload_lights(&before);
        match done {
            // A drag changes lights with each paint: the next frame waits for the one in flight.
            Ok(()) => self.averaged = (0, None),
            Err(_) => {
                Arc::make_mut(&mut self.scene).lights = before;
                // Some of the new lights may already be on the device.
                self.renderer.update(&mut self.uploaded, &self.scene)?;
            }
        }
        done
    }

    /// Uploads changed lights one by one if their number is the same and each allows it; otherwise updates the scene.
    fn upload_lights(&mut self, before: &[Light]) -> Result<(), RenderError> {
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

    /// Uploads changes of the scene.
    pub fn update(&mut self) -> Result<(), RenderError> {
        self.flush();
        self.renderer.update(&mut self.uploaded, &self.scene)?;
        self.restart();
        Ok(())
    }

    /// Changes the settings. After an error the previous settings stay.
    pub fn set(&mut self, settings: &Settings) -> Result<(), RenderError> {
        if *settings == self.requested {
            return Ok(());
        }
        let own = shown(settings, &self.scene);
        if own != self.settings {
            self.flush();
            let change = self.renderer.set(own.clone())?;
            if change == Change::Upload {
                let scene = Arc::clone(&self.scene);
                self.upload(&scene)?;
            }
            (self.settings, self.change) = (own, Some(change));
            self.restart();
        }
        self.requested = settings.clone();
        Ok(())
    }

    /// Exposure of the last frame, EV; `None` for a debug view. Blocks until the device is idle.
    pub fn exposure(&self) -> Result<Option<f32>, RenderError> {
        self.renderer.exposure()
    }

    /// The image's pixels, RGBA, rows from the top; stereo images are side by side. Blocks until the device is idle.
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

    /// Replaces the library's shaders by these texts. After an error the previous shaders stay.
    pub fn edit_shaders(&mut self, texts: ShaderTexts, camera: &Camera) -> Result<(), RenderError> {
        self.flush();
        // A small image compiles the shaders and reports their errors.
        let tried = texture(&self.gpu.device, TRIAL_SIZE);
        let request = ViewRequest::of_camera(0, camera, TRIAL_SIZE.into(), Target::Display(&tried, FORMAT));
        self.renderer.edit_shaders(texts, &self.uploaded, &[request])?;
        self.restart();
        Ok(())
    }

    /// True if the last frame shows this camera's view.
    pub fn shows(&self, camera: &Camera) -> bool {
        self.averaged.0 > 0 && self.averaged.1.as_ref() == Some(camera)
    }

    /// Contents of the last frame's clusters. Blocks until the device is idle.
    pub fn clusters(&self) -> Result<Vec<GridContents>, RenderError> {
        self.renderer.cluster_contents()
    }

    /// Light lists of the last frame's tiles, for each eye. Blocks until the device is idle.
    pub fn tiles(&self) -> Result<Vec<TileContents>, RenderError> {
        self.renderer.tile_contents()
    }

    /// Device memory that is kept between frames.
    pub fn memory(&self) -> FrameMemory {
        self.renderer.memory()
    }

    /// The settings of the renderer: those that were asked for, for this scene.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The settings that were asked for.
    pub fn requested(&self) -> &Settings {
        &self.requested
    }

    /// Resizes the image, pixels. A side of 0 becomes 1. Returns true if the size has changed.
    pub fn resize(&mut self, size: UVec2) -> bool {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        let size = size.clamp(UVec2::ONE, UVec2::splat(most));
        if size == self.size {
            return false;
        }
        self.flush();
        self.size = size;
        self.make_images();
        true
    }

    /// Changes to stereo, or to mono for `None`.
    pub fn show_to(&mut self, eyes: Option<Eyes>) {
        if self.eyes != eyes {
            self.flush();
            self.eyes = eyes;
            self.make_images();
        }
    }

    fn make_images(&mut self) {
        let count = if self.eyes.is_some() { 2 } else { 1 };
        self.renderings = (0..count).map(|_| texture(&self.gpu.device, self.size)).collect();
        self.averaged = (0, None);
    }

    /// The eyes of the stereo image; `None` for a mono image.
    pub fn eyes(&self) -> Option<Eyes> {
        self.eyes
    }

    /// The camera of each eye; `camera` itself for a mono image.
    pub fn cameras(&self, camera: &Camera) -> Vec<Camera> {
        stereo::cameras(self.eyes, camera, self.size.x as f32 / self.size.y as f32)
    }

    /// The display-encoded image of the last complete frame, on the device that paints; the left eye's in stereo.
    pub fn rendering(&self) -> &wgpu::TextureView {
        &self.shown.textures()[0]
    }

    /// The right eye's image; `None` for a mono image. Until the first stereo frame is complete, both eyes see the last
    /// mono image.
    pub fn right_image(&self) -> Option<&wgpu::TextureView> {
        self.eyes.map(|_| self.shown.textures().get(1).unwrap_or(self.rendering()))
    }

    /// Width and height of one eye's image, pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Number of frames that the image averages.
    pub fn averaged(&self) -> u32 {
        self.averaged.0
    }

    /// Identifies the accumulation that the image shows: it changes when accumulation restarts. `None` before the first
    /// frame.
    pub fn mean(&self) -> Option<u64> {
        (self.averaged.0 > 0).then(|| self.drawn - u64::from(self.averaged.0))
    }

    /// Number of frames submitted so far. It identifies the image.
    pub fn drawn(&self) -> u64 {
        self.drawn
    }

    /// True if another frame would change the image of this camera.
    pub fn has_more(&self, camera: &Camera) -> bool {
        self.averaged.1.as_ref() != Some(camera) || (self.settings.image.accumulate > 1 && self.averaged.0 < AT_REST)
    }

    /// True if a frame is still in flight.
    pub fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }

    /// Records and submits the next frame. At most one frame may be in flight, so that paints of the window run in
    /// between. In a window, a slow frame is submitted later, by [`Self::submit`].
    pub fn draw(&mut self, camera: &Camera) -> Result<(), RenderError> {
        let begun = Instant::now();
        let cameras = self.cameras(camera);
        let request = |(key, (camera, rendering))| {
            ViewRequest::of_camera(key, camera, self.size.into(), Target::Display(rendering, FORMAT))
        };
        let requests: Vec<_> = (0..).zip(cameras.iter().zip(&self.renderings)).map(request).collect();
        let is_sliced = self.slices_frames && SliceScheduler::slices(self.last_ms);
        let (frame, mut slices) = if is_sliced {
            self.renderer.record_slices(&self.uploaded, &requests)?
        } else {
            let mut commands = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let frame = self.renderer.record(&mut commands, &self.uploaded, &requests)?;
            (frame, vec![commands.finish()])
        };
        slices.extend(self.shown.record(&self.gpu, &self.renderings));
        self.slices = Slices::new(slices);
        tracing::trace!("recorded in {:.1?}: {} slices", begun.elapsed(), self.slices.left());
        let continues = self.averaged.1.as_ref() == Some(camera);
        self.averaged = (if continues { self.averaged.0 + 1 } else { 1 }, Some(camera.clone()));
        self.drawn += 1;
        self.in_flight = Some((frame.id(), begun));
        self.pending = Some(frame);
        // A driver may wait in `submit` for the submission before, and the window with it: the frame of the other side.
        if !is_sliced && !self.paints_apart() {
            self.flush();
        }
        Ok(())
    }

    fn restart(&mut self) {
        self.averaged = (0, None);
        (self.in_flight, self.pending) = (None, None);
        self.shown.forget();
    }
}

/// The settings that render the image at rest: the mean of [`AT_REST`] frames, or one frame of a debug view.
pub fn at_rest(settings: &Settings) -> Settings {
    let accumulate = if settings.image.debug_view.is_some() { 1 } else { AT_REST };
    settings.clone().with_accumulate(accumulate)
}

/// Settings for the window's renderer: accumulation is on except for debug views. Rays from every pixel begin with the
/// first frame at rest; in motion, indirect light is from screen probes.
fn shown(settings: &Settings, scene: &Scene) -> Settings {
    let accumulate = if settings.image.debug_view.is_some() { 1 } else { 2 };
    let indirect = match settings.indirect.get::<Sampled>() {
        Some(per_pixel) if per_pixel.hit_light == HitLight::Cached => {
            Probes { per_pixel: *per_pixel, ..Probes::default() }.into()
        }
        _ => settings.indirect.clone(),
    };
    settings.for_scene(scene).with_accumulate(accumulate).with_indirect(indirect)
}

#[cfg(test)]
mod soak;
#[cfg(test)]
mod steady;
#[cfg(test)]
mod tests;
