//! The comparison as JSON.

use lanternfish_metrics::{PixelFaults, RELATIVE_EPSILON, Spread, ZVerdict};
use serde::Serialize;

use super::{
    CompareArgs,
    input::{Inputs, Kind},
    measure::Measures,
    table::conclusion,
};

/// Figures that are not finite (PSNR of equal images, energy over a black reference) are null.
#[derive(Serialize)]
struct Json<'r> {
    /// Lanternfish's version.
    version: &'static str,
    image: String,
    reference: String,
    width: usize,
    height: usize,
    is_equal: bool,
    pixels_compared: usize,
    pixels_left_out: usize,
    faults: Faults,
    reference_faults: Faults,
    linear: Option<LinearErrors<'r>>,
    display: DisplayErrors,
    z_test: Option<ZTestFigures<'r>>,
    conclusion: String,
}

#[derive(Serialize)]
struct Faults {
    nan: usize,
    positive_infinity: usize,
    negative_infinity: usize,
    negative: usize,
    not_finite: usize,
}

impl From<PixelFaults> for Faults {
    fn from(faults: PixelFaults) -> Self {
        let PixelFaults { nan, positive_infinity, negative_infinity, negative, not_finite } = faults;
        Self { nan, positive_infinity, negative_infinity, negative, not_finite }
    }
}

#[derive(Serialize)]
struct Figures {
    mean: f64,
    percentile_95: f64,
    max: f64,
}

impl From<Spread> for Figures {
    fn from(Spread { mean, percentile_95, max }: Spread) -> Self {
        Self { mean, percentile_95, max }
    }
}

#[derive(Serialize)]
struct LinearErrors<'r> {
    mse: f64,
    relative_mse: f64,
    /// ε of the relative errors.
    epsilon: f64,
    absolute: Figures,
    relative: Figures,
    energy_ratio: f64,
    hdr_flip: Figures,
    hdr_flip_tone_map: &'r str,
    /// First and last exposure, stops.
    hdr_flip_exposures: [f32; 2],
    hdr_flip_exposure_count: u32,
}

#[derive(Serialize)]
struct DisplayErrors {
    /// Exposure, stops; `None` for PNG.
    exposure: Option<f32>,
    pixels_per_degree: f32,
    mse: f64,
    absolute: Figures,
    psnr_db: f64,
    ssim: Option<f64>,
    ldr_flip: Figures,
}

#[derive(Serialize)]
struct ZTestFigures<'r> {
    variance_a: Option<&'r str>,
    variance_b: Option<&'r str>,
    values: usize,
    mean_z: f64,
    mean_z_squared: f64,
    share_beyond_2: f64,
    share_beyond_3: f64,
    certain_equal: usize,
    certain_different: usize,
    invalid_variance: usize,
    offset: [f64; 3],
    spread: [f64; 3],
    p_value: f64,
    verdict: &'static str,
}

pub fn to_json(args: &CompareArgs, inputs: &Inputs, measures: &Measures) -> String {
    let pair = &inputs.pair;
    let [faults, reference_faults] = pair.faults().map(Faults::from);
    let [variance_a, variance_b] = inputs.variances.each_ref().map(|v| v.as_ref().map(|v| v.source.as_str()));
    let report = Json {
        version: env!("CARGO_PKG_VERSION"),
        image: args.image.display().to_string(),
        reference: args.reference.display().to_string(),
        width: pair.image().width,
        height: pair.image().height,
        is_equal: measures.is_equal(),
        pixels_compared: pair.compared_count(),
        pixels_left_out: pair.is_compared().len() - pair.compared_count(),
        faults,
        reference_faults,
        linear: measures.linear.zip(measures.hdr).map(|(errors, (tone_mapper, exposures))| LinearErrors {
            mse: errors.mse,
            relative_mse: errors.relative_mse,
            epsilon: RELATIVE_EPSILON,
            absolute: errors.absolute.into(),
            relative: errors.relative.into(),
            energy_ratio: errors.energy_ratio,
            hdr_flip: measures.flip.into(),
            hdr_flip_tone_map: tone_mapper.name(),
            hdr_flip_exposures: [exposures.start, exposures.stop],
            hdr_flip_exposure_count: exposures.count,
        }),
        display: DisplayErrors {
            exposure: (inputs.kind == Kind::Linear).then(|| args.exposure.unwrap_or(0.0)),
            pixels_per_degree: args.pixels_per_degree,
            mse: measures.display.mse,
            absolute: measures.display.absolute.into(),
            psnr_db: measures.psnr,
            ssim: measures.ssim,
            ldr_flip: measures.flip_ldr.into(),
        },
        z_test: measures.z_test.map(|test| ZTestFigures {
            variance_a,
            variance_b,
            values: test.value_count,
            mean_z: test.mean_z,
            mean_z_squared: test.mean_z_squared,
            share_beyond_2: test.share_beyond_2,
            share_beyond_3: test.share_beyond_3,
            certain_equal: test.certain_equal,
            certain_different: test.certain_different,
            invalid_variance: test.invalid_variance,
            offset: test.offset,
            spread: test.spread,
            p_value: test.p_value(),
            verdict: match test.verdict() {
                ZVerdict::Noise => "noise",
                ZVerdict::Offset => "offset",
                ZVerdict::Spread => "spread",
                ZVerdict::TooAlike => "too-alike",
                ZVerdict::Untested => "untested",
            },
        }),
        conclusion: conclusion(inputs, measures),
    };
    let mut text = serde_json::to_string_pretty(&report).expect("plain numbers and strings");
    text.push('\n');
    text
}
