//! Punctual lights as shaders read them: kinds, ranges, attenuation.

mod set;
#[cfg(test)]
mod tests;
pub mod tree;
#[cfg(test)]
mod twin;

use glam::Vec3;
use lanternfish_gpu::{SharedStruct, gpu_struct};
use lanternfish_scene::LightKind;

pub use self::set::{LightCount, LightSet};
use crate::{settings::Settings, shaders::Shaders};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders {
    roots: &[],
    structs: &[
        SharedStruct::of::<Light>(),
        SharedStruct::of::<LightCount>(),
        SharedStruct::of::<tree::LightNode>(),
        SharedStruct::of::<tree::LightTrees>(),
    ],
};

gpu_struct! {
    /// A punctual light. World space, linear Rec. 709.
    pub struct Light {
        /// Centre, m.
        position: Vec3,
        /// Distance at which the light ends, m; > 0.
        range: f32,
        /// Point, spot: cd; directional: lx.
        intensity: Vec3,
        /// 0: point, 1: spot, 2: directional.
        kind: u32,
        /// The way light travels, unit.
        direction: Vec3,
        /// Index of the [`Attenuation`](crate::settings::Attenuation).
        falloff: u32,
        /// Spot: cosine of the outer angle.
        cos_outer: f32,
        /// Spot: 1 / (cosine of the inner angle − cosine of the outer angle).
        inverse_cos_span: f32,
        /// Spot: tangent of the outer angle, for culling.
        tan_outer: f32,
        /// Radius of the disk around the light's centre that shadow rays end on, m; 0: a point.
        radius: f32,
    }
}

impl Light {
    /// A scene's light under these settings.
    pub fn new(light: &lanternfish_scene::Light, settings: &Settings) -> Self {
        let (kind, inner, outer) = match light.kind {
            LightKind::Point => (0, 0.0, std::f32::consts::PI),
            LightKind::Spot { inner_angle, outer_angle } => (1, inner_angle, outer_angle),
            LightKind::Directional => (2, 0.0, std::f32::consts::PI),
        };
        Self {
            position: light.position,
            range: light.effective_range(settings.attenuation, settings.range_threshold),
            intensity: light.intensity,
            kind,
            direction: light.direction,
            falloff: settings.attenuation as u32,
            cos_outer: outer.cos(),
            inverse_cos_span: 1.0 / (inner.cos() - outer.cos()).max(1e-4),
            tan_outer: outer.min(1.57).tan(),
            radius: if light.kind == LightKind::Directional { 0.0 } else { settings.light_radius },
        }
    }
}
