//! `lanternfish compare`: compares two images by error measures, an error map and an exit code.

mod input;
mod measure;
mod renderings;
mod report;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use clap::{Args, builder::TypedValueParser};
use lanternfish_metrics::{FlipToneMapper, PIXELS_PER_DEGREE};

use self::{input::Inputs, measure::Measures};
use crate::{
    choices::names,
    ending::has_ending,
    error::{self, CliError},
    output::{check_writable, print, same_file, write_text},
    parse,
};

pub const HELP: &str = "\
Examples:
  How far an image is from its reference:
    lanternfish compare fast.exr reference.exr
  An error map:
    lanternfish compare fast.exr reference.exr --map error.png --side-by-side both.png --exposure 1
  A test whether two noisy images differ by more than noise, with their layers `variance`:
    lanternfish compare a.exr b.exr
  In a script, to stop at a regression:
    lanternfish compare new.png old.png --max-flip 0.02 --json - > differences.json

EXR files hold linear radiance: errors of values, HDR-FLIP, and display measures at --exposure.
PNG files hold display colours: display measures only.
A pixel that is not finite in either image is counted and excluded from both.

Exits with 0; 1 if a limit is exceeded; 2 if the images cannot be compared.";

#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The image under test, .exr or .png.
    #[arg(value_name = "A")]
    pub image: PathBuf,
    /// The reference, of the same kind and size.
    #[arg(value_name = "B")]
    pub reference: PathBuf,

    /// Exposure in stops of EXR files for display measures and --side-by-side, 0 without it. Values are clamped to 0..1
    /// and sRGB-encoded. HDR-FLIP chooses its own exposures.
    #[arg(long, value_name = "EV", value_parser = parse::exposure, allow_hyphen_values = true)]
    pub exposure: Option<f32>,
    /// Tone mapper of HDR-FLIP: aces without it.
    #[arg(long, value_name = "NAME", value_parser = tone_mapper())]
    pub flip_tone_map: Option<FlipToneMapper>,
    /// Pixels per degree of visual angle, for FLIP. Higher: a larger viewing distance, and smaller errors.
    #[arg(long, value_name = "X", value_parser = pixels_per_degree, default_value_t = PIXELS_PER_DEGREE)]
    #[arg(allow_hyphen_values = true)]
    pub pixels_per_degree: f32,

    /// Variances of A's pixel values, for the z-test: an EXR file, its layer `variance` or its image. Without it: the
    /// layer `variance` of A, if present.
    #[arg(long, value_name = "FILE.exr")]
    pub variance_a: Option<PathBuf>,
    /// Variances of B's pixel values; as --variance-a. If only one of A and B has variances, the other counts as exact.
    #[arg(long, value_name = "FILE.exr")]
    pub variance_b: Option<PathBuf>,

    /// Writes all measures as JSON; - is standard output, instead of the table.
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,
    /// Writes FLIP's error map: black is zero, through purple and orange, pale yellow the largest; cyan pixels are
    /// excluded. HDR-FLIP for EXR files.
    #[arg(long, value_name = "FILE.png")]
    pub map: Option<PathBuf>,
    /// Writes A, B and the error map side by side.
    #[arg(long, value_name = "FILE.png")]
    pub side_by_side: Option<PathBuf>,

    /// Exits with 1 if FLIP's mean (HDR-FLIP for EXR files) is above X, or if A has a pixel that is not finite.
    #[arg(long, value_name = "X", value_parser = limit, allow_hyphen_values = true)]
    pub max_flip: Option<f64>,
    /// Exits with 1 if relMSE is above X, or if A has a pixel that is not finite. EXR only.
    #[arg(long, value_name = "X", value_parser = limit, allow_hyphen_values = true)]
    pub max_relmse: Option<f64>,
}

/// The tone mappers in the reference implementation of HDR-FLIP.
fn tone_mapper() -> impl TypedValueParser<Value = FlipToneMapper> {
    let known = [
        ("aces", "The fit of the ACES curve by Narkowicz: the authors' default"),
        ("hable", "The film curve by Hable"),
        ("reinhard", "x / (1 + x) of the luminance"),
    ];
    let of_name = |name: String| FlipToneMapper::ALL.into_iter().find(|mapper| mapper.name() == name);
    names(known).map(move |name| of_name(name).expect("clap lets only known names through"))
}

