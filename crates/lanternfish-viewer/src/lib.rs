//! The window of Lanternfish: a scene, a camera that flies through it, settings a click away, and what each pass costs.
//!
//! ```text
//! window.rs ─▶ panels/ ─▶ State (settings, camera, clip) ─▶ viewport.rs ─▶ a texture ─▶ window.rs
//!  winit, egui   egui       controls.rs                       Renderer::record
//! ```
//!
//! `renderings/` is a window of images of files; `events.rs` is the loop around either.

mod background;
mod cloud;
mod clusters;
mod comparison;
mod controls;
mod difference;
mod error;
mod events;
mod overlay;
mod panels;
mod player;
mod record;
mod renderings;
mod repaint_limiter;
mod resolution_scaling;
mod source_tree;
mod stereo;
mod sun;
mod surface;
mod texture;
mod viewport;
mod window;
mod window_state;
mod wipe;

use std::path::{Path, PathBuf};

use lanternfish::Settings;
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Camera, Eyes, Scene, generate::Rain};

pub use controls::Way;
pub use error::ViewerError;
pub use record::{Move, RecordKeeper, Recording};
pub use renderings::{ImageOfFile, ImageReader, RenderedImages};

/// Opens a file, or says why it cannot.
pub type Opener = Box<dyn Fn(&Path) -> Result<Opened, String>>;
/// Writes sRGB bytes, RGBA, of so many pixels across and down; says where they are, or why it cannot.
pub type Keeper = Box<dyn Fn(&[u8], [u32; 2]) -> Result<String, String>>;

/// Writes what is seen in a form, or says why that cannot be.
pub type Writer = Box<dyn Fn(&Shown<'_>, Form) -> Result<Written, String>>;

/// What is seen: the first side, at rest.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// How it is rendered. `accumulate` is the number of frames that the image is the mean of once no more come.
    pub settings: &'a Settings,
    /// The scene, with the lights of now.
    pub scene: &'a Scene,
    /// Where it is seen from.
    pub camera: &'a Camera,
    /// The eyes that it is seen by, side by side; none: one.
    pub eyes: Option<Eyes>,
    /// Pixels across and down, of one eye.
    pub size: [u32; 2],
    /// The moment that it is of; none where nothing was played.
    pub moment: Option<Moment>,
}

/// A moment of what moves by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Index of the animation that is played. None: everything but light rain is as the file has it.
    pub animation: Option<usize>,
    /// Seconds.
    pub time: f32,
}

/// How what is seen is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A file that renders it.
    File,
    /// A line for a shell.
    CommandLine,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Written {
    /// The line, or where the file is.
    pub text: String,
    /// The camera that what was written gives: the one that was seen, but for rounding. The window goes on with it, so that both show the
    /// same to the bit.
    pub camera: Camera,
}

/// What is seen first.
pub struct Start {
    /// What the window is called.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// Where it is seen from.
    pub camera: Camera,
    /// The eyes that it is seen by, side by side; none: one.
    pub eyes: Option<Eyes>,
    /// How it is rendered.
    pub settings: Settings,
    /// Points of the window across and down.
    pub size: [u32; 2],
    /// Whether somebody has chosen that size: else that of the last window is taken.
    pub size_is_chosen: bool,
    /// The moment that is shown; none: everything is as the file has it.
    pub moment: Option<Moment>,
    /// Lights that fall while time passes; the scene has them as they are at 0 s.
    pub rain: Option<Rain>,
    /// A file where the window leaves its size, its place and whether panels are shown, for the next one.
    pub kept: Option<PathBuf>,
    /// Where to run.
    pub adapter: AdapterChoice,
    /// Opens a file that was dropped on the window.
    pub open: Opener,
    /// Writes a screenshot.
    pub keep: Keeper,
    /// What becomes of what is done to the camera, in steps of so many seconds, when the window is closed. None: it is not recorded.
    pub record: Option<(f32, RecordKeeper)>,
    /// Writes what is seen.
    pub write: Writer,
    /// A folder whose shaders stand in for the library's as often as they are saved.
    pub shaders: Option<PathBuf>,
}

/// A file that was opened.
pub struct Opened {
    /// What the window is called.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// Where it is seen from.
    pub camera: Camera,
    /// The eyes that it is seen by; none where it does not say.
    pub eyes: Option<Eyes>,
    /// How it is rendered; none where it does not say, and is rendered as what was there before.
    pub settings: Option<Settings>,
    /// The moment that is shown; none: everything is as the file has it.
    pub moment: Option<Moment>,
    /// Lights that fall while time passes; the scene has them as they are at 0 s.
    pub rain: Option<Rain>,
}

/// Opens the window, and returns when it is closed.
pub fn run(start: Start) -> Result<(), ViewerError> {
    window::run(start)
}

/// Opens a window on images of files, one at least, and returns when it is closed.
pub fn compare(renderings: RenderedImages) -> Result<(), ViewerError> {
    renderings::run(renderings)
}
