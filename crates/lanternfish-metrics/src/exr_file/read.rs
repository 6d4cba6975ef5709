//! Reads OpenEXR files: the headers select the part and its channels before pixels are read.

use std::{
    collections::BTreeMap,
    io::{self, BufReader},
    path::Path,
};

use exr::{
    image::read::{layers::ReadChannels, specific_channels::ReadSpecificChannel},
    meta::{MetaData, attribute::AttributeValue, header::Header},
    prelude::{Error, ReadLayers, Text, Vec2},
};

use lanternfish_limits::{caught, memory::Budget};

use crate::{MetricsError, RgbImage, open_file::open_file};

/// Reads the channels R, G and B of the first part that has them, stored as half, float or 32-bit integer. Other channels
/// are ignored. A file with Y instead is read as grey.
pub fn read_exr(path: &Path) -> Result<RgbImage, MetricsError> {
    read_exr_layer(path, "")
}

/// Reads the layer `name`: its channels `name.R`, `name.G` and `name.B`, or R, G and B of the part of this name.
///
/// The empty name is the image itself, as in [`read_exr`]. A layer that has only Y is grey. [`exr_layers`] lists the layers
/// of a file.
pub fn read_exr_layer(path: &Path, name: &str) -> Result<RgbImage, MetricsError> {
    let layer = select(path, name)?;
    let pixels = (layer.size.width() as u64).saturating_mul(layer.size.height() as u64);
    // 12 bytes per pixel as read, and 12 as stored.
    Budget::of_process()
        .check(pixels.saturating_mul(24), || format!("{} × {} pixels need", layer.size.width(), layer.size.height()))
        .map_err(|need| MetricsError::TooMuch { path: path.to_owned(), need })?;
    if let Some(why) = layer.unreadable {
        return Err(invalid(path, why));
    }
    let pixels = caught(|| read_pixels(path, &layer)).map_err(|what| invalid(path, &what))?;
    pixels.map_err(|error| file_error(path, error))
}

/// Width and height, pixels, of a layer as in [`read_exr_layer`], from the headers alone.
pub fn exr_layer_size(path: &Path, name: &str) -> Result<(usize, usize), MetricsError> {
    let Vec2(width, height) = select(path, name)?.size;
    Ok((width, height))
}

/// The part and the channels of a layer.
fn select(path: &Path, name: &str) -> Result<Selection, MetricsError> {
    let headers = headers(path)?;
    Selection::find(&headers, name).ok_or_else(|| MetricsError::MissingChannels {
        path: path.to_owned(),
        layer: name.to_owned(),
        found: channel_names(&headers).join(", "),
    })
}

/// The names of the layers for [`read_exr_layer`], sorted: the text before the last dot of each channel's name, and the names
/// of parts. The image itself is the empty name.
///
/// A layer may be incomplete: reading one that lacks a channel is an error.
pub fn exr_layers(path: &Path) -> Result<Vec<String>, MetricsError> {
    let mut names = Vec::new();
    for header in headers(path)? {
        names.extend(header.own_attributes.layer_name.as_ref().map(utf8));
        for channel in &header.channels.list {
            let name = utf8(&channel.name);
            names.push(name.rsplit_once('.').map_or_else(String::new, |(layer, _)| layer.to_owned()));
        }
    }
    names.sort();
    names.dedup();
    Ok(names)
}

/// The text attributes of a file's parts by name. If several parts have an attribute of the same name, the first part's is returned.
pub fn read_exr_attributes(path: &Path) -> Result<BTreeMap<String, String>, MetricsError> {
    let mut texts = BTreeMap::new();
    for header in headers(path)? {
        for (name, value) in header.all_named_attributes() {
            if let AttributeValue::Text(value) = value {
                texts.entry(String::from_utf8_lossy(name).into_owned()).or_insert_with(|| utf8(&value));
            }
        }
    }
    Ok(texts)
}

/// The part and the channels of an image.
struct Selection {
    part: Option<Text>,
    /// Width and height of the part, pixels.
    size: Vec2<usize>,
    channels: Channels,
    /// The reason why the exr crate cannot read the part, and the remedy; `None` if it can.
    unreadable: Option<&'static str>,
}

enum Channels {
    Rgb([Text; 3]),
    Grey(Text),
}

impl Selection {
    fn find(headers: &[Header], layer: &str) -> Option<Self> {
        let prefix = if layer.is_empty() { String::new() } else { format!("{layer}.") };
        let named =
            |header: &&Header| header.own_attributes.layer_name.as_ref().is_some_and(|name| utf8(name) == layer);
        let anywhere = |names: &dyn Fn(&Header) -> Option<Self>| headers.iter().find_map(names);
        let in_part = |names: &dyn Fn(&Header) -> Option<Self>| headers.iter().filter(named).find_map(names);
        anywhere(&|header| Self::rgb(header, &prefix))
            .or_else(|| in_part(&|header| Self::rgb(header, "")))
            .or_else(|| anywhere(&|header| Self::grey(header, &prefix)))
            .or_else(|| in_part(&|header| Self::grey(header, "")))
    }

