//! A compute pipeline whose resources are bound by name.

use crate::{
    Bindings, LinkedShader,
    engine::{self, CloneCount, Pipeline, PipelineKey},
    made,
    pool::BindGroups,
    reflect::{Layouts, layouts},
};

/// Number of workgroups.
pub(crate) enum Workgroups<'a> {
    /// Known to the host: along x, y and z.
    Are([u32; 3]),
    /// In three words of a buffer at this offset, read by the device when it starts the dispatch.
    In(&'a wgpu::Buffer, u64),
}

/// One entry point of a compute shader, ready to run.
#[derive(Clone, Debug)]
pub struct ComputeKernel {
    label: String,
    pipeline: wgpu::ComputePipeline,
    layouts: Layouts,
    workgroup_size: [u32; 3],
    /// True if it uses `num_workgroups`, which Direct3D 12 sets to 0 in an indirect dispatch without validation.
    pub(crate) uses_workgroup_count: bool,
    clones: CloneCount,
}

impl Pipeline for ComputeKernel {
    fn clones(&self) -> &CloneCount {
        &self.clones
    }
}

impl ComputeKernel {
    /// Compiles `entry` of `shader`. The label, a path such as `light_culling/tiled/assign`, names the pass in reports.
    /// Within an [`Engine`](crate::Engine) that already holds it, returns that pipeline.
    pub fn new(device: &wgpu::Device, shader: &LinkedShader, entry: &str, label: &str) -> Self {
        let key = || PipelineKey::new(shader, &(entry, label));
        engine::kernel(device, key, || Self::compile(device, shader, entry, label))
    }

    fn compile(device: &wgpu::Device, shader: &LinkedShader, entry: &str, label: &str) -> Self {
        let layouts = layouts(device, shader, &[entry], &[], None);
        made::count(|made| made.pipelines += 1);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&layouts.pipeline),
            module: &shader.create_module(device),
            entry_point: Some(entry),
            compilation_options: Default::default(),
            cache: None,
        });
        let workgroup_size = shader.workgroup_size(entry);
        let uses_workgroup_count = shader.uses_workgroup_count(entry);
        let label = label.to_owned();
        Self { label, pipeline, layouts, workgroup_size, uses_workgroup_count, clones: CloneCount::default() }
    }

    /// The label of the pass.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Invocations of a workgroup along x, y and z.
    pub fn workgroup_size(&self) -> [u32; 3] {
        self.workgroup_size
    }

    pub(crate) fn dispatch(
        &self,
        groups: &mut BindGroups,
        pass: &mut wgpu::ComputePass<'_>,
        bindings: &Bindings<'_>,
        workgroups: &Workgroups<'_>,
    ) {
        pass.set_pipeline(&self.pipeline);
        for group in 0..self.layouts.groups.len() {
            let bind_group = bindings.bind_group(groups, &self.label, &self.layouts, group);
            pass.set_bind_group(group as u32, &bind_group, &[]);
        }
        match *workgroups {
            Workgroups::Are([x, y, z]) => pass.dispatch_workgroups(x, y, z),
            Workgroups::In(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, offset),
        }
    }
}
