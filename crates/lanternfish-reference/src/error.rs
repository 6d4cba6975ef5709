//! What can go wrong.

/// Why a ground truth could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The scene is not as its documentation promises.
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
        /// Which.
        setting: &'static str,
        /// What was given.
        got: String,
        /// What may be given.
        remedy: &'static str,
    },
    /// Pixels to go on from do not fit the image.
    #[error("{got} pixels to go on from, for an image of {width}×{height}")]
    PixelCount {
        /// Pixels given.
        got: usize,
        /// Of the image.
        width: usize,
        /// Of the image.
        height: usize,
    },
}
