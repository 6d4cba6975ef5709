//! Photons rasterized as splats with additive blending [Aalund2015, §4.2].

use glam::UVec2;
use lanternfish::{RenderError, denoise::smoothing::PixelIrradiance, texture::frame_target};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame, RasterPipeline, RasterState};

use super::DECLARED;

/// Sums of many photons: half floats would lose small contributions.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// The passes.
#[derive(Debug)]
pub(super) struct SplatRaster {
    diffuse: RasterPipeline,
    /// None: surfaces have no glossy lobe.
    glossy: Option<RasterPipeline>,
    add: ComputeKernel,
}

impl SplatRaster {
    /// An error if the device cannot blend 32-bit floats.
    pub fn new(device: &wgpu::Device, is_glossy: bool) -> Result<Self, RenderError> {
        if !device.features().contains(wgpu::Features::FLOAT32_BLENDABLE) {
            let feature = "blending of 32-bit floats";
            return Err(RenderError::MissingFeature {
                setting: "`photon-splat raster`",
                feature,
                instead: "`photon-splat gather`",
            });
        }
        let shader = DECLARED.link("indirect/photon_splatting/splat", &[])?;
        let component = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let target = wgpu::ColorTargetState {
            format: FORMAT,
            blend: Some(wgpu::BlendState { color: component, alpha: component }),
            write_mask: wgpu::ColorWrites::COLOR,
        };
        let topology = wgpu::PrimitiveTopology::TriangleStrip;
        let primitive = wgpu::PrimitiveState { topology, ..Default::default() };
        let targets = [Some(target.clone()), Some(target)];
        let state = RasterState { primitive, targets: &targets, ..Default::default() };
        let pipeline = |fragment: &str| {
            RasterPipeline::new(device, &shader, "rectangle", fragment, "indirect/photon_splatting/splat", &state)
        };
        let add = DECLARED.link("indirect/photon_splatting/add", &[])?;
        Ok(Self {
            diffuse: pipeline("splat_diffuse"),
            glossy: is_glossy.then(|| pipeline("splat_glossy")),
            add: ComputeKernel::new(device, &add, "add", "indirect/photon_splatting/add"),
        })
    }

    /// The render targets of photons.
    pub fn targets(&self, frame: &mut Frame<'_>, irradiance: &PixelIrradiance) -> [wgpu::TextureView; 4] {
        ["diffuse", "diffuse_grazing", "glossy", "glossy_grazing"].map(|name| {
            let label = format!("indirect/photon_splatting/{name}");
            frame_target(frame, &label, irradiance.size, FORMAT, wgpu::TextureUsages::empty(), 1)
        })
    }

    /// Draws at most `count` photons, and adds them to the pixels' sums. `bindings`: those of the gathering pass except the lists.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        bindings: &Bindings<'_>,
        slots: u32,
        irradiance: &PixelIrradiance,
        targets: Option<&[wgpu::TextureView; 4]>,
    ) {
        let targets = targets.expect("created for rasterized photons");
        for (pipeline, targets) in [Some(&self.diffuse), self.glossy.as_ref()].into_iter().zip(targets.chunks(2)) {
            let color = |view| wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            };
            let colors = [Some(color(&targets[0])), Some(color(&targets[1]))];
            frame.render("indirect/photon_splatting/splat", &colors, None, |groups, pass| {
                // Targets that no photon is drawn to are cleared nonetheless.
                if let Some(pipeline) = pipeline {
                    pipeline.set(pass);
                    pipeline.bind(groups, pass, bindings, 4);
                    pass.draw(0..4, 0..slots);
                }
            });
        }
        let [diffuse, diffuse_grazing, glossy, glossy_grazing] = targets;
        let adding = bindings
            .clone()
            .texture("drawn_diffuse", diffuse)
            .texture("drawn_diffuse_grazing", diffuse_grazing)
            .texture("drawn_glossy", glossy)
            .texture("drawn_glossy_grazing", glossy_grazing);
        let [width, height, _] = self.add.workgroup_size();
        let UVec2 { x, y } = irradiance.size;
        frame.dispatch(&self.add, &adding, [x.div_ceil(width), y.div_ceil(height), 1]);
    }
}
