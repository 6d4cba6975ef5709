//! From a scene and a camera to an image.

mod build;
mod change;
mod edit;
mod flight;
mod frames;
mod motion;
mod scenes;
#[cfg(test)]
mod tests;

use std::sync::{Mutex, PoisonError};

use glam::{UVec2, Vec3};
use half::{
    f16,
    slice::{HalfBitsSliceExt, HalfFloatSliceExt},
};
use lanternfish_gpu::{Engine, Frame, Growth, PassTime, Pool, Profiler, discarded, read_back, read_texture};
use lanternfish_scene::Camera;

use self::{
    build::{Built, Compiled, build},
    flight::Flight,
};
use crate::{
    context::FrameContext,
    error::RenderError,
    frame::{FrameResult, Passes, Shaded},
    gpu_scene::{GpuScene, SceneRequirements},
    light_culling::LightCullingPasses,
    settings::{Exposure, Settings},
    view::View,
};

pub use self::{
    change::Change,
    flight::{FrameId, FrameReport},
};

/// Renders scenes on the caller's device, under one choice of settings.
#[derive(Debug)]
pub struct Renderer {
    engine: Engine,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// As they were given.
    settings: Settings,
    /// As its passes take them: what a debug view does not show is left out.
    effective: Settings,
    /// What it needs of a scene.
    needs: SceneRequirements,
    compiled: Compiled,
    pub(crate) profiler: Profiler,
    /// What its frames use again. Locked by nobody for longer than a call.
    pub(crate) pool: Mutex<Pool>,
    pub(crate) passes: Passes,
    flight: Flight,
    /// When lists of frames get more room that are rendered into images.
    image_growth: Growth,
    /// The number of the last of those frames.
    last_frame: u64,
}

/// A finished image. Rows from the top.
#[derive(Clone, Debug)]
pub struct RenderedImage {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Scene-referred: linear Rec. 709, nits; alpha is the share that surfaces cover.
    pub radiance: Vec<[f32; 4]>,
    /// As a display shows it: exposed, tone-mapped, sRGB-encoded; or the debug view.
    pub display: Vec<[u8; 4]>,
    /// What `display` is exposed by, EV: that of [`Exposure::Auto`], where it was requested. None: a debug view.
    pub exposure: Option<f32>,
    /// What it cost.
    pub report: Report,
}

/// What an image cost.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Device time of each pass, in order, over all frames that were made; empty where the device has no timestamp queries.
    pub passes: Vec<PassTime>,
    /// Exact counts, by name; where frames are averaged, of the last one.
    pub counters: Vec<(String, u64)>,
}

/// What frames keep on the device, so that the next one need not make it again.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameMemory {
    /// Bytes of buffers and textures.
    pub bytes: u64,
    /// Every list that was ever counted, by name, and the elements that it has room for.
    pub lists: Vec<(&'static str, u64)>,
}

