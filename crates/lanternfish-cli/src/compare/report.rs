//! The comparison as tables and as JSON.

use lanternfish_metrics::{PixelFaults, RELATIVE_EPSILON, Spread, ZTest, ZVerdict};
use serde_json::{Value, json};

use super::{
    CompareArgs,
    input::{Inputs, Kind, Variance},
    measure::Measures,
};
use crate::table::{DASH, Row, decimal, grouped, to_json, to_text};

/// Formats a value with at most six significant digits, short values without an exponent.
fn figure(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&value.abs()) {
        let digits = (5 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
        format!("{value:.digits$}")
    } else if value.is_finite() {
        format!("{value:.4e}")
    } else if value.is_nan() {
        "none".to_owned()
    } else {
        value.to_string()
    }
}

/// Headings of spreads, after their first.
const SPREAD: [&str; 3] = ["mean", "95 % within", "largest"];

/// Rows of a name and figures under these headings.
struct Table<'h>(&'h str, [&'h str; 3], Vec<Row>);

impl Table<'_> {
    fn add(&mut self, name: &str, figures: &[String]) {
        let figures = figures.iter().map(String::as_str).chain(std::iter::repeat(""));
        let row = Row::default().text("", self.0, name);
        self.2.push(self.1.iter().zip(figures).fold(row, |row, (heading, figure)| row.shown(heading, figure)));
    }

    fn spread(&mut self, name: &str, Spread { mean, percentile_95, max }: Spread) {
        self.add(name, &[mean, percentile_95, max].map(figure));
    }
}

pub fn to_tables(args: &CompareArgs, inputs: &Inputs, measures: &Measures) -> String {
    let (pair, names) = (&inputs.pair, ["A", "B"]);
    let count = |count: usize| grouped(count as u64);
    let left_out = pair.is_compared().len() - pair.compared_count();
    let mut texts = vec![
        ("A, under test".to_owned(), args.image.display().to_string()),
        ("B, reference".to_owned(), args.reference.display().to_string()),
        ("size".to_owned(), format!("{}x{}", pair.image().width, pair.image().height)),
        ("pixels".to_owned(), format!("{} compared, {} left out", count(pair.compared_count()), count(left_out))),
    ];
    let faults = names.into_iter().zip(pair.faults());
    texts.extend(faults.map(|(name, faults)| (format!("odd pixels of {name}"), faults.to_string())));
    if let Some((tone_mapper, exposures)) = measures.hdr {
        let (start, stop) = (exposures.start, exposures.stop);
        let said = format!("{} of {start:.2} to {stop:.2} stops, {}", exposures.count, tone_mapper.name());
        texts.push(("exposures of HDR-FLIP".to_owned(), said));
    }
    if measures.z_test.is_some() {
        let source = |of: &Option<Variance>| {
            of.as_ref().map_or_else(|| "none: taken to be exact".to_owned(), |of| of.source.clone())
        };
        let sources = names.into_iter().zip(inputs.variances.iter().map(source));
        texts.extend(sources.map(|(name, source)| (format!("variances of {name}"), source)));
    }
    let texts = texts.iter().map(|(name, text)| Row::default().text("", "", name).text("", "", text));

    let mut tables = vec![texts.collect()];
    if let Some(errors) = &measures.linear {
        let mut table = Table("linear radiance", SPREAD, Vec::new());
        table.spread("absolute error", errors.absolute);
        table.spread(&format!("relative error (ε {RELATIVE_EPSILON})"), errors.relative);
        table.add(&format!("relMSE (ε {RELATIVE_EPSILON})"), &[figure(errors.relative_mse)]);
        table.add("MSE", &[figure(errors.mse)]);
        table.add("energy, A over B", &[figure(errors.energy_ratio)]);
        table.spread(measures.flip_name(), measures.flip);
        tables.push(table.2);
    }
    let exposure = args.exposure.unwrap_or(0.0);
    let display = format!("on a display, {exposure} EV");
    let display = if inputs.kind == Kind::Linear { display.as_str() } else { "on a display" };
    let mut table = Table(display, SPREAD, Vec::new());
    table.spread("absolute error", measures.display.absolute);
    table.add("MSE", &[figure(measures.display.mse)]);
    table.add("PSNR, dB", &[figure(measures.psnr)]);
    match measures.ssim {
        Some(ssim) => table.add("SSIM", &[figure(ssim)]),
        None => table.add("SSIM, of windows of 11x11", &[DASH.to_owned()]),
    }
    table.spread("LDR-FLIP", measures.flip_ldr);
    tables.push(table.2);
    tables.extend(measures.z_test.iter().flat_map(z_tables));
    let tables: String = tables.iter().map(|rows: &Vec<Row>| to_text(rows) + "\n").collect();
    format!("{tables}{}\n", conclusion(inputs, measures))
}

