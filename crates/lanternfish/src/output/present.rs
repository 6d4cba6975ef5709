//! Copies images to the caller's textures.

use super::DECLARED;
use std::collections::{HashMap, hash_map::Entry};

use glam::UVec2;
use lanternfish_gpu::{Bindings, Feature, Frame, RasterPipeline, RasterState};

use super::{DISPLAY_FORMAT, OutputParameters, cover, show};
use crate::{
    error::RenderError,
    shaders::Root,
    texture::{size_of_view, target},
    view::{PerView, ViewKey},
};

/// The image is sRGB-encoded, and so is the texture's format: the texture encodes again.
const DECODED: Feature = Feature::new("decoded");

/// The image is radiance, stored in a unit.
const STORED: Feature = Feature::new("stored");

pub(super) const ROOT: Root = Root::of("output/present", &[&[&[], &[DECODED], &[STORED]]]);

/// Copies images, and stores the last display image of each view.
#[derive(Debug, Default)]
pub(crate) struct Present {
    pipelines: HashMap<(wgpu::TextureFormat, Option<Feature>), RasterPipeline>,
    displays: PerView<wgpu::TextureView>,
}

impl Present {
    /// The display image of the view of this key; black at first.
    pub fn display(&mut self, frame: &Frame<'_>, key: u64, size: UVec2) -> wgpu::TextureView {
        let key = ViewKey::Key(key);
        let last = self.displays.take(frame, key).filter(|last| size_of_view(last) == size);
        let new = || target(frame.device, "display", size, DISPLAY_FORMAT, wgpu::TextureUsages::COPY_SRC);
        let display = last.unwrap_or_else(new);
        self.displays.leave(frame, key, display.clone());
        display
    }

    /// Copies a display image, which is always that of a complete frame.
    pub fn show(
        &mut self,
        frame: &mut Frame<'_>,
        display: &wgpu::TextureView,
        to: &wgpu::TextureView,
        format: wgpu::TextureFormat,
    ) -> Result<(), RenderError> {
        let pipeline = self.pipeline(frame.device, format, format.is_srgb().then_some(DECODED))?;
        cover(frame, pipeline, LABEL, &Bindings::new().texture("image_texture", display), to);
        Ok(())
    }

    /// Copies radiance if the frame is complete.
    pub fn copy(
        &mut self,
        frame: &mut Frame<'_>,
        radiance: &wgpu::TextureView,
        light_unit: f32,
        to: &wgpu::TextureView,
    ) -> Result<(), RenderError> {
        // A half float beyond its range would be infinite.
        let is_half = to.texture().format() == wgpu::TextureFormat::Rgba16Float;
        let most = if is_half { half::f16::MAX.to_f32() } else { f32::MAX };
        let parameters = frame.uniform(&OutputParameters { light_unit, most, ..Default::default() });
        let bindings = Bindings::new().texture("image_texture", radiance).part("output_parameters", &parameters);
        let pipeline = self.pipeline(frame.device, to.texture().format(), Some(STORED))?;
        show(frame, pipeline, LABEL, &bindings, to);
        Ok(())
    }

    fn pipeline(
        &mut self,
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        variant: Option<Feature>,
    ) -> Result<&RasterPipeline, RenderError> {
        Ok(match self.pipelines.entry((format, variant)) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(slot) => {
                let shader = DECLARED.link("output/present", variant.as_slice())?;
                let state = RasterState { targets: &[Some(format.into())], ..Default::default() };
                slot.insert(RasterPipeline::new(device, &shader, "vertex", "fragment", LABEL, &state))
            }
        })
    }
}

const LABEL: &str = "output/present";
