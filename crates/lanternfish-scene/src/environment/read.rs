//! Reading environment maps from Radiance and OpenEXR files.

use std::io::{Cursor, Read};
use std::path::Path;

use exr::image::read::read;
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers};
use glam::Vec3;
use image::ImageDecoder;
use image::codecs::hdr::{HdrDecoder, SIGNATURE};
use lanternfish_limits::caught;
use lanternfish_limits::memory::{Budget, TooMuch};

use super::Environment;
use crate::{SceneError, import};

/// Largest number of pixels: a panorama of the largest width. They take 1.5 GiB.
const MAX_PIXELS: usize = Environment::MAX_SIDE * Environment::MAX_SIDE / 2;

/// The second valid signature of Radiance files; the decoder accepts [`SIGNATURE`] only.
const RGBE_SIGNATURE: &[u8] = b"#?RGBE";

/// Pixel rows as stored in the file.
struct Stored {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    /// Warning about metadata that is not applied.
    note: Option<String>,
}

pub(super) fn load(path: &Path) -> Result<Environment, SceneError> {
    let is = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if !is("hdr") && !is("exr") {
        return Err(SceneError::UnknownEnvironmentFormat { path: path.to_owned() });
    }
    let budget = Budget::of_process();
    let bytes = import::read_file(path, &budget)?;
    let stored = caught(|| if is("hdr") { read_radiance(&bytes, &budget) } else { read_open_exr(&bytes, &budget) });
    let (environment, notes) =
        stored.unwrap_or_else(|panic| Err(panic.into())).and_then(checked).map_err(|fault| fault.at(path))?;
    for note in notes {
        tracing::warn!("{}: {note}", path.display());
    }
    Ok(environment)
}

/// Why an environment is not read.
enum Fault {
    Invalid(String),
    TooMuch(TooMuch),
}

impl From<String> for Fault {
    fn from(what: String) -> Self {
        Self::Invalid(what)
    }
}

impl Fault {
    fn at(self, path: &Path) -> SceneError {
        let path = path.to_owned();
        match self {
            Self::Invalid(what) => SceneError::Invalid { path, what },
            Self::TooMuch(need) => SceneError::TooMuch { path, need },
        }
    }
}

/// Rejects NaN and infinite values; clamps negative values to 0.
fn checked(stored: Stored) -> Result<(Environment, Vec<String>), Fault> {
    let Stored { width, height, pixels, note } = stored;
    let mut notes: Vec<_> = note.into_iter().collect();
    let count = |is: fn(&f32) -> bool| pixels.iter().filter(|pixel| pixel.iter().any(is)).count();
    let (unusable, negative) = (count(|value| !value.is_finite()), count(|value| *value < 0.0));
    if unusable > 0 {
        let all = pixels.len();
        return Err(
            format!("{unusable} of {all} pixels are infinite or not a number (replace them by finite values)").into()
        );
    }
    if negative > 0 {
        notes.push(format!("{negative} of {} pixels have negative values, which become 0", pixels.len()));
    }
    let pixels = pixels.into_iter().map(|pixel| Vec3::from(pixel).max(Vec3::ZERO)).collect();
    Ok((Environment { width, height, pixels, rotation: 0.0 }, notes))
}

fn check_size(width: usize, height: usize, budget: &Budget) -> Result<(), Fault> {
    let sides = 1..=Environment::MAX_SIDE;
    if !sides.contains(&width) || !sides.contains(&height) || width * height > MAX_PIXELS {
        let most = Environment::MAX_SIDE;
        return Err(
            format!("{width} × {height} pixels: expected 1 to {most} a side, and at most {MAX_PIXELS} in all").into()
        );
    }
    // One copy as read, and one as stored.
    let bytes = 2 * width as u64 * height as u64 * size_of::<Vec3>() as u64;
    budget.check(bytes, || format!("{width} × {height} pixels need")).map_err(Fault::TooMuch)
}

fn read_radiance(bytes: &[u8], budget: &Budget) -> Result<Stored, Fault> {
    let fault = |error: image::ImageError| format!("not a Radiance image that can be read ({error})");
    // The decoder accepts one of the two signatures.
    let rest = bytes.strip_prefix(RGBE_SIGNATURE);
    let (signature, rest) = rest.map_or((&[][..], bytes), |rest| (SIGNATURE, rest));
    let decoder = HdrDecoder::new(signature.chain(rest)).map_err(fault)?;
    let header = decoder.metadata();
    let (width, height) = (header.width as usize, header.height as usize);
    check_size(width, height, budget)?;
    // A row has at least the four bytes of its first pixel.
    if bytes.len() < 4 * height {
        return Err(format!("{} bytes hold no {height} rows", bytes.len()).into());
    }
    if let Some((_, format)) = header.custom_attributes.iter().find(|(key, _)| key == "FORMAT")
        && format != "32-bit_rle_rgbe"
    {
        return Err(format!("its format is {format} (expected 32-bit_rle_rgbe)").into());
    }
    let exposure = header.exposure.filter(|exposure| *exposure != 1.0);
    // Untouched zero pages take no memory, and decoding a truncated file stops before it writes them.
    let mut pixels = vec![[0.0f32; 3]; width * height];
    decoder.read_image(bytemuck::cast_slice_mut(&mut pixels)).map_err(fault)?;
    let note = exposure.map(|exposure| format!("its exposure of {exposure} is ignored"));
    Ok(Stored { width, height, pixels, note })
}

fn read_open_exr(bytes: &[u8], budget: &Budget) -> Result<Stored, Fault> {
    let fault = |error: exr::error::Error| format!("not an OpenEXR image that can be read ({error})");
    // Checked before the reader allocates the pixels.
    for header in MetaData::read_from_buffered(bytes, false).map_err(fault)?.headers {
        check_size(header.layer_size.width(), header.layer_size.height(), budget)?;
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| Stored {
                width: size.width(),
                height: size.height(),
                pixels: vec![[0.0; 3]; size.area()],
                note: None,
            },
            |stored: &mut Stored, position, (red, green, blue): (f32, f32, f32)| {
                stored.pixels[position.y() * stored.width + position.x()] = [red, green, blue];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(fault)?;
    Ok(image.layer_data.channel_data.pixels)
}
