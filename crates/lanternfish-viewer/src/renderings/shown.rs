//! Display values of images of files, and the difference of two.

use glam::UVec2;
use lanternfish::{output::display, settings::ToneMap};

use super::ImageOfFile;

/// What no image of light has: a pixel that is not a number.
const NOT_A_NUMBER: [u8; 4] = [0, 255, 255, 255];

/// How radiance is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Stops, EV.
    pub ev: f32,
    /// The curve.
    pub tone_map: ToneMap,
}

impl Look {
    /// As it is.
    pub const PLAIN: Self = Self { ev: 0.0, tone_map: ToneMap::None };
}

impl ImageOfFile {
    /// Pixels across and down.
    pub fn size(&self) -> UVec2 {
        UVec2::new(self.image.width as u32, self.image.height as u32)
    }

    /// As a display shows it: RGBA, rows from the top. What is not a number is cyan.
    pub fn bytes(&self, look: Look) -> Vec<[u8; 4]> {
        let pixels = &self.image.pixels;
        let encoded = match self.is_radiance {
            true => display::encoded(pixels, look.ev, look.tone_map),
            false => display::raw(pixels),
        };
        let shown = |(rgb, pixel): (&[u8; 3], &[f32; 3])| match pixel.iter().all(|value| value.is_finite()) {
            true => [rgb[0], rgb[1], rgb[2], 255],
            false => NOT_A_NUMBER,
        };
        encoded.as_chunks::<3>().0.iter().zip(pixels).map(shown).collect()
    }

    /// The value of a pixel; none outside of the image.
    pub fn value(&self, [x, y]: [i64; 2]) -> Option<[f32; 3]> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.image.width && y < self.image.height).then(|| self.image.pixels[y * self.image.width + x])
    }
}
