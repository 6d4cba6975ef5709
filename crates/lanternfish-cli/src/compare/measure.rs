//! All error measures of a comparison.

use lanternfish_metrics::{Exposures, FlipMap, FlipToneMapper, HdrFlip, ImageErrors, Pair, Spread, ZTest};

use super::{
    CompareArgs,
    input::{Inputs, Kind, failed},
};
use crate::error::CliError;

pub struct Measures {
    /// Errors of linear radiance; `None` for display colours.
    pub linear: Option<ImageErrors>,
    /// Errors of display colours.
    pub display: ImageErrors,
    /// Peak signal-to-noise ratio of display colours, dB; infinite if both images are equal.
    pub psnr: f64,
    /// Structural similarity of display colours; `None` if no complete window fits.
    pub ssim: Option<f64>,
    /// LDR-FLIP of display colours.
    pub flip_ldr: Spread,
    /// HDR-FLIP of linear radiance, else LDR-FLIP.
    pub flip: Spread,
    /// The error map that `flip` summarizes.
    pub map: FlipMap,
    /// Tone mapper and exposures of HDR-FLIP; `None` if `flip` is LDR-FLIP.
    pub hdr: Option<(FlipToneMapper, Exposures)>,
    pub z_test: Option<ZTest>,
    /// The two images in display colours.
    pub shown: Pair,
}

impl Measures {
    pub fn take(args: &CompareArgs, inputs: &Inputs) -> Result<Self, CliError> {
        let pair = &inputs.pair;
        let is_linear = inputs.kind == Kind::Linear;
        let shown = if is_linear { pair.shown(args.exposure.unwrap_or(0.0)) } else { pair.clone() };
        let ldr = shown.flip_ldr(args.pixels_per_degree).map_err(failed)?;
        let flip_ldr = shown.spread_of(&ldr);
        let (map, hdr) = if is_linear {
            let tone_mapper = args.flip_tone_map.unwrap_or_default();
            let looks = HdrFlip { pixels_per_degree: args.pixels_per_degree, tone_mapper, exposures: None };
            let hdr = pair.flip_hdr(&looks).map_err(failed)?;
            (hdr.map, Some((tone_mapper, hdr.exposures)))
        } else {
            (ldr, None)
        };
        let [a, b] = inputs.variances.each_ref().map(|variance| variance.as_ref().map(|variance| &variance.image));
        let z_test = if a.is_some() || b.is_some() { Some(pair.z_test(a, b).map_err(failed)?) } else { None };
        Ok(Self {
            linear: is_linear.then(|| pair.errors()),
            display: shown.errors(),
            psnr: shown.psnr(),
            // Fails only for images smaller than a window, or if every window has a pixel that is not finite.
            ssim: shown.ssim().ok(),
            flip_ldr,
            flip: pair.spread_of(&map),
            map,
            hdr,
            z_test,
            shown,
        })
    }

    /// Name of the measure in `flip`.
    pub fn flip_name(&self) -> &'static str {
        if self.hdr.is_some() { "HDR-FLIP" } else { "LDR-FLIP" }
    }

    /// True if all compared values are equal.
    pub fn is_equal(&self) -> bool {
        self.linear.unwrap_or(self.display).absolute.max == 0.0
    }
}
