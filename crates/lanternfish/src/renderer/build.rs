//! Compiles the passes that the settings need.

use glam::UVec2;
use lanternfish_gpu::{CAN_WAIT, Engine, Gpu, GpuError, Requested, checked};
use lanternfish_limits::memory::Budget;
use lanternfish_scene::Scene;

use super::flight::check_lost;
use crate::{
    antialiasing::TemporalAntialiasing,
    debug_views::DebugViews,
    direct_light::Direct,
    error::RenderError,
    frame::Passes,
    gpu_scene::{MemoryPlan, Parts, SceneRequirements, Shading, automatic_anisotropy, cost, is_of_copies},
    indirect,
    indirect::Indirect,
    light_culling::LightCulling,
    occlusion,
    occlusion::Occlusion,
    output::{Output, present::Present},
    prepass::{DEPTH_FORMAT, Prepass, ShownViews},
    progressive::Progressive,
    rays::{Structure, Tracer},
    settings::{
        Anisotropy, Antialiasing, Background, Caustics, DebugView, Exposure, Materials, Samples, Settings,
        Shadows as ShadowSetting, TextureBinding, ToneMap,
    },
    shading::{self, DemodulatedLight, ExtraSurface, Forward, VisibilityRatios},
    shadows::{self, Shadows},
    sky::Sky,
    texture::{RADIANCE_FORMAT, described},
};

/// The passes and scene requirements of settings on a device.
#[derive(Debug)]
pub(super) struct Built {
    /// The settings of the passes: without the parts that a debug view does not show.
    pub effective: Settings,
    /// The scene requirements.
    pub needs: SceneRequirements,
    pub passes: Passes,
    pub compiled: Compiled,
}

/// The shaders and pipelines of the passes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Compiled {
    /// The pipelines compiled with the passes.
    requested: Requested,
    /// The pipelines compiled when the first scene is drawn: their parameters, as `Debug` text.
    drawn: String,
}

/// Builds the passes for these settings and reuses what the engine has compiled.
pub(super) fn build(engine: &Engine, settings: &Settings) -> Result<Built, RenderError> {
    check_lost(&engine.device)?;
    let built = checked(&engine.device, "settings", || {
        let (built, requested) = engine.requested_within(|| passes(&engine.device, settings.clone()));
        let mut built = built?;
        built.compiled.requested = requested;
        Ok(built)
    });
    match &built {
        // A shader error is found before the device is used.
        Err(RenderError::Gpu(GpuError::Shader { .. })) => {}
        Err(RenderError::Gpu(_)) => engine.forget(),
        _ => {}
    }
    built
}

