//! Cache of bind groups across frames.

use std::{collections::HashMap, num::NonZeroU64};

use crate::made;

/// A bound resource, as part of a cache key. The handles keep the resource alive, so that its identity is not reused
/// while the bind group is cached.
#[derive(Debug, PartialEq, Eq, Hash)]
enum Resource {
    Buffer(wgpu::Buffer, u64, Option<NonZeroU64>),
    Sampler(wgpu::Sampler),
    Samplers(Vec<wgpu::Sampler>),
    Texture(wgpu::TextureView),
    Textures(Vec<wgpu::TextureView>),
    AccelerationStructure(wgpu::Tlas),
}

impl Resource {
    fn new(resource: &wgpu::BindingResource<'_>) -> Self {
        match resource {
            wgpu::BindingResource::Buffer(part) => Self::Buffer(part.buffer.clone(), part.offset, part.size),
            wgpu::BindingResource::Sampler(sampler) => Self::Sampler((*sampler).clone()),
            wgpu::BindingResource::SamplerArray(all) => Self::Samplers(all.iter().copied().cloned().collect()),
            wgpu::BindingResource::TextureView(view) => Self::Texture((*view).clone()),
            wgpu::BindingResource::TextureViewArray(all) => Self::Textures(all.iter().copied().cloned().collect()),
            wgpu::BindingResource::AccelerationStructure(tlas) => Self::AccelerationStructure((*tlas).clone()),
            other => panic!("{other:?} cannot be bound by name yet"),
        }
    }
}

#[derive(Debug, PartialEq, Eq, Hash)]
pub(super) struct Key {
    layout: wgpu::BindGroupLayout,
    entries: Vec<(u32, Resource)>,
}

#[derive(Debug)]
pub(super) struct CachedBindGroup {
    bind_group: wgpu::BindGroup,
    last_frame: u64,
}

/// Bind groups of the last few frames, by layout and bound resources.
#[derive(Debug)]
pub struct BindGroups {
    device: wgpu::Device,
    pub(super) all: HashMap<Key, CachedBindGroup>,
    frame: u64,
}

impl BindGroups {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        Self { device: device.clone(), all: HashMap::new(), frame: 0 }
    }

    /// The bind group of a layout with these entries, from the cache or new.
    pub(crate) fn get(
        &mut self,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        entries: &[wgpu::BindGroupEntry<'_>],
    ) -> wgpu::BindGroup {
        let resources = entries.iter().map(|entry| (entry.binding, Resource::new(&entry.resource)));
        let key = Key { layout: layout.clone(), entries: resources.collect() };
        let cached = self.all.entry(key).or_insert_with(|| {
            made::count(|made| made.bind_groups += 1);
            let bind_group =
                self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries });
            CachedBindGroup { bind_group, last_frame: self.frame }
        });
        cached.last_frame = self.frame;
        cached.bind_group.clone()
    }

    pub(super) fn begin(&mut self, frame: u64, oldest: u64) {
        self.frame = frame;
        self.all.retain(|_, cached| cached.last_frame >= oldest);
    }
}
