//! The error type of the command line: the fault, its location, and a hint.

use std::{
    backtrace::{Backtrace, BacktraceStatus},
    fmt,
    io::{self, Write},
    panic,
    path::Path,
};

use lanternfish::RenderError;
use lanternfish_gpu::GpuError;
use lanternfish_metrics::MetricsError;
use lanternfish_reference::ReferenceError;
use lanternfish_scene::{
    SceneError,
    memory::{Budget, TooMuch},
    printable,
};

use crate::{ending::has_ending, flags::as_flags, parse::Size};

/// Why the program stops.
#[derive(Debug)]
pub struct CliError {
    /// The fault and its location.
    what: String,
    /// The remedy, as a sentence without capital letter and full stop.
    hint: String,
}

impl CliError {
    /// Creates an error from a fault and a hint, which may be empty.
    pub fn new(what: impl fmt::Display, hint: impl Into<String>) -> Self {
        Self { what: what.to_string(), hint: hint.into() }
    }

    /// The fault in one line, without the hint.
    pub fn what(&self) -> String {
        self.what.clone()
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, hint } = self;
        match hint.is_empty() {
            true => write!(f, "error: {what}"),
            false => write!(f, "error: {what}\n\n  hint: {hint}"),
        }
    }
}

impl From<SceneError> for CliError {
    fn from(error: SceneError) -> Self {
        let hint = match &error {
            SceneError::Io { source, path }
                if source.kind() == io::ErrorKind::NotFound
                    && !["gltf", "glb", "obj"].iter().any(|ending| has_ending(path, ending))
                    && !is_environment(path) =>
            {
                "the scene consists of several files: copy this one to its place beside the others"
            }
            SceneError::Io { source, path } if source.kind() == io::ErrorKind::NotFound && !is_environment(path) => {
                "check the path, or render a built-in scene: lanternfish render demo:atrium"
            }
            SceneError::Io { .. } => "check that the file can be read",
            SceneError::TooMuch { need, .. } => memory_hint(need),
            SceneError::Outside { .. } => "put the file into the scene's folder, or leave --confine out",
            SceneError::UnknownFormat { .. } => {
                "export the scene as glTF 2.0 (.glb), which most modelling programs support; --environment FILE.hdr|.exr lights a scene"
            }
            SceneError::UnknownEnvironmentFormat { .. } => {
                "save it as Radiance (.hdr) or OpenEXR (.exr); a constant background is --sky"
            }
            SceneError::Invalid { path, .. } if is_environment(path) => {
                "save it again, or choose another --environment"
            }
            SceneError::Invalid { path, .. } if has_ending(path, "obj") => {
                "correct the file, or export the scene again, as OBJ or as glTF 2.0 (.glb)"
            }
            SceneError::Invalid { .. } => "export the file again; the Khronos glTF validator shows every fault it has",
            SceneError::Unsupported { .. } => "export the file again without it",
            SceneError::NoSuchScene { .. } => "choose one of these with --scene",
            SceneError::NoSuchVariant { known, .. } if known == "none" => "leave --variant out",
            SceneError::NoSuchVariant { .. } => "choose one of these with --variant, or leave it out",
            SceneError::UnknownDemo { .. } => "choose one of these, or name a .gltf, .glb or .obj file",
            _ => "",
        };
        // A path in a file may hold line breaks, and lines that look like a hint.
        Self::new(error.to_string().replace('\n', "\\n"), hint)
    }
}

/// A hint for lack of memory.
pub(crate) fn memory_hint(need: &TooMuch) -> &'static str {
    match need.limit {
        Some(_) => "allow more with a larger --memory-limit, or choose a smaller file",
        None => "free memory, or choose a smaller file; --memory-limit replaces the limit, which is the free memory",
    }
}

/// A hint for lack of memory for an image's pixels.
fn image_memory_hint(need: &TooMuch) -> &'static str {
    match need.limit {
        Some(_) => "choose a smaller --size, or allow more with a larger --memory-limit",
        None => "choose a smaller --size, or free memory; --memory-limit replaces the limit, which is the free memory",
    }
}

