//! Transforms and vertices of the previous frame, for motion vectors.
//!
//! A frame that asks for motion says that it shows the scene as it is ([`GpuScene::note_shown`]). The first change after it keeps that
//! moment on the device; further changes before the next such frame keep nothing more. A scene of which no frame asks keeps nothing.

use std::sync::atomic::{AtomicBool, Ordering};

use super::GpuScene;

/// The moment that was shown last before a change.
#[derive(Debug, Default)]
pub(super) struct Previous {
    /// True if a frame that asks for motion has shown the scene as it is.
    is_shown: AtomicBool,
    kept: Option<Kept>,
}

#[derive(Debug)]
struct Kept {
    /// [`GpuScene::generation`] of that moment.
    generation: u64,
    instances: wgpu::Buffer,
    /// Made when vertices bend for the first time.
    positions: Option<wgpu::Buffer>,
    /// Whether vertices have bent since that moment. If not, those of now are those of then.
    has_bent: bool,
}

/// Draw instances and positions of vertices at some moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GeometryAt<'s> {
    pub instances: &'s wgpu::Buffer,
    pub positions: &'s wgpu::Buffer,
}

impl GpuScene {
    /// Says that a frame that asks for motion shows the scene as it is.
    pub(crate) fn note_shown(&self) {
        self.previous.is_shown.store(true, Ordering::Relaxed);
    }

    /// Where everything is.
    pub(crate) fn geometry_now(&self) -> GeometryAt<'_> {
        GeometryAt { instances: &self.geometry.instances, positions: &self.geometry.positions }
    }

    /// Where everything was at a [`Self::generation`], if that is known: that of now, or the one that was shown last before a change.
    pub(crate) fn geometry_at(&self, generation: u64) -> Option<GeometryAt<'_>> {
        let now = self.geometry_now();
        if generation == self.generation() {
            return Some(now);
        }
        let kept = self.previous.kept.as_ref().filter(|kept| kept.generation == generation)?;
        let positions = kept.positions.as_ref().filter(|_| kept.has_bent).unwrap_or(now.positions);
        Some(GeometryAt { instances: &kept.instances, positions })
    }

    /// Keeps where instances are, if a frame has shown it. It comes before every write to draw instances, and before the scene's
    /// generation changes.
    pub(super) fn before_instances_move(&mut self, queue: &wgpu::Queue) {
        if !std::mem::take(self.previous.is_shown.get_mut()) {
            return;
        }
        let generation = self.generation();
        let (instances, positions) = match self.previous.kept.take() {
            Some(Kept { instances, positions, .. }) => (instances, positions),
            None => (self.copy_target("scene/previous_instances", &self.geometry.instances), None),
        };
        self.copy(queue, &self.geometry.instances, &instances);
        self.previous.kept = Some(Kept { generation, instances, positions, has_bent: false });
    }

    /// Forgets the moment that is kept: of a change after which things have another order on the device.
    pub(super) fn forget_previous(&mut self) {
        self.previous = Previous::default();
    }

    /// Keeps where instances and vertices are, if a frame has shown it. **Whatever writes `scene/positions` calls it first**, on the host
    /// or on the device, before the scene's generation changes. The copy is handed to the device at once: what is written with the queue
    /// after the call comes after it, and so do all commands that are submitted after the call, whenever they were recorded.
    pub(super) fn before_vertices_bend(&mut self, queue: &wgpu::Queue) {
        self.before_instances_move(queue);
        let Some(mut kept) = self.previous.kept.take_if(|kept| !kept.has_bent) else { return };
        let now = &self.geometry.positions;
        let positions = kept.positions.get_or_insert_with(|| self.copy_target("scene/previous_positions", now));
        self.copy(queue, now, positions);
        self.previous.kept = Some(Kept { has_bent: true, ..kept });
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

    /// The buffers of the moment that is kept.
    #[cfg(test)]
    pub(crate) fn kept_buffers(&self) -> Vec<wgpu::Buffer> {
        let kept = self.previous.kept.iter();
        kept.flat_map(|kept| [Some(kept.instances.clone()), kept.positions.clone()]).flatten().collect()
    }
}
