//! Frames one after the other: along the walk, and after the scene has changed.

use lanternfish::{GpuScene, RenderedImage, Renderer, settings::Settings};
use lanternfish_cli::error::CliError;
use lanternfish_scene::Scene;

use super::Bench;

impl Bench {
    /// Frames of the walk to the place of the ground truth.
    pub fn steps(&self) -> usize {
        self.cameras.len() / 2 + 1
    }

    /// Walks to the place of the ground truth, a frame a step: the last.
    pub fn walked(&self, settings: &Settings) -> Result<RenderedImage, CliError> {
        let mut renderer = Renderer::with_engine(&self.run.engine, settings.clone())?;
        let uploaded = renderer.upload(&self.scene)?;
        let mut frame = |camera| renderer.render(&uploaded, camera, self.size.width, self.size.height);
        let mut last = frame(&self.cameras[0])?;
        for camera in &self.cameras[1..self.steps()] {
            last = frame(camera)?;
        }
        Ok(last)
    }

    /// Frames at rest, of which so many show the scene and the others what it has changed to: those with these numbers, from 1,
    /// after the change.
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
            renderer.render(uploaded, self.camera(), self.size.width, self.size.height)
        };
        for _ in 0..before {
            frame(&mut renderer, &uploaded)?;
        }
        renderer.update(&mut uploaded, changed)?;
        let mut found = Vec::new();
        for number in 1..=after.iter().copied().max().unwrap_or(0) {
            let rendering = frame(&mut renderer, &uploaded)?;
            if after.contains(&number) {
                found.push(rendering);
            }
        }
        Ok(found)
    }
}
