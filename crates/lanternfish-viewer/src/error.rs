//! Errors of opening a window.

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewerError {
    /// The system has no display, or none that this program knows.
    #[error("no window can be opened: {0}. Without a display, `lanternfish render` makes images")]
    Display(String),
    /// The device, or the window's surface on it.
    #[error(transparent)]
    Gpu(#[from] lanternfish_gpu::GpuError),
    /// The scene cannot be rendered.
    #[error(transparent)]
    Render(#[from] lanternfish::RenderError),
    /// What was recorded is not kept.
    #[error("what was recorded is lost: {0}")]
    Record(String),
}
