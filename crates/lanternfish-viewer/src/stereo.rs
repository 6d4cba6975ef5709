//! Stereo: the eyes, and the rectangles of their images. It uses no window.

use egui::{Rect, Vec2};
use lanternfish_scene::{Camera, Eyes};

/// The stereo setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stereo {
    /// True if stereo is on.
    pub is_shown: bool,
    /// The eyes that are used while stereo is on.
    pub eyes: Eyes,
}

impl Stereo {
    /// Creates the initial setting; `None` is mono.
    pub fn new(eyes: Option<Eyes>) -> Self {
        Self { is_shown: eyes.is_some(), eyes: eyes.unwrap_or(Eyes::Parallel(Eyes::HUMAN)) }
    }

    /// True if the camera's projection supports these eyes.
    pub fn is_possible(&self, camera: &Camera) -> bool {
        self.eyes.cameras(camera, 1.0).is_some()
    }

    /// The eyes for this camera; `None` for a mono image.
    pub fn of(&self, camera: &Camera) -> Option<Eyes> {
        (self.is_shown && self.is_possible(camera)).then_some(self.eyes)
    }
}

/// The camera of each eye, left first; without eyes `camera` itself. `aspect` is width / height of one image.
pub fn cameras(eyes: Option<Eyes>, camera: &Camera, aspect: f32) -> Vec<Camera> {
    let of_eyes = eyes.and_then(|eyes| eyes.cameras(camera, aspect));
    of_eyes.map_or_else(|| vec![camera.clone()], Vec::from)
}

/// The rectangle of each eye's image in the viewport, left first; without eyes the whole viewport. All have the same size.
pub fn places(viewport: Rect, eyes: Option<Eyes>) -> Vec<Rect> {
    let Some(eyes) = eyes else { return vec![viewport] };
    let half = Vec2::new(0.5 * viewport.width(), viewport.height());
    let size = eyes.aspect().map_or(half, |aspect| {
        let width = half.x.min(aspect * half.y);
        Vec2::new(width, width / aspect)
    });
    let place = |side: f32| Rect::from_center_size(viewport.center() + Vec2::new(0.5 * side * half.x, 0.0), size);
    vec![place(-1.0), place(1.0)]
}

#[cfg(test)]
mod tests {
    use egui::pos2;
    use glam::Vec3;
    use lanternfish_scene::Projection;

    use super::*;

    #[test]
    fn stereo_images_are_side_by_side_and_keep_their_aspect() {
        let viewport = Rect::from_min_max(pos2(100.0, 0.0), pos2(900.0, 200.0));
        assert_eq!(places(viewport, None), [viewport]);
        let [left, right] = places(viewport, Some(Eyes::Parallel(0.1)))[..] else { panic!("there are two eyes") };
        assert_eq!(
            [left, right],
            [[100.0, 500.0], [500.0, 900.0]].map(|[from, to]| Rect::from_x_y_ranges(from..=to, 0.0..=200.0))
        );
        for viewport in [viewport, Rect::from_min_max(pos2(0.0, 0.0), pos2(90.0, 800.0))] {
            let [left, right] = places(viewport, Some(Eyes::Vive))[..] else { panic!("there are two eyes") };
            let aspect = Eyes::Vive.aspect().unwrap();
            assert!((left.aspect_ratio() - aspect).abs() < 1e-3, "{left}");
            assert!((left.size() - right.size()).length() < 1e-3, "{left}, {right}");
            assert!(left.right() <= right.left() + 1e-3 && viewport.expand(1e-3).contains_rect(left.union(right)));
        }
    }

    #[test]
    fn parallel_eyes_need_a_perspective_camera() {
        let perspective = Camera::look_at(Vec3::Z, Vec3::ZERO, Projection::Perspective { fov_y: 1.0, near: 0.1 });
        let flat = Projection::Orthographic { half_height: 1.0, near: 0.0, far: 9.0 };
        let flat = Camera { projection: flat, ..perspective.clone() };
        assert_eq!(Stereo::new(None).of(&perspective), None);
        let stereo = Stereo::new(Some(Eyes::Parallel(0.1)));
        assert_eq!((stereo.of(&perspective), stereo.of(&flat)), (Some(stereo.eyes), None));
        assert_eq!([&perspective, &flat].map(|camera| cameras(stereo.of(camera), camera, 1.5).len()), [2, 1]);
        let vive = Stereo::new(Some(Eyes::Vive));
        assert_eq!(vive.of(&flat), Some(Eyes::Vive));
    }
}
