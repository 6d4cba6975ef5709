//! A compute pass with exact shadow rays, in variants for scenes without panes and with.

use std::sync::OnceLock;

use lanternfish_gpu::{ComputeKernel, Feature};

use crate::{
    error::RenderError,
    gpu_scene::{GpuScene, PANES},
    shaders::Shaders,
};

/// The pass. Its variant for scenes with panes is compiled for the first such scene.
#[derive(Debug)]
pub struct SceneKernel {
    declared: Shaders,
    module: String,
    features: Vec<Feature>,
    entry: &'static str,
    label: String,
    plain: ComputeKernel,
    through_panes: OnceLock<ComputeKernel>,
}

impl SceneKernel {
    /// Compiles the variant for scenes without panes of an entry point of a folder's shader.
    pub fn new(
        device: &wgpu::Device,
        declared: Shaders,
        module: &str,
        features: &[Feature],
        entry: &'static str,
        label: &str,
    ) -> Result<Self, RenderError> {
        Ok(Self {
            declared,
            module: module.to_owned(),
            features: features.to_vec(),
            entry,
            label: label.to_owned(),
            plain: ComputeKernel::new(device, &*declared.link(module, features)?, entry, label),
            through_panes: OnceLock::new(),
        })
    }

    /// Compiles the variant for a scene.
    pub fn prepare(&self, device: &wgpu::Device, scene: &GpuScene) -> Result<(), RenderError> {
        if scene.has_panes() && self.through_panes.get().is_none() {
            let shader = self.declared.link(&self.module, &[&self.features[..], &[PANES]].concat())?;
            self.through_panes.get_or_init(|| ComputeKernel::new(device, &shader, self.entry, &self.label));
        }
        Ok(())
    }

    /// The variant for a scene, if it was prepared; else that for scenes without panes.
    pub fn of(&self, scene: &GpuScene) -> &ComputeKernel {
        self.through_panes.get().filter(|_| scene.has_panes()).unwrap_or(&self.plain)
    }
}
