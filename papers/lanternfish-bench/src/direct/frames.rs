//! Errors of one frame, and of the mean of many.

use lanternfish::{
    RenderedImage,
    techniques::{LightSamples, SampledLights},
};
use lanternfish_cli::{
    error::CliError,
    images::{energy, energy_of, hdr_flip, linear},
    times::{counter, frame_ms},
};
use lanternfish_metrics::{Pair, RgbImage};

use super::{DirectLight, cases};
use crate::{
    case::{Case, changed},
    table::Row,
};

pub const TEXT: &str = "Against a ray to every light (*all*). *FLIP*: HDR-FLIP of one frame; *p99*: 99th percentile of |error| over the mean of the \
                        image. *Mean*: the mean of the frames of a view at rest: its energy over that of *all*, and its FLIP; *z*: the difference of \
                        the whole image in standard errors, the largest of the channels (frames are better distributed than independent ones, so it is \
                        small).";

impl DirectLight {
    /// A row for each technique.
    pub fn one_frame(&self) -> Result<Vec<Row>, CliError> {
        let mut reference = None;
        let cases = cases(&self.view.look, |_| true);
        self.bench.rows("frame", cases, |case| case.name.clone(), |case| self.one_frame_of(case, &mut reference))
    }

    fn one_frame_of(
        &self,
        Case { name, settings, .. }: &Case,
        reference: &mut Option<RenderedImage>,
    ) -> Result<Row, CliError> {
        let mut stage = self.bench.stage(&self.view.scene, settings)?;
        let image = stage.frame(&self.view)?;
        let best = self.bench.timed_on(&mut stage, &self.view)?.image;
        self.bench.write(name, &image)?;
        let all = reference.get_or_insert_with(|| image.clone());
        let pair = Pair::new(linear(&image)?, linear(all)?)?;
        let row = Row::default()
            .text("technique", "", name)
            .fixed("rays", "rays", 2, counter(&image.report, "shadows/rays") as f64 / self.view.pixels())
            .fixed("frame_ms", "frame, ms", 1, frame_ms(&best.report.passes))
            .fixed("flip", "FLIP", 4, hdr_flip(&pair)?)
            .fixed("p99", "p99", 3, percentile(&pair, 0.99));
        let is_averaged =
            settings.direct.get::<SampledLights>().is_some_and(|lights| lights.light_samples == LightSamples::Four);
        if !is_averaged {
            return Ok(row.text("mean_energy", "mean: energy", "").text("mean_flip", "FLIP", "").text("z", "z", ""));
        }
        // With a history, frames of a view at rest go on in their random numbers, and their pixels stay in place.
        stage.renderer = self.bench.renderer(&changed(settings, "history on"))?;
        let mut sums = vec![[[0.0f64; 2]; 3]; image.radiance.len()];
        for _ in 0..self.frames {
            let frame = stage.frame(&self.view)?;
            for (sum, pixel) in sums.iter_mut().zip(&frame.radiance) {
                for (sum, value) in sum.iter_mut().zip(pixel) {
                    sum[0] += f64::from(*value);
                    sum[1] += f64::from(*value) * f64::from(*value);
                }
            }
        }
        let count = f64::from(self.frames);
        let of = |value: fn([f64; 2], f64) -> f64| {
            let pixels = sums.iter().map(|pixel| pixel.map(|sums| value(sums, count) as f32)).collect();
            RgbImage::new(image.width as usize, image.height as usize, pixels)
        };
        let mean = of(|[sum, _], count| sum / count)?;
        let variance = of(|[sum, squares], count| (squares / count - (sum / count).powi(2)).max(0.0) / (count - 1.0))?;
        let total = energy_of(&mean);
        let pair = Pair::new(mean, linear(all)?)?;
        let z = pair
            .z_test(Some(&variance), None)?
            .offset
            .into_iter()
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        Ok(row
            .fixed("mean_energy", "mean: energy", 4, total / energy(all))
            .fixed("mean_flip", "FLIP", 4, hdr_flip(&pair)?)
            .fixed("z", "z", 2, z))
    }
}

/// This percentile, 0..1, of a pixel's largest absolute error over the mean of the reference.
fn percentile(pair: &Pair, rank: f64) -> f64 {
    let reference = pair.reference();
    let mean = energy_of(reference) / (3 * reference.pixels.len()) as f64;
    let error =
        |(a, b): (&[f32; 3], &[f32; 3])| a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
    let mut errors: Vec<f64> = pair.image().pixels.iter().zip(&reference.pixels).map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors[((errors.len() - 1) as f64 * rank) as usize] / mean
}
