//! How much of the environment each visible surface sees, and what light arrives from them: ambient occlusion and obscurance,
//! [`crate::environment_light`].
//!
//! The library has no technique of this kind of its own: `lanternfish-papers` has two. What asks for the answer imports `ambient_visibility.wesl`.

pub mod by_normal;
mod history;

use std::fmt;

use glam::UVec2;
use lanternfish_gpu::{Bindings, Feature, Frame, Growth, gpu_constants};

use self::history::AccumulatedOcclusion;
use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::Parts,
    prepass::Surface,
    settings::{History, Settings},
    shaders::{Root, Shaders},
    technique::{AnyTechnique, Choice, Technique, clone_of},
    texture::frame_target,
};

/// The shaders of this folder, but for those of its techniques.
pub(crate) const DECLARED: Shaders =
    Shaders::new(&[Root::new("occlusion/by_normal"), Root::new("occlusion/history")], &[]);

/// [`AmbientVisibility`] is read.
pub(crate) const OCCLUSION: Feature = Feature::new("occlusion");

gpu_constants! {
    /// Pixels a side of a workgroup.
    pub const TILE: u32 = 8;
}

/// How it is found how much of the environment a surface sees, or that it is not.
pub type Occlusion = Choice<dyn OcclusionTechnique>;

impl<T: Technique + OcclusionTechnique> From<T> for Occlusion {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

impl Occlusion {
    /// Frames after a change of the scene until what is found is of nothing older.
    pub(crate) fn update_frames(&self, settings: &Settings) -> u32 {
        self.technique().map_or(1, |technique| technique.update_frames(settings))
    }

    /// True if what the technique finds may be mixed with that of the frames before.
    pub(crate) fn is_noisy(&self) -> bool {
        self.technique().is_some_and(|technique| technique.is_noisy())
    }

    /// What the technique reads of a scene.
    pub(crate) fn parts(&self) -> Parts {
        self.technique().map_or(Parts::NONE, |technique| technique.parts() | Parts::ENVIRONMENT_VISIBILITY)
    }
}

/// What a technique of occlusion is asked.
pub trait OcclusionTechnique: AnyTechnique {
    /// Distance from which on nothing occludes, m; none: everything occludes, however far.
    fn max_distance(&self) -> Option<f32>;

    /// Frames after a change of the scene until what it finds is of nothing older.
    fn update_frames(&self, _settings: &Settings) -> u32 {
        1
    }

    /// Whether what it finds has noise that differs from frame to frame, and is mixed with that of the frames before where there is a history.
    fn is_noisy(&self) -> bool {
        false
    }

    /// What it reads of a scene, beside what that looks like and its environment.
    fn parts(&self) -> Parts {
        Parts::NONE
    }

    /// Compiles its passes.
    fn build(&self, device: &wgpu::Device, settings: &Settings) -> Result<Box<dyn OcclusionPasses>, RenderError>;
}

/// The passes of a technique.
pub trait OcclusionPasses: fmt::Debug {
    /// Finds the ambient visibility of a surface that a view shows, one sample a pixel, with normals.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<AmbientVisibility, RenderError>;

    /// An error unless frames that get their lists so can be recorded.
    fn check_growth(&self, _growth: Growth) -> Result<(), RenderError> {
        Ok(())
    }

    /// Forgets what is kept from frame to frame: the last one was not handed to the device.
    fn forget(&mut self) {}
}

/// How open every pixel's opaque surface is.
#[derive(Clone, Debug)]
pub struct AmbientVisibility {
    /// 32-bit floats, the one format of one channel that every device lets a compute pass write. 1 where nothing occludes,
    /// and where no surface is.
    pub texture: wgpu::TextureView,
    /// What arrives from the environment: `shading/environment_light.wesl`.
    pub environment_irradiance: wgpu::TextureView,
    /// Exact counts, by name, of what the ambient visibility was found by.
    pub counters: Vec<(&'static str, u64)>,
}

impl AmbientVisibility {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new()
            .texture("occlusion_texture", &self.texture)
            .texture("environment_irradiance", &self.environment_irradiance)
    }
}

/// Compiles the passes that these settings want, if any; an error where the distance is not above 0 and finite. Where rays of indirect
/// light see the environment themselves, ambient visibility is found for its debug view alone.
pub(crate) fn passes(
    device: &wgpu::Device,
    settings: &Settings,
) -> Result<Option<Box<dyn OcclusionPasses>>, RenderError> {
    let Some(technique) = settings.occlusion.technique() else { return Ok(None) };
    if let Some(distance) = technique.max_distance().filter(|distance| !(*distance > 0.0 && distance.is_finite())) {
        return Err(RenderError::Value {
            setting: "`occlusion-distance`",
            got: distance.to_string(),
            needed: "metres above 0",
        });
    }
    if !settings.finds_ambient_visibility() {
        return Ok(None);
    }
    let passes = technique.build(device, settings)?;
    Ok(Some(match settings.history {
        History::On if technique.is_noisy() => Box::new(AccumulatedOcclusion::new(device, settings, passes)?),
        _ => passes,
    }))
}

/// The feature of shaders that read [`AmbientVisibility`].
pub(crate) fn feature(setting: &Occlusion) -> Option<Feature> {
    setting.is_some().then_some(OCCLUSION)
}

/// A texture for the ambient visibility of each pixel, for compute passes to write: one 32-bit float.
pub fn ambient_visibility_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
    frame_target(frame, "ambient_visibility", size, wgpu::TextureFormat::R32Float, usage, 1)
}
