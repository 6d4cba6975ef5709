//! Images of files, in a window of their own: side by side with a line between them, and what differs.
//!
//! ```text
//! window.rs ─▶ panel.rs ─▶ State (which two, exposure, place.rs) ─▶ shown.rs ─▶ textures, a map ─▶ window.rs
//! ```

mod panel;
mod place;
mod shown;
#[cfg(test)]
mod tests;
mod window;

use std::path::Path;

use lanternfish::settings::{Exposure, ToneMap};
use lanternfish_gpu::AdapterChoice;
use lanternfish_metrics::RgbImage;

pub use window::run;

/// An image of a file.
#[derive(Clone, Debug)]
pub struct ImageOfFile {
    /// What it is called.
    pub name: String,
    /// Its pixels.
    pub image: RgbImage,
    /// Whether they are linear radiance, nits, and not what a display shows, 0 to 1.
    pub is_radiance: bool,
}

/// Reads the images of a file that was dropped on the window, or says why it cannot.
pub type ImageReader = Box<dyn Fn(&Path) -> Result<Vec<ImageOfFile>, String>>;

/// What a window of images shows first.
pub struct RenderedImages {
    /// The images. The first two are compared.
    pub renderings: Vec<ImageOfFile>,
    /// How bright radiance is shown; from the first image of radiance where nobody says it.
    pub exposure: Exposure,
    /// The curve that it is shown by.
    pub tone_map: ToneMap,
    /// Points of the window across and down.
    pub size: [u32; 2],
    /// Where to run.
    pub adapter: AdapterChoice,
    /// Reads files that are dropped on the window.
    pub read: ImageReader,
}
