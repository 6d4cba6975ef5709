//! What is written comes back; what cannot be read is said.

use super::*;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes, WritableImage, f16,
};

use crate::{MetricsError, RgbImage};

#[test]
fn halves_come_back_as_they_were_and_floats_within_half_precision() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
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
fn what_halves_cannot_hold_is_written_as_32_bit_floats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bright.exr");
    write_exr(&path, &RgbImage::new(1, 1, vec![[1e9, f32::INFINITY, f32::NAN]]).unwrap()).unwrap();
    let [red, green, blue] = read_exr(&path).unwrap().pixels[0];
    assert_eq!((red, green), (1e9, f32::INFINITY));
    assert!(blue.is_nan());
    let dark = RgbImage::new(1, 1, vec![[1e-3, 1.001e-6, 0.0]]).unwrap();
    write_exr(&path, &dark).unwrap();
    assert_eq!(read_exr(&path).unwrap(), dark);
}

#[test]
fn missing_and_broken_files_are_errors_that_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
    assert!(matches!(read_exr(&path), Err(MetricsError::Io { .. })));

    std::fs::write(&path, "this is no image").unwrap();
    let error = read_exr(&path).unwrap_err();
    assert!(matches!(error, MetricsError::Invalid { .. }), "{error:?}");
    assert!(error.to_string().contains("image.exr"));

    // A truncated file.
    write_exr(&path, &RgbImage::new(40, 40, vec![[0.5; 3]; 1600]).unwrap()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 20]).unwrap();
    assert!(matches!(read_exr(&path), Err(MetricsError::Invalid { .. })));
}

/// Values that a half float cannot hold.
fn floats(seed: u32) -> RgbImage {
    let value =
        |i: usize, c: usize| f32::from_bits(0x3f80_0000 ^ (i as u32 * 3 + c as u32 + seed).wrapping_mul(0x0001_9351));
    RgbImage::new(37, 29, (0..37 * 29).map(|i| [value(i, 0), value(i, 1), 1e20 * value(i, 2)]).collect()).unwrap()
}

#[test]
fn layers_and_attributes_round_trip_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("layers.exr");
    let (image, variance, other) = (floats(0), floats(5), floats(9));
    let long = "µ".repeat(100_000);
    let attributes =
        [("lanternfish.samples", "64"), ("lanternfish.settings", "{\"größe\": 1}\n"), ("long", &long), ("e", "")];
    write_exr_layers(&path, &[("", &image), ("variance", &variance), ("a.b", &other)], &attributes).unwrap();
    assert_eq!(read_exr(&path).unwrap(), image);
    assert_eq!(read_exr_layer(&path, "").unwrap(), image);
    assert_eq!(read_exr_layer(&path, "variance").unwrap(), variance);
    assert_eq!(read_exr_layer(&path, "a.b").unwrap(), other);
    assert_eq!(exr_layers(&path).unwrap(), ["", "a.b", "variance"]);
    assert_eq!(exr_layer_size(&path, "a.b").unwrap(), (37, 29));
    assert!(matches!(exr_layer_size(&path, "a.c"), Err(MetricsError::MissingChannels { .. })));
    let read = read_exr_attributes(&path).unwrap();
    for (name, value) in attributes {
        assert_eq!(read.get(name).map(String::as_str), Some(value), "{name}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

    // Without an image: only the layer.
    write_exr_layers(&path, &[("variance", &variance)], &[]).unwrap();
    let error = read_exr(&path).unwrap_err().to_string();
    assert!(error.contains("layers.exr") && error.contains("variance.R"), "{error}");
    let error = read_exr_layer(&path, "other").unwrap_err().to_string();
    assert!(error.contains("layers.exr") && error.contains("other") && error.contains("variance.R"), "{error}");
}

#[test]
fn attributes_of_halves_stand_in_the_header_and_change_no_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let (plain, path) = (folder.path().join("plain.exr"), folder.path().join("image.exr"));
    let image = RgbImage::new(37, 29, (0..37 * 29).map(|i| [i as f32 / 8.0, 1.25, 7.0]).collect()).unwrap();
    write_exr(&plain, &image).unwrap();
    let attributes = [("lanternfish.b", "2"), ("Software", "lanternfish 1"), ("lanternfish.a", "x")];
    let written = || {
        write_exr_image(&path, &[("", &image, None)], &attributes).unwrap();
        std::fs::read(&path).unwrap()
    };
    let (bytes, plain) = (written(), std::fs::read(&plain).unwrap());
    assert!((0..8).all(|_| written() == bytes), "attributes are in one order");
    assert_eq!(read_exr(&path).unwrap(), image);
    let read = read_exr_attributes(&path).unwrap();
    for (name, value) in attributes {
        assert_eq!(read.get(name).map(String::as_str), Some(value), "{name}");
    }
    // By the format's specification: name, type, size (little-endian), value.
    let wanted = b"Software\0string\0\x0d\0\0\0lanternfish 1";
    assert!(bytes.windows(wanted.len()).any(|window| window == wanted));
    // The table of offsets and the blocks follow; blocks do not move by a bit.
    assert!(bytes.ends_with(&plain[plain.len() - 100..]));
}

