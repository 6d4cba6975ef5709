//! Sequences of frames: along the walk, and after a change of the scene.

use lanternfish::{GpuScene, RenderedImage, Renderer, settings::Settings};
use lanternfish_cli::error::CliError;
use lanternfish_scene::Scene;

use super::Bench;

impl Bench {
    /// Number of frames of the walk to the camera of the ground truth.
    pub fn steps(&self) -> usize {
        self.cameras.len() / 2 + 1
    }

    /// Renders the frames of the walk to the camera of the ground truth, and returns the last.
    pub fn walked(&self, settings: &Settings) -> Result<RenderedImage, CliError> {
        let mut renderer = Renderer::with_engine(&self.run.engine, settings.clone())?;
        let uploaded = renderer.upload(&self.scene)?;
        let mut frame = |camera| renderer.render(&uploaded, camera, [self.size.width, self.size.height]);
        let mut last = frame(&self.cameras[0])?;
        for camera in &self.cameras[1..self.steps()] {
            last = frame(camera)?;
        }
        Ok(last)
    }

    /// Renders `before` frames of the scene and then frames of `changed`, with the camera at rest. Returns the frames after the change whose
    /// numbers, from 1, are in `after`.
    pub fn after_change(
        &self,
        settings: &Settings,
        before: u32,
        changed: &Scene,
        after: &[u32],
    ) -> Result<Vec<RenderedImage>, CliError> {
        let mut renderer = Renderer::with_engine(&self.run.engine, settings.clone())?;
        let mut uploaded = renderer.upload(&self.scene)?;
        let frame = |renderer: &mut Renderer, uploaded: &GpuScene| {
            renderer.render(uploaded, self.camera(), [self.size.width, self.size.height])
        };
        for _ in 0..before {
            frame(&mut renderer, &uploaded)?;
        }
        renderer.update(&mut uploaded, changed)?;
        let mut renderings = Vec::new();
        for number in 1..=after.iter().copied().max().unwrap_or(0) {
            let rendering = frame(&mut renderer, &uploaded)?;
            if after.contains(&number) {
                renderings.push(rendering);
            }
        }
        Ok(renderings)
    }
}