    fn rgb(header: &Header, prefix: &str) -> Option<Self> {
        let [red, green, blue] = ["R", "G", "B"].map(|name| channel(header, &format!("{prefix}{name}")));
        Some(Self::new(header, Channels::Rgb([red?, green?, blue?])))
    }

    /// The selection of Y alone. `None` if colour differences (RY, BY) exist too: such an image is not grey.
    fn grey(header: &Header, prefix: &str) -> Option<Self> {
        let [y, ry, by] = ["Y", "RY", "BY"].map(|name| channel(header, &format!("{prefix}{name}")));
        if ry.or(by).is_some() { None } else { Some(Self::new(header, Channels::Grey(y?))) }
    }

    fn new(header: &Header, channels: Channels) -> Self {
        let chosen: &[Text] = match &channels {
            Channels::Rgb(names) => names,
            Channels::Grey(name) => std::slice::from_ref(name),
        };
        // The crate assumes that every line holds every channel.
        let subsampled = header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1));
        debug_assert!(chosen.iter().all(|name| header.channels.list.iter().any(|c| c.name == *name)));
        let unreadable = if header.deep {
            Some("deep pixels are not read: flatten the image")
        } else if subsampled {
            Some("subsampled channels are not read: write every channel at full resolution")
        } else {
            None
        };
        Self { part: header.own_attributes.layer_name.clone(), size: header.layer_size, channels, unreadable }
    }
}

fn channel(header: &Header, name: &str) -> Option<Text> {
    header.channels.list.iter().map(|channel| &channel.name).find(|text| utf8(text) == name).cloned()
}

/// Every channel of every part; in files of several parts, those of named parts are `part: channel`.
fn channel_names(headers: &[Header]) -> Vec<String> {
    let name = |header: &Header, channel: &Text| match &header.own_attributes.layer_name {
        Some(part) if headers.len() > 1 => format!("{}: {}", utf8(part), utf8(channel)),
        _ => utf8(channel),
    };
    headers.iter().flat_map(|header| header.channels.list.iter().map(move |c| name(header, &c.name))).collect()
}

fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn headers(path: &Path) -> Result<Vec<Header>, MetricsError> {
    let failed = |error| file_error(path, error);
    let file = open_file(path).map_err(|error| failed(error.into()))?;
    let meta = caught(|| MetaData::read_from_buffered(BufReader::new(file), false));
    let meta = meta.map_err(|what| invalid(path, &what))?.map_err(failed)?;
    Ok(meta.headers.into_iter().collect())
}

fn blank(size: Vec2<usize>) -> RgbImage {
    RgbImage { width: size.width(), height: size.height(), pixels: vec![[0.0; 3]; size.area()] }
}

fn set(image: &mut RgbImage, position: Vec2<usize>, pixel: [f32; 3]) {
    image.pixels[position.y() * image.width + position.x()] = pixel;
}

fn read_pixels(path: &Path, selection: &Selection) -> Result<RgbImage, Error> {
    let file = BufReader::new(open_file(path)?);
    let read = || exr::image::read::read().no_deep_data().largest_resolution_level();
    let part = selection.part.clone();
    match &selection.channels {
        Channels::Rgb([red, green, blue]) => {
            let channels = read()
                .specific_channels()
                .required(red.clone())
                .required(green.clone())
                .required(blue.clone())
                .collect_pixels(
                    |size, _| blank(size),
                    |image: &mut RgbImage, at, (red, green, blue): (f32, f32, f32)| set(image, at, [red, green, blue]),
                );
            let image = InPart { part, channels }.first_valid_layer().all_attributes().from_buffered(file)?;
            Ok(image.layer_data.channel_data.pixels)
        }
        Channels::Grey(y) => {
            let channels = read()
                .specific_channels()
                .required(y.clone())
                .collect_pixels(|size, _| blank(size), |image: &mut RgbImage, at, (y,): (f32,)| set(image, at, [y; 3]));
            let image = InPart { part, channels }.first_valid_layer().all_attributes().from_buffered(file)?;
            Ok(image.layer_data.channel_data.pixels)
        }
    }
}

/// Reads channels of the part of this name only: other parts may have channels of the same names.
struct InPart<C> {
    part: Option<Text>,
    channels: C,
}

impl<'s, C: ReadChannels<'s>> ReadChannels<'s> for InPart<C> {
    type Reader = C::Reader;

    fn create_channels_reader(&'s self, header: &Header) -> Result<Self::Reader, Error> {
        if header.own_attributes.layer_name != self.part {
            return Err(Error::Invalid("another part".into()));
        }
        self.channels.create_channels_reader(header)
    }
}

/// Converts an error of the exr crate.
fn file_error(path: &Path, error: Error) -> MetricsError {
    match error {
        // A file that ends early is invalid; it is not an I/O error.
        Error::Io(source) if source.kind() != io::ErrorKind::UnexpectedEof => {
            MetricsError::Io { path: path.to_owned(), source }
        }
        error => invalid(path, &format!("not an OpenEXR image that can be read ({error})")),
    }
}

fn invalid(path: &Path, what: &str) -> MetricsError {
    MetricsError::Invalid { path: path.to_owned(), what: what.to_owned() }
}
