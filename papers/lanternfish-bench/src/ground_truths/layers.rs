//! The file of a ground truth: layers of the mean, its variance, and the mean of half of the samples.

use std::path::Path;

use lanternfish::settings::{Exposure, ToneMap};
use lanternfish_cli::{
    error::CliError,
    images::{energy_of, shown},
    parse::Size,
};
use lanternfish_metrics::{
    MetricsError, PIXELS_PER_DEGREE, RELATIVE_EPSILON, RgbImage, flip_ldr, read_exr_attributes, read_exr_layer,
    write_exr_layers,
};
use lanternfish_reference::{Film, Tracer};
use lanternfish_scene::Camera;

/// Names of the file's layers and attributes.
const VARIANCE: &str = "variance";
const FIRST_HALF: &str = "first_half";
const DROPPED: &str = "lanternfish.dropped";

/// Contents of a ground truth's file.
pub struct Layers {
    pub mean: RgbImage,
    /// Variance of each value of `mean`.
    variance: RgbImage,
    /// Mean of the first ⌊spp / 2⌋ samples.
    pub first_half: RgbImage,
    /// Number of samples that were not finite.
    pub dropped: u64,
}

impl Layers {
    pub fn trace(tracer: &Tracer<'_>, camera: &Camera, size: Size, spp: u64) -> Result<Self, CliError> {
        let (width, height) = (size.width as usize, size.height as usize);
        let mut film = Film::new([size.width, size.height])?;
        tracer.render(camera, &mut film, spp / 2);
        let first_half = RgbImage::new(width, height, film.mean())?;
        tracer.render(camera, &mut film, spp - spp / 2);
        Ok(Self {
            mean: RgbImage::new(width, height, film.mean())?,
            variance: RgbImage::new(width, height, film.variance())?,
            first_half,
            dropped: film.dropped(),
        })
    }

    pub fn read(path: &Path) -> Result<Self, MetricsError> {
        let dropped = read_exr_attributes(path)?.get(DROPPED).and_then(|text| text.parse().ok());
        Ok(Self {
            mean: read_exr_layer(path, "")?,
            variance: read_exr_layer(path, VARIANCE)?,
            first_half: read_exr_layer(path, FIRST_HALF)?,
            dropped: dropped
                .ok_or_else(|| MetricsError::Invalid { path: path.to_owned(), what: format!("no {DROPPED}") })?,
        })
    }

    pub fn write(&self, path: &Path) -> Result<(), MetricsError> {
        let layers = [("", &self.mean), (VARIANCE, &self.variance), (FIRST_HALF, &self.first_half)];
        write_exr_layers(path, &layers, &[(DROPPED, &self.dropped.to_string())])
    }

    pub fn is_of(&self, size: Size) -> bool {
        (self.mean.width, self.mean.height) == (size.width as usize, size.height as usize)
    }

    pub fn noise(&self, spp: u64) -> Result<f64, CliError> {
        let RgbImage { width, height, pixels } = &self.mean;
        Ok(Film::resume(*width, &vec![spp; *height], pixels, &self.variance.pixels)?.noise().relative)
    }

    /// Expected `ImageErrors::relative_mse` of an exact image against this one.
    pub fn relative_mse(&self) -> f64 {
        let values = self.mean.pixels.iter().flatten().zip(self.variance.pixels.iter().flatten());
        let errors =
            values.map(|(mean, variance)| f64::from(*variance) / (f64::from(*mean).powi(2) + RELATIVE_EPSILON));
        errors.sum::<f64>() / (3 * self.mean.pixels.len()) as f64
    }

    /// Standard deviation of the image's energy, as a fraction of the energy. Pixels are independent. The channels of a pixel come from the
    /// same paths, and are assumed to be fully correlated.
    pub fn energy_deviation(&self) -> f64 {
        let deviation = |pixel: &[f32; 3]| pixel.iter().map(|variance| f64::from(*variance).sqrt()).sum::<f64>();
        let variance: f64 = self.variance.pixels.iter().map(|pixel| deviation(pixel).powi(2)).sum();
        variance.sqrt() / energy_of(&self.mean)
    }

    /// Mean of the samples that are not in `first_half`.
    pub fn second_half(&self, spp: u64) -> RgbImage {
        let (all, first) = (spp as f32, (spp / 2) as f32);
        let rest = |(mean, half): (&[f32; 3], &[f32; 3])| {
            // Rounding may give slightly negative values.
            std::array::from_fn(|c| ((all * mean[c] - first * half[c]) / (all - first)).max(0.0))
        };
        let pixels = self.mean.pixels.iter().zip(&self.first_half.pixels).map(rest).collect();
        RgbImage { pixels, ..self.mean }
    }

    pub fn flip_of_halves(&self, second: &RgbImage, exposure: Exposure, tone_map: ToneMap) -> Result<f64, CliError> {
        let [a, b] = [&self.first_half, second].map(|half| shown(half, exposure, tone_map).1);
        Ok(f64::from(flip_ldr(&a, &b, PIXELS_PER_DEGREE)?.mean()))
    }
}
