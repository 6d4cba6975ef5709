//! Errors of devices, shaders and buffers.

/// An error of an adapter, a device or a shader. Messages name the object and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no adapter.
    #[error(
        "no graphics adapter found: install a Vulkan driver (Debian, Ubuntu: `apt-get install mesa-vulkan-drivers \
         libvulkan1` gives a software one)"
    )]
    NoAdapter,
    /// No adapter has the requested name.
    #[error("no adapter called {name:?}; there are: {known}")]
    UnknownAdapter {
        /// The requested name.
        name: String,
        /// Names of the available adapters.
        known: String,
    },
    /// A graphics card was requested, and there is none.
    #[error("no graphics card found; there are: {known}")]
    NoHardware {
        /// Names of the available adapters.
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
    /// A shader fails to link or to validate.
    #[error("shader {shader}: {what}")]
    Shader {
        /// The module that was linked.
        shader: String,
        /// The linker's or validator's message, with source lines.
        what: String,
    },
    /// A resource exceeds the adapter's limit for a binding or a buffer.
    #[error("{what}: {needed} bytes needed, the adapter's limit is {limit}")]
    TooLarge {
        /// The list or image.
        what: String,
        /// Required size, bytes.
        needed: u64,
        /// The adapter's limit, bytes.
        limit: u64,
    },
    /// A software adapter's frame needs more memory than this process may allocate.
    #[error(transparent)]
    TooMuch(lanternfish_limits::memory::TooMuch),
    /// An image is larger than the adapter's textures.
    #[error("texture {name:?} of {width} x {height} pixels: the adapter's limit is {limit} a side")]
    TextureSize {
        /// The image's name.
        name: String,
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
        /// The adapter's maximum texture size per side, pixels.
        limit: u32,
    },
    /// The device ran out of memory, or rejected a command.
    #[error("{what}: the device refused: {source}; try a smaller image or scene")]
    Refused {
        /// The operation.
        what: String,
        /// wgpu's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The device is lost, with all its resources.
    #[error("the device is lost: open it again, make the renderer again, and upload its scenes")]
    Lost,
    /// A frame in the caller's encoder needed a readback before it was finished, which it cannot wait for.
    #[error("{what}: readback in the middle of a frame that must not wait")]
    Waits {
        /// The resource to be read.
        what: &'static str,
    },
    /// A readback failed.
    #[error("{what}: readback failed, or the device was lost: {source}")]
    ReadBack {
        /// The resource to be read.
        what: String,
        /// wgpu's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}
