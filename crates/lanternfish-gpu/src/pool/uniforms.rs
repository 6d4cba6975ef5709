//! Capacity for the uniforms of a frame: they lie behind each other in a few buffers, which are written once for each submission.

use crate::{BufferPart, made};

/// Bytes of a buffer: as many as one uniform may have on every device.
const PAGE_BYTES: u64 = 1 << 16;

#[derive(Debug)]
struct Page {
    buffer: wgpu::Buffer,
    /// What has been asked for since the frame began.
    staged: Vec<u8>,
    /// How much of it the device has.
    written: usize,
    last_frame: u64,
}

#[derive(Debug)]
pub(crate) struct Uniforms {
    device: wgpu::Device,
    pages: Vec<Page>,
    frame: u64,
    /// Offsets that may be bound are multiples of it.
    alignment: usize,
}

impl Uniforms {
    pub fn new(device: &wgpu::Device) -> Self {
        let alignment = device.limits().min_uniform_buffer_offset_alignment as usize;
        Self { device: device.clone(), pages: Vec::new(), frame: 0, alignment }
    }

    /// Capacity that will hold `content` when the commands run that come before the next submission.
    pub fn get(&mut self, content: &[u8]) -> BufferPart {
        assert!(content.len() as u64 <= PAGE_BYTES, "a uniform of {} bytes", content.len());
        let fits = |page: &Page| page.staged.len() + content.len() <= PAGE_BYTES as usize;
        let page = self.pages.iter().position(fits).unwrap_or_else(|| {
            made::count(|made| made.buffers += 1);
            let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("uniforms"),
                size: PAGE_BYTES,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            self.pages.push(Page { buffer, staged: Vec::new(), written: 0, last_frame: self.frame });
            self.pages.len() - 1
        });
        let page = &mut self.pages[page];
        page.last_frame = self.frame;
        let offset = page.staged.len() as u64;
        page.staged.extend_from_slice(content);
        page.staged.resize(page.staged.len().next_multiple_of(self.alignment), 0);
        BufferPart { buffer: page.buffer.clone(), offset, bytes: content.len() as u64 }
    }

    /// Writes what was requested since the last time. What submissions of the same frame have read stays as it is.
    pub fn write(&mut self, queue: &wgpu::Queue) {
        for page in self.pages.iter_mut().filter(|page| page.written < page.staged.len()) {
            let end = page.staged.len().min(PAGE_BYTES as usize);
            queue.write_buffer(&page.buffer, page.written as u64, &page.staged[page.written..end]);
            page.written = page.staged.len();
        }
    }

    pub fn begin(&mut self, frame: u64, oldest: u64) {
        self.frame = frame;
        self.pages.retain_mut(|page| {
            page.staged.clear();
            page.written = 0;
            page.last_frame >= oldest
        });
    }

    pub fn bytes(&self) -> u64 {
        self.pages.len() as u64 * PAGE_BYTES
    }
}
