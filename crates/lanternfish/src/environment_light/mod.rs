//! Light that arrives from the environment: an image of them, or one radiance everywhere.
//!
//! What a scene's image is made into once, when it is uploaded:
//!
//! * `samples`: small pieces of the sphere with their mean radiance, from which every direction of deep images gets its own, and
//!   nine numbers that give the irradiance by the normal where nothing occludes;
//! * `levels`: a cube of it, each level filtered as a surface of that roughness reflects it;
//! * `brdf_fractions`: what a surface reflects of an even light, of any scene.
//!
//! How much of it arrives is [`crate::occlusion`]'s; shading adds it by `shading/environment_light.wesl`.

pub(crate) mod brdf_fractions;
mod image;
mod levels;
mod samples;
#[cfg(test)]
pub(crate) mod tests;

use std::sync::Arc;

use glam::{UVec2, Vec2, Vec3, Vec4};
use lanternfish_gpu::{Bindings, Feature, Frame, SharedStruct, gpu_struct, uniform_buffer_of};
use lanternfish_scene::Environment;

pub use self::samples::samples_of;
use self::samples::{harmonics, sun_of};
pub use self::{
    image::{EnvironmentImage, EnvironmentParameters},
    levels::LevelParameters,
    samples::EnvironmentSample,
};
use crate::{
    error::RenderError,
    shaders::{Root, Shaders},
    texture::frame_layers,
};

/// The environment is an image.
pub const ENVIRONMENT: Feature = Feature::new("environment");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[Root::new("environment_light/levels")],
    &[
        SharedStruct::of::<EnvironmentParameters>(),
        SharedStruct::of::<EnvironmentLightParameters>(),
        SharedStruct::of::<LevelParameters>(),
    ],
);

gpu_struct! {
    /// What shaders know of the image of the environment.
    pub struct EnvironmentLightParameters {
        /// Factors of the polynomials in the normal that sum to irradiance over π, nits: `samples.rs`.
        harmonics: [Vec4; 9],
        /// Number of the cube's last level, which is of roughness 1.
        last_level: f32,
        /// Unused.
        _pad: f32,
        /// Unused.
        _pad_more: Vec2,
    }
}

/// A scene's environment as light. Without an image all of it is black: one radiance everywhere is the view's.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    /// Pieces of the image with their mean radiance; `None` without an image.
    pub samples: Option<Arc<[EnvironmentSample]>>,
    /// Unit direction, world space, towards a spot of the image that sends much of all light, if there is one.
    pub sun: Option<Vec3>,
    levels: wgpu::TextureView,
    brdf_fractions: wgpu::TextureView,
    sampler: wgpu::Sampler,
    parameters: wgpu::Buffer,
}

impl EnvironmentLight {
    /// Filters the image, if there is one. `uploaded` is the same image.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        environment: Option<(&Environment, &EnvironmentImage)>,
    ) -> Result<Self, RenderError> {
        let sampler = levels::sampler(device);
        let levels = match environment {
            Some((environment, uploaded)) => {
                levels::make(device, queue, &sampler, uploaded, levels::face_size(environment.width))?
            }
            None => levels::black(device, queue),
        };
        let samples: Option<Arc<[_]>> = environment.map(|(environment, _)| samples_of(environment).into());
        let parameters = EnvironmentLightParameters {
            harmonics: samples.as_deref().map(harmonics).unwrap_or_default(),
            last_level: (levels.texture().mip_level_count() - 1) as f32,
            ..Default::default()
        };
        Ok(Self {
            sun: samples.as_deref().and_then(sun_of),
            samples,
            levels,
            brdf_fractions: brdf_fractions::upload(device, queue),
            sampler,
            parameters: uniform_buffer_of(device, "environment_light", &parameters),
        })
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new()
            .buffer("environment_light_parameters", &self.parameters)
            .texture("environment_levels", &self.levels)
            .texture("brdf_fractions", &self.brdf_fractions)
            .sampler("environment_sampler", &self.sampler)
    }
}

/// A texture of two layers for what arrives at every pixel from the environment.
pub fn irradiance_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    frame_layers(frame, "environment_irradiance", size, wgpu::TextureFormat::Rgba16Float, 2)
}
