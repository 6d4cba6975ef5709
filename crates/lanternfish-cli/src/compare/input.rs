//! The input of a comparison: two images of one kind and size, and their variances.

use std::path::{Path, PathBuf};

use lanternfish_metrics::{MetricsError, Pair, RgbImage, exr_layers, read_exr, read_exr_layer, read_jpeg, read_png};
use lanternfish_scene::memory::Budget;

use super::CompareArgs;
use crate::{
    ending::has_ending,
    error::{CliError, memory_hint},
};

/// The layer of an EXR file that holds the variances of its pixel values.
pub const VARIANCE: &str = "variance";

/// Peak memory of the measures, bytes per pixel: FLIP's maps of both images.
const BYTES_PER_PIXEL: u64 = 100;

/// The meaning of the pixel values of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Linear radiance: EXR.
    Linear,
    /// Display colours: PNG, JPEG.
    Display,
}

/// All input: images A and B, and their variances.
pub struct Inputs {
    pub kind: Kind,
    pub pair: Pair,
    /// Variances of the pixel values of A and B; `None` for an image without variances.
    pub variances: [Option<Variance>; 2],
}

/// Variances of an image's pixel values, and their source: file and layer.
pub struct Variance {
    pub source: String,
    pub image: RgbImage,
}

impl Inputs {
    pub fn read(args: &CompareArgs) -> Result<Self, CliError> {
        let (kind, reference_kind) = (kind_of(&args.image)?, kind_of(&args.reference)?);
        if kind != reference_kind {
            let (a, b) = (args.image.display(), args.reference.display());
            return Err(CliError::new(
                format_args!("{a} and {b}: linear radiance (EXR) and display colours (PNG, JPEG) cannot be compared"),
                "render both as .exr, or both as .png",
            ));
        }
        if kind == Kind::Display {
            refuse_for_png(args)?;
        }
        let image = read(&args.image, kind)?;
        let reference = read(&args.reference, kind)?;
        Budget::of_process()
            .check(BYTES_PER_PIXEL * image.pixels.len() as u64, || "comparing the images needs".to_owned())
            .map_err(|need| CliError::new(&need, memory_hint(&need)))?;
        let variances = match kind {
            Kind::Linear => [
                Variance::read(&args.image, args.variance_a.as_ref(), &image)?,
                Variance::read(&args.reference, args.variance_b.as_ref(), &reference)?,
            ],
            Kind::Display => [None, None],
        };
        Ok(Self { kind, pair: Pair::new(image, reference).map_err(failed)?, variances })
    }
}

/// Refuses flags that do not apply to display colours.
fn refuse_for_png(args: &CompareArgs) -> Result<(), CliError> {
    let given = [
        ("--exposure", args.exposure.is_some()),
        ("--flip-tone-map", args.flip_tone_map.is_some()),
        ("--variance-a", args.variance_a.is_some()),
        ("--variance-b", args.variance_b.is_some()),
        ("--max-relmse", args.max_relmse.is_some()),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => Err(CliError::new(
            format_args!("{flag}: {} holds display colours, not linear radiance", args.image.display()),
            "compare .exr files, or leave the flag out",
        )),
        None => Ok(()),
    }
}

impl Variance {
    /// Reads an image's variances from the given file, else from the image's own layer. Returns `None` if there are none.
    fn read(rendering: &Path, named: Option<&PathBuf>, image: &RgbImage) -> Result<Option<Self>, CliError> {
        let path = named.map_or(rendering, PathBuf::as_path);
        if !has_ending(path, "exr") {
            return Err(CliError::new(
                format_args!("{}: variances are read from EXR files", path.display()),
                "name a file that ends with .exr",
            ));
        }
        let has_layer = exr_layers(path).map_err(failed)?.iter().any(|name| name == VARIANCE);
        let variance = match (has_layer, named) {
            (true, _) => Self {
                source: format!("{}, layer {VARIANCE}", path.display()),
                image: read_exr_layer(path, VARIANCE).map_err(failed)?,
            },
            (false, Some(_)) => Self { source: path.display().to_string(), image: read_exr(path).map_err(failed)? },
            (false, None) => return Ok(None),
        };
        let [size, expected] = [&variance.image, image].map(|image| format!("{}×{}", image.width, image.height));
        if size != expected {
            let what = format!("{}: variances of {size} pixels for an image of {expected}", path.display());
            return Err(CliError::new(what, "name the variances of this image"));
        }
        Ok(Some(variance))
    }
}

fn kind_of(path: &Path) -> Result<Kind, CliError> {
    if has_ending(path, "exr") {
        Ok(Kind::Linear)
    } else if ["png", "jpg", "jpeg"].iter().any(|ending| has_ending(path, ending)) {
        Ok(Kind::Display)
    } else {
        Err(CliError::new(
            format_args!("{}: unsupported format", path.display()),
            "compare two .exr files (linear radiance), or two .png or .jpg files (display colours)",
        ))
    }
}

fn read(path: &Path, kind: Kind) -> Result<RgbImage, CliError> {
    match kind {
        Kind::Linear => read_exr(path),
        Kind::Display if has_ending(path, "png") => read_png(path),
        Kind::Display => read_jpeg(path),
    }
    .map_err(failed)
}

/// Converts an error of reading or comparing, and adds a hint.
pub fn failed(error: MetricsError) -> CliError {
    let hint = match &error {
        MetricsError::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => "check the path",
        MetricsError::Io { .. } => "check that the file can be read",
        MetricsError::TooMuch { need, .. } => memory_hint(need),
        MetricsError::Invalid { .. } => "write the file again; `lanternfish render` writes both formats",
        MetricsError::MissingChannels { .. } => "write the image as R, G and B, or as Y",
        MetricsError::NothingFinite => "check the images: no finite pixel is left",
        // These messages contain their own hint.
        _ => "",
    };
    CliError::new(&error, hint)
}
