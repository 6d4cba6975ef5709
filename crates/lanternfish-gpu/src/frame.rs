//! Records the commands of a frame, and times each dispatch and render pass under its label.

mod across_frames;
mod commands;
mod profiler;

use std::sync::atomic::{AtomicU64, Ordering};

pub use self::across_frames::AcrossFrames;
use self::commands::{Commands, Slices};
pub use self::profiler::{PassCommands, PassProgress, PassTime, PassWatcher, Profiler};
use crate::{
    BindGroups, Bindings, BufferPart, ComputeKernel, GpuError, Pool, buffer::with_mapped, compute::Workgroups,
    pool::Use,
};

/// A frame whose commands are being recorded.
#[derive(Debug)]
pub struct Frame<'a> {
    /// Device that the frame runs on.
    pub device: &'a wgpu::Device,
    /// Queue that the frame is submitted to. Writes through it arrive before the frame runs.
    pub queue: &'a wgpu::Queue,
    encoder: Commands<'a>,
    /// The open compute pass, which the next dispatch shares.
    pass: Option<wgpu::ComputePass<'static>>,
    profiler: &'a mut Profiler,
    pub(crate) pool: FramePool<'a>,
    number: u64,
}

/// Source of a frame's buffers, textures and bind groups.
#[derive(Debug)]
pub(crate) enum FramePool<'a> {
    /// A pool of this frame alone.
    Own(Box<Pool>),
    /// A pool shared with earlier and later frames.
    Shared(&'a mut Pool),
}

impl std::ops::Deref for FramePool<'_> {
    type Target = Pool;

    fn deref(&self) -> &Pool {
        match self {
            Self::Own(pool) => pool,
            Self::Shared(pool) => pool,
        }
    }
}

impl std::ops::DerefMut for FramePool<'_> {
    fn deref_mut(&mut self) -> &mut Pool {
        match self {
            Self::Own(pool) => pool,
            Self::Shared(pool) => pool,
        }
    }
}

impl<'a> Frame<'a> {
    /// An empty frame that creates its own resources.
    #[doc(hidden)]
    pub fn new(device: &'a wgpu::Device, queue: &'a wgpu::Queue, profiler: &'a mut Profiler) -> Self {
        Self::with(device, queue, profiler, FramePool::Own(Box::new(Pool::new(device))), Commands::own(device))
    }

    /// An empty frame that reuses the resources of earlier frames of the pool. Earlier frames of the pool must not use
    /// them any more.
    #[doc(hidden)]
    pub fn pooled(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        profiler: &'a mut Profiler,
        pool: &'a mut Pool,
    ) -> Self {
        Self::with(device, queue, profiler, FramePool::Shared(pool), Commands::own(device))
    }

    /// Like [`Self::pooled`], but records into the caller's encoder. The caller must submit it before the next frame of
    /// the pool begins, because host writes of a frame arrive with the next submission. Such a frame ends with
    /// [`Self::finish`], and the host cannot read back in the middle of it.
    #[doc(hidden)]
    pub fn within(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        profiler: &'a mut Profiler,
        pool: &'a mut Pool,
        commands: &'a mut wgpu::CommandEncoder,
    ) -> Self {
        Self::with(device, queue, profiler, FramePool::Shared(pool), Commands::Callers(commands))
    }

    /// Like [`Self::within`], but records into command buffers of its own, which it adds to `slices`: one for each
    /// dispatch or render pass. The caller submits them in order, in as many submissions as desired.
    #[doc(hidden)]
    pub fn sliced(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        profiler: &'a mut Profiler,
        pool: &'a mut Pool,
        slices: &'a mut Vec<wgpu::CommandBuffer>,
    ) -> Self {
        let slices = Commands::Slices(Slices::new(device, slices));
        Self::with(device, queue, profiler, FramePool::Shared(pool), slices)
    }

