//! Transforms of lights and cameras from a node's space to the world.

use glam::{Affine3A, Mat3, Vec3};

use crate::{Camera, Light, LightKind};

/// Normalises `v`; `None` if it has no direction: zero, not finite, or so short that its square is denormal.
fn direction(v: Vec3) -> Option<Vec3> {
    v.try_normalize().filter(|unit| unit.is_normalized())
}

/// Transforms a light from a node's space to world space. Areas scale with "the largest component of the absolute value of the node's scale"
/// (`EXT_lights_area`). `None` for an area light without extent.
pub(crate) fn place_light(light: &Light, world_from_node: &Affine3A) -> Option<Light> {
    let rotated = |v: Vec3| direction(world_from_node.transform_vector3(v));
    let is_directional = light.kind == LightKind::Directional;
    let position = if is_directional { Vec3::ZERO } else { world_from_node.transform_point3(light.position) };
    // A node scaled to zero has no direction; lights without an area keep theirs.
    let placed = Light { position, direction: rotated(light.direction).unwrap_or(light.direction), ..light.clone() };
    let scale = world_from_node.matrix3.to_cols_array_2d().map(|axis| Vec3::from(axis).length());
    let scale = scale.into_iter().fold(0.0, f32::max);
    let has_extent = scale > 0.0 && rotated(light.direction).is_some();
    let area = match light.kind {
        LightKind::Disk { radius } if has_extent => {
            Light::disk(position, placed.direction, scale * radius, light.intensity)
        }
        LightKind::Rectangle { half_width, half_height, right } if has_extent => {
            let right = direction(rotated(right)?.reject_from_normalized(placed.direction))?;
            let size = [half_width, half_height].map(|half| 2.0 * scale * half);
            Light::rectangle(position, placed.direction, right, size, light.intensity)
        }
        LightKind::Disk { .. } | LightKind::Rectangle { .. } => return None,
        LightKind::Point | LightKind::Spot { .. } | LightKind::Directional => return Some(placed),
    };
    Some(Light { name: light.name.clone(), ..area })
}

/// Places a camera at a node. The transform is rotation and translation only: it keeps the viewing direction, and the component of
/// the up direction perpendicular to it.
pub(crate) fn place_camera(camera: &Camera, world_from_node: &Affine3A) -> Camera {
    let back = direction(world_from_node.transform_vector3(Vec3::Z)).unwrap_or(Vec3::Z);
    let up = world_from_node.transform_vector3(Vec3::Y).reject_from_normalized(back);
    let up = direction(up).unwrap_or_else(|| back.any_orthonormal_vector());
    let rotation = Mat3::from_cols(up.cross(back), up, back);
    let world_from_camera = Affine3A::from_mat3_translation(rotation, world_from_node.translation.into());
    Camera { world_from_camera, ..camera.clone() }
}
