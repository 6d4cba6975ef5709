//! Draws that a view may show, and their order.

use glam::Vec4;
use lanternfish_scene::Bounds;

use super::{
    scene::GpuScene,
    upload::geometry::{Draw, DrawAlpha},
};
use crate::view::View;

/// The draws whose box intersects the view's frustum.
#[derive(Clone, Debug)]
pub struct VisibleDraws<'s> {
    /// Opaque and masked ones: by pipeline, then near to far, which reduces overdraw.
    pub solid: Vec<&'s Draw>,
    /// Far to near, for blending.
    pub transparent: Vec<&'s Draw>,
}

impl GpuScene {
    /// Culls the draws outside `view`'s frustum. Conservative: a box may intersect the frustum although its triangles do not.
    #[doc(hidden)]
    pub fn visible_draws(&self, view: &View) -> VisibleDraws<'_> {
        let seen = self.geometry.draws.iter().filter(|draw| intersects_frustum(view, &draw.bounds));
        let (transparent, solid): (Vec<&Draw>, Vec<&Draw>) =
            seen.partition(|draw| draw.alpha == DrawAlpha::Transparent);
        let mut visible = VisibleDraws { solid, transparent };
        let pipeline = |draw: &Draw| (draw.alpha, draw.lobes, draw.facing);
        visible.solid.sort_by(|a, b| pipeline(a).cmp(&pipeline(b)).then(nearest(view, a).total_cmp(&nearest(view, b))));
        visible.transparent.sort_by(|a, b| middle(view, b).total_cmp(&middle(view, a)));
        visible
    }
}

/// Distance along the view axis of the nearest corner of a draw's box, m.
fn nearest(view: &View, draw: &Draw) -> f32 {
    let distances = draw.bounds.corners().map(|corner| -view.view_from_world.transform_point3(corner).z);
    distances.into_iter().fold(f32::INFINITY, f32::min)
}

/// Distance along the view axis of the centre of a draw's box, m.
fn middle(view: &View, draw: &Draw) -> f32 {
    -view.view_from_world.transform_point3(draw.bounds.center()).z
}

/// True unless all corners lie outside one plane of the frustum: left, right, bottom, top or near.
fn intersects_frustum(view: &View, bounds: &Bounds) -> bool {
    let clip_from_world = view.clip_from_view * view.view_from_world;
    let corners = bounds.corners().map(|corner| clip_from_world * corner.extend(1.0));
    let beyond: [fn(&Vec4) -> bool; 5] = [|c| c.x < -c.w, |c| c.x > c.w, |c| c.y < -c.w, |c| c.y > c.w, |c| c.z > c.w];
    !beyond.iter().any(|beyond| corners.iter().all(beyond))
}

#[cfg(test)]
mod tests {
    use glam::{UVec2, Vec3};
    use lanternfish_scene::{Camera, Projection};

    use super::*;

    #[test]
    fn boxes_in_and_around_the_view() {
        let projections = [
            Projection::Perspective { fov_y: 1.0, near: 0.1 },
            Projection::Orthographic { half_height: 2.0, near: 0.1, far: 50.0 },
        ];
        for projection in projections {
            let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, projection);
            let cube = |center: Vec3| Bounds { min: center - Vec3::ONE, max: center + Vec3::ONE };
            let all = Bounds { min: Vec3::splat(-60.0), max: Vec3::splat(60.0) };
            let view = View::new(&camera, UVec2::new(200, 100), Vec3::ZERO, &all);
            let seen = |center| intersects_frustum(&view, &cube(center));
            assert!(seen(Vec3::new(0.0, 0.0, -5.0)) && seen(Vec3::ZERO) && seen(Vec3::new(4.0, 0.0, -6.0)));
            assert!(!seen(Vec3::new(0.0, 0.0, 5.0)), "behind");
            assert!(!seen(Vec3::new(20.0, 0.0, -5.0)) && !seen(Vec3::new(0.0, -20.0, -5.0)), "beside and below");
            // Around the camera, larger than the view.
            assert!(intersects_frustum(&view, &all));
        }
    }
}
