//! Named buffers for passes of tests.

use std::collections::BTreeMap;

use bytemuck::Pod;

use crate::{Bindings, ComputeKernel, Frame, Gpu, LinkedShader, Profiler, read_back};

/// Buffers by their names in shaders. A buffer may have several names.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    buffers: Vec<Vec<u8>>,
    names: BTreeMap<String, usize>,
}

impl Memory {
    /// No buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// Binds a new buffer with this content under these names.
    pub fn bind<T: Pod>(&mut self, names: &[&str], content: &[T]) {
        self.buffers.push(bytemuck::cast_slice(content).to_vec());
        self.names.extend(names.iter().map(|name| ((*name).to_owned(), self.buffers.len() - 1)));
    }

    /// Replaces a buffer's content.
    pub fn set<T: Pod>(&mut self, name: &str, content: &[T]) {
        let buffer = self.names[name];
        self.buffers[buffer] = bytemuck::cast_slice(content).to_vec();
    }

    /// A buffer's content.
    pub fn get<T: Pod>(&self, name: &str) -> Vec<T> {
        bytemuck::pod_collect_to_vec(&self.buffers[self.names[name]])
    }

    /// Runs an entry point on these buffers.
    pub fn run_on(&mut self, gpu: &Gpu, shader: &LinkedShader, entry: &str, workgroups: [u32; 3]) {
        self.run(gpu, &ComputeKernel::new(&gpu.device, shader, entry, entry), workgroups);
    }

    /// The same for a compiled entry point.
    pub fn run(&mut self, gpu: &Gpu, kernel: &ComputeKernel, workgroups: [u32; 3]) {
        self.run_beside(gpu, kernel, &Bindings::new(), workgroups);
    }

    /// The same with other resources, under names that have no buffer here.
    pub fn run_beside(&mut self, gpu: &Gpu, kernel: &ComputeKernel, others: &Bindings<'_>, workgroups: [u32; 3]) {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let buffer = |content: &Vec<u8>| {
            let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("memory"),
                size: content.len().next_multiple_of(16) as u64,
                usage: usage | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            gpu.queue.write_buffer(&buffer, 0, content);
            buffer
        };
        let buffers: Vec<_> = self.buffers.iter().map(buffer).collect();
        let bound = self.names.iter().fold(others.clone(), |bound, (name, index)| {
            // The size before rounding up, because shaders may query the length.
            let size = std::num::NonZeroU64::new(self.buffers[*index].len() as u64);
            let part = wgpu::BufferBinding { buffer: &buffers[*index], offset: 0, size };
            bound.resource(name, wgpu::BindingResource::Buffer(part))
        });
        let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
        let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
        frame.dispatch(kernel, &bound, workgroups);
        frame.submit();
        for (content, buffer) in self.buffers.iter_mut().zip(&buffers) {
            *content = read_back(&gpu.device, &gpu.queue, buffer, content.len()).expect("a test's buffer can be read");
        }
    }
}
