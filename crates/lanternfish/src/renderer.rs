//! The renderer: from a scene and a camera to an image.

mod aovs;
mod build;
mod change;
mod edit;
mod flight;
mod frames;
mod motion;
mod report;
mod scenes;
#[cfg(test)]
mod tests;

use std::{
    ops::ControlFlow,
    sync::{Mutex, PoisonError},
};

use glam::{UVec2, Vec3};
use half::{
    f16,
    slice::{HalfBitsSliceExt, HalfFloatSliceExt},
};
use lanternfish_gpu::{Engine, Frame, Growth, PassWatcher, Pool, Profiler, discarded, read_texture};
use lanternfish_limits::memory::Budget;
use lanternfish_scene::Camera;

use self::{
    build::{Built, Compiled, build},
    flight::Flight,
};
use crate::{
    aovs::AovPass,
    context::FrameContext,
    error::RenderError,
    frame::{FrameResult, Passes},
    gpu_scene::{GpuScene, SceneRequirements},
    settings::{Exposure, Settings},
    shading::Shaded,
    view::View,
};

pub use self::{
    change::Change,
    flight::{FrameId, FrameReport, PendingFrame},
    report::{FrameMemory, Report},
};

/// Renders scenes on the caller's device with one set of settings.
#[derive(Debug)]
pub struct Renderer {
    pub(crate) engine: Engine,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// The settings as given.
    settings: Settings,
    /// The settings of the passes: without the parts that a debug view does not show.
    effective: Settings,
    /// The scene requirements of the settings.
    needs: SceneRequirements,
    compiled: Compiled,
    /// [`View::vertex_grid`] of its views.
    pub(crate) vertex_grid: f32,
    pub(crate) profiler: Profiler,
    /// The transient pool of its frames. No call holds the lock after it returns.
    pub(crate) pool: Mutex<Pool>,
    pub(crate) passes: Passes,
    pub(crate) aovs: AovPass,
    flight: Flight,
    /// The growth policy of lists in frames that are rendered to images.
    image_growth: Growth,
    /// The index of the last of those frames.
    last_frame: u64,
}

/// An error if the process may not allocate the images of these views.
fn check_memory(views: &[View]) -> Result<(), RenderError> {
    let pixels: u64 = views.iter().map(|view| u64::from(view.size.x) * u64::from(view.size.y)).sum();
    Budget::of_process()
        .check(pixels * RenderedImage::BYTES_PER_PIXEL, || format!("images of {pixels} pixels need"))
        .map_err(RenderError::ImageTooLarge)
}

/// A finished image. Rows from the top.
#[derive(Clone, Debug)]
pub struct RenderedImage {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Scene-referred: linear Rec. 709, nits; alpha is the coverage of surfaces, or
    /// [opacity](crate::settings::Background).
    pub radiance: Vec<[f32; 4]>,
    /// The display image: exposed, tone-mapped and sRGB-encoded, with straight alpha; or the debug view.
    pub display: Vec<[u8; 4]>,
    /// The exposure of `display`, EV; the measured one for [`Exposure::Auto`]. None for a debug view.
    pub exposure: Option<f32>,
    /// Time and counters of the image.
    pub report: Report,
}

impl RenderedImage {
    /// Memory of a pixel while an image is read back, bytes: its radiance, as halves before, and its display colour.
    #[doc(hidden)]
    pub const BYTES_PER_PIXEL: u64 = 16 + 8 + 4;
}

