//! Suballocation of a frame's uniforms from a few buffers, which are written once per submission.

use crate::{BufferPart, made};

/// Size of a buffer, bytes: the maximum size of a uniform binding that every device supports.
const PAGE_BYTES: u64 = 1 << 16;

#[derive(Debug)]
struct Page {
    buffer: wgpu::Buffer,
    /// Content requested since the frame began.
    staged: Vec<u8>,
    /// Number of staged bytes that were written to the buffer.
    written: usize,
    last_frame: u64,
}

#[derive(Debug)]
pub(crate) struct Uniforms {
    device: wgpu::Device,
    pages: Vec<Page>,
    frame: u64,
    /// Required alignment of binding offsets, bytes.
    alignment: usize,
}

impl Uniforms {
    pub fn new(device: &wgpu::Device) -> Self {
        let alignment = device.limits().min_uniform_buffer_offset_alignment as usize;
        Self { device: device.clone(), pages: Vec::new(), frame: 0, alignment }
    }

    /// A buffer range that holds `content` when the commands of the next submission run.
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

    /// Writes the content requested since the last call. Content read by earlier submissions of the frame stays unchanged.
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