impl Renderer {
    /// Compiles the passes that these settings need.
    ///
    /// The device may be any; optional features that it was opened with are used
    /// ([`lanternfish_gpu::Gpu::WANTED_FEATURES`] lists them), and a setting that needs one that is missing is an error.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: Settings) -> Result<Self, RenderError> {
        Self::with_engine(&Engine::new(device, queue), settings)
    }

    /// The same for the device of an engine: what other renderers of the engine have compiled is not compiled again.
    pub fn with_engine(engine: &Engine, settings: Settings) -> Result<Self, RenderError> {
        let Built { effective, needs, passes, compiled } = build(engine, &settings)?;
        let (device, queue) = (engine.device.clone(), engine.queue.clone());
        let (profiler, pool) = (Profiler::new(&device, &queue), Mutex::new(Pool::new(&device)));
        let engine = engine.clone();
        Ok(Self {
            engine,
            device,
            queue,
            settings,
            effective,
            needs,
            compiled,
            profiler,
            pool,
            passes,
            flight: Flight::default(),
            image_growth: Growth::Blocking,
            last_frame: 0,
        })
    }

    /// What it has compiled, for further renderers of its device.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The settings it was made with, as they were given, at the exposure of now.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Shows the images from now on at another exposure, which must be finite. Means of frames go on ([`Self::refine`]): they are of radiance.
    pub fn set_exposure(&mut self, exposure: Exposure) -> Result<(), RenderError> {
        self.passes.output.set_exposure(&self.device, exposure)?;
        (self.settings.exposure, self.effective.exposure) = (exposure, exposure);
        Ok(())
    }

    /// What the last frame is shown at, EV: that of [`Exposure::Auto`], where it was requested. Waits for the device. None: a debug view.
    pub fn exposure(&self) -> Result<Option<f32>, RenderError> {
        match &self.passes.debug_views {
            None => Ok(Some(self.passes.output.exposure(&self.device, &self.queue)?)),
            Some(_) => Ok(None),
        }
    }

    /// The passes of light culling, if they are of this type.
    pub(crate) fn culling_passes<P: LightCullingPasses>(&self) -> Option<&P> {
        self.passes.light_culling.passes()
    }

    /// What its frames keep on the device; scenes, deep images, means of frames and histories are not among it.
    pub fn memory(&self) -> FrameMemory {
        let pool = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        FrameMemory { bytes: pool.bytes(), lists: pool.capacities() }
    }

    /// Renders what `camera` sees of a scene that this renderer uploaded, and waits for it.
    pub fn render(
        &mut self,
        scene: &GpuScene,
        camera: &Camera,
        width: u32,
        height: u32,
    ) -> Result<RenderedImage, RenderError> {
        Ok(self.render_views(scene, &[(camera, width, height)])?.remove(0))
    }

    /// Renders several views of a scene at once: cameras with their images' width and height. Views may share the work
    /// of finding lights ([`crate::light_culling::clustered::Grouping`]); the passes' times, and what is shared, are in the first report.
    /// Each image is the mean of [`Settings::accumulate`] frames.
    pub fn render_views(
        &mut self,
        scene: &GpuScene,
        views: &[(&Camera, u32, u32)],
    ) -> Result<Vec<RenderedImage>, RenderError> {
        self.render_frames(scene, views, |_| ())
    }

    pub(crate) fn views(&self, scene: &GpuScene, views: &[(&Camera, u32, u32)]) -> Result<Vec<View>, RenderError> {
        scene.check(&self.device, &self.needs)?;
        let limit = self.device.limits().max_texture_dimension_2d;
        let view = |(camera, width, height): &(&Camera, u32, u32)| {
            let (width, height) = (*width, *height);
            if !(1..=limit).contains(&width) || !(1..=limit).contains(&height) {
                return Err(RenderError::Size { width, height, limit });
            }
            camera.validate().map_err(|what| RenderError::Camera { what })?;
            // An image of the environment stands in the sky's place.
            let sky = if scene.environment.is_some() { Vec3::ZERO } else { scene.sky };
            let view = View::new(camera, UVec2::new(width, height), sky, &scene.bounds);
            Ok(View { samples: self.effective.samples.count(), ..view })
        };
        views.iter().map(view).collect()
    }

    /// Hands a frame to the device.
    pub(crate) fn frame(&mut self, context: &FrameContext<'_>) -> Result<Vec<FrameResult>, RenderError> {
        let pool = self.pool.get_mut().unwrap_or_else(PoisonError::into_inner);
        let mut frame = Frame::pooled(&self.device, &self.queue, &mut self.profiler, pool);
        self.last_frame = frame.number();
        let results = self.engine.within(|| self.passes.record(&mut frame, context))?;
        frame.submit();
        self.flight.forget();
        Ok(results)
    }

    /// Forgets what frames have kept, as after an error: a frame that was recorded in part never ran, and what the device refused to make
    /// may be among what is used again.
    fn forget_frames(&mut self) {
        let pool = self.pool.get_mut().unwrap_or_else(PoisonError::into_inner);
        discarded(&self.device, &self.queue, &mut self.profiler, pool);
        pool.empty(&self.device);
        self.passes.forget();
        self.flight.forget();
    }

    /// When lists of images' frames get more room: in the frame that needs it, which waits for the device, unless something else is said
    /// here. What [`Self::render`] gives of a frame that may not wait is not whole where there is not room enough.
    #[cfg(any(test, feature = "testing"))]
    pub fn set_growth(&mut self, growth: Growth) -> Result<(), RenderError> {
        self.image_growth = growth;
        self.use_growth(growth)
    }

    /// When lists of the next frames get more room. A frame that may not wait, and for which there is not room enough, draws nothing: its
    /// display and its mean are those of the last one that was whole, of that size.
    fn use_growth(&mut self, growth: Growth) -> Result<(), RenderError> {
        let pool = self.pool.get_mut().unwrap_or_else(PoisonError::into_inner);
        if pool.growth() == growth {
            return Ok(());
        }
        self.passes.structure.as_ref().map_or(Ok(()), |structure| structure.check_growth(growth))?;
        self.passes.occlusion.as_ref().map_or(Ok(()), |occlusion| occlusion.check_growth(growth))?;
        // What a frame has kept that was not whole is not for those that wait, and the frames of a mean are counted on the device or on
        // the host.
        self.passes.forget();
        Ok(self.engine.within(|| pool.set_growth(&self.device, growth))?)
    }

    /// Reads back what the last frame of a scene left.
    pub(crate) fn renderings(
        &mut self,
        scene: &GpuScene,
        views: &[View],
        results: &[FrameResult],
    ) -> Result<Vec<RenderedImage>, RenderError> {
        let mut renderings = self.images_of(scene.counters(), views, results)?;
        if let Some(first) = renderings.first_mut() {
            first.report.passes = self.profiler.times_of(self.last_frame);
        }
        Ok(renderings)
    }

    /// The same, without times; `counters` are the scene's. A view of which nothing was shown has no image.
    fn images_of(
        &mut self,
        counters: &[(String, u64)],
        views: &[View],
        results: &[FrameResult],
    ) -> Result<Vec<RenderedImage>, RenderError> {
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
        let radiance = match &shaded.mean {
            Some(mean) => read_texture(&self.device, &self.queue, mean.texture())?,
            None => {
                let halves = read_texture::<[u16; 4]>(&self.device, &self.queue, shaded.radiance.target.texture())?;
                let mut radiance = vec![[0.0; 4]; halves.len()];
                halves.as_flattened().reinterpret_cast::<f16>().convert_to_f32_slice(radiance.as_flattened_mut());
                radiance
            }
        };

        let mut counters = counters.to_vec();
        counters.push(("light_culling/light_tests".to_owned(), shaded.lights.tests));
        counters.push(("light_culling/listed_lights".to_owned(), shaded.lights.listed));
        counters.extend(shaded.lights.counters.iter().map(|(name, count)| ((*name).to_owned(), *count)));
        if let Some(plan) = &shaded.visibility {
            let (totals, bands) = plan.ray_totals();
            let rays = read_back::<u32>(&self.device, &self.queue, totals, bands)?;
            counters.push(("shadows/rays".to_owned(), rays.iter().map(|r| u64::from(*r)).sum()));
            counters.push(("shadows/bands".to_owned(), bands as u64));
            counters.push(("shadows/bits_bytes".to_owned(), plan.bytes()));
        }
        let of_transparent = shaded.indirect_of_transparent.iter().flat_map(|irradiance| &irradiance.counters);
        let of_transparent = of_transparent.filter(|counters| counters.adds_up);
        for irradiance in shaded.indirect.iter().flat_map(|irradiance| &irradiance.counters).chain(of_transparent) {
            for (name, count) in irradiance.read(&self.device, &self.queue)? {
                match counters.iter_mut().find(|(known, _)| known == name) {
                    Some((_, known)) => *known += count,
                    None => counters.push((name.to_owned(), count)),
                }
            }
        }
        let of_ambient_visibility =
            shaded.ambient_visibility.iter().flat_map(|ambient_visibility| &ambient_visibility.counters);
        counters.extend(of_ambient_visibility.map(|(name, count)| ((*name).to_owned(), *count)));
        let report = Report { passes: Vec::new(), counters };
        Ok(RenderedImage { width: view.size.x, height: view.size.y, radiance, display, exposure, report })
    }
}
