//! What can go wrong while a scene is uploaded or an image is made.

use lanternfish_gpu::GpuError;

use crate::deep_images::ListFault;

/// Why there is no image. Messages name the thing and the remedy.
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
        /// Asked for.
        width: u32,
        /// Asked for.
        height: u32,
        /// The device's largest texture side.
        limit: u32,
    },
    /// A setting needs a feature that the device was not opened with.
    #[error("{setting} needs {feature}, which this device does not have; use {instead}")]
    MissingFeature {
        /// The setting, as on the command line.
        setting: &'static str,
        /// What is missing.
        feature: &'static str,
        /// What works everywhere.
        instead: &'static str,
    },
    /// A setting meets a fault of the device's driver.
    #[error("{setting}: {driver} {fault}; use {instead}, or install a newer driver")]
    Driver {
        /// The setting, as on the command line.
        setting: &'static str,
        /// The driver and its version.
        driver: String,
        /// What it does.
        fault: &'static str,
        /// What works there.
        instead: &'static str,
    },
    /// A mean of no frames.
    #[error("--accumulate 0: a picture is the mean of 1 frame or more")]
    NoFrames,
    /// Two settings that go together only otherwise.
    #[error("{setting} needs {needed}")]
    Together {
        /// The setting, as on the command line.
        setting: &'static str,
        /// What it needs beside it, as on the command line.
        needed: &'static str,
    },
    /// A number that a setting cannot be.
    #[error("{setting} {got}: expected {needed}")]
    Value {
        /// The setting, as on the command line.
        setting: &'static str,
        /// What it is.
        got: String,
        /// What it can be.
        needed: &'static str,
    },
    /// No one frustum looks the way of all views that are to share a grid of clusters.
    #[error(
        "the views face apart: no perspective grid encloses them; use orthographic clusters (--clusters ortho:4), or a grid \
         for each view (--cluster-views individual)"
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
    /// What has changed since the upload is more than can be brought to the device.
    #[error("{what}: an update brings only what moves, lights and factors of materials; upload the scene again")]
    Changed {
        /// The first thing that is not as it was uploaded.
        what: String,
    },
    /// There is no such set of directions.
    #[error("deep images: {what}")]
    Directions {
        /// What is wrong with it.
        what: String,
    },
    /// Deep images are not what they must be.
    #[error("deep images: {0}; this is a bug, or another driver is needed")]
    Lists(#[from] ListFault),
    /// A picture of something in deep images that is not there.
    #[error("deep images: there is no {what} {number}: {known}")]
    NoSuch {
        /// An image, or a layer of one.
        what: &'static str,
        /// Asked for.
        number: i64,
        /// What there is.
        known: String,
    },
    /// A list outgrew what one binding of the device can hold.
    #[error("{list}: {needed} entries needed, at most {limit} fit this device: {remedy}")]
    Overflow {
        /// The list.
        list: &'static str,
        /// Entries it would need.
        needed: u64,
        /// Entries that fit.
        limit: u64,
        /// How to shrink it.
        remedy: &'static str,
    },
}
