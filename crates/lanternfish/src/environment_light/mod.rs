//! Light from the environment: an image, or a constant radiance.
//!
//! Data computed from a scene's image at upload:
//!
//! * `samples`: small cells of the sphere with their mean radiance, which are summed per direction of the deep images, and nine
//!   coefficients of the unoccluded irradiance by normal;
//! * `levels`: a cube map, prefiltered by surface roughness;
//! * `brdf_fractions`: the fraction of uniform light that a surface reflects, independent of the scene.
//!
//! [`crate::occlusion`] computes the visible fraction; shading adds the light in `shading/environment_light.wesl`.

pub(crate) mod brdf_fractions;
mod image;
mod levels;
mod reduced;
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
    /// Parameters of the environment image in shaders.
    pub struct EnvironmentLightParameters {
        /// Coefficients of the polynomials in the normal that sum to irradiance over π, nits: `samples.rs`.
        harmonics: [Vec4; 9],
        /// Index of the cube's last level, of roughness 1.
        last_level: f32,
        /// Unused.
        _pad: f32,
        /// Unused.
        _pad_more: Vec2,
    }
}

/// A scene's environment as a light source. Without an image all data are black; a constant radiance is part of the view.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    /// Cells of the image with their mean radiance; `None` without an image.
    pub samples: Option<Arc<[EnvironmentSample]>>,
    /// Unit direction, world space, towards a small area of the image that emits a large fraction of all light, if there is one.
    pub sun: Option<Vec3>,
    levels: wgpu::TextureView,
    brdf_fractions: wgpu::TextureView,
    sampler: wgpu::Sampler,
    parameters: wgpu::Buffer,
}

impl EnvironmentLight {
    /// Filters the image, if there is one. `uploaded` is the same image on the device.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        environment: Option<(&Environment, &EnvironmentImage)>,
    ) -> Result<Self, RenderError> {
        let sampler = levels::sampler(device);
        let levels = match environment {
            Some((environment, uploaded)) => {
                let size = levels::face_size(environment.width);
                match reduced::reduced(environment) {
                    Some(reduced) => {
                        levels::make(device, queue, &sampler, &EnvironmentImage::new(device, queue, &reduced)?, size)?
                    }
                    None => levels::make(device, queue, &sampler, uploaded, size)?,
                }
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

/// A texture of two layers for the environment's light at every pixel.
pub fn irradiance_target(frame: &mut Frame<'_>, size: UVec2) -> wgpu::TextureView {
    frame_layers(frame, "environment_irradiance", size, wgpu::TextureFormat::Rgba16Float, 2)
}
