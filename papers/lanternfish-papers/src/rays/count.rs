//! Counts what rays read of deep images: the texels that they cross, and the fragments whose depth they compare with their own.
//! Nießner explains the speed of every ray by the former, his pixel crossings [Niessner2010, §3.2, §7].

use lanternfish::{
    RenderError,
    common::workgroups,
    rays::{Structure, TracedStructure, Tracer},
    shaders::{Root, Shaders},
};
use lanternfish_gpu::{Bindings, ComputeKernel, Feature, Frame, storage_buffer};

use crate::{ACROSS_TEXELS, DeepImageSettings, WITHIN_TEXEL, deep_images::DeepImages};

/// The tracer counts what it reads; others have no trace of it.
const COUNTED: Feature = Feature::new("counted");

/// The shaders of this folder that are no tracer's.
pub(crate) const DECLARED: Shaders =
    Shaders::of(&crate::shaders::SHADERS, &[Root::computed("rays/count", every_variant)], &[]);

fn every_variant() -> Vec<Vec<Feature>> {
    let images = DeepImageSettings::every_kind(false);
    let of = |tracer: Tracer| images.iter().map(move |images| features(tracer, images)).collect::<Vec<_>>();
    [WITHIN_TEXEL, ACROSS_TEXELS].into_iter().flat_map(of).collect()
}

fn features(tracer: Tracer, images: &DeepImageSettings) -> Vec<Feature> {
    [tracer.features(&Structure::from(*images), false), vec![COUNTED]].concat()
}

/// Counts what rays read of deep images, with a variant of a tracer of its own.
#[derive(Debug)]
pub struct RayCounter {
    kernel: ComputeKernel,
}

impl RayCounter {
    /// Compiles the pass for images of these settings. An error for a tracer that does not traverse deep images.
    pub fn new(device: &wgpu::Device, tracer: Tracer, images: &DeepImageSettings) -> Result<Self, RenderError> {
        if ![WITHIN_TEXEL, ACROSS_TEXELS].contains(&tracer) {
            let (setting, needed) = ("counting the texels that rays cross", "a tracer through deep images");
            return Err(RenderError::Together { setting, needed });
        }
        let shader = DECLARED.link("rays/count", &features(tracer, images))?;
        Ok(Self { kernel: ComputeKernel::new(device, &shader, "count", &format!("rays/count/{tracer}")) })
    }

    /// Records a pass that writes two numbers for each of `count` rays ([`lanternfish::rays::RayTracer::upload`]): texels, and
    /// fragments. `images`: of the settings that the pass was compiled for.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        images: &DeepImages,
        rays: &wgpu::Buffer,
        count: u32,
    ) -> Result<wgpu::Buffer, RenderError> {
        let counts = storage_buffer(frame.device, "rays/counts", 8 * u64::from(count))?;
        let bindings = Bindings::new().buffer("traced_rays", rays).buffer("ray_counts", &counts);
        images.for_each_part(&bindings, &mut |bindings| frame.dispatch(&self.kernel, bindings, workgroups(count)));
        Ok(counts)
    }
}