impl Renderer {
    /// Compiles the passes that these settings need.
    ///
    /// Optional features of the device are used ([`lanternfish_gpu::Gpu::WANTED_FEATURES`] lists them). A setting that
    /// needs a missing feature is an error.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Self, RenderError> {
        Self::with_engine(&Engine::new(device, queue), settings)
    }

    /// Compiles the passes on an engine's device and reuses what other renderers of the engine have compiled.
    pub fn with_engine(engine: &Engine, settings: Settings) -> Result<Self, RenderError> {
        let Built { effective, needs, passes, compiled } = build(engine, &settings)?;
        let (device, queue) = (engine.device.clone(), engine.queue.clone());
        let (profiler, pool) = (Profiler::new(&device, &queue), Mutex::new(Pool::new(&device)));
        let vertex_grid = 0.5f32.powi(engine.subpixel_bits() as i32);
        let engine = engine.clone();
        Ok(Self {
            engine,
            device,
            queue,
            settings,
            effective,
            needs,
            compiled,
            vertex_grid,
            profiler,
            pool,
            passes,
            aovs: AovPass::new(),
            flight: Flight::default(),
            image_growth: Growth::Blocking,
            last_frame: 0,
        })
    }

    /// The engine with everything compiled, for further renderers on its device.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The settings as given, with the current exposure.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Sets the exposure of later display images, which must be finite. Means of frames are not reset
    /// ([`Self::refine`]), because they store radiance.
    pub fn set_exposure(&mut self, exposure: Exposure) -> Result<(), RenderError> {
        self.passes.output.set_exposure(&self.device, exposure)?;
        (self.settings.image.exposure, self.effective.image.exposure) = (exposure, exposure);
        Ok(())
    }

    /// The exposure of the last frame, EV; the measured one for [`Exposure::Auto`]. Waits for the device. None for a
    /// debug view.
    pub fn exposure(&self) -> Result<Option<f32>, RenderError> {
        match &self.passes.debug_views {
            None => Ok(Some(self.passes.output.exposure(&self.device, &self.queue)?)),
            Some(_) => Ok(None),
        }
    }

    /// Calls `watcher` before each pass of a blocking frame ([`Self::render`] and similar functions), for progress
    /// bars. The host then waits for every pass, which costs time on a graphics card. Images do not change.
    #[doc(hidden)]
    pub fn watch_passes(&mut self, watcher: Option<PassWatcher>) {
        self.profiler.watch(watcher);
    }

    /// Device memory of its frames.
    pub fn memory(&self) -> FrameMemory {
        let device_bytes = self.device.generate_allocator_report().map(|report| report.total_allocated_bytes);
        let pool = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        FrameMemory { bytes: pool.bytes(), device_bytes, lists: pool.capacities() }
    }

    /// Renders a camera's view of a scene that this renderer uploaded, and waits for the result. `size`: width and
    /// height, pixels.
    pub fn render(&mut self, scene: &GpuScene, camera: &Camera, size: [u32; 2]) -> Result<RenderedImage, RenderError> {
        Ok(self.render_views(scene, &[(camera, size)])?.remove(0))
    }

    /// Renders several views of a scene at once: cameras with the sizes of their images. Views may share light culling
    /// ([`crate::light_culling::clustered::Grouping`]); the first report has the times of all passes and the shared
    /// counters. Each image is the mean of [`ImageSettings::accumulate`](crate::settings::ImageSettings::accumulate)
    /// frames.
    pub fn render_views(
        &mut self,
        scene: &GpuScene,
        views: &[(&Camera, [u32; 2])],
    ) -> Result<Vec<RenderedImage>, RenderError> {
        self.render_frames(scene, views, |_| ControlFlow::Continue(()))
    }

    pub(crate) fn views(&self, scene: &GpuScene, views: &[(&Camera, [u32; 2])]) -> Result<Vec<View>, RenderError> {
        scene.check(&self.device, &self.needs)?;
        let limit = self.device.limits().max_texture_dimension_2d;
        let view = |&(camera, [width, height]): &(&Camera, [u32; 2])| {
            if !(1..=limit).contains(&width) || !(1..=limit).contains(&height) {
                return Err(RenderError::Size { width, height, limit });
            }
            camera.validate().map_err(|what| RenderError::Camera { what })?;
            // An environment image replaces the sky.
            let sky = if scene.environment.is_some() { Vec3::ZERO } else { scene.sky };
            let view = View::new(camera, UVec2::new(width, height), sky, &scene.bounds);
            Ok(self.completed(view, scene))
        };
        views.iter().map(view).collect()
    }

    /// A view with the properties of settings and device.
    fn completed(&self, view: View, scene: &GpuScene) -> View {
        View {
            light_unit: scene.light_unit(),
            samples: self.effective.image.samples.count(),
            vertex_grid: self.vertex_grid,
            ..view
        }
    }

    /// Submits a frame.
    pub(crate) fn frame(&mut self, context: &FrameContext<'_>) -> Result<Vec<FrameResult>, RenderError> {
        let pool = self.pool.get_mut().unwrap_or_else(PoisonError::into_inner);
        let mut frame = Frame::pooled(&self.device, &self.queue, &mut self.profiler, pool);
        self.last_frame = frame.number();
        let results = self.engine.within(|| self.passes.record(&mut frame, context))?;
        frame.submit();
        self.flight.forget();
        Ok(results)
    }

    /// Discards all state that frames store, as needed after an error: a partly recorded frame never ran, and the pool
    /// may hold resources that the device failed to allocate.
    fn forget_frames(&mut self) {
        let pool = self.pool.get_mut().unwrap_or_else(PoisonError::into_inner);
        discarded(&self.device, &self.queue, &mut self.profiler, pool);
        pool.empty(&self.device);
        self.passes.progressive.reset();
        self.flight.forget();
    }

    /// Sets the growth policy of lists in frames of images. By default the frame that overflows a list waits for the
    /// device and repeats with a larger list. With another policy, [`Self::render`] may return an incomplete frame.
    #[cfg(any(test, feature = "testing"))]
    pub fn set_growth(&mut self, growth: Growth) -> Result<(), RenderError> {
        self.image_growth = growth;
        self.use_growth(growth)
    }

    /// Sets the growth policy of lists in the next frames. A frame with deferred readback that overflows a list draws
    /// nothing: its display image and its mean are those of the last complete frame of that size.
    fn use_growth(&mut self, growth: Growth) -> Result<(), RenderError> {
        let pool = self.pool.get_mut().unwrap_or_else(PoisonError::into_inner);
        if pool.growth() == growth {
            return Ok(());
        }
        self.passes.structures.iter().try_for_each(|(_, structure)| structure.check_growth(growth))?;
        self.passes.occlusion.as_ref().map_or(Ok(()), |occlusion| occlusion.check_growth(growth))?;
        // State of an incomplete frame is not valid for frames with blocking readback, and the number of frames in a
        // mean is counted on the device for one policy and on the host for the other.
        self.passes.progressive.reset();
        Ok(self.engine.within(|| pool.set_growth(&self.device, growth))?)
    }

    /// Reads back the results of the last frame of a scene.
    pub(crate) fn renderings(
        &mut self,
        scene: &GpuScene,
        views: &[View],
        results: &[FrameResult],
    ) -> Result<Vec<RenderedImage>, RenderError> {
        let mut renderings = self.images_of(scene.counters(), views, results)?;
        if let Some(first) = renderings.first_mut() {
            first.report.passes = self.profiler.times_of(self.last_frame);
            first.report.commands = self.profiler.commands_of(self.last_frame);
        }
        Ok(renderings)
    }

    /// Reads back the images, without times. `counters` are the scene's. A view without a display image has no image.
    fn images_of(
        &mut self,
        counters: &[(String, u64)],
        views: &[View],
        results: &[FrameResult],
    ) -> Result<Vec<RenderedImage>, RenderError> {
        check_memory(views)?;
        let exposure = self.exposure()?;
        let shown =
            views.iter().zip(results).filter_map(|(view, result)| Some((view, result, result.display.as_ref()?)));
        let renderings = shown.map(|(view, result, display)| {
            let display = read_texture::<[u8; 4]>(&self.device, &self.queue, display.texture())?;
            self.rendering(counters, view, &result.shaded, display, exposure)
        });
        let mut renderings = renderings.collect::<Result<Vec<_>, _>>()?;
        if let Some(first) = renderings.first_mut()
            && results[0].shaded.mean.is_some()
        {
            let frames = self.passes.progressive.frames();
            first.report.counters.push(("progressive/frames".to_owned(), u64::from(frames)));
        }
        Ok(renderings)
    }

    fn rendering(
        &self,
        counters: &[(String, u64)],
        view: &View,
        shaded: &Shaded,
        display: Vec<[u8; 4]>,
        exposure: Option<f32>,
    ) -> Result<RenderedImage, RenderError> {
        let mut radiance: Vec<[f32; 4]> = match &shaded.mean {
            Some(mean) => read_texture(&self.device, &self.queue, mean.texture())?,
            None => {
                let halves = read_texture::<[u16; 4]>(&self.device, &self.queue, shaded.single().texture())?;
                let mut radiance = vec![[0.0; 4]; halves.len()];
                halves.as_flattened().reinterpret_cast::<f16>().convert_to_f32_slice(radiance.as_flattened_mut());
                radiance
            }
        };
        radiance.iter_mut().flat_map(|pixel| &mut pixel[..3]).for_each(|value| *value *= view.light_unit);

        let mut counters = counters.to_vec();
        if let Some(lights) = &shaded.lights {
            counters.push(("light_culling/light_tests".to_owned(), lights.tests));
            counters.push(("light_culling/listed_lights".to_owned(), lights.listed));
            counters.extend(lights.counters.iter().map(|(name, count)| ((*name).to_owned(), *count)));
        }
        if let Some(direct) = &shaded.direct {
            let counts = direct.counters.read(&self.device, &self.queue)?;
            counters.extend(counts.into_iter().map(|(name, count)| (name.to_owned(), count)));
        }
        if let Some(plan) = &shaded.visibility {
            let counts = plan.counters(&self.device, &self.queue)?;
            counters.extend(counts.into_iter().map(|(name, count)| (name.to_owned(), count)));
        }
        let of_transparent = shaded.indirect_of_transparent.iter().flat_map(|irradiance| &irradiance.counters);
        let of_transparent = of_transparent.filter(|counters| counters.adds_up);
        for irradiance in shaded.indirect.iter().flat_map(|irradiance| &irradiance.counters).chain(of_transparent) {
            for (name, count) in irradiance.read(&self.device, &self.queue)? {
                match counters.iter_mut().find(|(counter, _)| counter == name) {
                    Some((_, total)) => *total += count,
                    None => counters.push((name.to_owned(), count)),
                }
            }
        }
        let of_ambient_visibility =
            shaded.ambient_visibility.iter().flat_map(|ambient_visibility| &ambient_visibility.counters);
        counters.extend(of_ambient_visibility.map(|(name, count)| ((*name).to_owned(), *count)));
        let report = Report { counters, ..Report::default() };
        Ok(RenderedImage { width: view.size.x, height: view.size.y, radiance, display, exposure, report })
    }
}