fn passes(device: &wgpu::Device, mut settings: Settings) -> Result<Built, RenderError> {
    if settings.image.debug_view.is_some() {
        settings.image.background = Background::Environment;
    }
    if settings.image.debug_view == Some(DebugView::BaseColor) {
        // A base colour is displayed as stored and needs no light.
        (settings.image.exposure, settings.image.tone_map, settings.shadows.technique) =
            (Exposure::Ev(0.0), ToneMap::None, ShadowSetting::None);
        settings.occlusion = Occlusion::NONE;
    }
    if let Some(view) = settings.image.debug_view.filter(|view| *view != DebugView::Nan) {
        // Views of G-buffer data show the surface at each pixel's centre. They need no light unless the view shows light.
        settings.image.samples = Samples::One;
        settings.direct = Direct::NONE;
        settings.image.antialiasing = Antialiasing::None;
        if view != DebugView::Indirect {
            (settings.indirect, settings.caustics) = (Indirect::NONE, Caustics::NONE);
        }
    }
    let automatic = Tracer::automatic(device.adapter_info().device_type, device.features());
    let tracer = tracer(device, settings.shadows.technique, automatic)?;
    settings.indirect.resolve_tracer(beside(tracer, automatic));
    check_samples(device, &settings)?;
    super::frames::check(&settings)?;
    shadows::check(&settings)?;
    let texture_arrays = texture_arrays(device, settings.materials.textures)?;
    let shadow_passes = tracer.map(|tracer| Shadows::new(device, &settings, tracer)).transpose()?;
    let ambient_visibility_passes = occlusion::passes(device, &settings)?;
    let direct = settings.direct.technique();
    let parts = parts(&settings, tracer);
    let structures = structures(tracer, &settings).into_iter().filter_map(|structure| {
        let built = structure.technique()?.build(device);
        Some(built.map(|built| (structure, built)))
    });
    let finds_arriving = ambient_visibility_passes.is_some() || settings.finds_indirect();
    let needs_normals = (tracer.is_some() && shadows::reads_surface(&settings))
        || settings.direct.is_some()
        || settings.image.debug_view.is_some()
        || finds_arriving;
    let is_temporal = settings.image.antialiasing == Antialiasing::Temporal;
    let needs_motion = settings.image.debug_view == Some(DebugView::Motion) || settings.keeps_history() || is_temporal;
    // Per-pixel estimates use the surface at the pixel's centre.
    let one_sample = needs_normals && settings.image.samples != Samples::One;
    if has_both_forms(parts) {
        let needed = "no technique with a structure, and no other tracer: a scene has its triangles in one form";
        return Err(RenderError::Together { setting: "`shadows two-level` or `indirect-tracer two-level`", needed });
    }
    let direct = direct.map(|technique| technique.build(device, &settings, tracer)).transpose()?;
    let hides_environment = settings.image.background.hides_environment();
    let passes = Passes {
        direct,
        prepass: match needs_motion && !one_sample {
            false => Prepass::new(needs_normals, settings.image.samples.count()),
            true => Prepass::of_moving(),
        },
        shown: needs_motion.then(|| ShownViews::new(settings.keeps_history())),
        one_sample: one_sample.then(|| match needs_motion {
            false => Prepass::new(true, 1),
            true => Prepass::of_moving(),
        }),
        light_culling: LightCulling::new(device, &settings.culling, settings.image.samples.count())?,
        occlusion: ambient_visibility_passes,
        shadows: shadow_passes,
        structures: structures.collect::<Result<_, RenderError>>()?,
        indirect: indirect::passes(device, &settings, tracer)?,
        nearest_transparent: ExtraSurface::nearest_transparent(&settings, tracer),
        second_transparent: ExtraSurface::second_transparent(&settings, tracer),
        coats: ExtraSurface::coats(&settings, tracer),
        other_sides: ExtraSurface::other_sides(&settings, tracer),
        visibility_ratios: VisibilityRatios::new(device, &settings)?,
        forward: Forward::new(&settings, tracer),
        irradiance: DemodulatedLight::new(&settings, tracer),
        sky: (!hides_environment).then(Sky::new),
        progressive: Progressive::new(device)?,
        antialiasing: is_temporal.then(|| TemporalAntialiasing::new(device)).transpose()?,
        output: Output::new(device, &settings.image)?,
        debug_views: DebugViews::new(device, &settings)?,
        present: Present::default(),
    };
    let anisotropy = anisotropy(settings.materials.anisotropy, &device.adapter_info());
    let needs = SceneRequirements::new(shading(&settings), settings.light_storage(), parts, texture_arrays, anisotropy);
    let lit = shading::features(&settings, tracer, settings.direct.is_some());
    let drawn = (needs_normals, needs_motion, one_sample, settings.image.samples, hides_environment, lit);
    let compiled = Compiled { requested: Requested::default(), drawn: format!("{drawn:?}") };
    Ok(Built { effective: settings, needs, passes, compiled })
}

/// The tracer of other rays that `auto` stands for beside that of shadows: a scene has its triangles in one level or in two.
fn beside(shadows: Option<Tracer>, automatic: Tracer) -> Tracer {
    shadows.filter(|tracer| tracer.parts().instances).unwrap_or(automatic)
}

/// The parts of a scene that settings need, whose tracers are chosen.
fn parts(settings: &Settings, shadows: Option<Tracer>) -> Parts {
    let tracers = shadows.into_iter().chain(settings.indirect.tracers());
    // Rays that the structures do not serve are traced through the scene itself.
    let traced = tracers.fold(Parts::NONE, |parts, tracer| parts | tracer.parts() | tracer.exact().parts());
    let direct = settings.direct.technique().map_or(Parts::NONE, |technique| technique.parts(settings));
    let occlusion = if settings.finds_ambient_visibility() { settings.occlusion.parts() } else { Parts::NONE };
    let caustics = settings.caustics.technique().filter(|_| settings.finds_caustics());
    let caustics = caustics.map_or(Parts::NONE, |technique| technique.parts());
    let mut parts = traced | settings.indirect.parts() | caustics | occlusion | direct;
    parts.bvh |= parts.hits && !parts.instances;
    parts
}

/// True if the parts hold the triangles in both forms.
fn has_both_forms(parts: Parts) -> bool {
    parts.instances && (parts.bvh || parts.ray_query)
}

