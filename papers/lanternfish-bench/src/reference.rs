//! IndirectErrors of images against a path-traced reference, whose direct light is known.

use lanternfish::RenderedImage;
use lanternfish_cli::{
    error::CliError,
    images::{energy, energy_of, hdr_flip, linear},
};
use lanternfish_metrics::{MetricsError, Pair, RgbImage};

use crate::table::Row;

/// A path-traced image.
pub struct Reference {
    pub image: RgbImage,
    /// Energy of its indirect light alone.
    indirect: f64,
}

/// IndirectErrors of an image against a reference.
#[derive(Clone, Copy, Debug)]
pub struct IndirectErrors {
    /// Energy of indirect light alone, as a ratio to that of the reference.
    pub energy: f64,
    /// Mean HDR-FLIP of the complete image.
    pub flip: f64,
}

impl IndirectErrors {
    /// The errors as figures of a row; the energy has this key.
    pub fn row(&self, energy: &'static str) -> Row {
        Row::default().fixed(energy, "energy", 3, self.energy).fixed("flip", "FLIP", 4, self.flip)
    }
}

impl Reference {
    /// A reference, of which `direct` is the energy without indirect light. Fails without indirect light.
    pub fn new(image: RgbImage, direct: f64, hint: &str) -> Result<Self, CliError> {
        let indirect = energy_of(&image) - direct;
        if indirect > 0.0 {
            Ok(Self { image, indirect })
        } else {
            Err(CliError::new("no indirect light arrives", hint))
        }
    }

    /// IndirectErrors of an image. `direct`: the renderer's energy without indirect light.
    pub fn errors(&self, image: &RenderedImage, direct: f64) -> Result<IndirectErrors, MetricsError> {
        Ok(IndirectErrors { energy: (energy(image) - direct) / self.indirect, flip: flip(image, &self.image)? })
    }

    /// Deviation of the energy of indirect light, as a ratio, from that of all light.
    pub fn noise(&self, noise: f64) -> f64 {
        noise * energy_of(&self.image) / self.indirect
    }
}

/// Mean HDR-FLIP of an image against linear radiance.
pub fn flip(image: &RenderedImage, reference: &RgbImage) -> Result<f64, MetricsError> {
    hdr_flip(&Pair::new(linear(image)?, reference.clone())?)
}

#[test]
fn lost_light_is_reported() {
    use crate::testing::rendering;
    // Direct light of 1, indirect light of 0.5 in each of three channels of 64 pixels.
    let image = RgbImage::new(64, 1, vec![[1.5; 3]; 64]).unwrap();
    assert!(Reference::new(image.clone(), 288.0, "").is_err());
    let reference = Reference::new(image, 192.0, "").unwrap();
    let of = |indirect: f32| {
        let pixel = 1.0 + indirect;
        reference.errors(&rendering(vec![[pixel, pixel, pixel, 1.0]; 64], 0), 192.0).unwrap()
    };
    let [exact, dark] = [0.5, 0.4].map(of);
    assert_eq!((exact.energy, exact.flip), (1.0, 0.0));
    assert!((dark.energy - 0.8).abs() < 1e-6 && dark.flip > 0.001, "{dark:?}");
}