    fn with(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        profiler: &'a mut Profiler,
        mut pool: FramePool<'a>,
        mut encoder: Commands<'a>,
    ) -> Self {
        pool.begin(&mut encoder);
        pool.capacity_policy.begin(device, queue);
        profiler.recorded.clear();
        static FRAMES: AtomicU64 = AtomicU64::new(0);
        let number = FRAMES.fetch_add(1, Ordering::Relaxed) + 1;
        Self { device, queue, encoder, pass: None, profiler, pool, number }
    }

    /// The frame's unique number.
    #[doc(hidden)]
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Index of the frame among those of its pool, from 1.
    #[doc(hidden)]
    pub fn index(&self) -> u64 {
        self.pool.frame
    }

    /// A storage buffer of at least `bytes` with undefined content, which must be written before it is read. It may be
    /// longer than requested. Fails if `bytes` exceeds the device's limit for a binding.
    pub fn scratch(&mut self, label: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.pool.buffer(Use::Scratch, label, bytes)
    }

    /// Lets later requests of this frame return a buffer of [`Self::scratch`] again: no pass that is recorded from now
    /// on needs its content.
    #[doc(hidden)]
    pub fn release(&mut self, buffer: &wgpu::Buffer) {
        self.pool.buffers.release(buffer);
    }

    /// Like [`Self::scratch`], but filled with zeros at first, and also usable by [`Self::dispatch_indirect`].
    pub fn zeroed(&mut self, label: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.pool.buffer(Use::Zeroed, label, bytes)
    }

