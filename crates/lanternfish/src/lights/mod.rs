//! Lights as shaders read them: kinds, ranges, attenuation.

#[cfg(test)]
mod cpu_reference;
mod set;
#[cfg(test)]
mod tests;
pub mod tree;

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use lanternfish_gpu::{Feature, SharedStruct, gpu_struct};
use lanternfish_scene::{LightKind, shading::Falloff};

pub use self::set::{LightCount, LightSet};
use crate::shaders::{Root, Shaders};

/// The scene has area lights: disks or rectangles, whose points are sampled.
pub(crate) const AREA_LIGHTS: Feature = Feature::new("area_lights");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[Root::new("lights/tree/build")],
    &[
        SharedStruct::of::<Light>(),
        SharedStruct::of::<LightCount>(),
        SharedStruct::of::<tree::LightNode>(),
        SharedStruct::of::<tree::LightTrees>(),
        SharedStruct::of::<tree::BuiltTree>(),
        SharedStruct::of::<tree::Emitters>(),
    ],
);

gpu_struct! {
    /// A light. World space, linear Rec. 709.
    pub struct Light {
        /// Centre, m.
        position: Vec3,
        /// Distance at which the light ends, m; greater than 0.
        range: f32,
        /// Point, spot: cd; directional: lx; disk, rectangle: radiance, nits.
        intensity: Vec3,
        /// 0: point, 1: spot, 2: directional, 3: disk, 4: rectangle.
        kind: u32,
        /// Direction in which light travels, unit; disk, rectangle: the normal of the emitting side.
        direction: Vec3,
        /// Index of the [`Attenuation`](lanternfish_scene::shading::Attenuation).
        falloff: u32,
        /// Spot: cosine of the outer angle. Rectangle: direction of its width, octahedral, x.
        cos_outer: f32,
        /// Spot: 1 / (cosine of the inner angle − cosine of the outer angle). Rectangle: direction of its width, octahedral, y.
        inverse_cos_span: f32,
        /// Spot: tangent of the outer angle, for culling. Rectangle: half its height, m.
        tan_outer: f32,
        /// Point, spot: radius of the disk around the light's centre that shadow rays sample, m; 0: a point. Directional: that of the disk at
        /// distance 1, the tangent of the angular radius. Disk: its radius. Rectangle: half its width.
        radius: f32,
    }
}

/// The settings with which lights are packed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightStorage {
    /// Attenuation function and its parameters.
    pub falloff: Falloff,
    /// Intensity at which a light without a stated range ends, cd/m²; > 0.
    pub range_threshold: f32,
    /// Radius of point and spot lights, m; 0: points.
    pub radius: f32,
    /// Tangent of the angular radius of directional lights; 0: a single direction.
    pub sun_radius: f32,
    /// Shadow rays from a pixel to each area light.
    pub shadow_rays: u32,
}

impl Light {
    /// Packs a scene's light with these settings.
    pub fn new(light: &lanternfish_scene::Light, settings: &LightStorage) -> Self {
        let cone = |inner: f32, outer: f32| {
            let span = 1.0 / (inner.cos() - outer.cos()).max(1e-4);
            [outer.cos(), span, outer.min(1.57).tan()]
        };
        let every_way = cone(0.0, PI);
        let (kind, [cos_outer, inverse_cos_span, tan_outer], radius) = match light.kind {
            LightKind::Point => (0, every_way, settings.radius),
            LightKind::Spot { inner_angle, outer_angle } => (1, cone(inner_angle, outer_angle), settings.radius),
            LightKind::Directional => (2, every_way, settings.sun_radius),
            LightKind::Disk { radius } => (3, every_way, radius),
            LightKind::Rectangle { half_width, half_height, right } => {
                let Vec2 { x, y } = octahedral_from_unit(right);
                (4, [x, y, half_height], half_width)
            }
        };
        Self {
            position: light.position,
            range: light.effective_range(settings.falloff.attenuation, settings.range_threshold),
            intensity: light.intensity,
            kind,
            direction: light.direction,
            falloff: settings.falloff.attenuation as u32,
            cos_outer,
            inverse_cos_span,
            tan_outer,
            radius,
        }
    }

    /// The light in this unit, nits: see `gpu_scene/upload/light_unit.rs`.
    pub(crate) fn in_unit(self, light_unit: f32) -> Self {
        Self { intensity: self.intensity / light_unit, ..self }
    }

    /// True if it is infinitely far away: it has no position.
    pub(crate) fn is_directional(&self) -> bool {
        self.kind == 2
    }

    /// True if it is directional and shines.
    pub(crate) fn is_sun(&self) -> bool {
        self.is_directional() && self.shines()
    }

    /// True if it has a position and shines: it is in the light tree. `lights/tree/build.wesl` has the same condition.
    pub(crate) fn is_placed(&self) -> bool {
        !self.is_directional() && self.shines()
    }

    /// Devices may take smaller numbers for zero.
    fn shines(&self) -> bool {
        self.intensity.max_element() >= f32::MIN_POSITIVE
    }

    /// True if it is a disk or rectangle.
    pub(crate) fn is_area(&self) -> bool {
        self.kind >= 3
    }

    /// World space, m.
    pub(crate) fn position(&self) -> Vec3 {
        self.position
    }
}

/// Octahedral mapping of a unit vector to the square −1..1: `octahedral_from_unit` of `common/math.wesl` [Cigolle2014].
fn octahedral_from_unit(v: Vec3) -> Vec2 {
    let p = v.truncate() / v.abs().element_sum();
    if v.z >= 0.0 { p } else { (Vec2::ONE - Vec2::new(p.y, p.x).abs()) * Vec2::ONE.copysign(p) }
}