#[test]
fn invalid_names_and_sizes_are_refused_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("layers.exr");
    let (image, small) = (floats(0), RgbImage::new(1, 1, vec![[0.0; 3]]).unwrap());
    let long = "x".repeat(300);
    type Layers<'a> = &'a [(&'a str, &'a RgbImage)];
    type Attributes<'a> = &'a [(&'a str, &'a str)];
    let cases: [(Layers<'_>, Attributes<'_>); 8] = [
        (&[], &[]),
        (&[("", &image), ("variance", &small)], &[]),
        (&[("", &image), ("", &image)], &[]),
        (&[("größe", &image)], &[]),
        (&[("", &image)], &[("", "x")]),
        (&[("", &image)], &[("a", "x"), ("a", "y")]),
        (&[("", &image)], &[("compression", "x")]),
        (&[("", &image)], &[(&long, "x")]),
    ];
    for (layers, attributes) in cases {
        let error = write_exr_layers(&path, layers, attributes).unwrap_err();
        assert!(!matches!(error, MetricsError::Io { .. }), "{error:?}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "{error}");
    }
}

/// A part of a file with these channels.
fn part(name: &str, channels: Vec<(&str, FlatSamples)>) -> Layer<AnyChannels<FlatSamples>> {
    let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let attributes = if name.is_empty() { LayerAttributes::default() } else { LayerAttributes::named(name) };
    Layer::new((2, 1), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(channels))
}

fn written(parts: Vec<Layer<AnyChannels<FlatSamples>>>) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.exr");
    let attributes = ImageAttributes::with_size((2, 1));
    Image::from_layers(attributes, parts.into_iter().collect::<Vec<_>>()).write().to_file(&path).unwrap();
    (folder, path)
}

#[test]
fn unusual_channels_are_read_or_listed() {
    let half = |a: f32, b: f32| FlatSamples::F16(vec![f16::from_f32(a), f16::from_f32(b)]);
    let float = |a: f32, b: f32| FlatSamples::F32(vec![a, b]);
    let integer = |a: u32, b: u32| FlatSamples::U32(vec![a, b]);

    // Every sample type, and channels that are ignored.
    let colors = vec![
        ("R", half(1.0, 2.0)),
        ("G", float(3.0, 4.0)),
        ("B", integer(5, 6)),
        ("A", half(0.0, 0.5)),
        ("Z", float(7.0, 8.0)),
    ];
    let (_folder, path) = written(vec![part("", colors)]);
    assert_eq!(read_exr(&path).unwrap().pixels, [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]);

    let (_folder, path) = written(vec![part("", vec![("Y", float(1.5, 2.5)), ("A", half(1.0, 1.0))])]);
    assert_eq!(read_exr(&path).unwrap().pixels, [[1.5; 3], [2.5; 3]]);

    for (channels, named) in [
        (vec![("R", float(1.0, 2.0))], "there are: R"),
        (vec![("R", float(1.0, 2.0)), ("B", float(1.0, 2.0)), ("A", float(1.0, 1.0))], "there are: A, B, R"),
        (vec![("Y", float(1.0, 2.0)), ("RY", float(1.0, 2.0)), ("BY", float(1.0, 2.0))], "there are: BY, RY, Y"),
        (vec![("r", float(1.0, 2.0)), ("g", float(1.0, 2.0)), ("b", float(1.0, 2.0))], "there are: b, g, r"),
    ] {
        let (_folder, path) = written(vec![part("", channels)]);
        let error = read_exr(&path).unwrap_err().to_string();
        assert!(error.contains(named) && error.contains("odd.exr"), "{named:?} is not in {error}");
    }
}

#[test]
fn parts_are_layers_too() {
    let rgb = |v: f32| ["R", "G", "B"].map(|name| (name, FlatSamples::F32(vec![v, v + 1.0]))).to_vec();
    let depth = vec![("Z", FlatSamples::F32(vec![9.0, 9.0]))];
    let (_folder, path) = written(vec![part("depth", depth), part("beauty", rgb(1.0)), part("variance", rgb(5.0))]);
    assert_eq!(read_exr(&path).unwrap().pixels[0], [1.0; 3]);
    assert_eq!(read_exr_layer(&path, "beauty").unwrap().pixels[0], [1.0; 3]);
    assert_eq!(read_exr_layer(&path, "variance").unwrap().pixels[1], [6.0; 3]);
    assert_eq!(exr_layers(&path).unwrap(), ["", "beauty", "depth", "variance"]);
    let error = read_exr_layer(&path, "depth").unwrap_err().to_string();
    assert!(error.contains("depth: Z") && error.contains("variance: R"), "{error}");
}

#[test]
fn channels_are_written_by_name_in_full_precision() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
    let channels = [("R", vec![0.1f32, 7.0]), ("Depth.Z", vec![1e9, 1e-9]), ("A", vec![1.0, 16_777_215.0])];
    let channels = channels.map(|(name, values)| (name.to_owned(), values));
    write_exr_channels(&path, [2, 1], channels.to_vec(), &[]).unwrap();
    let read = exr::prelude::read_first_flat_layer_from_file(&path).unwrap().layer_data;
    let read = read.channel_data.list.into_iter();
    let read = read.map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect::<Vec<_>>()));
    let mut written = channels.to_vec();
    written.sort_by(|a, b| a.0.cmp(&b.0));
    assert_eq!(read.collect::<Vec<_>>(), written);
    let twice = [channels[0].clone(), channels[0].clone()].to_vec();
    assert!(write_exr_channels(&path, [2, 1], twice, &[]).is_err());
    assert!(write_exr_channels(&path, [3, 1], channels.to_vec(), &[]).is_err());
}
