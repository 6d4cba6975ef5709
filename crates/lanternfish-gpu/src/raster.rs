//! A render pipeline whose resources are bound by name.

use crate::{
    BindGroups, Bindings, LinkedShader,
    engine::{self, CloneCount, Pipeline, PipelineKey},
    made,
    reflect::{Layouts, layouts},
};

/// The fixed-function state of a render pipeline.
#[derive(Clone, Debug, Default)]
pub struct RasterState<'a> {
    /// Vertex buffers.
    pub vertex_buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    /// Culling and winding.
    pub primitive: wgpu::PrimitiveState,
    /// Depth test, if there is one.
    pub depth: Option<wgpu::DepthStencilState>,
    /// Formats and blending of the colour attachments.
    pub targets: &'a [Option<wgpu::ColorTargetState>],
    /// Length of each binding array, by name.
    pub array_lengths: &'a [(&'a str, u32)],
    /// Name of the uniform buffer that [`RasterPipeline::set_group`] gives an offset.
    pub dynamic_uniform: Option<&'a str>,
    /// Samples per pixel; 0 means 1.
    pub samples: u32,
}

/// A vertex and a fragment entry point of one shader, ready to draw.
#[derive(Clone, Debug)]
pub struct RasterPipeline {
    label: String,
    pipeline: wgpu::RenderPipeline,
    layouts: Layouts,
    clones: CloneCount,
}

impl Pipeline for RasterPipeline {
    fn clones(&self) -> &CloneCount {
        &self.clones
    }
}

impl RasterPipeline {
    /// Compiles the entry points `vertex` and, if the shader has it, `fragment`. Without `fragment`, the pipeline writes only depth.
    /// Within an [`Engine`](crate::Engine) that already holds it, returns that pipeline.
    pub fn new(
        device: &wgpu::Device,
        shader: &LinkedShader,
        vertex: &str,
        fragment: &str,
        label: &str,
        state: &RasterState<'_>,
    ) -> Self {
        let key = || PipelineKey::new(shader, &(vertex, fragment, label, state));
        engine::raster(device, key, || Self::compile(device, shader, [vertex, fragment], label, state))
    }

    fn compile(
        device: &wgpu::Device,
        shader: &LinkedShader,
        [vertex, fragment]: [&str; 2],
        label: &str,
        state: &RasterState<'_>,
    ) -> Self {
        let has_fragment = shader.has_entry(fragment);
        let entries = if has_fragment { vec![vertex, fragment] } else { vec![vertex] };
        let layouts = layouts(device, shader, &entries, state.array_lengths, state.dynamic_uniform);
        let module = shader.create_module(device);
        made::count(|made| made.pipelines += 1);
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(&layouts.pipeline),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: state.vertex_buffers,
            },
            primitive: state.primitive,
            depth_stencil: state.depth.clone(),
            multisample: wgpu::MultisampleState { count: state.samples.max(1), ..Default::default() },
            fragment: has_fragment.then_some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(fragment),
                compilation_options: Default::default(),
                targets: state.targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { label: label.to_owned(), pipeline, layouts, clones: CloneCount::default() }
    }

    /// Sets the pass's pipeline, without binding resources.
    pub fn set(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
    }

    /// Binds all groups of the pipeline whose index is below `group_limit`.
    pub fn bind(
        &self,
        groups: &mut BindGroups,
        pass: &mut wgpu::RenderPass<'_>,
        bindings: &Bindings<'_>,
        group_limit: usize,
    ) {
        for group in 0..self.layouts.groups.len().min(group_limit) {
            pass.set_bind_group(group as u32, &self.bind_group(groups, bindings, group), &[]);
        }
    }

    /// The bind group of one group index, for repeated use. `None` if the pipeline has no such group.
    pub fn bind_group_if_used(
        &self,
        groups: &mut BindGroups,
        bindings: &Bindings<'_>,
        group: usize,
    ) -> Option<wgpu::BindGroup> {
        (group < self.layouts.groups.len()).then(|| self.bind_group(groups, bindings, group))
    }

    /// Binds the bind group of one group index. The dynamic uniform buffer, if the group has it, starts `offset` bytes after the start of
    /// its binding.
    pub fn set_group(&self, pass: &mut wgpu::RenderPass<'_>, group: usize, bound: &wgpu::BindGroup, offset: u32) {
        let offsets: &[u32] = if self.layouts.dynamic_group == Some(group) { &[offset] } else { &[] };
        pass.set_bind_group(group as u32, bound, offsets);
    }

    fn bind_group(&self, groups: &mut BindGroups, bindings: &Bindings<'_>, group: usize) -> wgpu::BindGroup {
        bindings.bind_group(groups, &self.label, &self.layouts, group)
    }
}
