//! Depth and the thin surface target of what the view shows [Elagabani2025, §4.1].

use glam::UVec2;
use lanternfish_gpu::{Bindings, Frame};

use crate::{
    error::RenderError,
    gpu_scene::{GpuScene, PassState, SceneRaster, VisibleDraws},
    texture::target,
    view::ViewBuffer,
};

/// Depth of every pixel; its precision is what reverse-Z is for.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Packed as `surface_target.wesl` says.
pub const SURFACE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Uint;

/// The pass.
#[derive(Debug)]
pub struct Prepass {
    raster: SceneRaster,
    surface: Option<Surface>,
}

/// What the view shows: the prepass's result.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Reverse-Z; 0 where nothing is.
    pub depth: wgpu::TextureView,
    /// Normals and roughness.
    pub target: wgpu::TextureView,
    /// Pixels.
    pub size: UVec2,
}

impl Surface {
    /// As an attachment that is tested and not written.
    pub(crate) fn read_depth(&self) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        wgpu::RenderPassDepthStencilAttachment { view: &self.depth, depth_ops: None, stencil_ops: None }
    }

    /// What shaders call it.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().texture("depth_texture", &self.depth).texture("surface_texture", &self.target)
    }
}

impl Prepass {
    /// Nothing is compiled until the first scene is drawn.
    pub fn new() -> Self {
        let depth = wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            // Of two surfaces at one depth the later is kept, as it is where shading tests for equal depth.
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let state = PassState { depth, target: Some(SURFACE_FORMAT.into()) };
        let raster = SceneRaster::new("prepass", "prepass/prepass", &[], true, state);
        Self { raster, surface: None }
    }

    /// Draws everything but blended surfaces.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        draws: &VisibleDraws<'_>,
        view: &ViewBuffer,
        size: UVec2,
    ) -> Result<Surface, RenderError> {
        self.raster.prepare(frame.device, scene, &draws.solid)?;
        if self.surface.as_ref().is_none_or(|s| s.size != size) {
            self.surface = Some(Surface {
                depth: target(frame.device, "depth", size, DEPTH_FORMAT, wgpu::TextureUsages::empty()),
                target: target(frame.device, "surface", size, SURFACE_FORMAT, wgpu::TextureUsages::empty()),
                size,
            });
        }
        let surface = self.surface.clone().expect("made above");
        let bindings = view.bindings().with(&scene.bindings());
        let color = wgpu::RenderPassColorAttachment {
            view: &surface.target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &surface.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        frame.render("prepass", &[Some(color)], Some(depth), |device, pass| {
            self.raster.draw(device, pass, scene, &bindings, &draws.solid);
        });
        Ok(surface)
    }
}

impl Default for Prepass {
    fn default() -> Self {
        Self::new()
    }
}
