//! Transforms and vertices of the previous frame, for motion vectors.
//!
//! A frame that requests motion marks the current state of the scene as shown ([`GpuScene::note_shown`]). The first
//! change after it copies that state on the device; further changes before the next such frame copy nothing. A scene
//! for which no frame requests motion keeps no copy.

use std::sync::atomic::{AtomicBool, Ordering};

use super::super::scene::GpuScene;

/// The state that was shown last before a change.
#[derive(Debug, Default)]
pub(in crate::gpu_scene) struct Previous {
    /// True if a frame that requests motion has shown the current state.
    is_shown: AtomicBool,
    kept: Option<GeometryCopy>,
}

#[derive(Debug)]
struct GeometryCopy {
    /// [`GpuScene::generation`] of that state.
    generation: u64,
    instances: wgpu::Buffer,
    /// Created at the first deformation of vertices.
    positions: Option<wgpu::Buffer>,
    /// True if vertices have been deformed since that state; if false, they are unchanged.
    has_bent: bool,
}

/// Draw instances and vertex positions of one state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GeometryAt<'s> {
    pub instances: &'s wgpu::Buffer,
    pub positions: &'s wgpu::Buffer,
}

impl GpuScene {
    /// Notes that a frame that requests motion shows the current state.
    pub(crate) fn note_shown(&self) {
        self.previous.is_shown.store(true, Ordering::Relaxed);
    }

    /// The current geometry.
    pub(crate) fn geometry_now(&self) -> GeometryAt<'_> {
        GeometryAt { instances: &self.geometry.instances, positions: &self.geometry.positions }
    }

    /// The geometry at a [`Self::generation`], if it is available: the current one, or the one that was shown last
    /// before a change.
    pub(crate) fn geometry_at(&self, generation: u64) -> Option<GeometryAt<'_>> {
        let now = self.geometry_now();
        if generation == self.generation() {
            return Some(now);
        }
        let kept = self.previous.kept.as_ref().filter(|kept| kept.generation == generation)?;
        let positions = kept.positions.as_ref().filter(|_| kept.has_bent).unwrap_or(now.positions);
        Some(GeometryAt { instances: &kept.instances, positions })
    }

    /// Copies the draw instances if a frame has shown them. Call it before every write to draw instances, and before
    /// the scene's generation changes.
    pub(in crate::gpu_scene) fn before_instances_move(&mut self, queue: &wgpu::Queue) {
        if !std::mem::take(self.previous.is_shown.get_mut()) {
            return;
        }
        let generation = self.generation();
        let (instances, positions) = match self.previous.kept.take() {
            Some(GeometryCopy { instances, positions, .. }) => (instances, positions),
            None => (self.copy_target("scene/previous_instances", &self.geometry.instances), None),
        };
        self.copy(queue, &self.geometry.instances, &instances);
        self.previous.kept = Some(GeometryCopy { generation, instances, positions, has_bent: false });
    }

    /// Discards the copy: for changes after which the device has another order of draws.
    pub(in crate::gpu_scene) fn forget_previous(&mut self) {
        self.previous = Previous::default();
    }

    /// Copies draw instances and vertices if a frame has shown them. **Call it before every write to
    /// `scene/positions`**, on the host or on the device, and before the scene's generation changes. The copy is
    /// submitted at once: it precedes queue writes after the call and all commands that are submitted after the call,
    /// whenever they were recorded.
    pub(in crate::gpu_scene) fn before_vertices_bend(&mut self, queue: &wgpu::Queue) {
        self.before_instances_move(queue);
        let Some(mut kept) = self.previous.kept.take_if(|kept| !kept.has_bent) else { return };
        let now = &self.geometry.positions;
        let positions = kept.positions.get_or_insert_with(|| self.copy_target("scene/previous_positions", now));
        self.copy(queue, now, positions);
        self.previous.kept = Some(GeometryCopy { has_bent: true, ..kept });
    }

    /// Copies of the current draw instances and vertex positions.
    pub(crate) fn copied_geometry(&self, queue: &wgpu::Queue) -> [wgpu::Buffer; 2] {
        [&self.geometry.instances, &self.geometry.positions].map(|from| {
            let to = self.copy_target("scene/moment", from);
            self.copy(queue, from, &to);
            to
        })
    }

    fn copy_target(&self, label: &str, from: &wgpu::Buffer) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: from.size(),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    fn copy(&self, queue: &wgpu::Queue, from: &wgpu::Buffer, to: &wgpu::Buffer) {
        let label = wgpu::CommandEncoderDescriptor { label: Some("scene/previous") };
        let mut commands = self.device.create_command_encoder(&label);
        commands.copy_buffer_to_buffer(from, 0, to, 0, from.size());
        queue.submit([commands.finish()]);
    }

    /// The buffers of the copy.
    #[cfg(test)]
    pub(crate) fn kept_buffers(&self) -> Vec<wgpu::Buffer> {
        let kept = self.previous.kept.iter();
        kept.flat_map(|kept| [Some(kept.instances.clone()), kept.positions.clone()]).flatten().collect()
    }
}
