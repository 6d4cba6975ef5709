//! The comparison as a table.

use std::fmt::Write as _;

use lanternfish_metrics::{ImageErrors, RELATIVE_EPSILON, Spread, ZTest, ZVerdict};

use super::{
    CompareArgs,
    input::{Inputs, Kind},
    measure::Measures,
};
use crate::report::grouped;

/// Width of a column of values, characters.
const COLUMN: usize = 14;
/// Width of the names, characters.
const NAME: usize = 26;

/// Lines of a name and values in columns.
#[derive(Default)]
struct Table(String);

impl Table {
    fn line(&mut self, name: &str, figures: &[&str]) {
        let columns: String = figures.iter().map(|figure| format!("{figure:>COLUMN$}")).collect();
        // Writing to a String cannot fail.
        writeln!(self.0, "{}", format!("{name:<NAME$}{columns}").trim_end()).expect("String");
    }

    fn text(&mut self, name: &str, text: &str) {
        writeln!(self.0, "{}", format!("{name:<NAME$}{text}").trim_end()).expect("String");
    }

    fn gap(&mut self) {
        self.0.push('\n');
    }

    fn spread(&mut self, name: &str, Spread { mean, percentile_95, max }: Spread) {
        self.line(name, &[&figure(mean), &figure(percentile_95), &figure(max)]);
    }
}

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

pub fn to_table(args: &CompareArgs, inputs: &Inputs, measures: &Measures) -> String {
    let mut table = Table::default();
    let pair = &inputs.pair;
    let (width, height) = (pair.image().width, pair.image().height);
    let [faults, reference_faults] = pair.faults();
    table.text("A, under test", &args.image.display().to_string());
    table.text("B, reference", &args.reference.display().to_string());
    table.text("size", &format!("{width}x{height}"));
    let left_out = pair.is_compared().len() - pair.compared_count();
    let counts = format!("{} compared, {} left out", grouped(pair.compared_count() as u64), grouped(left_out as u64));
    table.text("pixels", &counts);
    table.text("odd pixels of A", &faults.to_string());
    table.text("odd pixels of B", &reference_faults.to_string());
    table.gap();

    if let Some(errors) = &measures.linear {
        table.line("linear radiance", &["mean", "95 % within", "largest"]);
        errors_lines(&mut table, errors, true);
        table.spread(measures.flip_name(), measures.flip);
        if let Some((tone_mapper, exposures)) = measures.hdr {
            let (start, stop) = (exposures.start, exposures.stop);
            let text = format!("{} of {start:.2} to {stop:.2} stops, {}", exposures.count, tone_mapper.name());
            table.text("  exposures", &text);
        }
        table.gap();
    }
    let display = match inputs.kind {
        Kind::Linear => format!("on a display, {} EV", args.exposure.unwrap_or(0.0)),
        Kind::Display => "on a display".to_owned(),
    };
    table.line(&display, &["mean", "95 % within", "largest"]);
    errors_lines(&mut table, &measures.display, false);
    table.line("PSNR, dB", &[&figure(measures.psnr)]);
    let ssim = measures.ssim.map_or_else(|| "none: it needs windows of 11x11 pixels".to_owned(), figure);
    table.line("SSIM", &[&ssim]);
    table.spread("LDR-FLIP", measures.flip_ldr);
    table.gap();

    if let Some(test) = &measures.z_test {
        z_lines(&mut table, inputs, test);
        table.gap();
    }
    table.0.push_str(&conclusion(inputs, measures));
    table.0.push('\n');
    table.0
}

fn errors_lines(table: &mut Table, errors: &ImageErrors, is_linear: bool) {
    table.spread("absolute error", errors.absolute);
    if is_linear {
        table.spread(&format!("relative error (ε {RELATIVE_EPSILON})"), errors.relative);
        table.line(&format!("relMSE (ε {RELATIVE_EPSILON})"), &[&figure(errors.relative_mse)]);
    }
    table.line("MSE", &[&figure(errors.mse)]);
    if is_linear {
        table.line("energy, A over B", &[&figure(errors.energy_ratio)]);
    }
}

fn z_lines(table: &mut Table, inputs: &Inputs, test: &ZTest) {
    let percent = |fraction: f64| format!("{:.3} %", 100.0 * fraction);
    table.line("z-test, (A - B) / σ", &["value", "of noise"]);
    for (name, variance) in ["variances of A", "variances of B"].into_iter().zip(&inputs.variances) {
        table.text(name, variance.as_ref().map_or("none: taken to be exact", |variance| &variance.source));
    }
    table.line("values tested", &[&grouped(test.value_count as u64)]);
    if test.value_count > 0 {
        table.line("mean z", &[&figure(test.mean_z), "0"]);
        table.line("mean z²", &[&figure(test.mean_z_squared), "1"]);
        table.line("beyond 2 σ", &[&percent(test.share_beyond_2), "4.550 %"]);
        table.line("beyond 3 σ", &[&percent(test.share_beyond_3), "0.270 %"]);
        table.line("", &["red", "green", "blue"]);
        for (name, deviates) in [("offset of the sum, σ", test.offset), ("spread of tiles, σ", test.spread)] {
            let [red, green, blue] = deviates.map(|d| if d.is_nan() { "none".to_owned() } else { format!("{d:.2}") });
            table.line(name, &[&red, &green, &blue]);
        }
        table.line("p value", &[&figure(test.p_value())]);
    }
    for (name, count) in [
        ("no variance, equal", test.certain_equal),
        ("no variance, different", test.certain_different),
        ("invalid variance, pixels", test.invalid_variance),
    ] {
        if count > 0 {
            table.line(name, &[&grouped(count as u64)]);
        }
    }
}

/// The conclusion in one sentence.
pub fn conclusion(inputs: &Inputs, measures: &Measures) -> String {
    if measures.is_equal() {
        return match inputs.pair.is_compared().len() - inputs.pair.compared_count() {
            0 => "A and B are equal, value by value.".to_owned(),
            count => format!("A and B are equal, value by value, but for the {count} pixels that were excluded."),
        };
    }
    let mut line = match &measures.linear {
        Some(errors) => format!(
            "A has {} times the energy of B; relMSE {}, {} {}.",
            figure(errors.energy_ratio),
            figure(errors.relative_mse),
            measures.flip_name(),
            figure(measures.flip.mean)
        ),
        None => format!("{} {}, PSNR {} dB.", measures.flip_name(), figure(measures.flip.mean), figure(measures.psnr)),
    };
    if let Some(test) = &measures.z_test {
        let p = figure(test.p_value());
        let verdict = match test.verdict() {
            ZVerdict::Noise => format!("Noise explains the difference (p = {p})."),
            ZVerdict::Offset => format!("Noise does not explain the difference in brightness (p = {p})."),
            ZVerdict::Spread => format!(
                "Noise does not explain the difference from region to region, or the variances are too small (p = {p})."
            ),
            ZVerdict::TooAlike => {
                format!(
                    "They are more alike than their noise: the variances are too large, or they share samples (p = {p})."
                )
            }
            ZVerdict::Untested => "No value has a variance: nothing was tested.".to_owned(),
        };
        write!(line, " {verdict}").expect("String");
        if test.certain_different > 0 {
            let count = grouped(test.certain_different as u64);
            write!(line, " {count} values without variance differ: no noise explains those.").expect("String");
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::figure;

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
}