/// An error if the process may not allocate `bytes` for each pixel of an image.
pub(crate) fn check_image_memory(size: Size, bytes: u64) -> Result<(), CliError> {
    let Size { width, height } = size;
    let needed = bytes.saturating_mul(u64::from(width)).saturating_mul(u64::from(height));
    Budget::of_process()
        .check(needed, || format!("--size {width}x{height}: the image and writing it need"))
        .map_err(|need| CliError::new(&need, image_memory_hint(&need)))
}

/// True if only [`lanternfish_scene::Environment`] reads this file type.
fn is_environment(path: &Path) -> bool {
    has_ending(path, "hdr") || has_ending(path, "exr")
}

impl From<GpuError> for CliError {
    fn from(error: GpuError) -> Self {
        let hint = match &error {
            // These messages contain their own hint.
            GpuError::NoAdapter => "`cargo xtask demo` installs one; `lanternfish info --adapters` lists the adapters",
            GpuError::UnknownAdapter { .. } => "`lanternfish info --adapters` lists them; a part of the name is enough",
            GpuError::NoHardware { .. } => {
                "install the card's driver; `lanternfish info --adapters` lists the adapters, and --adapter cpu selects software"
            }
            GpuError::Device { .. } => "choose another adapter with --adapter; --adapter cpu is the safest",
            GpuError::TooLarge { .. } => {
                "the scene or the image is larger than this adapter can hold: choose a smaller --size, fewer lights \
                 or a simpler scene, or another adapter with --adapter"
            }
            GpuError::TooMuch(need) => image_memory_hint(need),
            GpuError::TextureSize { .. } => "scale the image down, or choose another adapter with --adapter",
            _ => "",
        };
        Self::new(&error, hint)
    }
}

impl From<RenderError> for CliError {
    fn from(error: RenderError) -> Self {
        let hint = match error {
            RenderError::Gpu(error) => return error.into(),
            RenderError::TooMuch(need) => return Self::new(&need, memory_hint(&need)),
            RenderError::ImageTooLarge(need) => return Self::new(&need, image_memory_hint(&need)),
            RenderError::Size { .. } => "choose a smaller --size",
            RenderError::MissingFeature { .. } => "`lanternfish info --adapters` lists what each adapter has",
            // Its message says how to shrink the list.
            _ => "",
        };
        Self::new(as_flags(&error.to_string()), hint)
    }
}

impl From<ReferenceError> for CliError {
    fn from(error: ReferenceError) -> Self {
        let hint = match &error {
            ReferenceError::TooMuch(need) => memory_hint(need),
            ReferenceError::ImageTooLarge(need) => image_memory_hint(need),
            ReferenceError::InvalidScene { .. } => "this is a bug of Lanternfish; please report it with the scene",
            // The other messages state the valid values.
            _ => "",
        };
        Self::new(&error, hint)
    }
}

impl From<MetricsError> for CliError {
    fn from(error: MetricsError) -> Self {
        Self::new(&error, "check that the disk has free space and the folder is writable")
    }
}

/// Prints a line to standard error. A failure is ignored, because nothing is left to report it to.
pub fn say(what: &dyn fmt::Display) {
    let _ = writeln!(io::stderr(), "{}", printable(&what.to_string()));
}

/// A panic is a bug in Lanternfish. It is reported like any other error, with the details for a bug report.
pub(crate) fn install_panic_message() {
    panic::set_hook(Box::new(|info| {
        let message = info.payload_as_str().unwrap_or("no message");
        let location = info.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
        let what = format!("internal error: {message}{location}");
        let hint = "this is a bug of Lanternfish; please report it with the command line and the scene";
        say(&CliError::new(what, hint));
        let backtrace = Backtrace::capture();
        if backtrace.status() == BacktraceStatus::Captured {
            say(&format_args!("\n{backtrace}"));
        }
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hints_name_only_possible_causes() {
        let hint = |error: GpuError| CliError::from(error).to_string().split_once("hint: ").unwrap().1.to_owned();
        // Buffers grow with the geometry, the lights or the image, and the label does not tell which.
        let buffer = hint(GpuError::TooLarge { what: "scene/positions".to_owned(), needed: 2, limit: 1 });
        for word in ["--size", "lights", "simpler scene", "--adapter"] {
            assert!(buffer.contains(word), "{buffer}");
        }
        let image = hint(GpuError::TextureSize { name: "moss".to_owned(), width: 9, height: 1, limit: 8 });
        assert!(image.contains("image") && !image.contains("--size") && !image.contains("lights"), "{image}");
    }
}
