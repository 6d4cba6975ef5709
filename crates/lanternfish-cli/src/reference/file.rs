//! The image file of a ground truth: its contents, and how a run resumes from it.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use lanternfish::{
    output::display,
    settings::{Exposure, ToneMap},
};
use lanternfish_metrics::{
    ColorType, MetricsError, RgbImage, is_stream, read_exr_attributes, read_exr_layer, write_exr_layers, write_png,
};
use lanternfish_reference::{Film, settings::Integrator};

use super::sums;
use crate::{
    ending::has_ending,
    error::CliError,
    output::{check_writable, same_file},
    parse::{Size, Span},
};

/// Names of text attributes.
pub const SAMPLES: &str = "lanternfish.samples";
/// Samples per pixel of each row, if rows differ: `SAMPLESxROWS` for successive blocks of rows.
pub const ROW_SAMPLES: &str = "lanternfish.row-samples";
pub const SEED: &str = "lanternfish.seed";
pub const DROPPED: &str = "lanternfish.dropped";
pub const NOISE: &str = "lanternfish.noise";
pub const FINGERPRINT: &str = "lanternfish.fingerprint";

/// The samples of a part, `A-B`, counted from 1.
pub const PART: &str = "lanternfish.part";

/// Name of the layer that holds the variance.
const VARIANCE: &str = "variance";

/// The output files.
#[derive(Debug)]
pub struct Target {
    pub path: PathBuf,
    /// True for PNG, which holds the tone-mapped mean; false for EXR.
    is_png: bool,
    /// EXR file for the variance as a separate image.
    variance: Option<PathBuf>,
    /// True if written files can be replaced; false for a pipe.
    is_replaceable: bool,
}

/// The settings of the image, stored in the file.
#[derive(Debug)]
pub struct Making {
    /// [`super::fingerprint::of`] everything that affects the mean.
    pub fingerprint: String,
    pub seed: u64,
    /// The samples of a part, counted from 1. The file then holds the exact sums.
    pub part: Option<Span<u64>>,
    /// Further text attributes for people, by name.
    pub facts: Vec<(String, String)>,
}

/// The state that an earlier run left in the file.
#[derive(Debug)]
pub struct Before {
    pub film: Film,
    pub seed: u64,
    /// Samples that were not finite.
    pub dropped: u64,
}

impl Target {
    /// Chooses the output files. Refuses everything that can be refused without work.
    pub fn choose(path: PathBuf, variance: Option<PathBuf>, resume: bool) -> Result<Self, CliError> {
        let failed = |path: &Path, what: &str, hint: &str| CliError::new(format!("{}: {what}", path.display()), hint);
        let is_png = has_ending(&path, "png");
        if !is_png && !has_ending(&path, "exr") {
            let hint = "end the name with .exr (linear, with the variance) or .png (tone-mapped)";
            return Err(failed(&path, "unsupported output format", hint));
        }
        if is_png && resume {
            let what = "--resume needs the samples' sums, which PNG does not hold";
            return Err(failed(&path, what, "end the name with .exr, or leave --resume out"));
        }
        check_writable(&path)?;
        if let Some(variance) = &variance {
            if !has_ending(variance, "exr") {
                return Err(failed(variance, "--variance writes EXR only", "end the name with .exr"));
            }
            check_writable(variance)?;
            if same_file(variance, &path) {
                return Err(failed(variance, "both the image and --variance", "give them different names"));
            }
        }
        let is_replaceable = !std::iter::once(&path).chain(&variance).any(|path| is_stream(path));
        Ok(Self { path, is_png, variance, is_replaceable })
    }

    /// True if the image is tone-mapped.
    pub fn is_png(&self) -> bool {
        self.is_png
    }

    /// Memory that [`Self::write`] needs, bytes per pixel; `is_part`: with the exact sums.
    pub fn bytes_per_pixel(&self, is_part: bool) -> u64 {
        // 12 bytes for each layer as an image, 12 by channels, and at most 12 in the encoded file. A PNG file needs less than the mean's.
        let layers =
            1 + u64::from(!self.is_png || self.variance.is_some()) + if is_part { sums::LAYER_COUNT } else { 0 };
        36 * layers
    }

    /// True if intermediate images may be written. The reader of a pipe leaves after the first complete image.
    pub fn takes_checkpoints(&self) -> bool {
        self.is_replaceable
    }

    /// True if another run can resume from the file.
    pub fn is_resumable(&self) -> bool {
        !self.is_png && self.is_replaceable
    }

