//! Two eyes: which they are, and where their images stand beside each other. No window.

use egui::{Rect, Vec2};
use lanternfish_scene::{Camera, Eyes};

/// Whether the scene is shown to two eyes, and to which.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stereo {
    /// True if it is.
    pub is_shown: bool,
    /// The eyes.
    pub eyes: Eyes,
}

impl Stereo {
    /// What is shown first: none is one image.
    pub fn new(eyes: Option<Eyes>) -> Self {
        Self { is_shown: eyes.is_some(), eyes: eyes.unwrap_or(Eyes::Parallel(Eyes::HUMAN)) }
    }

    /// True if these eyes can see what the camera sees.
    pub fn is_possible(&self, camera: &Camera) -> bool {
        self.eyes.cameras(camera, 1.0).is_some()
    }

    /// The eyes that see what the camera sees; none where it is seen by one.
    pub fn of(&self, camera: &Camera) -> Option<Eyes> {
        (self.is_shown && self.is_possible(camera)).then_some(self.eyes)
    }
}

/// The camera of each eye, the left one first; without eyes the camera itself. An image is `aspect` times as wide as high.
pub fn cameras(eyes: Option<Eyes>, camera: &Camera, aspect: f32) -> Vec<Camera> {
    let of_eyes = eyes.and_then(|eyes| eyes.cameras(camera, aspect));
    of_eyes.map_or_else(|| vec![camera.clone()], Vec::from)
}

/// Where each eye's image is in the window's room, the left one first; without eyes the one image. All are of one size.
pub fn places(room: Rect, eyes: Option<Eyes>) -> Vec<Rect> {
    let Some(eyes) = eyes else { return vec![room] };
    let half = Vec2::new(0.5 * room.width(), room.height());
    let size = eyes.aspect().map_or(half, |aspect| {
        let width = half.x.min(aspect * half.y);
        Vec2::new(width, width / aspect)
    });
    let place = |side: f32| Rect::from_center_size(room.center() + Vec2::new(0.5 * side * half.x, 0.0), size);
    vec![place(-1.0), place(1.0)]
}

#[cfg(test)]
mod tests {
    use egui::pos2;
    use glam::Vec3;
    use lanternfish_scene::Projection;

    use super::*;

    #[test]
    fn images_stand_beside_each_other_and_nothing_is_stretched() {
        let room = Rect::from_min_max(pos2(100.0, 0.0), pos2(900.0, 200.0));
        assert_eq!(places(room, None), [room]);
        let [left, right] = places(room, Some(Eyes::Parallel(0.1)))[..] else { panic!("there are two eyes") };
        assert_eq!(
            [left, right],
            [[100.0, 500.0], [500.0, 900.0]].map(|[from, to]| Rect::from_x_y_ranges(from..=to, 0.0..=200.0))
        );
        for room in [room, Rect::from_min_max(pos2(0.0, 0.0), pos2(90.0, 800.0))] {
            let [left, right] = places(room, Some(Eyes::Vive))[..] else { panic!("there are two eyes") };
            let aspect = Eyes::Vive.aspect().unwrap();
            assert!((left.aspect_ratio() - aspect).abs() < 1e-3, "{left}");
            assert!((left.size() - right.size()).length() < 1e-3, "{left}, {right}");
            assert!(left.right() <= right.left() + 1e-3 && room.expand(1e-3).contains_rect(left.union(right)));
        }
    }

    #[test]
    fn an_orthographic_camera_is_seen_by_one_eye() {
        let perspective = Camera::look_at(Vec3::Z, Vec3::ZERO, Projection::Perspective { fov_y: 1.0, near: 0.1 });
        let flat = Projection::Orthographic { half_height: 1.0, near: 0.0, far: 9.0 };
        let flat = Camera { projection: flat, ..perspective.clone() };
        assert_eq!(Stereo::new(None).of(&perspective), None);
        let stereo = Stereo::new(Some(Eyes::Parallel(0.1)));
        assert_eq!((stereo.of(&perspective), stereo.of(&flat)), (Some(stereo.eyes), None));
        assert_eq!([&perspective, &flat].map(|camera| cameras(stereo.of(camera), camera, 1.5).len()), [2, 1]);
        let of_vive = Stereo::new(Some(Eyes::Vive));
        assert_eq!(of_vive.of(&flat), Some(Eyes::Vive));
    }
}
