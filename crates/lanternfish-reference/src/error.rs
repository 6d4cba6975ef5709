//! Errors of the path tracer.

/// Why a ground truth could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The scene breaks a rule that its documentation states.
    #[error("the scene is unsound: {what}")]
    InvalidScene {
        /// The first fault.
        what: String,
    },
    /// More memory is needed than there is, or than may be used.
    #[error(transparent)]
    TooMuch(#[from] lanternfish_limits::memory::TooMuch),
    /// A setting is out of range.
    #[error("{setting}: {got}; {remedy}")]
    InvalidSetting {
        /// Name of the setting.
        setting: &'static str,
        /// What was given.
        got: String,
        /// What may be given.
        remedy: &'static str,
    },
    /// The lists of pixels to resume from are not of the image's size.
    #[error("{got} pixels to go on from, for an image of {width}×{height}")]
    PixelCount {
        /// Number of pixels given.
        got: usize,
        /// Width of the image, pixels.
        width: usize,
        /// Height of the image, pixels.
        height: usize,
    },
    /// Two films that are not parts of one image, the second where the first ends.
    #[error("{second} cannot be added to {first}")]
    Parts {
        /// The film that is added to: size and samples.
        first: String,
        /// The film that is added: size and samples.
        second: String,
    },
}
