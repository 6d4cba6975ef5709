//! Zoom and pan of an image in its window. No window.

use egui::{Pos2, Rect, Vec2};

/// Times that a pixel is enlarged and made smaller, at most.
const ZOOMS: std::ops::RangeInclusive<f32> = 0.02..=256.0;

/// Where the image is, whatever the size of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Points of the window a pixel, and which place of the image, in pixels, is in the window's middle. None: all of it is seen.
    chosen: Option<(f32, Vec2)>,
}

impl Place {
    /// Points of the window a pixel.
    pub fn zoom(&self, room: Rect, size: Vec2) -> f32 {
        self.chosen
            .map_or_else(|| (room.size() / size).min_elem().clamp(*ZOOMS.start(), *ZOOMS.end()), |(zoom, _)| zoom)
    }

    fn middle(&self, size: Vec2) -> Vec2 {
        self.chosen.map_or(size / 2.0, |(_, middle)| middle)
    }

    /// Where all of the image is: `room` is the window's part for it, `size` its pixels across and down.
    pub fn whole(&self, room: Rect, size: Vec2) -> Rect {
        let zoom = self.zoom(room, size);
        Rect::from_min_size(room.center() - zoom * self.middle(size), zoom * size)
    }

    /// The place of the image, in pixels, that is at a place of the window.
    pub fn pixel(&self, room: Rect, size: Vec2, at: Pos2) -> Vec2 {
        (at - self.whole(room, size).min) / self.zoom(room, size)
    }

    /// All of it is seen.
    pub fn fit(&mut self) {
        self.chosen = None;
    }

    /// Enlarges by a factor; what is at `at` stays there.
    pub fn enlarge(&mut self, room: Rect, size: Vec2, at: Pos2, factor: f32) {
        let fixed = self.pixel(room, size, at);
        let zoom = (factor * self.zoom(room, size)).clamp(*ZOOMS.start(), *ZOOMS.end());
        self.hold(room, size, fixed, at, zoom);
    }

    /// A pixel takes so many points; what is in the middle stays there.
    pub fn enlarge_to(&mut self, size: Vec2, zoom: f32) {
        self.chosen = Some((zoom.clamp(*ZOOMS.start(), *ZOOMS.end()), self.middle(size)));
    }

    /// Moves the image by points of the window.
    pub fn pan(&mut self, room: Rect, size: Vec2, by: Vec2) {
        let at = room.center() + by;
        self.hold(room, size, self.middle(size), at, self.zoom(room, size));
    }

    /// A place of the image comes to be at a place of the window. The middle of the window stays on the image.
    fn hold(&mut self, room: Rect, size: Vec2, pixel: Vec2, at: Pos2, zoom: f32) {
        let middle = pixel + (room.center() - at) / zoom;
        self.chosen = Some((zoom, middle.clamp(Vec2::ZERO, size)));
    }
}

#[cfg(test)]
mod tests {
    use egui::{pos2, vec2};

    use super::*;

    const SIZE: Vec2 = vec2(200.0, 100.0);

    fn room() -> Rect {
        Rect::from_min_size(pos2(10.0, 20.0), vec2(400.0, 400.0))
    }

    #[test]
    fn all_of_it_is_seen_until_it_is_enlarged_about_the_pointer() {
        let mut place = Place::default();
        assert_eq!(place.whole(room(), SIZE), Rect::from_min_max(pos2(10.0, 120.0), pos2(410.0, 320.0)));
        let at = pos2(110.0, 170.0);
        assert_eq!(place.pixel(room(), SIZE, at), vec2(50.0, 25.0));
        place.enlarge(room(), SIZE, at, 4.0);
        assert_eq!((place.zoom(room(), SIZE), place.pixel(room(), SIZE, at)), (8.0, vec2(50.0, 25.0)));
        place.pan(room(), SIZE, vec2(16.0, -8.0));
        assert_eq!(place.pixel(room(), SIZE, at), vec2(48.0, 26.0));
        place.enlarge_to(SIZE, 1.0);
        assert_eq!(place.zoom(room(), SIZE), 1.0);
        place.fit();
        assert_eq!(place, Place::default());
    }

    #[test]
    fn it_is_never_lost() {
        let mut place = Place::default();
        for i in 0..100 {
            place.enlarge(room(), SIZE, pos2(13.0 + i as f32, 40.0), if i < 50 { 3.0 } else { 0.1 });
            place.pan(room(), SIZE, vec2(900.0, -700.0));
            assert!(place.whole(room(), SIZE).expand(0.01).contains(room().center()), "{place:?}");
        }
        assert_eq!(place.zoom(room(), SIZE), *ZOOMS.start());
    }
}
