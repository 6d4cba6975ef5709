//! Cameras.

use glam::{Affine3A, Mat3, Vec3};

use super::fault::{Place, Result, invalid, item};
use super::hierarchy::Placed;
use super::normals::direction;
use super::schema::{self, Root};
use crate::{Camera, Projection};

/// The camera at a node. A finite far plane and the aspect ratio of a perspective are not kept.
pub(super) fn read(root: &Root, index: usize, at: &Placed) -> Result<Camera> {
    let camera = item(&root.cameras, index, "cameras")?;
    let projection = read_projection(camera).place(|| format!("cameras[{index}]"))?;
    let name = if at.node.name.is_empty() { camera.name.clone() } else { at.node.name.clone() };
    Ok(Camera { name, world_from_camera: without_scale(&at.world_from_node), projection })
}

fn read_projection(camera: &schema::Camera) -> Result<Projection> {
    match (&camera.perspective, &camera.orthographic) {
        (Some(view), None) => {
            let (fov_y, near) = (view.yfov, view.znear);
            if !(fov_y > 0.0 && fov_y < std::f32::consts::PI && near > 0.0 && near.is_finite()) {
                return Err(invalid(format!("yfov {fov_y} is to be in (0, π) and znear {near} above 0")));
            }
            Ok(Projection::Perspective { fov_y, near })
        }
        (None, Some(view)) => {
            let (half_height, near, far) = (view.ymag.abs(), view.znear, view.zfar);
            if !(half_height > 0.0 && half_height.is_finite() && near >= 0.0 && far > near && far.is_finite()) {
                return Err(invalid(format!("ymag {half_height}, znear {near}, zfar {far} enclose nothing")));
            }
            Ok(Projection::Orthographic { half_height, near, far })
        }
        _ => Err(invalid("not one of perspective and orthographic")),
    }
}

/// Rotation and translation only: keeps the viewing direction, and the up direction as far as it is perpendicular.
fn without_scale(world_from_node: &Affine3A) -> Affine3A {
    let back = direction(world_from_node.transform_vector3(Vec3::Z)).unwrap_or(Vec3::Z);
    let up = world_from_node.transform_vector3(Vec3::Y).reject_from_normalized(back);
    let up = direction(up).unwrap_or_else(|| back.any_orthonormal_vector());
    let rotation = Mat3::from_cols(up.cross(back), up, back);
    Affine3A::from_mat3_translation(rotation, world_from_node.translation.into())
}
