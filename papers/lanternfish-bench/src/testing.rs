//! Images for tests.

use lanternfish::RenderedImage;

/// An image with one row of pixels, for tests.
pub fn rendering(texels: Vec<[f32; 4]>, display: u8) -> RenderedImage {
    RenderedImage {
        width: texels.len() as u32,
        height: 1,
        display: vec![[display; 4]; texels.len()],
        exposure: None,
        radiance: texels,
        report: Default::default(),
    }
}