    /// The first of its files that is also one of `others`.
    pub fn overlap<'o>(&self, mut others: impl Iterator<Item = &'o Path>) -> Option<&'o Path> {
        let own = || std::iter::once(&self.path).chain(&self.variance);
        others.find(|other| own().any(|path| same_file(path, other)))
    }

    /// Writes the film to the files, each completely or not at all. `dropped` counts samples of the film and of earlier runs.
    pub fn write(&self, film: &Film, making: &Making, dropped: u64, look: &Look) -> Result<(), CliError> {
        let size = film.size();
        let image = |pixels| RgbImage::new(size[0] as usize, size[1] as usize, pixels);
        let mean = film.mean();
        let variance = if self.is_png && self.variance.is_none() { Vec::new() } else { film.variance() };

        let numbers = [
            (SAMPLES, film.samples().to_string()),
            (SEED, making.seed.to_string()),
            (DROPPED, dropped.to_string()),
            (NOISE, format!("{:.3e}", film.noise().relative)),
            (FINGERPRINT, making.fingerprint.clone()),
        ];
        let rows = (!film.is_even()).then(|| (ROW_SAMPLES, blocks_of(film.row_samples())));
        let part = making.part.map(|part| (PART, part.to_string()));
        let numbers = numbers.into_iter().chain(rows).chain(part).collect::<Vec<_>>();
        let facts = making.facts.iter().map(|(name, value)| (name.as_str(), value.as_str()));
        let attributes: Vec<(&str, &str)> =
            numbers.iter().map(|(n, value)| (*n, value.as_str())).chain(facts).collect();
        let shown = if let Some(path) = &self.variance {
            let variance = image(variance)?;
            write_exr_layers(path, &[("", &variance)], &attributes)?;
            variance.pixels
        } else {
            variance
        };
        if self.is_png {
            write_png(&self.path, size, ColorType::Rgb, &look.bytes(&mean))?;
        } else {
            let (mean, variance) = (image(mean)?, image(shown)?);
            let sums = if making.part.is_some() { sums::layers(film)? } else { Vec::new() };
            let sums = sums.iter().map(|(name, image)| (name.as_str(), image));
            let layers: Vec<_> = [("", &mean), (VARIANCE, &variance)].into_iter().chain(sums).collect();
            write_exr_layers(&self.path, &layers, &attributes)?;
        }
        Ok(())
    }

    /// The file's state to resume from; `None` if there is no file. Returns an error if its settings differ from `making`, or
    /// if its seed differs from the requested `seed`.
    pub fn before(&self, making: &Making, size: Size, seed: Option<u64>) -> Result<Option<Before>, CliError> {
        if !self.path.exists() {
            return Ok(None);
        }
        let failed = |what: &str, hint: &str| CliError::new(format!("{}: {what}", self.path.display()), hint);
        let unreadable = |error: MetricsError| CliError::new(error, "leave --resume out to replace it");
        let attributes = read_exr_attributes(&self.path).map_err(unreadable)?;
        let number = |name: &str| attributes.get(name).and_then(|text| text.parse::<u64>().ok());
        let height = size.height as usize;
        let rows = match attributes.get(ROW_SAMPLES) {
            Some(blocks) => rows_of(blocks, height),
            None => number(SAMPLES).map(|samples| vec![samples; height]),
        };
        let (Some(rows), Some(its_seed), Some(fingerprint)) = (rows, number(SEED), attributes.get(FINGERPRINT)) else {
            let hint = "choose another name, or leave --resume out to replace it";
            return Err(failed("not an image of `lanternfish reference`, so there is nothing to resume from", hint));
        };
        if *fingerprint != making.fingerprint {
            let why = differences(&attributes, &making.facts, "here");
            let hint = "repeat the command that made it, choose another name, or leave --resume out to start again";
            return Err(failed(&format!("cannot resume from it: {why}"), hint));
        }
        if let Some(seed) = seed.filter(|seed| *seed != its_seed) {
            let what = format!("its seed is {its_seed}, not {seed}");
            return Err(failed(&what, "leave --seed out: --resume uses the file's"));
        }
        let (its_part, part) = (attributes.get(PART), making.part.map(|part| part.to_string()));
        if its_part != part.as_ref() {
            let of = |part: Option<&String>| part.map_or("all samples".to_owned(), |part| format!("samples {part}"));
            let what = format!("it is of {}, not of {}", of(its_part), of(part.as_ref()));
            return Err(failed(&what, "repeat the command that made it, or choose another name"));
        }
        let dropped = number(DROPPED).unwrap_or(0);
        if let Some(part) = making.part {
            let sums = sums::read(&self.path).map_err(unreadable)?;
            let film = Film::resume_part(size.width as usize, &rows, part.first - 1, sums.into_iter())?;
            return Ok(Some(Before { film, seed: its_seed, dropped }));
        }
        let mean = read_exr_layer(&self.path, "").map_err(unreadable)?;
        let mut variance = read_exr_layer(&self.path, VARIANCE).map_err(unreadable)?;
        // Pixels of fewer than two samples have an infinite variance, which `Film::resume` does not use.
        variance.pixels.iter_mut().flatten().filter(|value| !value.is_finite()).for_each(|value| *value = 0.0);
        let film = Film::resume(size.width as usize, &rows, &mean.pixels, &variance.pixels)?;
        Ok(Some(Before { film, seed: its_seed, dropped }))
    }
}

