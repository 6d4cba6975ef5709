//! The mean of frames with subpixel jitter: antialiased edges, and noise that averages out.
//!
//! The device stores the mean of radiance while views and scene do not change ([`crate::Renderer::refine`]).

#[cfg(test)]
mod tests;

use glam::UVec2;
use lanternfish_gpu::{AcrossFrames, Bindings, Feature, Frame, RasterPipeline, RasterState};

use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::GpuScene,
    output::cover,
    shaders::{Root, Shaders},
    texture::{Radiance, target},
    view::View,
};

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(&[Root::of("progressive/mean", &[&[&[], &[DEFERRED]]])], &[]);

/// Deferred readback: incomplete frames do not count.
const DEFERRED: Feature = Feature::new("later");

/// Linear radiance, nits; 32 bits, which resolve the contribution of the thousandth frame.
pub const MEAN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// The pass, and the means of the views of a frame.
#[derive(Debug)]
pub struct Progressive {
    pipeline: RasterPipeline,
    /// Compiled for the first frame with deferred readback.
    later: Option<RasterPipeline>,
    means: AcrossFrames<Vec<Mean>>,
    subject: Option<Subject>,
}

/// The mean of one view: the texture that a frame writes, and the one that it reads. They swap each frame.
#[derive(Debug)]
struct Mean {
    now: wgpu::TextureView,
    before: wgpu::TextureView,
    size: UVec2,
}

/// The scene and views of the means.
#[derive(Debug)]
struct Subject {
    views: Vec<View>,
    /// [`GpuScene::revision`].
    revision: u64,
    frames: u32,
}

impl Progressive {
    /// Compiles the pass.
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        Ok(Self { pipeline: pipeline(device, &[])?, later: None, means: AcrossFrames::default(), subject: None })
    }

    /// Number of frames in the means.
    pub fn frames(&self) -> u32 {
        self.subject.as_ref().map_or(0, |subject| subject.frames)
    }

    /// Resets the means: the next frame is the first.
    pub fn reset(&mut self) {
        self.subject = None;
    }

    /// The index of the next frame of these views: 0 if the means belong to other views, or to a scene that has changed
    /// since. A frame that begins and does not [`Self::finish`] leaves no mean.
    pub fn begin(&mut self, scene: &GpuScene, views: &[View]) -> u32 {
        let subject = self.subject.take();
        subject.filter(|s| s.revision == scene.revision() && s.views == views).map_or(0, |s| s.frames)
    }

    /// Completes the frame of this index.
    pub fn finish(&mut self, scene: &GpuScene, views: &[View], index: u32) {
        self.subject = Some(Subject { views: views.to_vec(), revision: scene.revision(), frames: index + 1 });
    }

    /// Adds the radiance of a view's frame to the mean of its slot and returns the mean, linear, nits. `view` holds the
    /// frame index.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { buffer, surface, .. }: &ViewContext<'_>,
        radiance: &Radiance,
        slot: usize,
    ) -> Result<wgpu::TextureView, RenderError> {
        let size = surface.size;
        let means = self.means.get(frame);
        if means.get(slot).is_none_or(|mean| mean.size != size) {
            let more = wgpu::TextureUsages::COPY_SRC;
            frame.take_memory("progressive/mean", 2 * 16 * u64::from(size.x) * u64::from(size.y))?;
            let texture = || target(frame.device, "progressive/mean", size, MEAN_FORMAT, more);
            means.truncate(slot);
            means.push(Mean { now: texture(), before: texture(), size });
        }
        let mean = &mut means[slot];
        std::mem::swap(&mut mean.now, &mut mean.before);
        let textures = Bindings::new().texture("mean_texture", &mean.before);
        let textures = textures.texture("radiance_texture", &radiance.target);
        let bindings = buffer.bindings().with(&textures);
        match frame.completeness_buffer() {
            None => cover(frame, &self.pipeline, LABEL, &bindings, &mean.now),
            Some(capacity_policy) => {
                let later = match &mut self.later {
                    Some(later) => later,
                    none => none.insert(pipeline(frame.device, &[DEFERRED])?),
                };
                cover(frame, later, LABEL, &bindings.buffer("capacity_policy", &capacity_policy), &mean.now);
            }
        }
        Ok(mean.now.clone())
    }
}

const LABEL: &str = "progressive/mean";

fn pipeline(device: &wgpu::Device, features: &[Feature]) -> Result<RasterPipeline, RenderError> {
    let shader = DECLARED.link("progressive/mean", features)?;
    let state = RasterState { targets: &[Some(MEAN_FORMAT.into())], ..Default::default() };
    Ok(RasterPipeline::new(device, &shader, "vertex", "fragment", LABEL, &state))
}
