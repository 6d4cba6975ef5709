//! A second camera that looks at the first one [VanGelderen2020, fig. 4.8].

use glam::Vec3;
use lanternfish::light_culling::clustered::GridContents;
use lanternfish_scene::{Bounds, Camera, Controls, Projection};

use super::MOST_CLUSTERS;

/// The bird's-eye view.
#[derive(Clone, Debug)]
pub struct BirdsEye {
    /// The first camera and its controls.
    pub first: Controls,
    /// Aspect ratio of the first camera's image, width / height.
    pub aspect: f32,
    /// Corners of visible clusters, world space, m, and the number of lights in each list. At most `MOST_CLUSTERS`.
    pub clusters: Vec<([Vec3; 8], u32)>,
    /// Number of visible clusters.
    pub all: usize,
    /// Corners of each cluster grid, world space, m.
    pub outlines: Vec<[Vec3; 8]>,
}

impl BirdsEye {
    /// Creates the view. `grids` are the cluster grids of the first camera's last frame.
    pub fn new(first: &Controls, aspect: f32, grids: &[GridContents]) -> Self {
        let mut visible: Vec<_> =
            grids.iter().flat_map(|grid| grid.visible.iter().map(move |cluster| (grid, cluster))).collect();
        let all = visible.len();
        if all > MOST_CLUSTERS {
            visible.sort_by_key(|(_, cluster)| std::cmp::Reverse(cluster.lights));
            visible.truncate(MOST_CLUSTERS);
        }
        let clusters =
            visible.into_iter().map(|(grid, cluster)| (grid.geometry.corners(cluster.index), cluster.lights)).collect();
        let outlines = grids.iter().map(|grid| grid.geometry.outline()).collect();
        Self { first: first.clone(), aspect, clusters, all, outlines }
    }

    /// The initial second camera: above, behind and to the right of the first frustum, most of which it sees.
    pub fn camera(&self, bounds: &Bounds) -> Camera {
        let camera = &self.first.camera;
        let far = far_of(camera, bounds);
        let forward = self.first.forward();
        let level = Vec3::new(forward.x, 0.0, forward.z).normalize_or(Vec3::NEG_Z);
        let middle = self.first.eye() + 0.4 * far * forward;
        let eye = middle + far * (0.75 * Vec3::Y - 0.55 * level + 0.35 * level.cross(Vec3::Y));
        let near = (1e-3 * far).max(camera.projection.near());
        Camera::look_at(eye, middle, Projection::Perspective { fov_y: 0.8, near })
    }
}

/// The far distance of the scene along the camera's axis, m.
pub fn far_of(camera: &Camera, bounds: &Bounds) -> f32 {
    let view_from_world = camera.world_from_camera.inverse();
    let distances = bounds.corners().map(|corner| -view_from_world.transform_point3(corner).z);
    let near = camera.projection.near();
    distances.into_iter().filter(|distance| distance.is_finite()).fold(near.max(1e-3) * 2.0, f32::max)
}

#[cfg(test)]
mod tests {
    use egui::{Rect, pos2};
    use lanternfish_scene::generate::demo;

    use super::{super::project::Projector, *};

    #[test]
    fn the_second_camera_sees_the_first() {
        for name in ["cornell", "atrium", "hall"] {
            let scene = demo(name).unwrap();
            let first = Controls::new(scene.default_camera(1.5), scene.bounds().size().length());
            let view = BirdsEye::new(&first, 1.5, &[]);
            let camera = view.camera(&scene.bounds());
            camera.validate().unwrap();
            let rendering = Rect::from_min_max(pos2(0.0, 0.0), pos2(600.0, 400.0));
            let projector = Projector::new(&camera, rendering);
            let far = far_of(&first.camera, &scene.bounds());
            for p in [first.eye(), first.eye() + 0.5 * far * first.forward()] {
                let at = projector.point(p).unwrap_or(pos2(-1.0, -1.0));
                assert!(rendering.contains(at), "{name}: {p} is at {at}");
            }
        }
    }
}
