//! Ambient visibility (ambient occlusion and obscurance) of each visible surface, and the environment irradiance that
//! it leaves: [`crate::environment_light`].
//!
//! The library has no technique of this kind of its own: `lanternfish-papers` has two. Shaders that read the result
//! import `ambient_visibility.wesl`.

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

/// The shaders of this folder, without those of techniques.
pub(crate) const DECLARED: Shaders =
    Shaders::new(&[Root::new("occlusion/by_normal"), Root::new("occlusion/history")], &[]);

/// The shader reads [`AmbientVisibility`].
pub(crate) const OCCLUSION: Feature = Feature::new("occlusion");

gpu_constants! {
    /// Edge of a workgroup, pixels.
    pub const TILE: u32 = 8;
}

/// The technique that computes ambient visibility, or none.
pub type Occlusion = Choice<dyn OcclusionTechnique>;

impl<T: Technique + OcclusionTechnique> From<T> for Occlusion {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

impl Occlusion {
    /// Frames after a change of the scene until the estimate no longer contains older data.
    pub(crate) fn update_frames(&self, settings: &Settings) -> u32 {
        self.technique().map_or(1, |technique| technique.update_frames(settings))
    }

    /// True if the technique's estimate has noise that temporal accumulation reduces.
    pub(crate) fn is_noisy(&self) -> bool {
        self.technique().is_some_and(|technique| technique.is_noisy())
    }

    /// Parts of a scene that the technique reads.
    pub(crate) fn parts(&self) -> Parts {
        self.technique().map_or(Parts::NONE, |technique| technique.parts() | Parts::ENVIRONMENT_VISIBILITY)
    }
}

/// A technique for ambient visibility.
pub trait OcclusionTechnique: AnyTechnique {
    /// Distance beyond which geometry does not occlude, m; `None`: no limit.
    fn max_distance(&self) -> Option<f32>;

    /// Frames after a change of the scene until its estimate no longer contains older data.
    fn update_frames(&self, _settings: &Settings) -> u32 {
        1
    }

    /// True if its estimate has noise that differs from frame to frame. With a history, such estimates are accumulated
    /// over frames.
    fn is_noisy(&self) -> bool {
        false
    }

    /// Parts of a scene that it reads, beside those that are rasterized and the environment.
    fn parts(&self) -> Parts {
        Parts::NONE
    }

    /// Compiles its passes.
    fn build(&self, device: &wgpu::Device, settings: &Settings) -> Result<Box<dyn OcclusionPasses>, RenderError>;
}

/// The passes of a technique.
pub trait OcclusionPasses: Send + fmt::Debug {
    /// Records the passes that compute the ambient visibility of a view's surface: one sample per pixel, with normals.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<AmbientVisibility, RenderError>;

    /// Returns an error if the technique cannot record frames whose lists grow in this way.
    fn check_growth(&self, _growth: Growth) -> Result<(), RenderError> {
        Ok(())
    }
}

/// Ambient visibility of each pixel's opaque surface.
#[derive(Clone, Debug)]
pub struct AmbientVisibility {
    /// Ambient visibility, 0 to 1, as 32-bit floats: the only single-channel format that compute passes may write on
    /// every device. 1 where nothing occludes and where there is no surface.
    pub texture: wgpu::TextureView,
    /// Irradiance from the environment: `shading/environment_light.wesl`.
    pub environment_irradiance: wgpu::TextureView,
    /// Exact counts of the technique's work, by name.
    pub counters: Vec<(&'static str, u64)>,
}

impl AmbientVisibility {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new()
            .texture("occlusion_texture", &self.texture)
            .texture("environment_irradiance", &self.environment_irradiance)
    }

    /// The same of clear coats.
    pub(crate) fn coat_bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("coat_environment_irradiance", &self.environment_irradiance)
    }
}

/// Compiles the passes that these settings need, if any. If rays of indirect light sample the environment themselves,
/// ambient visibility is computed only for its debug view.
///
/// # Errors
///
/// If the maximum distance is not above 0 and finite, or a pass does not compile.
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

/// Creates a texture for the ambient visibility of each pixel, writable by compute passes: one 32-bit float.
pub fn ambient_visibility_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
    frame_target(frame, "ambient_visibility", size, wgpu::TextureFormat::R32Float, usage, 1)
}
