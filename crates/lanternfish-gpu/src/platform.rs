//! What differs in a browser (wasm32), which cannot wait: its promises are kept only after the program has returned to it.

use std::borrow::Cow;

use crate::LinkedShader;

/// True if the program can wait for the device. Where it cannot, images are rendered by frames that are recorded and polled, readbacks in
/// the middle of a frame are errors, a frame's report tells that the device was lost, and errors of the device go to
/// [`wgpu::Device::on_uncaptured_error`], which whoever opens the device sets.
pub const CAN_WAIT: bool = cfg!(not(target_arch = "wasm32"));

/// The result of a future; none in a browser.
pub fn wait<T>(future: impl Future<Output = T>) -> Option<T> {
    CAN_WAIT.then(|| pollster::block_on(future))
}

/// Errors of a kind that a device reports from now on. In a browser they stay with the handler of uncaptured errors.
pub struct ErrorScope(Option<wgpu::ErrorScopeGuard>);

impl ErrorScope {
    pub fn new(device: &wgpu::Device, kind: wgpu::ErrorFilter) -> Self {
        Self(CAN_WAIT.then(|| device.push_error_scope(kind)))
    }

    /// The first error.
    pub fn end(self) -> Option<wgpu::Error> {
        wait(self.0?.pop())?
    }
}

/// What the device compiles: the validated module, or in a browser, which has a validator of its own, the text.
pub fn source(shader: &LinkedShader) -> wgpu::ShaderSource<'_> {
    match CAN_WAIT {
        true => wgpu::ShaderSource::Naga(Cow::Owned(shader.module.clone())),
        false => wgpu::ShaderSource::Wgsl(Cow::Borrowed(&shader.source)),
    }
}