    /// A storage buffer that starts with this content when the commands run. It may be longer than the content.
    #[doc(hidden)]
    pub fn storage_of<T: bytemuck::NoUninit>(&mut self, label: &str, content: &[T]) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.pool.buffer(Use::Uploaded, label, size_of_val(content) as u64)?;
        self.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(content));
        Ok(buffer)
    }

    /// A uniform that has this content when the commands run.
    pub fn uniform<T: bytemuck::NoUninit>(&mut self, content: &T) -> BufferPart {
        self.pool.uniforms.get(bytemuck::bytes_of(content))
    }

    /// A view of all levels and layers of a texture whose content is undefined at first.
    pub fn texture(&mut self, wanted: &wgpu::TextureDescriptor<'_>) -> wgpu::TextureView {
        self.pool.texture(self.device, wanted)
    }

    /// Lets later requests of this frame return a texture of [`Self::texture`] again: no pass that is recorded from now
    /// on needs its content.
    ///
    /// Panics if the texture is not of this frame's pool.
    #[doc(hidden)]
    pub fn release_texture(&mut self, view: &wgpu::TextureView) {
        self.pool.textures.release(view);
    }

    /// Counts memory of a new resource that the caller creates for this and later frames. Fails on a software adapter
    /// if the process may not allocate it, like every later request of the frame.
    #[doc(hidden)]
    pub fn take_memory(&mut self, label: &str, bytes: u64) -> Result<(), GpuError> {
        self.pool.memory.take(label, bytes)
    }

    /// Fails if the process may not allocate the resources of this frame, which then must not be submitted.
    #[doc(hidden)]
    pub fn check_memory(&self) -> Result<(), GpuError> {
        self.pool.memory.check()
    }

    /// Drops all cached bind groups and their references to resources, so that memory is free before a large
    /// allocation.
    #[doc(hidden)]
    pub fn forget_bind_groups(&mut self) {
        self.pool.forget_bind_groups();
    }

    /// The command encoder, for copies and clears between passes.
    #[doc(hidden)]
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.pass = None;
        &mut self.encoder
    }

    /// Adds a dispatch. It sees all earlier writes.
    pub fn dispatch(&mut self, kernel: &ComputeKernel, bindings: &Bindings<'_>, workgroups: [u32; 3]) {
        self.compute(kernel, bindings, &Workgroups::Are(workgroups));
    }

    /// Adds a dispatch whose number of workgroups, three u32, is read from a buffer with indirect usage
    /// ([`Self::zeroed`]), at `offset` bytes. The dispatch may read this buffer, but not write it. The numbers must be
    /// within the device's limit, and the kernel must not use `num_workgroups` ([`crate::instance_flags`]).
    pub fn dispatch_indirect(
        &mut self,
        kernel: &ComputeKernel,
        bindings: &Bindings<'_>,
        workgroups: &wgpu::Buffer,
        offset: u64,
    ) {
        assert!(!kernel.uses_workgroup_count, "{}: `num_workgroups` in an indirect dispatch", kernel.label());
        self.compute(kernel, bindings, &Workgroups::In(workgroups, offset));
    }

    /// Begins a command buffer for the pass of this label, if the frame is cut between its passes.
    fn cut(&mut self, label: &str) {
        match &mut self.encoder {
            Commands::Slices(slices) => {
                self.pass = None;
                slices.cut(self.device);
            }
            Commands::Own(own) if self.profiler.watcher.is_some() => {
                self.pass = None;
                own.cut(self.device, label);
            }
            Commands::Own(_) | Commands::Callers(_) => {}
        }
    }

    fn compute(&mut self, kernel: &ComputeKernel, bindings: &Bindings<'_>, workgroups: &Workgroups<'_>) {
        self.cut(kernel.label());
        self.profiler.count(kernel.label(), true, matches!(workgroups, Workgroups::In(..)));
        if self.profiler.is_shared_pass {
            let pass = self.pass.get_or_insert_with(|| {
                self.profiler.compute_passes += 1;
                let descriptor = wgpu::ComputePassDescriptor { label: Some("dispatches"), timestamp_writes: None };
                self.encoder.begin_compute_pass(&descriptor).forget_lifetime()
            });
            let query = self.profiler.inner.begin_query(kernel.label(), pass);
            kernel.dispatch(&mut self.pool.bind_groups, pass, bindings, workgroups);
            self.profiler.inner.end_query(pass, query);
            return;
        }
        self.profiler.compute_passes += 1;
        let query = self.profiler.inner.begin_pass_query(kernel.label(), &mut self.encoder);
        let mut pass = self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(kernel.label()),
            timestamp_writes: query.compute_pass_timestamp_writes(),
        });
        kernel.dispatch(&mut self.pool.bind_groups, &mut pass, bindings, workgroups);
        drop(pass);
        self.profiler.inner.end_query(&mut *self.encoder, query);
    }

    /// Adds a render pass; `draw` fills it.
    #[doc(hidden)]
    pub fn render(
        &mut self,
        label: &str,
        colors: &[Option<wgpu::RenderPassColorAttachment<'_>>],
        depth: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
        draw: impl FnOnce(&mut BindGroups, &mut wgpu::RenderPass<'_>),
    ) {
        self.pass = None;
        self.cut(label);
        self.profiler.count(label, false, false);
        let query = self.profiler.inner.begin_pass_query(label, &mut self.encoder);
        let mut pass = self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: colors,
            depth_stencil_attachment: depth,
            timestamp_writes: query.render_pass_timestamp_writes(),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        draw(&mut self.pool.bind_groups, &mut pass);
        drop(pass);
        self.profiler.inner.end_query(&mut *self.encoder, query);
    }

    /// Submits the commands so far, waits for them, and reads the first `count` elements of a buffer.
    ///
    /// Passes before and after this call are timed as one frame. Fails in a frame whose commands the caller submits.
    #[doc(hidden)]
    pub fn read_now<T: bytemuck::Pod>(&mut self, buffer: &wgpu::Buffer, count: usize) -> Result<Vec<T>, GpuError> {
        if let Commands::Callers(_) | Commands::Slices(_) = self.encoder {
            return Err(GpuError::Waits { what: "a buffer" });
        }
        let bytes = (count * size_of::<T>()) as u64;
        let copied = bytes.next_multiple_of(4);
        let staging = self.pool.buffer(Use::Read, "read_now", copied)?;
        self.encoder().copy_buffer_to_buffer(buffer, 0, &staging, 0, copied);
        self.pass = None;
        let recorded = std::mem::replace(&mut self.encoder, Commands::own(self.device));
        let Commands::Own(recorded) = recorded else { unreachable!("checked above") };
        self.pool.submitting(self.queue);
        recorded.submit(self.device, self.queue, self.profiler.watcher.as_mut());
        self.pool.waits += 1;
        let read = with_mapped(self.device, &staging, |data| bytemuck::pod_collect_to_vec(&data[..bytes as usize]));
        staging.unmap();
        read
    }

    /// Submits the commands. Does not submit those that the caller submits (see [`Self::finish`]).
    #[doc(hidden)]
    pub fn submit(mut self) {
        self.close();
        let Self { device, queue, encoder, profiler, mut pool, number, .. } = self;
        if let Commands::Own(own) = encoder {
            own.submit(device, queue, profiler.watcher.as_mut());
            submitted(number, profiler, &mut pool);
        }
    }

    /// Ends a frame whose commands the caller submits, and returns its number, which the caller passes to [`submitted`]
    /// after submitting all.
    #[doc(hidden)]
    pub fn finish(mut self) -> u64 {
        self.close();
        if let Commands::Slices(slices) = &mut self.encoder {
            // No command is recorded after the last one.
            slices.end(self.device);
        }
        self.number
    }

    fn close(&mut self) {
        self.pass = None;
        self.profiler.inner.resolve_queries(&mut self.encoder);
        self.pool.capacity_policy.end(self.number, &mut self.encoder);
        self.pool.submitting(self.queue);
    }
}

/// Notes that the caller submitted the encoder that holds the frame of this number.
pub fn submitted(frame: u64, profiler: &mut Profiler, pool: &mut Pool) {
    pool.capacity_policy.submitted();
    profiler.submitted(frame);
}

/// Notes that the commands of the last frame will never be submitted.
pub fn discarded(device: &wgpu::Device, queue: &wgpu::Queue, profiler: &mut Profiler, pool: &mut Pool) {
    pool.capacity_policy.discarded();
    // The profiler still holds the frame's closed queries, which will never be resolved.
    profiler.renew(device, queue);
}

#[cfg(all(test, feature = "testing"))]
mod tests {
    use super::*;
    use crate::{primitives::Scan, read_back, storage_buffer_of, testing};

    /// With and without timestamps inside passes, a dispatch sees all earlier writes; and either all dispatches are
    /// timed or none.
    #[gpu_test]
    fn gpu_dispatches_share_a_pass_unless_that_prevents_timing(gpu: &Gpu) {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
        let adapter = adapters.iter().find(|adapter| adapter.get_info().name == gpu.description.name);
        let adapter = adapter.expect("it was opened before");
        let timestamps = wgpu::Features::TIMESTAMP_QUERY;
        let inside = timestamps.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);
        for required_features in [wgpu::Features::empty(), timestamps, inside] {
            if !adapter.features().contains(required_features) {
                println!("the adapter lacks {required_features:?}");
                continue;
            }
            let descriptor = wgpu::DeviceDescriptor { required_features, ..Default::default() };
            let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("it has them");
            let mut profiler = Profiler::new(&device, &queue);
            let scan = Scan::new(&device, "test").unwrap();
            let values = vec![3u32; 100_000];
            let none = wgpu::BufferUsages::empty();
            let buffer = storage_buffer_of(&device, "values", &values, none).unwrap();
            let mut frame = Frame::new(&device, &queue, &mut profiler);
            scan.record(&mut frame, &buffer, values.len() as u32).unwrap();
            let number = frame.number();
            frame.submit();
            let commands = profiler.commands_of(number);
            assert_eq!(commands.iter().map(|pass| pass.dispatches).sum::<u32>(), 3, "{commands:?}");
            let starts = read_back::<u32>(&device, &queue, &buffer, values.len()).unwrap();
            assert!(starts.iter().zip(0..).all(|(start, i)| *start == 3 * i), "{required_features:?}");
            let (passes, times) = (profiler.compute_passes(), profiler.finished());
            println!("{required_features:?}: {passes} passes, {} times", times.len());
            let dispatches = 3;
            let is_shared = required_features != timestamps;
            assert_eq!(passes, if is_shared { 1 } else { dispatches }, "{required_features:?}");
            let timed = if required_features.is_empty() { 0 } else { dispatches as usize };
            assert_eq!(times.len(), timed, "{required_features:?}: {times:?}");
        }
    }
}
