//! Writes OpenEXR files atomically, with lossless ZIP compression.

use std::{io::Cursor, path::Path};

use exr::{
    meta::attribute::AttributeValue,
    prelude::{
        AnyChannel, AnyChannels, Encoding, Error, FlatSamples, Image, Layer, LayerAttributes, Text, WritableImage, f16,
    },
};

use super::order::sort_attributes;
use crate::{MetricsError, RgbImage, compare::check_sizes, write_aside};

/// Smallest largest value of an image of half floats.
const LEAST_OF_HALVES: f32 = 1.0 / 16.0;

/// Writes R, G and B, ZIP-compressed. The write is atomic.
///
/// Values are half floats, with 11 bits of precision, if they hold the image: no finite value exceeds 65504, and the
/// largest is zero or above 1/16, so that a thousandth of it has full precision. Otherwise they are 32-bit floats.
pub fn write_exr(path: &Path, image: &RgbImage) -> Result<(), MetricsError> {
    write_exr_image(path, &[("", image, None)], &[])
}

/// Writes several images of one size into one part of a file as 32-bit floats, losslessly, with text attributes. The
/// write is atomic. Equal content gives equal bytes.
///
/// A layer called `variance` becomes the channels `variance.R`, `variance.G` and `variance.B`; the empty name is the
/// image itself, R, G and B, which other programs show. Names of channels and attributes are unique, ASCII, and at most
/// 250 letters long. Attributes must not have the names that OpenEXR itself uses (`compression`, `comments`): use the
/// prefix `lanternfish.`. Values are any text.
pub fn write_exr_layers(
    path: &Path,
    layers: &[(&str, &RgbImage)],
    attributes: &[(&str, &str)],
) -> Result<(), MetricsError> {
    let layers: Vec<_> = layers.iter().map(|(name, image)| (*name, *image, None)).collect();
    write_layers(path, &layers, attributes, FlatSamples::F32)
}

/// As [`write_exr_layers`], each image with the opacity of its pixels, if given: the channel `A`, by which the colours
/// are premultiplied. A single image is of half floats if they hold it, as in [`write_exr`].
pub fn write_exr_image(
    path: &Path,
    layers: &[(&str, &RgbImage, Option<&[f32]>)],
    attributes: &[(&str, &str)],
) -> Result<(), MetricsError> {
    match layers {
        [(_, image, _)] if fits_halves(image) => write_layers(path, layers, attributes, |samples| {
            FlatSamples::F16(samples.into_iter().map(f16::from_f32).collect())
        }),
        _ => write_layers(path, layers, attributes, FlatSamples::F32),
    }
}

fn fits_halves(image: &RgbImage) -> bool {
    let finite = image.pixels.as_flattened().iter().filter(|value| value.is_finite());
    let largest = finite.fold(0.0, |largest: f32, value| largest.max(value.abs()));
    largest == 0.0 || (LEAST_OF_HALVES..=f16::MAX.to_f32()).contains(&largest)
}

fn write_layers(
    path: &Path,
    layers: &[(&str, &RgbImage, Option<&[f32]>)],
    attributes: &[(&str, &str)],
    samples: impl Fn(Vec<f32>) -> FlatSamples,
) -> Result<(), MetricsError> {
    let Some((_, first, _)) = layers.first() else {
        return Err(invalid(path, "a file has at least one layer".to_owned()));
    };
    let mut channels = Vec::with_capacity(4 * layers.len());
    for (name, image, alpha) in layers {
        check_sizes(image, first)?;
        let colors = ["R", "G", "B"].into_iter().enumerate();
        let colors = colors.map(|(i, letter)| (letter, image.pixels.iter().map(|pixel| pixel[i]).collect()));
        for (letter, values) in colors.chain(alpha.map(|alpha| ("A", alpha.to_vec()))) {
            let name = if name.is_empty() { letter.to_owned() } else { format!("{name}.{letter}") };
            channels.push((name, samples(values)));
        }
    }
    write(path, [first.width, first.height], channels, attributes)
}

/// Writes channels by name, rows from the top, as [`write_exr_layers`] does. `size`: width and height, pixels.
pub fn write_exr_channels(
    path: &Path,
    size: [usize; 2],
    channels: Vec<(String, Vec<f32>)>,
    attributes: &[(&str, &str)],
) -> Result<(), MetricsError> {
    let expected = size[0] * size[1];
    if let Some((_, samples)) = channels.iter().find(|(_, samples)| samples.len() != expected) {
        return Err(MetricsError::PixelCount { got: samples.len(), expected });
    }
    let channels = channels.into_iter().map(|(name, samples)| (name, FlatSamples::F32(samples)));
    write(path, size, channels.collect(), attributes)
}

fn write(
    path: &Path,
    [width, height]: [usize; 2],
    channels: Vec<(String, FlatSamples)>,
    attributes: &[(&str, &str)],
) -> Result<(), MetricsError> {
    check_names(path, "channel", channels.iter().map(|(name, _)| name.as_str()))?;
    let described = described(path, attributes)?;
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name.as_str(), samples));
    let layer = Layer::new((width, height), described, encoding(), AnyChannels::sort(channels.collect()));
    write_sorted(path, |file| Image::from_layer(layer).write().to_buffered(file))
}

/// A layer with these text attributes.
fn described(path: &Path, attributes: &[(&str, &str)]) -> Result<LayerAttributes, MetricsError> {
    check_names(path, "attribute", attributes.iter().map(|(name, _)| *name))?;
    if attributes.iter().any(|(name, _)| name.is_empty()) {
        return Err(invalid(path, "an attribute has no name".to_owned()));
    }
    let mut described = LayerAttributes::default();
    for (name, value) in attributes {
        let value = AttributeValue::Text(Text::from_slice_unchecked(value.as_bytes()));
        described.other.insert(Text::from_slice_unchecked(name.as_bytes()), value);
    }
    Ok(described)
}

/// Encodes a file in memory, sorts its attributes and writes it.
fn write_sorted(
    path: &Path,
    encode: impl FnOnce(&mut Cursor<Vec<u8>>) -> Result<(), Error>,
) -> Result<(), MetricsError> {
    let mut file = Cursor::new(Vec::new());
    encode(&mut file).map_err(|error| failed(path, error))?;
    sort_attributes(file.get_mut());
    write_aside(path, |aside| aside.write_all(file.get_ref()))
        .map_err(|source| MetricsError::Io { path: path.to_owned(), source })
}

fn encoding() -> Encoding {
    Encoding { compression: exr::compression::Compression::ZIP16, ..Encoding::SMALL_LOSSLESS }
}

fn check_names<'n>(path: &Path, what: &str, names: impl Iterator<Item = &'n str>) -> Result<(), MetricsError> {
    let mut names_before = Vec::new();
    for name in names {
        // Names end with a zero byte and have at most 255 bytes.
        if !name.bytes().all(|b| b.is_ascii_graphic() || b == b' ') || name.len() > 250 {
            return Err(invalid(
                path,
                format!("{name:?} cannot be the name of a {what}: take up to 250 ASCII letters"),
            ));
        }
        if names_before.contains(&name) {
            return Err(invalid(path, format!("duplicate {what} {name:?}")));
        }
        names_before.push(name);
    }
    Ok(())
}

fn failed(path: &Path, error: Error) -> MetricsError {
    match error {
        Error::Io(source) => MetricsError::Io { path: path.to_owned(), source },
        error => invalid(path, format!("cannot be written as OpenEXR ({error})")),
    }
}

fn invalid(path: &Path, what: String) -> MetricsError {
    MetricsError::Invalid { path: path.to_owned(), what }
}
