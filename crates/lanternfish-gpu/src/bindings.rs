//! Resources by their names in shaders.

use crate::{pool::BindGroups, reflect::Layouts};

/// A range of bytes of a buffer, to be bound.
#[derive(Clone, Debug)]
pub struct BufferPart {
    pub(crate) buffer: wgpu::Buffer,
    pub(crate) offset: u64,
    pub(crate) bytes: u64,
}

impl BufferPart {
    /// The entire buffer.
    pub fn whole(buffer: wgpu::Buffer) -> Self {
        Self { offset: 0, bytes: buffer.size(), buffer }
    }
}

/// Resources by their names in shaders. A pipeline binds those that it uses and ignores the rest.
#[derive(Clone, Debug, Default)]
pub struct Bindings<'a> {
    entries: Vec<(&'a str, wgpu::BindingResource<'a>)>,
}

impl<'a> Bindings<'a> {
    /// No resources.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an entire buffer.
    pub fn buffer(self, name: &'a str, buffer: &'a wgpu::Buffer) -> Self {
        self.resource(name, buffer.as_entire_binding())
    }

    /// Adds a range of a buffer.
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

    /// Adds any bindable resource. It replaces an earlier one of the same name.
    pub fn resource(mut self, name: &'a str, resource: wgpu::BindingResource<'a>) -> Self {
        self.entries.retain(|(bound, _)| *bound != name);
        self.entries.push((name, resource));
        self
    }

    /// Adds all resources of `other`.
    pub fn with(self, other: &Bindings<'a>) -> Self {
        other.entries.iter().fold(self, |all, (name, resource)| all.resource(name, resource.clone()))
    }

    /// The bind group for one group index of a pipeline.
    ///
    /// # Panics
    ///
    /// If the shader uses a name that is not bound, which is a bug of the caller.
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
                let entry = self.entries.iter().find(|(bound, _)| bound == name);
                let (_, resource) = entry.unwrap_or_else(|| {
                    let bound: Vec<_> = self.entries.iter().map(|(name, _)| *name).collect();
                    panic!("{label}: needs {name}, given {bound:?}")
                });
                wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() }
            })
            .collect();
        groups.get(label, &layouts.groups[group], &entries)
    }
}
