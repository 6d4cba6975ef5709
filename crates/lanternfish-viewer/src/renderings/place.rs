//! Zoom and pan of an image in its window. The module uses no window.

use egui::{Pos2, Rect, Vec2};

/// Smallest and largest zoom, points per pixel.
const ZOOMS: std::ops::RangeInclusive<f32> = 0.02..=256.0;

/// Zoom and pan, independent of the window's size.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Zoom in points per pixel, and the image position at the viewport's centre, pixels. `None` fits the image to the viewport.
    chosen: Option<(f32, Vec2)>,
}

impl Place {
    /// The zoom, points per pixel. `viewport` is in points, `size` in pixels.
    pub fn zoom(&self, viewport: Rect, size: Vec2) -> f32 {
        self.chosen
            .map_or_else(|| (viewport.size() / size).min_elem().clamp(*ZOOMS.start(), *ZOOMS.end()), |(zoom, _)| zoom)
    }

    fn middle(&self, size: Vec2) -> Vec2 {
        self.chosen.map_or(size / 2.0, |(_, middle)| middle)
    }

    /// The rectangle of the complete image, points.
    pub fn image_rect(&self, viewport: Rect, size: Vec2) -> Rect {
        let zoom = self.zoom(viewport, size);
        Rect::from_min_size(viewport.center() - zoom * self.middle(size), zoom * size)
    }

    /// The image position, pixels, at a window position, points.
    pub fn pixel(&self, viewport: Rect, size: Vec2, at: Pos2) -> Vec2 {
        (at - self.image_rect(viewport, size).min) / self.zoom(viewport, size)
    }

    /// Fits the image to the viewport.
    pub fn fit(&mut self) {
        self.chosen = None;
    }

    /// Zooms by a factor around the window position `at`.
    pub fn enlarge(&mut self, viewport: Rect, size: Vec2, at: Pos2, factor: f32) {
        let fixed = self.pixel(viewport, size, at);
        let zoom = (factor * self.zoom(viewport, size)).clamp(*ZOOMS.start(), *ZOOMS.end());
        self.hold(viewport, size, fixed, at, zoom);
    }

    /// Sets the zoom, points per pixel, around the viewport's centre.
    pub fn enlarge_to(&mut self, size: Vec2, zoom: f32) {
        self.chosen = Some((zoom.clamp(*ZOOMS.start(), *ZOOMS.end()), self.middle(size)));
    }

    /// Moves the image by a distance, points.
    pub fn pan(&mut self, viewport: Rect, size: Vec2, by: Vec2) {
        let at = viewport.center() + by;
        self.hold(viewport, size, self.middle(size), at, self.zoom(viewport, size));
    }

    /// Sets the zoom, and moves the image position `pixel` to the window position `at`. The viewport's centre stays on the image.
    fn hold(&mut self, viewport: Rect, size: Vec2, pixel: Vec2, at: Pos2, zoom: f32) {
        let middle = pixel + (viewport.center() - at) / zoom;
        self.chosen = Some((zoom, middle.clamp(Vec2::ZERO, size)));
    }
}

#[cfg(test)]
mod tests {
    use egui::{pos2, vec2};

    use super::*;

    const SIZE: Vec2 = vec2(200.0, 100.0);

    fn viewport() -> Rect {
        Rect::from_min_size(pos2(10.0, 20.0), vec2(400.0, 400.0))
    }

    #[test]
    fn the_image_fits_until_it_is_zoomed_around_the_pointer() {
        let mut place = Place::default();
        assert_eq!(place.image_rect(viewport(), SIZE), Rect::from_min_max(pos2(10.0, 120.0), pos2(410.0, 320.0)));
        let at = pos2(110.0, 170.0);
        assert_eq!(place.pixel(viewport(), SIZE, at), vec2(50.0, 25.0));
        place.enlarge(viewport(), SIZE, at, 4.0);
        assert_eq!((place.zoom(viewport(), SIZE), place.pixel(viewport(), SIZE, at)), (8.0, vec2(50.0, 25.0)));
        place.pan(viewport(), SIZE, vec2(16.0, -8.0));
        assert_eq!(place.pixel(viewport(), SIZE, at), vec2(48.0, 26.0));
        place.enlarge_to(SIZE, 1.0);
        assert_eq!(place.zoom(viewport(), SIZE), 1.0);
        place.fit();
        assert_eq!(place, Place::default());
    }

    #[test]
    fn the_viewport_centre_stays_on_the_image() {
        let mut place = Place::default();
        for i in 0..100 {
            place.enlarge(viewport(), SIZE, pos2(13.0 + i as f32, 40.0), if i < 50 { 3.0 } else { 0.1 });
            place.pan(viewport(), SIZE, vec2(900.0, -700.0));
            assert!(place.image_rect(viewport(), SIZE).expand(0.01).contains(viewport().center()), "{place:?}");
        }
        assert_eq!(place.zoom(viewport(), SIZE), *ZOOMS.start());
    }
}
