//! OpenEXR: linear images on disk.

use std::{
    fs::File,
    io::{self, BufReader},
    path::Path,
};

use exr::prelude::{
    Encoding, Error, Image, Layer, LayerAttributes, ReadChannels, ReadLayers, SpecificChannels, WritableImage, f16,
};

use crate::{MetricsError, RgbImage, write_aside};

/// Reads the channels R, G and B of the first layer that has them, stored as half or float. Others are ignored.
pub fn read_exr(path: &Path) -> Result<RgbImage, MetricsError> {
    let failed = |error| file_error(path, error);
    let file = File::open(path).map_err(|error| failed(error.into()))?;
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |resolution, _| RgbImage {
                width: resolution.width(),
                height: resolution.height(),
                pixels: vec![[0.0; 3]; resolution.area()],
            },
            |image: &mut RgbImage, position, (red, green, blue): (f32, f32, f32)| {
                image.pixels[position.y() * image.width + position.x()] = [red, green, blue];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(BufReader::new(file))
        .map_err(failed)?;
    Ok(image.layer_data.channel_data.pixels)
}

/// Writes R, G and B as half floats, ZIP-compressed, whole or not at all.
///
/// A half holds up to 65504 with 11 bits: brighter finite values are written as 65504.
pub fn write_exr(path: &Path, image: &RgbImage) -> Result<(), MetricsError> {
    let half = |value: f32| {
        let largest = f16::MAX.to_f32();
        f16::from_f32(if value.is_finite() { value.clamp(-largest, largest) } else { value })
    };
    let channels = SpecificChannels::rgb(|position: exr::prelude::Vec2<usize>| {
        let [red, green, blue] = image.pixels[position.y() * image.width + position.x()].map(half);
        (red, green, blue)
    });
    let encoding = Encoding { compression: exr::compression::Compression::ZIP16, ..Encoding::SMALL_LOSSLESS };
    let layer = Layer::new((image.width, image.height), LayerAttributes::default(), encoding, channels);
    write_aside(path, |file| Image::from_layer(layer).write().to_buffered(file))
        .map_err(|error: Error| file_error(path, error))
}

/// The error of this crate for one of the exr crate.
fn file_error(path: &Path, error: Error) -> MetricsError {
    let path = path.to_owned();
    match error {
        // A file that ends early is a broken file, not a fault of the disk.
        Error::Io(source) if source.kind() != io::ErrorKind::UnexpectedEof => MetricsError::Io { path, source },
        error => MetricsError::Invalid { path, what: format!("not an OpenEXR image that can be read ({error})") },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_come_back_as_they_were_and_floats_within_half_precision() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.exr");
        // 37 × 29: neither a multiple of the 16 lines of a ZIP block nor of anything else.
        let pixels = (0..37 * 29).map(|i| [i as f32 / 8.0, 0.1 * i as f32, -1e-3 * i as f32]).collect();
        let image = RgbImage::new(37, 29, pixels).unwrap();
        write_exr(&path, &image).unwrap();
        let read = read_exr(&path).unwrap();
        assert_eq!((read.width, read.height), (37, 29));
        for (read, written) in read.pixels.iter().zip(&image.pixels) {
            // Eighths up to 134 need 11 bits: exact.
            assert_eq!(read[0], written[0]);
            for (read, written) in read.iter().zip(written) {
                // 11 bits, rounded: 2⁻¹¹ relative, 2⁻²⁵ below the smallest normal half.
                assert!((read - written).abs() <= written.abs() * 2f32.powi(-11) + 2f32.powi(-25));
            }
        }
        // Once through half, the values stay.
        write_exr(&path, &read).unwrap();
        assert_eq!(read_exr(&path).unwrap(), read);
    }

    #[test]
    fn what_a_half_cannot_hold_stays_finite() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bright.exr");
        write_exr(&path, &RgbImage::new(1, 1, vec![[1e9, f32::INFINITY, f32::NAN]]).unwrap()).unwrap();
        let [red, green, blue] = read_exr(&path).unwrap().pixels[0];
        assert_eq!((red, green), (65504.0, f32::INFINITY));
        assert!(blue.is_nan());
    }

    #[test]
    fn missing_and_broken_files_are_errors_that_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.exr");
        assert!(matches!(read_exr(&path), Err(MetricsError::Io { .. })));

        std::fs::write(&path, "this is no picture").unwrap();
        let error = read_exr(&path).unwrap_err();
        assert!(matches!(error, MetricsError::Invalid { .. }), "{error:?}");
        assert!(error.to_string().contains("picture.exr"));

        // Cut short.
        write_exr(&path, &RgbImage::new(40, 40, vec![[0.5; 3]; 1600]).unwrap()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() - 20]).unwrap();
        assert!(matches!(read_exr(&path), Err(MetricsError::Invalid { .. })));
    }

    #[test]
    fn writing_into_a_missing_folder_fails() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing").join("picture.exr");
        let error = write_exr(&path, &RgbImage::new(1, 1, vec![[0.0; 3]]).unwrap()).unwrap_err();
        assert!(matches!(error, MetricsError::Io { .. }), "{error:?}");
    }
}
