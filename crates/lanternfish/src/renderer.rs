//! From a scene and a camera to a picture.

use glam::UVec2;
use half::{
    f16,
    slice::{HalfBitsSliceExt, HalfFloatSliceExt},
};
use lanternfish_gpu::{Frame, Gpu, PassTime, Profiler, checked, read_back, read_texture};
use lanternfish_scene::{Camera, Scene};

use crate::{
    debug_views::DebugViews,
    error::RenderError,
    frame::Passes,
    gpu_scene::GpuScene,
    light_culling::LightCulling,
    output::Output,
    prepass::Prepass,
    settings::{DebugView, Settings, Shadows as ShadowSetting, TextureBinding, ToneMap},
    shading::Forward,
    shadows::{Shadows, Tracer},
    sky::Sky,
    view::View,
};

/// Renders scenes on the caller's device, under one choice of settings.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    settings: Settings,
    tracer: Tracer,
    texture_arrays: bool,
    profiler: Profiler,
    pub(crate) passes: Passes,
}

/// A finished picture. Rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Scene-referred: linear Rec. 709, nits; alpha is the share that surfaces cover.
    pub radiance: Vec<[f32; 4]>,
    /// As a display shows it: exposed, tone-mapped, sRGB-encoded; or the debug view.
    pub display: Vec<[u8; 4]>,
    /// What it cost.
    pub report: Report,
}

/// What a picture cost.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Device time of each pass, in order; empty where the device has no timestamp queries.
    pub passes: Vec<PassTime>,
    /// Exact counts, by name.
    pub counters: Vec<(String, u64)>,
}

impl Renderer {
    /// Compiles the passes that these settings need.
    ///
    /// The device may be any; optional features that it was opened with are used
    /// ([`Gpu::WANTED_FEATURES`] lists them), and a setting that needs one that is missing is an error.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, mut settings: Settings) -> Result<Self, RenderError> {
        if settings.debug_view == Some(DebugView::BaseColor) {
            // A colour is shown as it is, and no light is asked for.
            (settings.exposure, settings.tone_map, settings.shadows) = (0.0, ToneMap::None, ShadowSetting::None);
        }
        let tracer = tracer(device, settings.shadows)?;
        let texture_arrays = texture_arrays(device, settings.textures)?;
        let shadows = (tracer != Tracer::None).then(|| Shadows::new(device, &settings, tracer)).transpose()?;
        let passes = Passes {
            prepass: Prepass::new(),
            light_culling: LightCulling::new(device, settings.culling)?,
            shadows,
            forward: Forward::new(&settings, tracer),
            sky: Sky::new(),
            output: Output::new(device, settings.tone_map)?,
            debug_views: DebugViews::new(device, &settings)?,
        };
        let profiler = Profiler::new(device, queue);
        let (device, queue) = (device.clone(), queue.clone());
        Ok(Self { device, queue, settings, tracer, texture_arrays, profiler, passes })
    }

    /// The settings it was made with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Puts a scene on the device: geometry, textures with mip levels, lights, and what rays are traced through.
    pub fn upload(&self, scene: &Scene) -> Result<GpuScene, RenderError> {
        checked(&self.device, "upload", || {
            GpuScene::new(&self.device, &self.queue, scene, &self.settings, self.tracer, self.texture_arrays)
        })
    }

    /// Renders what `camera` sees of a scene that this renderer uploaded, and waits for it.
    pub fn render(
        &mut self,
        scene: &GpuScene,
        camera: &Camera,
        width: u32,
        height: u32,
    ) -> Result<Picture, RenderError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        if !(1..=limit).contains(&width) || !(1..=limit).contains(&height) {
            return Err(RenderError::Size { width, height, limit });
        }
        let view =
            View::new(camera, UVec2::new(width, height), self.settings.exposure.exp2(), scene.sky, &scene.bounds);
        let device = self.device.clone();
        checked(&device, "render", || self.render_view(scene, &view))
    }

    fn render_view(&mut self, scene: &GpuScene, view: &View) -> Result<Picture, RenderError> {
        let mut frame = Frame::new(&self.device, &self.queue, &mut self.profiler);
        let result = self.passes.record(&mut frame, scene, view)?;
        frame.submit();

        let display = read_texture::<[u8; 4]>(&self.device, &self.queue, result.display.texture())?;
        let halves = read_texture::<[u16; 4]>(&self.device, &self.queue, result.radiance.target.texture())?;
        let mut radiance = vec![[0.0; 4]; halves.len()];
        halves.as_flattened().reinterpret_cast::<f16>().convert_to_f32_slice(radiance.as_flattened_mut());

        let mut counters = scene.counters().to_vec();
        counters.push(("light_culling/light_tests".to_owned(), result.lights.tests));
        counters.push(("light_culling/listed_lights".to_owned(), result.lights.listed));
        if let Some(clusters) = &result.lights.clusters {
            counters.push(("light_culling/clusters".to_owned(), clusters.clusters));
            counters.push(("light_culling/visible_clusters".to_owned(), clusters.visible));
            counters.push(("light_culling/cluster_bytes".to_owned(), clusters.bytes));
        }
        if let Some(plan) = &result.visibility {
            let (totals, bands) = plan.ray_totals();
            let rays = read_back::<u32>(&self.device, &self.queue, totals, bands)?;
            counters.push(("shadows/rays".to_owned(), rays.iter().map(|r| u64::from(*r)).sum()));
            counters.push(("shadows/bands".to_owned(), bands as u64));
            counters.push(("shadows/bits_bytes".to_owned(), plan.bytes()));
        }
        let report = Report { passes: self.profiler.finished(), counters };
        Ok(Picture { width: view.size.x, height: view.size.y, radiance, display, report })
    }
}

fn tracer(device: &wgpu::Device, setting: ShadowSetting) -> Result<Tracer, RenderError> {
    let ray_query = device.features().contains(wgpu::Features::EXPERIMENTAL_RAY_QUERY);
    let software = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
    match setting {
        ShadowSetting::None => Ok(Tracer::None),
        ShadowSetting::Bvh => Ok(Tracer::Bvh),
        // A software adapter's ray query is slower than the walk in compute.
        ShadowSetting::Auto => Ok(if ray_query && !software { Tracer::RayQuery } else { Tracer::Bvh }),
        ShadowSetting::RayQuery if ray_query => Ok(Tracer::RayQuery),
        ShadowSetting::RayQuery => Err(RenderError::MissingFeature {
            setting: "--shadows ray-query",
            feature: "ray queries",
            instead: "--shadows bvh",
        }),
    }
}

fn texture_arrays(device: &wgpu::Device, setting: TextureBinding) -> Result<bool, RenderError> {
    let has = device.features().contains(Gpu::TEXTURE_ARRAYS);
    let software = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
    match setting {
        // A software adapter reads what is chosen by index for each fragment by itself.
        TextureBinding::Auto => Ok(has && !software),
        TextureBinding::PerMaterial => Ok(false),
        TextureBinding::Array if has => Ok(true),
        TextureBinding::Array => Err(RenderError::MissingFeature {
            setting: "--textures array",
            feature: "texture binding arrays",
            instead: "--textures per-material",
        }),
    }
}
