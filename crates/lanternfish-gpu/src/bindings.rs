//! Resources by the name that shaders call them.

use crate::{pool::BindGroups, reflect::Layouts};

/// Some bytes of a buffer, to be bound.
#[derive(Clone, Debug)]
pub struct BufferPart {
    pub(crate) buffer: wgpu::Buffer,
    pub(crate) offset: u64,
    pub(crate) bytes: u64,
}

impl BufferPart {
    /// All of a buffer.
    pub fn whole(buffer: wgpu::Buffer) -> Self {
        Self { offset: 0, bytes: buffer.size(), buffer }
    }
}

/// Resources by the name that shaders call them. A pipeline takes from it what it uses; the rest is ignored.
#[derive(Clone, Debug, Default)]
pub struct Bindings<'a> {
    entries: Vec<(&'a str, wgpu::BindingResource<'a>)>,
}

impl<'a> Bindings<'a> {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a whole buffer.
    pub fn buffer(self, name: &'a str, buffer: &'a wgpu::Buffer) -> Self {
        self.resource(name, buffer.as_entire_binding())
    }

    /// Adds a part of a buffer.
    pub fn part(self, name: &'a str, part: &'a BufferPart) -> Self {
        let BufferPart { buffer, offset, bytes } = part;
        let size = std::num::NonZeroU64::new(*bytes);
        self.resource(name, wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: *offset, size }))
    }

    /// Adds a texture.
    pub fn texture(self, name: &'a str, view: &'a wgpu::TextureView) -> Self {
        self.resource(name, wgpu::BindingResource::TextureView(view))
    }

    /// Adds a sampler.
    pub fn sampler(self, name: &'a str, sampler: &'a wgpu::Sampler) -> Self {
        self.resource(name, wgpu::BindingResource::Sampler(sampler))
    }

    /// Adds anything else that can be bound. A later resource of the same name takes the earlier one's place.
    pub fn resource(mut self, name: &'a str, resource: wgpu::BindingResource<'a>) -> Self {
        self.entries.retain(|(known, _)| *known != name);
        self.entries.push((name, resource));
        self
    }

    /// Adds all of `other`.
    pub fn with(self, other: &Bindings<'a>) -> Self {
        other.entries.iter().fold(self, |all, (name, resource)| all.resource(name, resource.clone()))
    }

    /// The bind group of one group of a pipeline.
    ///
    /// Panics when the shader uses a name that is not there: a bug.
    pub(crate) fn bind_group(
        &self,
        groups: &mut BindGroups,
        label: &str,
        layouts: &Layouts,
        group: usize,
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = layouts.names[group]
            .iter()
            .map(|(name, binding)| {
                let found = self.entries.iter().find(|(known, _)| known == name);
                let (_, resource) = found.unwrap_or_else(|| {
                    let known: Vec<_> = self.entries.iter().map(|(name, _)| *name).collect();
                    panic!("{label}: needs {name}, given {known:?}")
                });
                wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() }
            })
            .collect();
        groups.get(label, &layouts.groups[group], &entries)
    }
}
