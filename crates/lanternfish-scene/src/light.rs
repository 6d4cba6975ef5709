//! Punctual lights in world space: glTF's `KHR_lights_punctual`.

use glam::Vec3;

/// A light without extent, in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// The file's name for it, or empty.
    pub name: String,
    /// Which way it shines.
    pub kind: LightKind,
    /// World space, m. Of no meaning for directional lights.
    pub position: Vec3,
    /// The direction light travels, unit length: the axis of a spot, every ray of a directional light.
    pub direction: Vec3,
    /// Linear Rec. 709. Point and spot: luminous intensity (on the axis), cd; directional: illuminance of a surface
    /// that faces the light, lx.
    pub intensity: Vec3,
    /// Distance at which the light ends, m; `None`: the renderer derives it from a threshold.
    pub range: Option<f32>,
}

/// Which way a light shines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Every way.
    Point,
    /// A cone around the direction.
    Spot {
        /// Angle from the axis up to which the light is full, radians; 0 <= inner < outer.
        inner_angle: f32,
        /// Angle from the axis at which the light ends, radians; <= π/2.
        outer_angle: f32,
    },
    /// From infinitely far.
    Directional,
}

impl Light {
    /// A point light without a stated range.
    pub fn point(position: Vec3, intensity: Vec3) -> Self {
        Self { name: String::new(), kind: LightKind::Point, position, direction: Vec3::NEG_Y, intensity, range: None }
    }

    /// A light from infinitely far, travelling along `direction` (any length but zero).
    pub fn directional(direction: Vec3, illuminance: Vec3) -> Self {
        Self {
            name: String::new(),
            kind: LightKind::Directional,
            position: Vec3::ZERO,
            direction: direction.normalize(),
            intensity: illuminance,
            range: None,
        }
    }
}
