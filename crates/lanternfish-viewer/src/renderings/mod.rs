//! The viewer of image files: two images with a wipe, and their difference.
//!
//! ```text
//! window.rs ─▶ panel.rs ─▶ State (which two, exposure, place.rs) ─▶ shown.rs ─▶ textures, a map ─▶ window.rs
//! ```

#[cfg(feature = "window")]
mod panel;
#[cfg(feature = "window")]
mod place;
#[cfg(feature = "window")]
mod shown;
#[cfg(all(test, feature = "window"))]
mod tests;
#[cfg(feature = "window")]
mod window;

use std::path::Path;

use lanternfish::settings::{Exposure, ToneMap};
use lanternfish_gpu::AdapterChoice;
use lanternfish_metrics::RgbImage;

#[cfg(feature = "window")]
pub use window::run;

/// An image that was read from a file.
#[derive(Clone, Debug)]
pub struct ImageOfFile {
    /// The displayed name.
    pub name: String,
    /// The pixels.
    pub image: RgbImage,
    /// True if the pixels are linear radiance, nits; false if they are display values, 0 to 1.
    pub is_radiance: bool,
}

/// Reads the images of a file that was dropped on the window. The error is a message for the user.
pub type ImageReader = Box<dyn Fn(&Path) -> Result<Vec<ImageOfFile>, String>>;

/// The initial state of a window of image files.
pub struct RenderedImages {
    /// The images. The first two are compared.
    pub renderings: Vec<ImageOfFile>,
    /// Exposure of radiance; `Auto` meters the first radiance image.
    pub exposure: Exposure,
    /// Tone-mapping curve of radiance.
    pub tone_map: ToneMap,
    /// Width and height of the window, points.
    pub size: [u32; 2],
    /// The adapter to run on.
    pub adapter: AdapterChoice,
    /// Reads files that are dropped on the window.
    pub read: ImageReader,
}
