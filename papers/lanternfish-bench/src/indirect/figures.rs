//! The parts of an image with diffuse and glossy indirect light, as Nießner adds them [Niessner2010, fig. 5, fig. 1].

use lanternfish_cli::{error::CliError, images::linear, times::frame_ms};
use lanternfish_metrics::RgbImage;
use lanternfish_papers::ACROSS_TEXELS;

use super::{
    cases::{Brdf, ImageSet, RayCase},
    gaussian::RADIUS,
    measure::{RayBench, sized},
};
use crate::{case::changed, table::Row};

/// Diffuse rays of a pixel; glossy ones are 16 [Niessner2010, §7].
const DIFFUSE_RAYS: &str = "indirect-rays 8";

impl RayBench {
    /// Writes the parts of fig. 5, and gives the milliseconds of the frame with all of them; or why there are none.
    pub fn parts(&self, set: ImageSet, built: &[Row]) -> Result<f64, CliError> {
        let words = format!("Diffuse and glossy light, {}", set.in_words());
        self.bench.step("figures", &words, || self.write_parts(set, built))
    }

    fn write_parts(&self, set: ImageSet, built: &[Row]) -> Result<f64, CliError> {
        let structure = sized(set.settings(), built)?;
        let case =
            RayCase { images: Some((set, ACROSS_TEXELS)), filter_radius: RADIUS, ..RayCase::plain(Brdf::Glossy) };
        let settings = case.settings(&self.view.look, Some(structure.fragments_a_texel));
        let with = |changes: &str| changed(&settings, changes);
        let frame = |changes: &str| linear(&self.frame(Brdf::Glossy, &with(changes))?).map_err(CliError::from);
        let direct = frame("indirect none")?;
        let without_glossy = frame(&format!("{DIFFUSE_RAYS}, glossy-rays 0"))?;
        let all = with(&format!("{DIFFUSE_RAYS}, glossy-rays 16"));
        let all = self.fastest(self.scene(Brdf::Glossy), &all)?;
        let with_glossy = linear(&all)?;
        let write = |image: &RgbImage, name: &str| self.bench.write_linear(name, image, &self.view.look);
        write(&difference(&without_glossy, &direct), "parts-diffuse")?;
        write(&difference(&with_glossy, &without_glossy), "parts-glossy")?;
        write(&direct, "parts-direct")?;
        write(&with_glossy, "parts-all")?;
        Ok(frame_ms(&all.report.passes))
    }
}

/// What one image has beyond another.
fn difference(image: &RgbImage, less: &RgbImage) -> RgbImage {
    let pixels = image.pixels.iter().zip(&less.pixels);
    RgbImage { pixels: pixels.map(|(a, b)| std::array::from_fn(|channel| a[channel] - b[channel])).collect(), ..*image }
}

#[test]
fn parts_add_up() {
    let image = |value: f32| RgbImage { width: 2, height: 1, pixels: vec![[value, 2.0 * value, 0.0]; 2] };
    assert_eq!(difference(&image(3.0), &image(1.0)), image(2.0));
}
