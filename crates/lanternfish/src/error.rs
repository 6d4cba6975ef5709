//! Errors of uploading a scene or rendering an image.

use lanternfish_gpu::GpuError;
use lanternfish_scene::SceneFault;

/// The reason why there is no image. Messages name the cause and the remedy. Settings stand in backticks with the names
/// of shot files: `shadows bvh`. A front end may rewrite them: the command line prints `--shadows bvh`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The device does not support the request or cannot allocate it.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The memory budget or the device's memory is exceeded.
    #[error(transparent)]
    TooMuch(#[from] lanternfish_limits::memory::TooMuch),
    /// Not enough memory for an image's pixels, or above the memory limit.
    #[error(transparent)]
    ImageTooLarge(lanternfish_limits::memory::TooMuch),
    /// The caller ended the work: [`Renderer::render_frames`](crate::Renderer::render_frames).
    #[error("interrupted")]
    Interrupted,
    /// The image has no pixels or exceeds the device's texture limit.
    #[error("image of {width} x {height} pixels: each side must be from 1 to {limit}")]
    Size {
        /// Requested width, pixels.
        width: u32,
        /// Requested height, pixels.
        height: u32,
        /// The device's largest texture side, pixels.
        limit: u32,
    },
    /// A setting needs a device feature that is not enabled.
    #[error("{setting} needs {feature}, which this device does not have; use {instead}")]
    MissingFeature {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// The missing feature.
        feature: &'static str,
        /// A setting that works on every device.
        instead: &'static str,
    },
    /// A defect of the device's driver affects a setting.
    #[error("{setting}: {driver} {fault}; use {instead}, or install a newer driver")]
    Driver {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// The driver and its version.
        driver: String,
        /// The defect.
        fault: &'static str,
        /// A setting that works with this driver.
        instead: &'static str,
    },
    /// [`ImageSettings::accumulate`](crate::settings::ImageSettings::accumulate) is 0, and a mean needs at least one
    /// frame.
    #[error("`accumulate 0`: an image is the mean of 1 frame or more")]
    NoFrames,
    /// A setting needs another setting, or a value in another range.
    #[error("{setting} needs {needed}")]
    Together {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// The needed setting or the valid values.
        needed: &'static str,
    },
    /// A setting has an invalid value.
    #[error("{setting} {got}: expected {needed}")]
    Value {
        /// The setting: see [`RenderError`].
        setting: &'static str,
        /// The invalid value.
        got: String,
        /// The valid values.
        needed: &'static str,
    },
    /// No frustum encloses all views that share a cluster grid.
    #[error(
        "the views face different directions: no perspective grid encloses them; use orthographic clusters (`clusters ortho:4`), or a grid \
         for each view (`cluster-views individual`)"
    )]
    Unaligned,
    /// The scene is not valid.
    #[error("the scene is not valid: {0}; fix it, then run `Scene::validate` to find the next error")]
    InvalidScene(#[from] SceneFault),
    /// The uploaded scene lacks data that these settings need.
    #[error("the scene was uploaded under other settings: {what}; upload it with the renderer that is to render it")]
    OtherSettings {
        /// The difference.
        what: &'static str,
    },
    /// The scene was uploaded to another device than the renderer's.
    #[error("the scene was uploaded to another device; upload it with the renderer that is to render it")]
    OtherDevice,
    /// The camera has no valid view.
    #[error("camera: {what}")]
    Camera {
        /// The error and its remedy.
        what: String,
    },
    /// The image of a view cannot be written to its target.
    #[error("the target of view {key}: {what}")]
    Target {
        /// [`crate::ViewRequest::key`].
        key: u64,
        /// The error.
        what: String,
    },
    /// The previous frame is recorded in the caller's commands and was neither submitted nor dropped.
    #[error(
        "the previous frame was not submitted: call `Renderer::submitted` after its commands were, or drop its `PendingFrame` with them"
    )]
    NotSubmitted,
    /// The frame was replaced by a later frame, or never existed.
    #[error("the frame is no longer there: only the last one that was recorded can be read")]
    Gone,
    /// A single item cannot be uploaded alone.
    #[error("{what}: upload the complete scene with `Renderer::update`")]
    NeedsUpdate {
        /// The reason.
        what: String,
    },
    /// The scene has no such animation.
    #[error("there is no animation {number}: the scene has {count}, from 0 on (`Scene::motion`)")]
    NoAnimation {
        /// The requested index.
        number: usize,
        /// Number of animations in the scene.
        count: usize,
    },
    /// The direction set is not valid.
    #[error("deep images: {what}")]
    Directions {
        /// The error.
        what: String,
    },
    /// A check of device-written data failed.
    #[error("{what}: {fault}; this is a bug, or another driver is needed")]
    Check {
        /// The checked data.
        what: &'static str,
        /// The failure.
        #[source]
        fault: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A list exceeds the largest binding of the device.
    #[error("{list}: {needed} entries needed, at most {limit} fit this device: {remedy}")]
    Overflow {
        /// The name of the list.
        list: &'static str,
        /// Number of entries needed.
        needed: u64,
        /// Number of entries that fit.
        limit: u64,
        /// How to make the list smaller.
        remedy: &'static str,
    },
}
