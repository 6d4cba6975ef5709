//! The command encoders that a frame records into.

use super::profiler::{PassProgress, PassWatcher};

/// Command encoder of a frame.
#[derive(Debug)]
pub(super) enum Commands<'a> {
    /// Its own encoder, which the frame submits.
    Own(OwnCommands),
    /// The caller's encoder, which the caller submits.
    Callers(&'a mut wgpu::CommandEncoder),
    /// An encoder for each pass, which the caller submits in order.
    Slices(Slices<'a>),
}

impl Commands<'_> {
    /// An encoder that the frame submits.
    pub fn own(device: &wgpu::Device) -> Self {
        Self::Own(OwnCommands { current: encoder(device, "frame"), label: None, done: Vec::new() })
    }
}

impl std::ops::Deref for Commands<'_> {
    type Target = wgpu::CommandEncoder;

    fn deref(&self) -> &wgpu::CommandEncoder {
        match self {
            Self::Own(own) => &own.current,
            Self::Callers(encoder) => encoder,
            Self::Slices(slices) => &slices.current,
        }
    }
}

impl std::ops::DerefMut for Commands<'_> {
    fn deref_mut(&mut self) -> &mut wgpu::CommandEncoder {
        match self {
            Self::Own(own) => &mut own.current,
            Self::Callers(encoder) => encoder,
            Self::Slices(slices) => &mut slices.current,
        }
    }
}

/// Commands that the frame submits: all at once, or pass by pass if somebody watches them.
#[derive(Debug)]
pub(super) struct OwnCommands {
    current: wgpu::CommandEncoder,
    /// The pass of `current`, if passes are watched and it has one.
    label: Option<String>,
    /// Earlier passes that are watched.
    done: Vec<(String, wgpu::CommandBuffer)>,
}

impl OwnCommands {
    /// Begins a command buffer for the pass of this label unless the current one has no pass yet.
    pub fn cut(&mut self, device: &wgpu::Device, label: &str) {
        if let Some(before) = self.label.replace(label.to_owned()) {
            let current = std::mem::replace(&mut self.current, encoder(device, "frame"));
            self.done.push((before, current.finish()));
        }
    }

    /// Submits everything. Passes that are watched run one by one.
    pub fn submit(self, device: &wgpu::Device, queue: &wgpu::Queue, watcher: Option<&mut PassWatcher>) {
        let Self { current, label, mut done } = self;
        let (Some(label), Some(watcher)) = (label, watcher) else {
            queue.submit([current.finish()]);
            return;
        };
        done.push((label, current.finish()));
        let count = done.len();
        for (index, (label, commands)) in done.into_iter().enumerate() {
            watcher(PassProgress { label: &label, index, count });
            queue.submit([commands]);
            // If the device is lost, whoever reads the frame's results reports it.
            let _ = device.poll(wgpu::PollType::wait_indefinitely());
        }
    }
}

/// Command buffers of a frame, cut between its passes.
#[derive(Debug)]
pub(super) struct Slices<'a> {
    current: wgpu::CommandEncoder,
    /// True if `current` has a pass.
    has_pass: bool,
    done: &'a mut Vec<wgpu::CommandBuffer>,
}

impl<'a> Slices<'a> {
    pub fn new(device: &wgpu::Device, done: &'a mut Vec<wgpu::CommandBuffer>) -> Self {
        Self { current: encoder(device, "slice"), has_pass: false, done }
    }

    /// Begins a command buffer unless the current one has no pass yet.
    pub fn cut(&mut self, device: &wgpu::Device) {
        if std::mem::replace(&mut self.has_pass, true) {
            self.end(device);
        }
    }

    /// Ends the current command buffer and begins another one.
    pub fn end(&mut self, device: &wgpu::Device) {
        self.done.push(std::mem::replace(&mut self.current, encoder(device, "slice")).finish());
    }
}

fn encoder(device: &wgpu::Device, label: &str) -> wgpu::CommandEncoder {
    device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
}
