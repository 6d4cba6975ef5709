//! How much of the surroundings each visible surface sees, and what light arrives from them: ambient occlusion and obscurance,
//! [`crate::environment_light`].
//!
//! The rooms are `deep` (by the directions of deep images) and `hbao` (in screen space, for comparison); what asks for the
//! answer imports `openness.wesl`.

pub(crate) mod deep;
pub(crate) mod hbao;
#[cfg(test)]
mod tests;

use glam::UVec2;
use lanternfish_gpu::{Bindings, Feature, Frame};

pub use self::{
    deep::{DeepOcclusion, DirectionRun},
    hbao::{Hbao, HbaoParameters},
};
use crate::{
    context::ViewContext,
    deep_images::DeepCounts,
    error::RenderError,
    prepass::Surface,
    settings::{Occlusion as OcclusionSetting, Settings},
    texture::frame_target,
};

/// [`Openness`] is read.
pub(crate) const OCCLUSION: Feature = Feature("occlusion");

/// Pixels a side of a workgroup: the shaders' `TILE`.
const TILE: u32 = 8;

/// The passes that find it.
#[derive(Debug)]
pub enum Occlusion {
    /// By the directions of deep images.
    Deep(Box<DeepOcclusion>),
    /// By horizons in the view's depth.
    Hbao(Box<Hbao>),
}

/// How open every pixel's opaque surface is.
#[derive(Clone, Debug)]
pub struct Openness {
    /// 32-bit floats, the one format of one channel that every device lets a compute pass write. 1 where nothing occludes,
    /// and where no surface is.
    pub texture: wgpu::TextureView,
    /// What arrives from the surroundings: `environment_light/environment_light.wesl`.
    pub environment_sums: wgpu::TextureView,
    /// Of the deep images that it was found by.
    pub images: Option<DeepCounts>,
}

impl Openness {
    /// What shaders call it.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("occlusion_texture", &self.texture).texture("environment_sums", &self.environment_sums)
    }
}

impl Occlusion {
    /// Compiles the passes that these settings want, if any. A distance that is none is an error. Where rays of indirect
    /// light see the surroundings themselves, it is found for its debug view alone.
    pub fn new(device: &wgpu::Device, settings: &Settings) -> Result<Option<Self>, RenderError> {
        let distance = match settings.occlusion {
            OcclusionSetting::None => return Ok(None),
            OcclusionSetting::Deep { max_distance } => max_distance,
            OcclusionSetting::Hbao { radius } => Some(radius),
        };
        if let Some(distance) = distance.filter(|distance| !(*distance > 0.0 && distance.is_finite())) {
            return Err(RenderError::Value {
                setting: "--occlusion-distance",
                got: distance.to_string(),
                needed: "metres above 0",
            });
        }
        if !settings.finds_openness() {
            return Ok(None);
        }
        Ok(Some(match settings.occlusion {
            OcclusionSetting::None => return Ok(None),
            OcclusionSetting::Deep { max_distance } => {
                Self::Deep(Box::new(DeepOcclusion::new(device, settings.deep_images, max_distance)?))
            }
            OcclusionSetting::Hbao { radius } => Self::Hbao(Box::new(Hbao::new(device, radius)?)),
        }))
    }

    /// The feature of shaders that read [`Openness`].
    pub fn feature(setting: OcclusionSetting) -> Option<Feature> {
        (setting != OcclusionSetting::None).then_some(OCCLUSION)
    }

    /// Finds it for a surface that a view shows, one sample a pixel, with normals.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<Openness, RenderError> {
        match self {
            Self::Deep(deep) => deep.record(frame, view, surface),
            Self::Hbao(hbao) => Ok(hbao.record(frame, view, surface)),
        }
    }
}

/// A texture for the answer.
fn openness_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
    frame_target(frame, "openness", size, wgpu::TextureFormat::R32Float, usage, 1)
}
