//! The interactive viewer of Lanternfish: a scene, a fly-through camera, panels for all settings, and device time per
//! pass.
//!
//! ```text
//! window.rs ─▶ panels/ ─▶ State (settings, camera, clip) ─▶ viewport.rs ─▶ a texture ─▶ window.rs
//!  winit, egui   egui       Controls                          Renderer::record
//! ```

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

mod background;
mod clusters;
mod comparison;
mod difference;
mod error;
mod overlay;
mod panels;
mod player;
mod repaint_limiter;
mod slice_scheduler;
mod source_tree;
mod stereo;
mod surface;
#[cfg(test)]
mod testing;
mod texture;
mod viewport;
mod window;
mod window_state;
mod wipe;

use std::path::{Path, PathBuf};

use lanternfish::{Settings, settings::Exposure};
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Camera, Eyes, RecordKeeper, Scene, generate::Rain, motion::Moment};

pub use error::ViewerError;
pub use window::run;

/// Opens a file. The error is a message for the user.
pub type Opener = Box<dyn Fn(&Path) -> Result<Opened, String>>;
/// Writes a screenshot: sRGB-encoded RGBA bytes, rows from the top, and the width and height in pixels.
///
/// Returns the file's path. The error is a message for the user.
pub type Keeper = Box<dyn Fn(&[u8], [u32; 2]) -> Result<String, String>>;

/// Writes the current view as a shot or a command line. The error is a message for the user.
pub type Writer = Box<dyn Fn(&Shown<'_>, Form) -> Result<Written, String>>;

/// The current view: side A, at rest.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// The settings of A. `accumulate` is the number of frames that the image at rest averages.
    pub settings: &'a Settings,
    /// The scene with its current lights.
    pub scene: &'a Scene,
    /// The current camera.
    pub camera: &'a Camera,
    /// The eyes of a stereo image, side by side; `None` for a mono image.
    pub eyes: Option<Eyes>,
    /// Width and height of one eye's image, pixels.
    pub size: [u32; 2],
    /// The animation time; `None` if nothing was played.
    pub moment: Option<Moment>,
}

/// The form in which the current view is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A shot: a file that renders the view.
    File,
    /// A command line for a shell.
    CommandLine,
}

/// A written view.
#[derive(Clone, Debug)]
pub struct Written {
    /// The command line, or the path of the file.
    pub text: String,
    /// The camera as written: the current camera, rounded. The window continues with it, so that both images are equal
    /// bit for bit.
    pub camera: Camera,
}

/// The initial state of the window.
pub struct Start {
    /// The window's title.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// The initial camera.
    pub camera: Camera,
    /// The eyes of a stereo image, side by side; `None` for a mono image.
    pub eyes: Option<Eyes>,
    /// The render settings.
    pub settings: Settings,
    /// Width and height of the window, points.
    pub size: [u32; 2],
    /// True if the user chose `size`. Otherwise the stored size of the last window takes precedence.
    pub size_is_chosen: bool,
    /// The animation time that is shown; `None` leaves everything as the file has it.
    pub moment: Option<Moment>,
    /// Light rain: lights that fall over time. The scene holds their state at 0 s.
    pub rain: Option<Rain>,
    /// The file that stores size, position and panel visibility for the next window.
    pub kept: Option<PathBuf>,
    /// The adapter to run on.
    pub adapter: AdapterChoice,
    /// Opens a file that was dropped on the window.
    pub open: Opener,
    /// Writes a screenshot.
    pub keep: Keeper,
    /// Records camera moves in steps of this length in seconds, and passes them to the keeper when the window is
    /// closed. `None` records nothing.
    pub record: Option<(f32, RecordKeeper)>,
    /// Writes the current view.
    pub write: Writer,
    /// A folder of WESL files that replace the library's shaders. They are reloaded when saved.
    pub shaders: Option<PathBuf>,
}

/// The contents of an opened file.
pub struct Opened {
    /// The window's title.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// The initial camera.
    pub camera: Camera,
    /// The eyes of a stereo image; `None` if the file specifies none.
    pub eyes: Option<Eyes>,
    /// The render settings; `None` if the file specifies none, which leaves the current settings.
    pub settings: Option<Settings>,
    /// The exposure that replaces the current one, since another scene has other light; `None` keeps that of the
    /// settings.
    pub exposure: Option<Exposure>,
    /// The animation time that is shown; `None` leaves everything as the file has it.
    pub moment: Option<Moment>,
    /// Light rain: lights that fall over time. The scene holds their state at 0 s.
    pub rain: Option<Rain>,
}
