//! Errors of the path tracer.

/// An error of the path tracer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The scene is invalid.
    #[error("the scene is invalid: {0}")]
    InvalidScene(#[from] lanternfish_scene::SceneFault),
    /// Not enough memory, or above the memory limit.
    #[error(transparent)]
    TooMuch(#[from] lanternfish_limits::memory::TooMuch),
    /// Not enough memory for the sums of an image's pixels, or above the memory limit.
    #[error(transparent)]
    ImageTooLarge(lanternfish_limits::memory::TooMuch),
    /// A setting is out of range.
    #[error("{setting}: {got}; {remedy}")]
    InvalidSetting {
        /// Name of the setting.
        setting: &'static str,
        /// The given value.
        got: String,
        /// The allowed values.
        remedy: &'static str,
    },
    /// The lists of pixels to resume from do not match the image's size.
    #[error("{got} pixels to resume from, for an image of {width}×{height} pixels")]
    PixelCount {
        /// Number of pixels given.
        got: usize,
        /// Width of the image, pixels.
        width: usize,
        /// Height of the image, pixels.
        height: usize,
    },
    /// Two films are not consecutive parts of one image.
    #[error("{second} cannot be added to {first}")]
    Parts {
        /// The film to add to: size and samples.
        first: String,
        /// The added film: size and samples.
        second: String,
    },
}
