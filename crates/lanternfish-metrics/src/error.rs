//! Errors of images and comparisons.

use std::path::PathBuf;

/// An error of reading, writing or comparing images.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// The file cannot be opened, read, written or renamed.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// More memory is needed than is free or allowed.
    #[error("{path}: {need}", path = path.display())]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// The request that was refused.
        need: lanternfish_limits::memory::TooMuch,
    },
    /// The file's content is not a readable image.
    #[error("{path}: {what}", path = path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// An OpenEXR file has no image of this name.
    #[error("{path}: no channels {}; there are: {found}", wanted_channels(.layer), path = path.display())]
    MissingChannels {
        /// The file.
        path: PathBuf,
        /// The layer that was requested; empty for the image itself.
        layer: String,
        /// The channels that exist, separated by commas.
        found: String,
    },
    /// The number of pixel values does not match width and height.
    #[error("{got} values for an image that needs {expected}")]
    PixelCount {
        /// Values given.
        got: usize,
        /// Width × height × values per pixel.
        expected: usize,
    },
    /// Two images to be compared differ in size.
    #[error("images of {}×{} and {}×{} cannot be compared: render both at one size", .image.0, .image.1, .reference.0, .reference.1)]
    SizeMismatch {
        /// Width and height of the first.
        image: (usize, usize),
        /// Width and height of the second.
        reference: (usize, usize),
    },
    /// An image cannot be divided into whole boxes.
    #[error("{width}×{height} is not a multiple of {factor}: choose a factor that divides both sides")]
    Indivisible {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// Width and height of a box, pixels.
        factor: usize,
    },
    /// No pixel of the reference is brighter than the threshold, so that nothing can be measured.
    #[error("no pixel of the reference is brighter than {threshold}: lower the threshold")]
    NothingLit {
        /// Luminance above which a pixel counts as lit.
        threshold: f32,
    },
    /// A value of an image to be compared is not a number.
    #[error("pixel {x}, {y} is not a number (NaN): leave such pixels out or give them a colour")]
    NotANumber {
        /// Column, from the left.
        x: usize,
        /// Row, from the top.
        y: usize,
    },
    /// A value of an image to be compared is infinite or not a number.
    #[error("pixel {x}, {y} is not finite: leave such pixels out or give them a colour")]
    NotFinite {
        /// Column, from the left.
        x: usize,
        /// Row, from the top.
        y: usize,
    },
    /// No pixel of two images is finite in both, so there is nothing to compare.
    #[error("no pixel is finite in both images: there is nothing to compare")]
    NothingFinite,
    /// An image is too small for a measure.
    #[error("images of {width}×{height} are too small: both sides must be at least {smallest} pixels")]
    TooSmall {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// Minimum width and height, pixels.
        smallest: usize,
    },
    /// A z-test without any variance.
    #[error("no image of variances was given: render with variances, or compare without a z-test")]
    NoVariance,
    /// Exposures of HDR-FLIP that are out of range.
    #[error("{count} exposures from {start} to {stop} stops: take 1 to 300, from -126 to 126 stops, darkest first")]
    Exposures {
        /// First exposure, stops.
        start: f32,
        /// Last exposure, stops.
        stop: f32,
        /// Number of exposures.
        count: u32,
    },
    /// The distance of the observer is out of range.
    #[error("{got} pixels per degree: take 2 to 1000; 67 is a 4K display 0.7 m wide, from 0.7 m")]
    PixelsPerDegree {
        /// Pixels per degree given.
        got: f32,
    },
}

fn wanted_channels(layer: &str) -> String {
    if layer.is_empty() { "R, G and B, nor Y alone".to_owned() } else { format!("{layer}.R, {layer}.G and {layer}.B") }
}
