//! Lights in world space: glTF's `KHR_lights_punctual`, and the disks and rectangles of `EXT_lights_area`.

use std::f32::consts::PI;

use glam::Vec3;

/// A light in world space. It is not a surface: it is invisible, and it casts no shadow.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name in the file, or empty.
    pub name: String,
    /// Type of the light.
    pub kind: LightKind,
    /// Position, world space, m; the centre of a disk or rectangle. Not used for directional lights.
    pub position: Vec3,
    /// The direction light travels, unit length: the axis of a spot, every ray of a directional light; the normal of a disk or
    /// rectangle, on the emitting side.
    pub direction: Vec3,
    /// Linear Rec. 709. Point and spot: luminous intensity (on the axis), cd; directional: illuminance of a surface
    /// that faces the light, lx; disk and rectangle: radiance of every point in every direction, nits.
    pub intensity: Vec3,
    /// Distance from the position at which the light ends, m; `None`: the renderer derives it from a threshold.
    pub range: Option<f32>,
}

/// Type of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Emits in every direction.
    Point,
    /// Emits in a cone around the direction.
    Spot {
        /// Angle from the axis up to which the intensity is full, radians; 0 <= inner < outer.
        inner_angle: f32,
        /// Angle from the axis at which the light ends, radians; <= π/2.
        outer_angle: f32,
    },
    /// Parallel light from an infinite distance.
    Directional,
    /// Area light: one side of a disk, with constant radiance (a Lambertian emitter). Its flux is π · area · radiance.
    Disk {
        /// Radius, m; > 0.
        radius: f32,
    },
    /// Area light: one side of a rectangle, with constant radiance.
    Rectangle {
        /// Half the width, m; > 0.
        half_width: f32,
        /// Half the height, m; > 0.
        half_height: f32,
        /// Direction of the width: world space, unit length, perpendicular to the light's direction. The height is perpendicular to both.
        right: Vec3,
    },
}

impl Light {
    /// A point light without a stated range.
    pub fn point(position: Vec3, intensity: Vec3) -> Self {
        Self { name: String::new(), kind: LightKind::Point, position, direction: Vec3::NEG_Y, intensity, range: None }
    }

    /// A directional light that travels along `direction` (any length but zero), with `illuminance` in lx.
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

    /// A disk with the normal `direction` (unit length), `radius` in m and `radiance` in nits.
    pub fn disk(position: Vec3, direction: Vec3, radius: f32, radiance: Vec3) -> Self {
        Self { kind: LightKind::Disk { radius }, direction, ..Self::point(position, radiance) }
    }

    /// A rectangle with the normal `direction` (unit length), size in m and `radiance` in nits. `right`: direction of the width, any
    /// length but zero, not parallel to `direction`; it is made perpendicular to it.
    pub fn rectangle(position: Vec3, direction: Vec3, right: Vec3, [width, height]: [f32; 2], radiance: Vec3) -> Self {
        let right = right.reject_from_normalized(direction).normalize();
        let kind = LightKind::Rectangle { half_width: 0.5 * width, half_height: 0.5 * height, right };
        Self { kind, direction, ..Self::point(position, radiance) }
    }

    /// Emitting area of a disk or rectangle, m²; `None` for lights without an area.
    #[doc(hidden)]
    pub fn area(&self) -> Option<f32> {
        match self.kind {
            LightKind::Disk { radius } => Some(PI * radius * radius),
            LightKind::Rectangle { half_width, half_height, .. } => Some(4.0 * half_width * half_height),
            LightKind::Point | LightKind::Spot { .. } | LightKind::Directional => None,
        }
    }

    /// Maximum far-field intensity over all directions, cd; for disks and rectangles, radiance times area. For directional lights,
    /// the illuminance, lx.
    #[doc(hidden)]
    pub fn greatest_intensity(&self) -> Vec3 {
        self.intensity * self.area().unwrap_or(1.0)
    }

    /// Half the size of the light's world-space bounding box, m, which is centred on the position. Zero for lights without an
    /// area.
    #[doc(hidden)]
    pub fn half_extent(&self) -> Vec3 {
        match self.kind {
            // The extent along an axis is the radius times the sine of the angle between axis and normal.
            LightKind::Disk { radius } => {
                radius * (1.0 - self.direction * self.direction).max(Vec3::ZERO).map(f32::sqrt)
            }
            LightKind::Rectangle { half_width, half_height, right } => {
                half_width * right.abs() + half_height * right.cross(self.direction).abs()
            }
            LightKind::Point | LightKind::Spot { .. } | LightKind::Directional => Vec3::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    #[test]
    fn areas_send_radiance_times_area_and_lie_in_their_box() {
        let direction = Vec3::new(1.0, -2.0, 0.5).normalize();
        let disk = Light::disk(Vec3::ONE, direction, 0.5, Vec3::splat(8.0));
        assert!((disk.greatest_intensity().x - 8.0 * PI * 0.25).abs() < 1e-5);
        let rectangle = Light::rectangle(Vec3::ONE, direction, Vec3::X, [3.0, 0.5], Vec3::splat(2.0));
        assert!((rectangle.greatest_intensity().x - 3.0).abs() < 1e-6);
        assert_eq!(Light::point(Vec3::ONE, Vec3::X).greatest_intensity(), Vec3::X);
        let LightKind::Rectangle { right, .. } = rectangle.kind else { panic!("{rectangle:?}") };
        assert!(right.dot(direction).abs() < 1e-6 && right.is_normalized() && right.x > 0.0);

        // The box is tight.
        let (across, up) = direction.any_orthonormal_pair();
        let rim = (0..10_000).map(|i| 0.5 * Vec2::from_angle(i as f32 * 1e-3)).map(|p| p.x * across + p.y * up);
        let farthest = rim.fold(Vec3::ZERO, |farthest, p| farthest.max(p.abs()));
        assert!(disk.half_extent().abs_diff_eq(farthest, 1e-5), "{} and {farthest}", disk.half_extent());
        let up = right.cross(direction);
        let corners = [1.5 * right + 0.25 * up, 1.5 * right - 0.25 * up];
        let farthest = corners[0].abs().max(corners[1].abs());
        assert!(rectangle.half_extent().abs_diff_eq(farthest, 1e-6), "{} and {farthest}", rectangle.half_extent());
    }
}