fn z_tables(test: &ZTest) -> Vec<Vec<Row>> {
    let percent = |fraction: f64| format!("{:.3} %", 100.0 * fraction);
    let count = |count: usize| grouped(count as u64);
    let mut table = Table("z-test, (A - B) / σ", ["value", "of noise", ""], Vec::new());
    table.add("values tested", &[count(test.value_count)]);
    let counts = [
        ("no variance, equal", test.certain_equal),
        ("no variance, different", test.certain_different),
        ("invalid variance, pixels", test.invalid_variance),
    ];
    for (name, values) in counts.into_iter().filter(|(_, values)| *values > 0) {
        table.add(name, &[count(values)]);
    }
    if test.value_count == 0 {
        return vec![table.2];
    }
    table.add("mean z", &[figure(test.mean_z), "0".to_owned()]);
    table.add("mean z²", &[figure(test.mean_z_squared), "1".to_owned()]);
    table.add("beyond 2 σ", &[percent(test.share_beyond_2), "4.550 %".to_owned()]);
    table.add("beyond 3 σ", &[percent(test.share_beyond_3), "0.270 %".to_owned()]);
    table.add("p value", &[figure(test.p_value())]);
    let mut channels = Table("by channel", ["red", "green", "blue"], Vec::new());
    for (name, deviates) in [("offset of the sum, σ", test.offset), ("spread of tiles, σ", test.spread)] {
        channels.add(name, &deviates.map(|d| if d.is_nan() { "none".to_owned() } else { format!("{d:.2}") }));
    }
    vec![table.2, channels.2]
}

/// For scripts, and for people.
fn verdict(test: &ZTest) -> (&'static str, String) {
    let p = figure(test.p_value());
    let (verdict, words) = match test.verdict() {
        ZVerdict::Noise => ("noise", "Noise explains the difference"),
        ZVerdict::Offset => ("offset", "Noise does not explain the difference in brightness"),
        ZVerdict::Spread => {
            ("spread", "Noise does not explain the difference from region to region, or the variances are too small")
        }
        ZVerdict::TooAlike => {
            ("too-alike", "They are more alike than their noise: the variances are too large, or they share samples")
        }
        ZVerdict::Untested => return ("untested", "No value has a variance: nothing was tested.".to_owned()),
    };
    (verdict, format!("{words} (p = {p})."))
}

/// The conclusion in one sentence.
fn conclusion(inputs: &Inputs, measures: &Measures) -> String {
    if measures.is_equal() {
        return match inputs.pair.is_compared().len() - inputs.pair.compared_count() {
            0 => "A and B are equal, value by value.".to_owned(),
            count => format!("A and B are equal, value by value, but for the {count} pixels that were excluded."),
        };
    }
    let flip = format!("{} {}", measures.flip_name(), figure(measures.flip.mean));
    let mut line = match &measures.linear {
        Some(errors) => {
            let [energy, relative_mse] = [errors.energy_ratio, errors.relative_mse].map(figure);
            format!("A has {energy} times the energy of B; relMSE {relative_mse}, {flip}.")
        }
        None => format!("{flip}, PSNR {} dB.", figure(measures.psnr)),
    };
    if let Some(test) = &measures.z_test {
        line = format!("{line} {}", verdict(test).1);
        if test.certain_different > 0 {
            let count = grouped(test.certain_different as u64);
            line += &format!(" {count} values without variance differ: no noise explains those.");
        }
    }
    line
}

