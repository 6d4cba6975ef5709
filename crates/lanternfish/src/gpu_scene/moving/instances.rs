//! Moves instances on the device, and continues background rebuilds.

use glam::Affine3A;
use lanternfish_gpu::Frame;

use super::{
    super::scene::GpuScene,
    passes::Moving,
    rebuild::Rebuild,
    sent::Sent,
    shaders::{Moved, MovingParameters},
};
use crate::error::RenderError;

impl GpuScene {
    /// An error if the device cannot bind, for moves, the buffers that otherwise only drawing uses: vertices, and corners of its own
    /// structure.
    pub(super) fn check_bindings(&self) -> Result<(), RenderError> {
        let geometry = &self.geometry;
        let buffers = [&geometry.positions, &geometry.attributes, &geometry.indices];
        let limit = self.device.limits().max_storage_buffer_binding_size;
        let all = buffers.into_iter().chain(self.tlas.iter().map(|tlas| &tlas.vertices));
        match all.map(wgpu::Buffer::size).find(|size| *size > limit) {
            Some(size) => {
                let what = format!("{size} bytes of vertices are more than the {limit} that this device binds");
                Err(RenderError::NeedsUpdate { what })
            }
            None => Ok(()),
        }
    }

    /// An error if the BVH has two levels, and any of these instances has triangles in world space, or becomes so flat that it needs some.
    pub(in crate::gpu_scene) fn check_levels(&self, moved: &[(usize, Affine3A)]) -> Result<(), RenderError> {
        let Some(upper) = &self.upper else { return Ok(()) };
        let fits =
            |(instance, transform): &&(usize, Affine3A)| upper.is_free(*instance) && upper.takes(*instance, transform);
        match moved.iter().find(|one| !fits(one)) {
            None => Ok(()),
            Some((instance, _)) => Err(RenderError::NeedsUpdate {
                what: format!("instance {instance} has triangles in world space, or would at this scale"),
            }),
        }
    }

    /// Moves instances with a tree below them, and refits the tree over them on the host, or builds it again if `may_rebuild`.
    fn put_levels(&mut self, queue: &wgpu::Queue, moved: &[(usize, Affine3A)], may_rebuild: bool) -> Sent {
        let (Some(upper), Some(bvh)) = (&mut self.upper, &mut self.bvh) else { return Sent::default() };
        moved.iter().for_each(|(instance, transform)| upper.set_transform(*instance, transform));
        Sent { bytes: upper.send(queue, bvh, may_rebuild), ..Sent::default() }
    }

    /// See [`crate::Renderer::move_instances`].
    pub(crate) fn move_instances(
        &mut self,
        frame: &mut Frame<'_>,
        moved: &[(usize, Affine3A)],
    ) -> Result<Sent, RenderError> {
        self.placed.check_moves(moved)?;
        self.check_shining(moved)?;
        self.check_levels(moved)?;
        // The last entry for an instance counts.
        let mut last: Vec<(usize, Affine3A)> = moved.to_vec();
        last.sort_by_key(|(instance, _)| *instance);
        last.reverse();
        last.dedup_by_key(|(instance, _)| *instance);
        last.reverse();
        last.retain(|(instance, transform)| self.placed.may_have_moved(*instance, transform));
        if last.is_empty() {
            return self.stay(frame);
        }
        self.put(frame, &last)
    }

    /// Continues background work if nothing has moved.
    pub(super) fn stay(&mut self, frame: &mut Frame<'_>) -> Result<Sent, RenderError> {
        let is_under_way = |moving: &Moving| moving.rebuild.as_ref().is_some_and(Rebuild::is_under_way);
        match self.moving.take_if(|moving| is_under_way(moving)) {
            Some(moving) => self.go_on(frame, moving, &[]),
            None => Ok(Sent::default()),
        }
    }

    /// Transforms the triangles of moved instances, and continues background work.
    fn go_on(&mut self, frame: &mut Frame<'_>, mut moving: Moving, moved: &[Moved]) -> Result<Sent, RenderError> {
        // Runs callbacks of finished readbacks.
        let _ = self.device.poll(wgpu::PollType::Poll);
        let built = moving.rebuild.as_mut().and_then(Rebuild::built);
        let mut sent = Sent { has_rebuilt: built.is_some(), ..Sent::default() };
        if let Some(built) = built {
            // The previous geometry of frames that have shown the current state is kept.
            self.before_instances_move(frame.queue);
            sent.bytes += moving.adopt(frame, self, built)?;
            self.placed.moved();
        }
        if !moved.is_empty() {
            moving.pose(frame, self, moved)?;
            sent.dispatches += 1;
        }
        if sent.has_rebuilt || !moved.is_empty() {
            sent.dispatches += moving.refit(frame, self);
        }
        sent.dispatches += moving.watch(frame, self, !moved.is_empty());
        self.moving = Some(moving);
        Ok(sent)
    }

    /// An error if any of these instances is emissive, and in a light tree.
    pub(super) fn check_shining(&self, moved: &[(usize, Affine3A)]) -> Result<(), RenderError> {
        match (self.needs.parts.hits, self.placed.first_shining(moved, &self.geometry)) {
            (true, Some(instance)) => Err(RenderError::NeedsUpdate {
                what: format!("instance {instance} is emissive, and is in a light tree"),
            }),
            _ => Ok(()),
        }
    }

    /// Transforms the triangles of these instances, each listed once and with ascending indices, and stores the transforms. Vertices are
    /// read as the previous passes have written them.
    pub(super) fn put(&mut self, frame: &mut Frame<'_>, moved: &[(usize, Affine3A)]) -> Result<Sent, RenderError> {
        let mut sent = Sent::default();
        if self.upper.is_some() {
            sent = self.put_levels(frame.queue, moved, true);
        } else if self.needs.parts.rays() && !moved.is_empty() {
            let moving = match self.moving.take() {
                Some(moving) => moving,
                None => Moving::new(self)?,
            };
            let list: Vec<Moved> = moved.iter().map(|(instance, transform)| Moved::new(*instance, transform)).collect();
            sent = self.go_on(frame, moving, &list)?;
            let uniforms = u64::from(sent.dispatches) * size_of::<MovingParameters>() as u64;
            sent.bytes += size_of_val(list.as_slice()) as u64 + uniforms;
        }
        // No errors from here on.
        sent.bytes += self.stand(frame.queue, moved);
        Ok(sent)
    }

    /// The same for an update, if the BVH has two levels. The tree is refitted alone, so that frames do not depend on their order.
    pub(in crate::gpu_scene) fn update_levels(&mut self, queue: &wgpu::Queue, moved: &[(usize, Affine3A)]) {
        self.put_levels(queue, moved, false);
        self.stand(queue, moved);
    }

    /// Stores transforms, and places what is drawn. Returns the bytes that it has uploaded.
    fn stand(&mut self, queue: &wgpu::Queue, moved: &[(usize, Affine3A)]) -> u64 {
        self.before_instances_move(queue);
        if self.placed.mirrors_others(moved.iter().copied()) {
            self.forget_previous();
        }
        for (instance, transform) in moved {
            self.placed.set_transform(*instance, *transform);
        }
        let bytes = self.geometry.place(queue, self.placed.stands());
        self.has_placed();
        self.placed.moved();
        bytes
    }
}