/// The differences between a file's settings and `facts`, which belong to `here`.
pub fn differences(attributes: &BTreeMap<String, String>, facts: &[(String, String)], here: &str) -> String {
    let other = |(name, value): &(String, String)| {
        let its = attributes.get(name).map_or("nothing", String::as_str);
        let short = name.rsplit('.').next().unwrap_or(name);
        (its != value).then(|| format!("{short} is {its} there and {value} {here}"))
    };
    let others: Vec<_> = facts.iter().filter_map(other).collect();
    match others.is_empty() {
        true => "the scene's content differs".to_owned(),
        false => others.join(", "),
    }
}

/// Formats the samples per pixel of each row: `5x512 4x568` is 512 rows of 5 samples, then 568 rows of 4.
fn blocks_of(rows: &[u64]) -> String {
    let blocks = rows.chunk_by(|a, b| a == b).map(|block| format!("{}x{}", block[0], block.len()));
    blocks.collect::<Vec<_>>().join(" ")
}

/// Parses the text of [`blocks_of`]; `None` if it does not describe `height` rows.
fn rows_of(blocks: &str, height: usize) -> Option<Vec<u64>> {
    let mut rows = Vec::new();
    for block in blocks.split(' ') {
        let (samples, count) = block.split_once('x')?;
        let count = count.parse().ok().filter(|count| *count <= height - rows.len())?;
        rows.extend(std::iter::repeat_n(samples.parse::<u64>().ok()?, count));
    }
    (rows.len() == height).then_some(rows)
}

/// The conversion of the mean to display colours for PNG.
#[derive(Debug)]
pub struct Look {
    pub integrator: Integrator,
    pub exposure: Exposure,
    pub tone_map: ToneMap,
    /// Fraction of each pixel that surfaces cover, 0..=1; empty if the exposure is not metered.
    pub coverage: Vec<f32>,
}

impl Look {
    /// For images without exposure and tone map.
    pub fn plain(integrator: Integrator) -> Self {
        Self { integrator, exposure: Exposure::Ev(0.0), tone_map: ToneMap::None, coverage: Vec::new() }
    }

    /// Exposure, EV, metered as in `render`.
    pub fn exposure(&self, mean: &[[f32; 3]]) -> f32 {
        self.exposure.of(mean.iter().zip(&self.coverage).map(|([r, g, b], covered)| [*r, *g, *b, *covered]))
    }

    fn bytes(&self, mean: &[[f32; 3]]) -> Vec<u8> {
        match self.integrator {
            Integrator::Path => display::encoded(mean, self.exposure(mean), self.tone_map),
            // Visibility ratios have no exposure.
            Integrator::Occlusion | Integrator::Obscurance { .. } => display::encoded(mean, 0.0, ToneMap::None),
            // As in --debug-view normal.
            Integrator::Normal => display::raw(mean),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn pipes_get_no_checkpoints() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(path("pipe.exr")).status().unwrap().success());
        let takes = |rendering: &str, variance: Option<&str>| {
            Target::choose(path(rendering), variance.map(path), false).unwrap().takes_checkpoints()
        };
        assert!(takes("a.exr", None) && takes("a.exr", Some("b.exr")));
        assert!(!takes("pipe.exr", None) && !takes("a.exr", Some("pipe.exr")));
    }

    #[test]
    fn memory_of_writing_grows_with_the_layers() {
        let folder = tempfile::tempdir().unwrap();
        let target = |name: &str, variance: Option<&str>| {
            Target::choose(folder.path().join(name), variance.map(|name| folder.path().join(name)), false).unwrap()
        };
        assert_eq!(target("a.png", None).bytes_per_pixel(false), 36);
        assert_eq!(target("a.png", Some("b.exr")).bytes_per_pixel(false), 72);
        assert_eq!(target("a.exr", None).bytes_per_pixel(false), 72);
        assert_eq!(target("a.exr", None).bytes_per_pixel(true), 14 * 36, "mean, variance and 12 layers of sums");
    }

    #[test]
    fn row_samples_survive_a_round_trip() {
        for rows in [&[3, 3, 2, 3][..], &[0, 1], &[7]] {
            assert_eq!(rows_of(&blocks_of(rows), rows.len()).as_deref(), Some(rows));
        }
        assert_eq!(blocks_of(&[3, 3, 2, 3]), "3x2 2x1 3x1");
        for bad in ["", "3x4", "3x2", "3x2 ", "x3", "3x-1 1x4", "3", "3x2 2x18446744073709551615"] {
            assert_eq!(rows_of(bad, 3), None, "{bad}");
        }
    }
}
