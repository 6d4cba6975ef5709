//! HDR-ꟻLIP: the maximum of LDR-ꟻLIP over a range of exposures [Andersson2021, algorithm].

use super::{FlipMap, FlipToneMapper, Observer, PIXELS_PER_DEGREE, check_finite};
use crate::{MetricsError, RgbImage, compare::check_sizes, image::luminance};

/// Fraction of the display's white that the first exposure gives the reference's brightest pixel, and the last its median
/// [Andersson2021, exposures].
const SHOWN: f32 = 0.85;

/// Lower bound of the luminances that determine the exposures, as in the authors' tool: 2⁻²³.
const DARKEST: f32 = f32::EPSILON;

/// Maximum number of exposures: more than the range of a float has stops are of no use.
const MOST_EXPOSURES: u32 = 300;

/// The exposures at which two images are compared: `count` of them, evenly spaced from `start` to `stop`, stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// First and darkest exposure, stops: log₂ of the factor of radiance.
    pub start: f32,
    /// Last and brightest exposure, stops; at least `start`.
    pub stop: f32,
    /// Number of exposures, at least 1. A single exposure is `start`.
    pub count: u32,
}

impl Exposures {
    /// The exposures of a reference: the first shows its brightest pixel at 0.85 of white, the last its median. Their number is the
    /// number of stops between the two, rounded up, and at least 2 [Andersson2021, exposures].
    ///
    /// The median of an even number of pixels is the upper of the two in the middle. Luminances below 2⁻²³ count as
    /// 2⁻²³, so that most of a reference may be black. An entirely black reference is allowed too, which the authors' tool
    /// refuses. The reference must be finite; an empty one counts as black.
    pub fn of(reference: &RgbImage, tone_mapper: FlipToneMapper) -> Self {
        let mut luminances: Vec<f32> = reference.pixels.iter().map(|pixel| luminance(*pixel)).collect();
        let middle = luminances.len() / 2;
        let (median, brightest) = match luminances.len() {
            0 => (DARKEST, DARKEST),
            _ => {
                let median = *luminances.select_nth_unstable_by(middle, f32::total_cmp).1;
                (median, luminances.into_iter().fold(median, f32::max))
            }
        };
        let exposure = |luminance: f32| (tone_mapper.inverse(SHOWN) / luminance.max(DARKEST)).log2();
        let (start, stop) = (exposure(brightest), exposure(median));
        Self { start, stop, count: ((stop - start).ceil() as u32).max(2) }
    }

    /// Every exposure, stops.
    #[doc(hidden)]
    pub fn iter(self) -> impl Iterator<Item = f32> {
        let step = (self.stop - self.start) / self.count.saturating_sub(1).max(1) as f32;
        (0..self.count).map(move |i| self.start + i as f32 * step)
    }

    fn check(self) -> Result<Self, MetricsError> {
        let Self { start, stop, count } = self;
        let usable = (-126.0..=126.0).contains(&start) && (start..=126.0).contains(&stop);
        if usable && (1..=MOST_EXPOSURES).contains(&count) {
            Ok(self)
        } else {
            Err(MetricsError::Exposures { start, stop, count })
        }
    }
}

/// Settings of HDR-ꟻLIP: viewing distance, tone mapper and exposures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HdrFlip {
    /// Pixels per degree of visual angle, 2..=1000, as in [`flip_ldr`](crate::flip_ldr). Higher: a larger viewing distance.
    pub pixels_per_degree: f32,
    /// Tone mapper from exposed radiance to display values.
    pub tone_mapper: FlipToneMapper,
    /// Exposures to compare at. `None`: the reference's, [`Exposures::of`].
    pub exposures: Option<Exposures>,
}

impl Default for HdrFlip {
    fn default() -> Self {
        Self { pixels_per_degree: PIXELS_PER_DEGREE, tone_mapper: FlipToneMapper::default(), exposures: None }
    }
}

/// The perceived difference of every pixel at the exposure where it is largest.
#[derive(Clone, Debug, PartialEq)]
pub struct HdrFlipMap {
    /// The largest error of each pixel.
    pub map: FlipMap,
    /// The exposures that were compared.
    pub exposures: Exposures,
}

/// HDR-ꟻLIP of `test` against `reference`, both linear Rec. 709 [Andersson2021, algorithm].
///
/// The images are exposed, tone-mapped, clamped to 0..=1, and compared by [`flip_ldr`](crate::flip_ldr); the result is each
/// pixel's maximum error over all exposures. The measure is not symmetric: the reference determines the exposures.
/// Radiance below 0 counts as 0.
///
/// An error if sizes differ, if a value is not finite ([`Pair`](crate::Pair) leaves such pixels out), or if
/// `looks` is out of range. The cost is that of [`flip_ldr`](crate::flip_ldr) times the number of exposures.
pub fn flip_hdr(reference: &RgbImage, test: &RgbImage, looks: &HdrFlip) -> Result<HdrFlipMap, MetricsError> {
    check_sizes(test, reference)?;
    check_finite(reference)?;
    check_finite(test)?;
    let observer = Observer::new(looks.pixels_per_degree)?;
    let exposures = looks.exposures.unwrap_or_else(|| Exposures::of(reference, looks.tone_mapper)).check()?;
    let mut largest = vec![0.0f32; reference.pixels.len()];
    for exposure in exposures.iter() {
        let scale = exposure.exp2();
        let shown = |pixel: [f32; 3]| looks.tone_mapper.display(pixel.map(|v| (v * scale).clamp(0.0, f32::MAX)));
        let errors = observer.errors(reference, test, shown);
        largest.iter_mut().zip(errors).for_each(|(largest, error)| *largest = largest.max(error));
    }
    let map = FlipMap { width: reference.width, height: reference.height, errors: largest };
    Ok(HdrFlipMap { map, exposures })
}
