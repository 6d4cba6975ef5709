//! The parts of an image with diffuse and glossy indirect light, as Nießner adds them [Niessner2010, fig. 5, fig. 1], and his filter.

use std::time::Instant;

use lanternfish::RenderedImage;
use lanternfish_cli::{
    error::CliError,
    images::{energy_of, hdr_flip, linear},
    times::{frame_ms, ms_of},
};
use lanternfish_metrics::{Pair, RgbImage};
use lanternfish_papers::ACROSS_TEXELS;

use super::{
    cases::{Brdf, ImageSet, RayCase},
    gaussian::{RADIUS, filtered},
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

    /// Diffuse light without a filter, with his, which does not stop at edges, and with ours of the same width and as usual [Niessner2010, §5,
    /// §7]. `many`: the mean of many frames through the BVH.
    pub fn filters(&self, set: ImageSet, built: &[Row], many: &RenderedImage) -> Result<Vec<Row>, CliError> {
        let (structure, many) = (sized(set.settings(), built)?, linear(many)?);
        let case = RayCase { images: Some((set, ACROSS_TEXELS)), ..RayCase::plain(Brdf::Diffuse) };
        let settings = |filter_radius| {
            RayCase { filter_radius, ..case }.settings(&self.view.look, Some(structure.fragments_a_texel))
        };
        let direct = linear(&self.frame(Brdf::Diffuse, &changed(&settings(0), "indirect none"))?)?;
        let row = |name: &str, image: &RgbImage, ms: f64| {
            self.bench.write_linear(&format!("filter, {name}"), image, &self.view.look)?;
            let energy = (energy_of(image) - energy_of(&direct)) / (energy_of(&many) - energy_of(&direct));
            Ok(Row::default()
                .text("filter", "filter", name)
                .fixed("filter_ms", "ms", 1, ms)
                .fixed("indirect_energy_ratio", "energy of indirect", 3, energy)
                .fixed("many_flip", "FLIP to many frames", 4, hdr_flip(&Pair::new(image.clone(), many.clone())?)?))
        };
        let ours = |radius: u32| {
            let frame = self.fastest(self.scene(Brdf::Diffuse), &settings(radius))?;
            Ok::<_, CliError>((linear(&frame)?, ms_of(&frame.report.passes, "indirect/filter")))
        };
        let (noisy, _) = ours(0)?;
        let started = Instant::now();
        let light = difference(&noisy, &direct);
        let pixels = filtered(&light.pixels, light.width, RADIUS as usize);
        let his = sum(&RgbImage { pixels, ..light }, &direct);
        let ms = 1e3 * started.elapsed().as_secs_f64();
        let ((narrow, narrow_ms), (usual, usual_ms)) = (ours(RADIUS)?, ours(case.filter_radius)?);
        let rows: [Result<Row, CliError>; 4] = [
            row("none", &noisy, 0.0),
            row("his Gaussian, 11 x 11", &his, ms),
            row("ours, 11 x 11", &narrow, narrow_ms),
            row("ours, as usual", &usual, usual_ms),
        ];
        rows.into_iter().collect()
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
    joined(image, less, |a, b| a - b)
}

fn sum(image: &RgbImage, more: &RgbImage) -> RgbImage {
    joined(image, more, |a, b| a + b)
}

fn joined(image: &RgbImage, other: &RgbImage, of: impl Fn(f32, f32) -> f32) -> RgbImage {
    let pixels = image.pixels.iter().zip(&other.pixels);
    RgbImage { pixels: pixels.map(|(a, b)| std::array::from_fn(|i| of(a[i], b[i]))).collect(), ..*image }
}

#[test]
fn parts_add_up() {
    let image = |value: f32| RgbImage { width: 2, height: 1, pixels: vec![[value, 2.0 * value, 0.0]; 2] };
    assert_eq!(difference(&image(3.0), &image(1.0)), image(2.0));
    assert_eq!(sum(&image(2.0), &image(1.0)), image(3.0));
}