impl Settings {
    /// These settings for a scene: `shadows auto` becomes `two-level` where the scene has over 2^21 placed triangles, at least four times as many as
    /// are stored with one copy of each mesh, and no other technique of these settings needs its triangles in one level. A scene with faults
    /// changes nothing.
    pub fn for_scene(&self, scene: &Scene) -> Self {
        let mut levels = self.clone().with_shadows(ShadowSetting::Traced(Tracer::TWO_LEVEL));
        levels.indirect.resolve_tracer(Tracer::TWO_LEVEL);
        let is_auto = self.shadows.technique == ShadowSetting::Auto;
        match is_auto && !has_both_forms(parts(&levels, Some(Tracer::TWO_LEVEL))) && is_of_copies(scene) {
            true => self.clone().with_shadows(ShadowSetting::Traced(Tracer::TWO_LEVEL)),
            false => self.clone(),
        }
    }

    /// What uploading a valid scene for these settings takes of the process's memory, without an adapter; an error if that does not fit.
    #[doc(hidden)]
    pub fn memory_plan(&self, scene: &Scene) -> Result<MemoryPlan, RenderError> {
        let mut settings = self.for_scene(scene);
        let tracer = match settings.shadows.technique {
            ShadowSetting::None => None,
            ShadowSetting::Auto => Some(Tracer::BVH),
            ShadowSetting::Traced(tracer) => Some(tracer),
        };
        settings.indirect.resolve_tracer(beside(tracer, Tracer::BVH));
        Ok(cost::plan(scene, shading(&settings), parts(&settings, tracer), &Budget::of_process())?)
    }
}

/// The acceleration structures of the inexact tracers, each once: that of shadow rays first, then those of indirect light.
fn structures(shadows: Option<Tracer>, settings: &Settings) -> Vec<Structure> {
    let mut found: Vec<Structure> = Vec::new();
    let of_shadows = shadows.map(|tracer| tracer.structure(&settings.structure));
    let of_indirect = settings.indirect.structures(settings);
    for structure in of_shadows.into_iter().chain(of_indirect).filter(Structure::is_some) {
        if !found.contains(&structure) {
            found.push(structure);
        }
    }
    found
}

/// The parts of a material that the passes read.
fn shading(settings: &Settings) -> Shading {
    match (settings.image.debug_view, settings.materials.model) {
        (Some(DebugView::BaseColor), _) => Shading::BaseColor,
        (_, Materials::Lambert) => Shading::Lambert,
        (_, Materials::File) => Shading::File,
    }
}

fn tracer(device: &wgpu::Device, setting: ShadowSetting, automatic: Tracer) -> Result<Option<Tracer>, RenderError> {
    match setting {
        ShadowSetting::None => Ok(None),
        ShadowSetting::Auto => Ok(Some(automatic)),
        ShadowSetting::Traced(tracer) => tracer.check(device, "`shadows ray-query`", "`shadows bvh`").map(Some),
    }
}

/// Checks that the device can draw with this number of samples.
fn check_samples(device: &wgpu::Device, settings: &Settings) -> Result<(), RenderError> {
    let count = settings.image.samples.count();
    if count == 1 {
        return Ok(());
    }
    let missing = RenderError::MissingFeature {
        setting: "`samples`",
        feature: "this number of samples per pixel",
        instead: "`samples 4`",
    };
    if !CAN_WAIT {
        // What WebGPU guarantees.
        return if count == 4 { Ok(()) } else { Err(missing) };
    }
    let try_targets = || {
        for format in [RADIANCE_FORMAT, DEPTH_FORMAT] {
            let _ =
                device.create_texture(&described("samples", UVec2::ONE, format, wgpu::TextureUsages::empty(), count));
        }
        Ok::<(), RenderError>(())
    };
    checked(device, "samples", try_targets).map_err(|_| missing)
}

/// Maximum samples along the long axis of a texture footprint, for a setting on an adapter.
fn anisotropy(setting: Anisotropy, adapter: &wgpu::AdapterInfo) -> u16 {
    let samples = setting.samples().unwrap_or_else(|| automatic_anisotropy(adapter));
    if setting == Anisotropy::Auto && samples == 1 {
        tracing::info!(
            driver = adapter.driver_info,
            "textures are not filtered anisotropically: this driver hangs on them"
        );
    }
    samples
}

fn texture_arrays(device: &wgpu::Device, setting: TextureBinding) -> Result<bool, RenderError> {
    let has = device.features().contains(Gpu::TEXTURE_ARRAYS);
    let software = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
    match setting {
        // A software adapter reads an indexed texture separately for each fragment.
        TextureBinding::Auto => Ok(has && !software),
        TextureBinding::PerMaterial => Ok(false),
        TextureBinding::Array if has => Ok(true),
        TextureBinding::Array => Err(RenderError::MissingFeature {
            setting: "`textures array`",
            feature: "texture binding arrays",
            instead: "`textures per-material`",
        }),
    }
}