fn spread(Spread { mean, percentile_95, max }: Spread) -> Value {
    json!({ "mean": mean, "percentile_95": percentile_95, "max": max })
}

/// Figures that are not finite (PSNR of equal images, energy over a black reference) are null.
pub fn json_of(args: &CompareArgs, inputs: &Inputs, measures: &Measures) -> String {
    let pair = &inputs.pair;
    let faults = |PixelFaults { nan, positive_infinity, negative_infinity, negative, not_finite }: PixelFaults| {
        json!({
            "nan": nan,
            "positive_infinity": positive_infinity,
            "negative_infinity": negative_infinity,
            "negative": negative,
            "not_finite": not_finite,
        })
    };
    let linear = measures.linear.zip(measures.hdr).map(|(errors, (tone_mapper, exposures))| {
        json!({
            "mse": errors.mse,
            "relative_mse": errors.relative_mse,
            // ε of the relative errors.
            "epsilon": RELATIVE_EPSILON,
            "absolute": spread(errors.absolute),
            "relative": spread(errors.relative),
            "energy_ratio": errors.energy_ratio,
            "hdr_flip": spread(measures.flip),
            "hdr_flip_tone_map": tone_mapper.name(),
            // First and last exposure, stops.
            "hdr_flip_exposures": [decimal(exposures.start), decimal(exposures.stop)],
            "hdr_flip_exposure_count": exposures.count,
        })
    });
    let display = json!({
        // Stops; null for PNG.
        "exposure": (inputs.kind == Kind::Linear).then(|| decimal(args.exposure.unwrap_or(0.0))),
        "pixels_per_degree": decimal(args.pixels_per_degree),
        "mse": measures.display.mse,
        "absolute": spread(measures.display.absolute),
        "psnr_db": measures.psnr,
        "ssim": measures.ssim,
        "ldr_flip": spread(measures.flip_ldr),
    });
    let source = |i: usize| inputs.variances[i].as_ref().map(|variance| &variance.source);
    let z_test = measures.z_test.map(|test| {
        json!({
            "variance_a": source(0),
            "variance_b": source(1),
            "values": test.value_count,
            "mean_z": test.mean_z,
            "mean_z_squared": test.mean_z_squared,
            "share_beyond_2": test.share_beyond_2,
            "share_beyond_3": test.share_beyond_3,
            "certain_equal": test.certain_equal,
            "certain_different": test.certain_different,
            "invalid_variance": test.invalid_variance,
            "offset": test.offset,
            "spread": test.spread,
            "p_value": test.p_value(),
            "verdict": verdict(&test).0,
        })
    });
    let [image, reference] = [&args.image, &args.reference].map(|path| path.display().to_string());
    let report = Row::default()
        .data("version", env!("CARGO_PKG_VERSION"))
        .data("image", image)
        .data("reference", reference)
        .data("width", pair.image().width)
        .data("height", pair.image().height)
        .data("is_equal", measures.is_equal())
        .data("pixels_compared", pair.compared_count())
        .data("pixels_left_out", pair.is_compared().len() - pair.compared_count())
        .data("faults", faults(pair.faults()[0]))
        .data("reference_faults", faults(pair.faults()[1]))
        .data("linear", linear)
        .data("display", display)
        .data("z_test", z_test);
    to_json(&report.data("conclusion", conclusion(inputs, measures)))
}

#[cfg(test)]
#[test]
fn figures_are_short() {
    for (value, text) in [
        (0.0, "0"),
        (0.131_647_4, "0.131647"),
        (1.0, "1.00000"),
        (-12.345_678, "-12.3457"),
        (123_456.7, "123457"),
        (0.000_012_345_67, "1.2346e-5"),
        (f64::INFINITY, "inf"),
        (f64::NAN, "none"),
    ] {
        assert_eq!(figure(value), text);
    }
}
