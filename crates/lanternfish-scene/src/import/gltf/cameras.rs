//! Import of cameras.

use glam::Affine3A;

use super::fault::{Place, Result, invalid, item};
use super::hierarchy::Placed;
use super::schema::{self, Root};
use crate::{Camera, Projection, motion::place_camera};

/// The camera at a node. The far plane and aspect ratio of a perspective camera are ignored.
pub(super) fn read(root: &Root, index: usize, at: &Placed) -> Result<Camera> {
    let camera = item(&root.cameras, index, "cameras")?;
    let projection = read_projection(camera).place(|| format!("cameras[{index}]"))?;
    let name = if at.node.name.is_empty() { camera.name.clone() } else { at.node.name.clone() };
    let camera = Camera { name, world_from_camera: Affine3A::IDENTITY, projection };
    Ok(place_camera(&camera, &at.world_from_node))
}

fn read_projection(camera: &schema::Camera) -> Result<Projection> {
    match (&camera.perspective, &camera.orthographic) {
        (Some(view), None) => {
            let (fov_y, near) = (view.yfov, view.znear);
            if !(fov_y > 0.0 && fov_y < std::f32::consts::PI && near > 0.0 && near.is_finite()) {
                return Err(invalid(format!("yfov {fov_y} must be in (0, π), and znear {near} above 0")));
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
