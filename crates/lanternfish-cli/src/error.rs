//! The one error a run ends with: what, where, and what to do.

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
use lanternfish_scene::{SceneError, memory::TooMuch};

use crate::{flags::as_flags, output::has_ending};

/// Why the program stops.
#[derive(Debug)]
pub enum CliError {
    /// Something a user can do something about.
    Failed {
        /// What went wrong, and where.
        what: String,
        /// What to do, as a sentence without capital and full stop.
        hint: String,
    },
    /// Standard output was closed by its reader: not an error.
    ReaderGone,
}

impl CliError {
    /// What went wrong and where, and what to do about it; see [`CliError::Failed`].
    pub fn new(what: impl fmt::Display, hint: impl Into<String>) -> Self {
        Self::Failed { what: what.to_string(), hint: hint.into() }
    }

    /// What went wrong, in a line, without what to do.
    pub fn what(&self) -> String {
        match self {
            Self::Failed { what, .. } => what.clone(),
            Self::ReaderGone => "standard output is closed".to_owned(),
        }
    }

    /// An error of writing to standard output.
    pub(crate) fn from_stdout(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ReaderGone,
            _ => Self::new(format_args!("standard output: {error}"), "check where the output is sent to"),
        }
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failed { what, hint } if hint.is_empty() => write!(f, "error: {what}"),
            Self::Failed { what, hint } => write!(f, "error: {what}\n\n  hint: {hint}"),
            Self::ReaderGone => Ok(()),
        }
    }
}

impl From<SceneError> for CliError {
    fn from(error: SceneError) -> Self {
        let hint = match &error {
            SceneError::Io { source, path } if source.kind() == io::ErrorKind::NotFound && !is_environment(path) => {
                "check the path, or render a built-in scene: lanternfish render demo:atrium"
            }
            SceneError::Io { .. } => "check that the file can be read",
            SceneError::TooMuch { need, .. } => memory_hint(need),
            SceneError::Outside { .. } => "put the file into the scene's folder, or leave --confine out",
            SceneError::UnknownFormat { .. } => {
                "export the scene as glTF 2.0 (.glb), which every modelling program can"
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
            SceneError::UnknownDemo { .. } => "choose one of these, or name a .gltf, .glb or .obj file",
            _ => "",
        };
        Self::new(&error, hint)
    }
}

/// What to do where memory is short.
pub(crate) fn memory_hint(need: &TooMuch) -> &'static str {
    match need.limit {
        Some(_) => "allow more with a larger --memory-limit, or choose a smaller file",
        None => "free memory, or choose a smaller file; --memory-limit sets another limit than what is free",
    }
}

/// Whether it is a file that only [`lanternfish_scene::Environment`] is read from.
fn is_environment(path: &Path) -> bool {
    has_ending(path, "hdr") || has_ending(path, "exr")
}

impl From<GpuError> for CliError {
    fn from(error: GpuError) -> Self {
        let hint = match &error {
            // These messages say what to do themselves.
            GpuError::NoAdapter => "`cargo xtask demo` installs one; `lanternfish info --adapters` lists what is there",
            GpuError::UnknownAdapter { .. } => "`lanternfish info --adapters` lists them; a part of the name is enough",
            GpuError::NoHardware { .. } => {
                "install the card's driver; `lanternfish info --adapters` lists what is found, and --adapter cpu takes software"
            }
            GpuError::Device { .. } => "choose another adapter with --adapter; --adapter cpu is the safest",
            GpuError::TooLarge { .. } => {
                "the scene or the image is larger than this adapter can hold: choose a smaller --size, fewer lights \
                 or a simpler scene, or another adapter with --adapter"
            }
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
            ReferenceError::InvalidScene { .. } => "this is a bug of Lanternfish; please report it with the scene",
            // The others say what may be given.
            _ => "",
        };
        Self::new(&error, hint)
    }
}

impl From<MetricsError> for CliError {
    fn from(error: MetricsError) -> Self {
        Self::new(&error, "check that the disk has room and the folder can be written to")
    }
}

/// Prints a line to standard error. Where that is full or closed there is nobody left to tell, so failing is no error.
pub fn say(what: &dyn fmt::Display) {
    let _ = writeln!(io::stderr(), "{what}");
}

/// A panic is a bug of ours: it is reported like any other error, with what is needed to report it.
pub(crate) fn install_panic_message() {
    panic::set_hook(Box::new(|info| {
        let message = info.payload_as_str().unwrap_or("no message");
        let place = info.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
        let what = format!("internal error: {message}{place}");
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
    fn a_hint_does_not_blame_what_is_not_at_fault() {
        let hint = |error: GpuError| CliError::from(error).to_string().split_once("hint: ").unwrap().1.to_owned();
        // Buffers grow with the scene's geometry, its lights, or the image: the label alone does not tell which.
        let buffer = hint(GpuError::TooLarge { what: "scene/positions".to_owned(), needed: 2, limit: 1 });
        for word in ["--size", "lights", "simpler scene", "--adapter"] {
            assert!(buffer.contains(word), "{buffer}");
        }
        let image = hint(GpuError::TextureSize { name: "moss".to_owned(), width: 9, height: 1, limit: 8 });
        assert!(image.contains("image") && !image.contains("--size") && !image.contains("lights"), "{image}");
    }
}
