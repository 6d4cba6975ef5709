//! Conversions and comparisons of images.

use lanternfish::{
    RenderedImage,
    output::display,
    settings::{Exposure, ToneMap},
};
use lanternfish_metrics::{HdrFlip, MetricsError, PIXELS_PER_DEGREE, Pair, RgbImage};

/// Display colours without alpha, as RGB bytes.
pub fn rgb(rendering: &RenderedImage) -> Vec<u8> {
    rendering.display.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect()
}

/// Makes pixels black whose radiance is not finite; returns their number.
pub fn make_finite(rendering: &mut RenderedImage) -> usize {
    let wrong = rendering.radiance.iter_mut().filter(|pixel| pixel.iter().any(|value| !value.is_finite()));
    wrong.map(|pixel| *pixel = [0.0, 0.0, 0.0, 1.0]).count()
}

/// Linear radiance of an image.
pub fn linear(rendering: &RenderedImage) -> Result<RgbImage, MetricsError> {
    let pixels = rendering.radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    RgbImage::new(rendering.width as usize, rendering.height as usize, pixels)
}

/// Display colours, 0..=1.
pub fn displayed(rendering: &RenderedImage) -> Result<RgbImage, MetricsError> {
    let pixels = rendering.display.iter().map(|[r, g, b, _]| [*r, *g, *b].map(|value| f32::from(value) / 255.0));
    RgbImage::new(rendering.width as usize, rendering.height as usize, pixels.collect())
}

/// Display colours of linear radiance, as bytes and as values of 0..=1.
pub fn shown(image: &RgbImage, exposure: Exposure, tone_map: ToneMap) -> (Vec<u8>, RgbImage) {
    let ev = exposure.of(image.pixels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]));
    let bytes = display::encoded(&image.pixels, ev, tone_map);
    let pixels = bytes.as_chunks::<3>().0.iter().map(|pixel| pixel.map(|v| f32::from(v) / 255.0)).collect();
    (bytes, RgbImage { pixels, ..*image })
}

/// Sum of all channels of all pixels.
pub fn energy(rendering: &RenderedImage) -> f64 {
    rendering.radiance.iter().flat_map(|pixel| &pixel[..3]).map(|value| f64::from(*value)).sum()
}

/// Sum of all channels of all pixels of a path-traced image.
pub fn energy_of(image: &RgbImage) -> f64 {
    image.pixels.iter().flatten().map(|value| f64::from(*value)).sum()
}

/// Mean LDR-FLIP of the display colours.
pub fn flip(rendering: &RenderedImage, reference: &RenderedImage) -> Result<f64, MetricsError> {
    let pair = Pair::new(displayed(rendering)?, displayed(reference)?)?;
    Ok(pair.mean_of(&pair.flip_ldr(PIXELS_PER_DEGREE)?))
}

/// Mean HDR-FLIP of the radiance.
pub fn hdr_flip(pair: &Pair) -> Result<f64, MetricsError> {
    Ok(pair.mean_of(&pair.flip_hdr(&HdrFlip::default())?.map))
}

/// Number of pixels whose radiance is not bit-identical.
pub fn differing(a: &RenderedImage, b: &RenderedImage) -> usize {
    let bits = |texel: &[f32; 4]| texel.map(f32::to_bits);
    a.radiance.iter().zip(&b.radiance).filter(|(a, b)| bits(a) != bits(b)).count()
}

#[test]
fn every_bit_of_radiance_counts() {
    let image = |texels: Vec<[f32; 4]>| RenderedImage {
        width: texels.len() as u32,
        height: 1,
        display: Vec::new(),
        exposure: None,
        radiance: texels,
        report: Default::default(),
    };
    let a = image(vec![[0.0; 4], [1.0; 4], [f32::NAN; 4]]);
    let b = image(vec![[-0.0, 0.0, 0.0, 0.0], [1.0; 4], [f32::NAN; 4]]);
    assert_eq!((differing(&a, &a), differing(&a, &b)), (0, 1));
}

#[cfg(test)]
#[test]
fn pixels_that_are_no_numbers_are_counted_and_black() {
    let pixels = [[0.5, 1.0, 2.0, 1.0], [f32::NAN, 0.0, 0.0, 1.0], [0.0, f32::INFINITY, 0.0, 0.0]];
    let report = lanternfish::Report::default();
    let (radiance, display) = (pixels.to_vec(), Vec::new());
    let mut image = RenderedImage { width: 3, height: 1, radiance, display, exposure: None, report };
    assert_eq!((make_finite(&mut image), image.radiance[0]), (2, pixels[0]));
    assert_eq!(image.radiance[1..], [[0.0, 0.0, 0.0, 1.0]; 2]);
}
