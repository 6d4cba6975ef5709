//! Errors of devices, shaders and buffers.

/// Why the GPU cannot be used as asked. Messages name the thing and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no adapter at all.
    #[error(
        "no graphics adapter found: install a Vulkan driver (Debian, Ubuntu: `apt-get install mesa-vulkan-drivers \
         libvulkan1` gives a software one)"
    )]
    NoAdapter,
    /// No adapter of that name.
    #[error("no adapter called {name:?}; there are: {known}")]
    UnknownAdapter {
        /// What was requested.
        name: String,
        /// What there is.
        known: String,
    },
    /// A graphics card was requested, and there is none.
    #[error("no graphics card found; there are: {known}")]
    NoHardware {
        /// What there is.
        known: String,
    },
    /// The adapter refused to open a device.
    #[error("{adapter}: cannot open a device: {source}")]
    Device {
        /// The adapter's name.
        adapter: String,
        /// The driver's reason.
        source: wgpu::RequestDeviceError,
    },
    /// A shader does not link or validate.
    #[error("shader {shader}: {what}")]
    Shader {
        /// The module that was linked.
        shader: String,
        /// The linker's or validator's message, with source lines.
        what: String,
    },
    /// More memory than the adapter can bind or hold.
    #[error("{what}: {needed} bytes needed, the adapter's limit is {limit}")]
    TooLarge {
        /// The list or image.
        what: String,
        /// Bytes it would need.
        needed: u64,
        /// The adapter's limit, bytes.
        limit: u64,
    },
    /// An image has more pixels a side than the adapter's textures.
    #[error("texture {name:?} of {width} x {height} pixels: the adapter's limit is {limit} a side")]
    TextureSize {
        /// The image's name.
        name: String,
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
        /// The adapter's largest texture side.
        limit: u32,
    },
    /// The device ran out of memory, or does not allow what was asked.
    #[error("{what}: the device refused: {source}; try a smaller image or scene")]
    Refused {
        /// What was being done.
        what: String,
        /// wgpu's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The device is gone, and all that was on it.
    #[error("the device is lost: open it again, make the renderer again, and upload its scenes")]
    Lost,
    /// A frame in the caller's commands cannot be handed to the device before it is finished.
    #[error("{what}: read by the host in the middle of a frame, where frames may not wait")]
    Waits {
        /// What is read.
        what: &'static str,
    },
    /// The device stopped answering.
    #[error("{what}: the device was lost or refused to be read: {source}")]
    ReadBack {
        /// What was read.
        what: String,
        /// wgpu's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}