fn limit(text: &str) -> Result<f64, String> {
    let limit: Option<f64> = text.trim().parse().ok();
    limit.filter(|x| *x >= 0.0 && x.is_finite()).ok_or_else(|| "expected a number, 0 or more, e.g. 0.05".to_owned())
}

fn pixels_per_degree(text: &str) -> Result<f32, String> {
    let number: Option<f32> = text.trim().parse().ok();
    number.filter(|x| (2.0..=1000.0).contains(x)).ok_or_else(|| {
        "expected 2 to 1000 pixels a degree, e.g. 67 for a 4K display 0.7 m wide, seen from 0.7 m".to_owned()
    })
}

/// Compares two images, prints the result and the limits that it exceeds, and returns the exit code.
pub fn run(args: &CompareArgs) -> Result<u8, CliError> {
    check(args)?;
    let inputs = Inputs::read(args)?;
    let measures = Measures::take(args, &inputs)?;
    if let Some(path) = &args.map {
        renderings::write_map(path, &inputs.pair, &measures.map)?;
    }
    if let Some(path) = &args.side_by_side {
        renderings::write_side_by_side(path, &measures.shown, &measures.map)?;
    }
    match args.json.as_deref() {
        Some(path) if path == Path::new("-") => print(&report::json_of(args, &inputs, &measures)),
        Some(path) => write_text(path, &report::json_of(args, &inputs, &measures))
            .and_then(|()| print(&report::to_tables(args, &inputs, &measures))),
        None => print(&report::to_tables(args, &inputs, &measures)),
    }?;
    let exceeded = exceeded(args, &inputs, &measures);
    exceeded.iter().for_each(|limits| error::say(limits));
    Ok(u8::from(exceeded.is_some()))
}

/// Checks everything that can be checked before a file is read.
fn check(args: &CompareArgs) -> Result<(), CliError> {
    let json = args.json.as_ref().filter(|path| *path != Path::new("-"));
    let outputs = [("--map", args.map.as_ref()), ("--side-by-side", args.side_by_side.as_ref()), ("--json", json)];
    let outputs: Vec<(&str, &PathBuf)> = outputs.into_iter().filter_map(|(flag, path)| Some((flag, path?))).collect();
    let inputs = [Some(&args.image), Some(&args.reference), args.variance_a.as_ref(), args.variance_b.as_ref()];
    for (i, (flag, path)) in outputs.iter().enumerate() {
        if *flag != "--json" && !has_ending(path, "png") {
            let what = format_args!("{flag} {}: unsupported output format", path.display());
            return Err(CliError::new(what, "end the name with .png"));
        }
        check_writable(path)?;
        let others = inputs.iter().flatten().copied().chain(outputs[..i].iter().map(|(_, other)| *other));
        if others.into_iter().any(|other| same_file(path, other)) {
            return Err(CliError::new(
                format_args!("{flag} {}: this file is named twice", path.display()),
                "choose another name: compared images are never overwritten",
            ));
        }
    }
    Ok(())
}

/// The error that lists every exceeded limit.
fn exceeded(args: &CompareArgs, inputs: &Inputs, measures: &Measures) -> Option<CliError> {
    let mut reasons = Vec::new();
    if let Some(limit) = args.max_flip.filter(|limit| measures.flip.mean > *limit) {
        reasons.push(format!("{} {:.6} is above --max-flip {limit}", measures.flip_name(), measures.flip.mean));
    }
    let relative_mse = measures.linear.map(|errors| errors.relative_mse);
    if let (Some(limit), Some(got)) = (args.max_relmse, relative_mse)
        && got > limit
    {
        reasons.push(format!("relMSE {got:.6e} is above --max-relmse {limit}"));
    }
    let [faults, _] = inputs.pair.faults();
    if (args.max_flip.is_some() || args.max_relmse.is_some()) && faults.not_finite > 0 {
        reasons.push(format!("pixels that are not finite exceed every limit ({faults})"));
    }
    if reasons.is_empty() {
        return None;
    }
    let hint = if args.map.is_some() || args.side_by_side.is_some() {
        "the error map shows where"
    } else {
        "--side-by-side FILE.png shows where"
    };
    Some(CliError::new(format_args!("{}: {}", args.image.display(), reasons.join("; ")), hint))
}
