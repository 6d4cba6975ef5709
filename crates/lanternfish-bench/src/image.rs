//! Images as they are written and compared.

use std::path::Path;

use lanternfish::{
    Picture,
    output::display,
    settings::{Exposure, ToneMap},
};
use lanternfish_cli::error::CliError;
use lanternfish_metrics::{ColorType, HdrFlip, MetricsError, PIXELS_PER_DEGREE, Pair, RgbImage, write_png};

/// What a display shows, without alpha.
pub fn rgb(picture: &Picture) -> Vec<u8> {
    picture.display.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()
}

/// Writes what a display shows as PNG.
pub fn write(path: &Path, picture: &Picture) -> Result<(), CliError> {
    Ok(write_png(path, picture.width, picture.height, ColorType::Rgb, &rgb(picture))?)
}

/// Linear radiance.
pub fn linear(picture: &Picture) -> Result<RgbImage, MetricsError> {
    let pixels = picture.radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    RgbImage::new(picture.width as usize, picture.height as usize, pixels)
}

/// What a display shows, 0..=1.
pub fn displayed(picture: &Picture) -> Result<RgbImage, MetricsError> {
    let pixels = picture.display.iter().map(|[r, g, b, _]| [*r, *g, *b].map(|value| f32::from(value) / 255.0));
    RgbImage::new(picture.width as usize, picture.height as usize, pixels.collect())
}

/// What a display shows of linear radiance: bytes, and the same as values of 0..=1.
pub fn shown(image: &RgbImage, exposure: Exposure, tone_map: ToneMap) -> (Vec<u8>, RgbImage) {
    let ev = exposure.of(image.pixels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]));
    let bytes = display::encoded(&image.pixels, ev, tone_map);
    let pixels = bytes.as_chunks::<3>().0.iter().map(|pixel| pixel.map(|v| f32::from(v) / 255.0)).collect();
    (bytes, RgbImage { pixels, ..*image })
}

/// Sum of all channels of all pixels.
pub fn energy(picture: &Picture) -> f64 {
    picture.radiance.iter().flat_map(|pixel| &pixel[..3]).map(|value| f64::from(*value)).sum()
}

/// The same of an image of the path tracer.
pub fn energy_of(image: &RgbImage) -> f64 {
    image.pixels.iter().flatten().map(|value| f64::from(*value)).sum()
}

/// Mean LDR-FLIP of what a display shows.
pub fn flip(picture: &Picture, reference: &Picture) -> Result<f64, MetricsError> {
    let pair = Pair::new(displayed(picture)?, displayed(reference)?)?;
    Ok(pair.mean_of(&pair.flip_ldr(PIXELS_PER_DEGREE)?))
}

/// Mean HDR-FLIP of radiance.
pub fn hdr_flip(pair: &Pair) -> Result<f64, MetricsError> {
    Ok(pair.mean_of(&pair.flip_hdr(&HdrFlip::default())?.map))
}

/// Pixels whose radiance differs in any bit.
pub fn differing(a: &Picture, b: &Picture) -> usize {
    let bits = |texel: &[f32; 4]| texel.map(f32::to_bits);
    a.radiance.iter().zip(&b.radiance).filter(|(a, b)| bits(a) != bits(b)).count()
}

/// An image of one pixel row, for tests.
#[cfg(test)]
pub fn picture(texels: Vec<[f32; 4]>, display: u8) -> Picture {
    Picture {
        width: texels.len() as u32,
        height: 1,
        display: vec![[display; 4]; texels.len()],
        exposure: None,
        radiance: texels,
        report: Default::default(),
    }
}

#[test]
fn every_bit_of_radiance_counts() {
    let a = picture(vec![[0.0; 4], [1.0; 4], [f32::NAN; 4]], 0);
    let b = picture(vec![[-0.0, 0.0, 0.0, 0.0], [1.0; 4], [f32::NAN; 4]], 0);
    assert_eq!((differing(&a, &a), differing(&a, &b)), (0, 1));
}
