//! The window of Lanternfish: a scene, a camera that flies through it, settings a click away, and what each pass costs.
//!
//! ```text
//! window.rs ─▶ panels/ ─▶ State (settings, camera, clip) ─▶ seen.rs ─▶ a texture ─▶ window.rs
//!  winit, egui   egui       controls.rs                       Renderer::record
//! ```

mod background;
mod beside;
mod controls;
mod difference;
mod error;
mod pace;
mod panels;
mod player;
mod seen;
mod surface;
mod window;
mod wipe;

use std::path::Path;

use lanternfish::Settings;
use lanternfish_gpu::AdapterChoice;
use lanternfish_scene::{Camera, Scene};

pub use error::ViewerError;

/// Opens a file, or says why it cannot.
pub type Opener = Box<dyn Fn(&Path) -> Result<Opened, String>>;
/// Writes sRGB bytes, RGBA, of so many pixels across and down; says where they are, or why it cannot.
pub type Keeper = Box<dyn Fn(&[u8], [u32; 2]) -> Result<String, String>>;

/// What is seen first.
pub struct Start {
    /// What the window is called.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// Where it is seen from.
    pub camera: Camera,
    /// How it is rendered.
    pub settings: Settings,
    /// Points of the window across and down.
    pub size: [u32; 2],
    /// Where to run.
    pub adapter: AdapterChoice,
    /// Opens a file that was dropped on the window.
    pub open: Opener,
    /// Writes a screenshot.
    pub keep: Keeper,
}

/// A file that was opened.
pub struct Opened {
    /// What the window is called.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// Where it is seen from.
    pub camera: Camera,
}

/// Opens the window, and returns when it is closed.
pub fn run(start: Start) -> Result<(), ViewerError> {
    window::run(start)
}
