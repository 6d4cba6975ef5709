//! How far a picture is from others.

use lanternfish::Picture;
use lanternfish_metrics::{MetricsError, PIXELS_PER_DEGREE, Pair, RgbImage};
use serde::Serialize;

/// How far a picture is from others of the same view.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Sum of the picture's radiance over that of the same picture with the same rays through the BVH.
    pub energy_ratio: f64,
    /// The same ratio for indirect light alone, which is what a picture has beyond one without indirect light.
    pub indirect_energy_ratio: f64,
    /// Mean LDR-FLIP of what a display shows, against the picture with the same rays through the BVH: the error due to deep images.
    pub flip: f64,
    /// Mean LDR-FLIP against the mean of many frames through the BVH, without filter: noise, blur and jagged edges count as well.
    pub converged_flip: f64,
}

/// What a picture is compared with.
#[derive(Clone, Copy, Debug)]
pub struct Yardsticks<'a> {
    /// The same picture with the same rays through the BVH.
    pub bvh: &'a Picture,
    /// Sum of the radiance of the same picture without indirect light.
    pub direct_energy: f64,
    /// The mean of many frames through the BVH, without filter.
    pub converged: &'a Picture,
}

impl Errors {
    pub fn of(picture: &Picture, yardsticks: &Yardsticks<'_>) -> Result<Self, MetricsError> {
        let Yardsticks { bvh, direct_energy, converged } = yardsticks;
        let (found, expected) = (energy(picture), energy(bvh));
        Ok(Self {
            energy_ratio: found / expected,
            indirect_energy_ratio: (found - direct_energy) / (expected - direct_energy),
            flip: flip(picture, bvh)?,
            converged_flip: flip(picture, converged)?,
        })
    }
}

/// Sum of all channels of all pixels.
pub fn energy(picture: &Picture) -> f64 {
    picture.radiance.iter().flat_map(|pixel| &pixel[..3]).map(|value| f64::from(*value)).sum()
}

/// Mean LDR-FLIP of what a display shows.
pub fn flip(picture: &Picture, reference: &Picture) -> Result<f64, MetricsError> {
    let pair = Pair::new(shown(picture)?, shown(reference)?)?;
    Ok(pair.mean_of(&pair.flip_ldr(PIXELS_PER_DEGREE)?))
}

/// What a display shows, 0..=1.
fn shown(picture: &Picture) -> Result<RgbImage, MetricsError> {
    let pixels = picture.display.iter().map(|[r, g, b, _]| [*r, *g, *b].map(|value| f32::from(value) / 255.0));
    RgbImage::new(picture.width as usize, picture.height as usize, pixels.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(radiance: f32) -> Picture {
        let (width, height) = (8, 8);
        let shown = (255.0 * radiance) as u8;
        Picture {
            width,
            height,
            radiance: vec![[radiance, radiance, radiance, 1.0]; 64],
            display: vec![[shown, shown, shown, 255]; 64],
            exposure: None,
            report: Default::default(),
        }
    }

    #[test]
    fn a_picture_is_itself_and_no_other_is() {
        let (bvh, converged) = (picture(0.5), picture(0.4));
        let direct_energy = 0.5 * energy(&bvh);
        let yardsticks = Yardsticks { bvh: &bvh, direct_energy, converged: &converged };
        let same = Errors::of(&bvh, &yardsticks).unwrap();
        assert_eq!((same.energy_ratio, same.indirect_energy_ratio, same.flip), (1.0, 1.0, 0.0));
        assert!(same.converged_flip > 0.0);
        // A tenth too bright, all of it indirect.
        let brighter = Errors::of(&picture(0.55), &yardsticks).unwrap();
        assert!((brighter.energy_ratio - 1.1).abs() < 1e-6 && (brighter.indirect_energy_ratio - 1.2).abs() < 1e-6);
        assert!(brighter.flip > 0.0 && brighter.converged_flip > same.converged_flip);
        assert!(Errors::of(&Picture { width: 4, height: 16, ..picture(0.5) }, &yardsticks).is_err());
    }
}
