//! The image that the window shows: the last complete one, on the device that paints the window.

use std::sync::Arc;

use lanternfish_gpu::Gpu;

use crate::texture::{texture, write};

/// Bytes of a texel of [`crate::texture::FORMAT`].
const TEXEL: u32 = 4;

/// The last complete image, one texture for each eye.
#[derive(Debug)]
pub struct ShownImage {
    /// The device that paints, if it is not the one that renders.
    interface: Option<Arc<Gpu>>,
    textures: Vec<wgpu::TextureView>,
    /// Copies of the frame in flight for the host.
    copies: Vec<wgpu::Buffer>,
    /// The submission of the copies.
    submission: Option<wgpu::SubmissionIndex>,
}

impl ShownImage {
    /// A black image of one pixel. `interface`: the device that paints, if it is not the one that renders.
    pub fn new(gpu: &Gpu, interface: Option<Arc<Gpu>>) -> Self {
        let device = interface.as_ref().map_or(&gpu.device, |interface| &interface.device);
        Self { textures: vec![texture(device, glam::UVec2::ONE)], interface, copies: Vec::new(), submission: None }
    }

    /// The device that paints, if it is not the one that renders.
    pub fn interface(&self) -> Option<&Arc<Gpu>> {
        self.interface.as_ref()
    }

    /// The image of each eye.
    pub fn textures(&self) -> &[wgpu::TextureView] {
        &self.textures
    }

    /// The last commands of a frame into `targets`: copies for another device. They belong to the frame's last submission, because a driver
    /// may wait in `submit` for the submission before.
    pub fn record(&mut self, gpu: &Gpu, targets: &[wgpu::TextureView]) -> Option<wgpu::CommandBuffer> {
        self.forget();
        self.interface.as_ref()?;
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        self.copies = targets.iter().map(|target| copy(&gpu.device, &mut commands, target.texture())).collect();
        Some(commands.finish())
    }

    /// Notes that all commands of the frame were submitted.
    pub fn submitted(&mut self, submission: wgpu::SubmissionIndex) {
        for copy in &self.copies {
            // `complete` waits for the submission, and reads only if it has run.
            copy.map_async(wgpu::MapMode::Read, .., |_| ());
        }
        self.submission = Some(submission);
    }

    /// Shows a frame that the device has completed.
    pub fn complete(&mut self, gpu: &Gpu, targets: &[wgpu::TextureView]) {
        let Some(interface) = &self.interface else {
            self.textures = targets.to_vec();
            return;
        };
        let (copies, submission) = (std::mem::take(&mut self.copies), self.submission.take());
        // The frame has ended, so this does not wait.
        let done = gpu.device.poll(wgpu::PollType::Wait { submission_index: submission, timeout: None });
        if let Err(error) = done {
            tracing::error!("the image cannot be shown: {error}");
            return;
        }
        self.textures.truncate(targets.len());
        for (slot, (target, copied)) in targets.iter().zip(&copies).enumerate() {
            let size = glam::UVec2::new(target.texture().width(), target.texture().height());
            let is_other = |shown: &wgpu::TextureView| shown.texture().size() != target.texture().size();
            if self.textures.get(slot).is_none_or(is_other) {
                self.textures.truncate(slot);
                self.textures.push(texture(&interface.device, size));
            }
            let Ok(bytes) = copied.get_mapped_range(..) else { continue };
            let (row, stride) = ((TEXEL * size.x) as usize, stride(size.x) as usize);
            let rows: Vec<u8> = bytes.chunks(stride).flat_map(|padded| &padded[..row]).copied().collect();
            write(&interface.queue, &self.textures[slot], &rows);
        }
    }

    /// Forgets the frame in flight, which is not shown.
    pub fn forget(&mut self) {
        (self.copies, self.submission) = (Vec::new(), None);
    }
}

/// Bytes of a row of a copied texture.
fn stride(width: u32) -> u32 {
    (TEXEL * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

/// Copies a texture to a new buffer that the host can read.
fn copy(device: &wgpu::Device, commands: &mut wgpu::CommandEncoder, from: &wgpu::Texture) -> wgpu::Buffer {
    let stride = stride(from.width());
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("viewer/shown"),
        size: u64::from(stride) * u64::from(from.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(stride), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    commands.copy_texture_to_buffer(from.as_image_copy(), to, from.size());
    buffer
}
