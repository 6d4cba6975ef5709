//! Errors of uploading a scene or rendering an image.

use lanternfish_gpu::GpuError;

/// Why there is no image. Messages name the thing and the remedy; settings in backticks, by their names in shots and their values:
/// `shadows bvh`. A front end says them in its own words, as the command line does: `--shadows bvh`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The device cannot do or hold what was asked.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// More memory is needed than there is, or than may be used.
    #[error(transparent)]
    TooMuch(#[from] lanternfish_limits::memory::TooMuch),
    /// The image has no pixels, or more than the device can draw.
    #[error("image of {width} x {height} pixels: each side must be from 1 to {limit}")]
    Size {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
        /// The device's largest texture side, pixels.
        limit: u32,
    },
    /// A setting needs a feature that the device was not opened with.
    #[error("{setting} needs {feature}, which this device does not have; use {instead}")]
    MissingFeature {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// The feature that is missing.
        feature: &'static str,
        /// A setting that works on every device.
        instead: &'static str,
    },
    /// A setting meets a fault of the device's driver.
    #[error("{setting}: {driver} {fault}; use {instead}, or install a newer driver")]
    Driver {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// The driver and its version.
        driver: String,
        /// The fault: what the driver does.
        fault: &'static str,
        /// A setting that works with this driver.
        instead: &'static str,
    },
    /// [`crate::settings::Settings::accumulate`] is 0: a mean of no frames.
    #[error("`accumulate 0`: an image is the mean of 1 frame or more")]
    NoFrames,
    /// A setting needs another one beside it, or a value within other bounds.
    #[error("{setting} needs {needed}")]
    Together {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// What the setting needs: another setting, or the values it can have.
        needed: &'static str,
    },
    /// A setting has a value that it cannot have.
    #[error("{setting} {got}: expected {needed}")]
    Value {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// The value it has.
        got: String,
        /// The values it can have.
        needed: &'static str,
    },
    /// No one frustum looks the way of all views that are to share a grid of clusters.
    #[error(
        "the views face apart: no perspective grid encloses them; use orthographic clusters (`clusters ortho:4`), or a grid \
         for each view (`cluster-views individual`)"
    )]
    Unaligned,
    /// The scene is not as its types promise.
    #[error("the scene is not valid: {what}; put it right, and ask `Scene::validate` for the next such fault")]
    InvalidScene {
        /// The first fault, and where it is.
        what: String,
    },
    /// The scene on the device does not have what these settings need.
    #[error("the scene was uploaded under other settings: {what}; upload it with the renderer that is to render it")]
    OtherSettings {
        /// What it has, or lacks.
        what: &'static str,
    },
    /// The scene lies on another device than the renderer's.
    #[error("the scene was uploaded to another device; upload it with the renderer that is to render it")]
    OtherDevice,
    /// There is no view through such a camera.
    #[error("camera: {what}")]
    Camera {
        /// What is wrong with it, and how it is put right.
        what: String,
    },
    /// The image of a view cannot go where it is wanted.
    #[error("the target of view {key}: {what}")]
    Target {
        /// [`crate::ViewRequest::key`].
        key: u64,
        /// What is wrong with it.
        what: String,
    },
    /// The frame before is recorded in the caller's commands, and nobody has said what became of them.
    #[error(
        "the frame before was not submitted: call `Renderer::submitted` after its commands were, or `Renderer::discard` if they never will be"
    )]
    NotSubmitted,
    /// A frame has made place for another one, or was never there.
    #[error("the frame is no longer there: only the last one that was recorded can be read")]
    Gone,
    /// One thing cannot be brought to the device by itself.
    #[error("{what}: `Renderer::update` brings it, with the whole scene")]
    NeedsUpdate {
        /// Why it cannot.
        what: String,
    },
    /// The scene has no such animation.
    #[error("there is no animation {number}: the scene has {count}, from 0 on (`Scene::motion`)")]
    NoAnimation {
        /// The index that was requested.
        number: usize,
        /// Animations that there are.
        count: usize,
    },
    /// A set of directions that cannot be made.
    #[error("deep images: {what}")]
    Directions {
        /// What is wrong with the set.
        what: String,
    },
    /// A check of what the device wrote has failed.
    #[error("{what}: {fault}; this is a bug, or another driver is needed")]
    Check {
        /// What was checked.
        what: &'static str,
        /// What was found.
        #[source]
        fault: Box<dyn std::error::Error + Send + Sync>,
    },
    /// An image or a layer of deep images was requested that does not exist.
    #[error("deep images: there is no {what} {number}: {known}")]
    NoSuch {
        /// An image, or a layer of one.
        what: &'static str,
        /// The number that was requested.
        number: i64,
        /// The numbers there are.
        known: String,
    },
    /// A list outgrew what one binding of the device can hold.
    #[error("{list}: {needed} entries needed, at most {limit} fit this device: {remedy}")]
    Overflow {
        /// The name of the list.
        list: &'static str,
        /// Entries it would need.
        needed: u64,
        /// Entries that fit.
        limit: u64,
        /// How to shrink it.
        remedy: &'static str,
    },
}
