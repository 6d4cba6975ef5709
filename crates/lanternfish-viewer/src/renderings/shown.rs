//! Display values of image files.

use glam::UVec2;
use lanternfish::{output::display, settings::ToneMap};

use super::ImageOfFile;

/// The display value of a pixel that is not finite: cyan.
const NOT_FINITE: [u8; 4] = [0, 255, 255, 255];

/// Exposure and tone mapping of radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Exposure, EV.
    pub ev: f32,
    /// Tone-mapping curve.
    pub tone_map: ToneMap,
}

impl Look {
    /// No exposure and no tone mapping.
    pub const PLAIN: Self = Self { ev: 0.0, tone_map: ToneMap::None };
}

impl ImageOfFile {
    /// Width and height, pixels.
    pub fn size(&self) -> UVec2 {
        UVec2::new(self.image.width as u32, self.image.height as u32)
    }

    /// Display values: RGBA, rows from the top. Pixels that are not finite are cyan.
    pub fn bytes(&self, look: Look) -> Vec<[u8; 4]> {
        let pixels = &self.image.pixels;
        let encoded = match self.is_radiance {
            true => display::encoded(pixels, look.ev, look.tone_map),
            false => display::raw(pixels),
        };
        let shown = |(rgb, pixel): (&[u8; 3], &[f32; 3])| match pixel.iter().all(|value| value.is_finite()) {
            true => [rgb[0], rgb[1], rgb[2], 255],
            false => NOT_FINITE,
        };
        encoded.as_chunks::<3>().0.iter().zip(pixels).map(shown).collect()
    }

    /// The value of a pixel; `None` outside the image.
    pub fn value(&self, [x, y]: [i64; 2]) -> Option<[f32; 3]> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < self.image.width && y < self.image.height).then(|| self.image.pixels[y * self.image.width + x])
    }
}
