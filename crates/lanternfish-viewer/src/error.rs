//! Errors of opening a window.

/// An error of opening or running a window.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewerError {
    /// The system has no display, or none that is supported.
    #[error("no window can be opened: {0}; without a display, `lanternfish render` renders images")]
    Display(String),
    /// The device, or the window's surface on it, failed.
    #[error(transparent)]
    Gpu(#[from] lanternfish_gpu::GpuError),
    /// The scene cannot be rendered.
    #[error(transparent)]
    Render(#[from] lanternfish::RenderError),
    /// The recording could not be written.
    #[error("the recording is lost: {0}")]
    Record(String),
}
