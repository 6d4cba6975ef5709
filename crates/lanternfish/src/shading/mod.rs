//! Forward shading of what is visible, and of transparent surfaces over it [Elagabani2025, §4.4].

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin;

use glam::{UVec2, Vec3};
use lanternfish_gpu::Frame;

use crate::{
    error::RenderError,
    gpu_scene::{Draw, DrawAlpha, GpuScene, SceneRaster},
    light_culling::{LightCulling, LightLists},
    prepass::{DEPTH_FORMAT, Surface},
    settings::Settings,
    shadows::{Tracer, Visibility},
    texture::target,
    view::ViewBuffer,
};

/// Linear radiance, nits. Half floats: the widest format that every adapter can blend.
pub const RADIANCE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// The passes.
#[derive(Debug)]
pub struct Forward {
    opaque: SceneRaster,
    blended: SceneRaster,
    radiance: Option<Radiance>,
}

/// The picture so far: linear, scene-referred.
#[derive(Clone, Debug)]
pub struct Radiance {
    /// RGB: nits; A: 1 where a surface is.
    pub target: wgpu::TextureView,
    size: UVec2,
}

impl Forward {
    /// Nothing is compiled until the first scene is drawn.
    pub fn new(settings: &Settings, tracer: Tracer) -> Self {
        let depth = |compare| wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let culling = LightCulling::feature(settings.culling);
        let mut opaque: Vec<_> = culling.into_iter().collect();
        let mut blended: Vec<_> = culling.into_iter().chain(["transparent"]).collect();
        if tracer != Tracer::None {
            opaque.push("shadow_bits");
            blended.push("shadow_rays");
            blended.extend(tracer.feature());
        }
        let over = wgpu::ColorTargetState {
            format: RADIANCE_FORMAT,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let equal = depth(wgpu::CompareFunction::Equal);
        let nearer = depth(wgpu::CompareFunction::GreaterEqual);
        let module = "shading/forward";
        Self {
            opaque: SceneRaster::new("shading/forward", module, &opaque, false, equal, RADIANCE_FORMAT.into()),
            blended: SceneRaster::new("shading/transparent", module, &blended, false, nearer, over),
            radiance: None,
        }
    }

    /// Shades the visible opaque surfaces of the visibility's rows, or of the whole view where there are no shadows.
    /// `first`: whether this is the frame's first call, which clears the target to the sky.
    #[allow(clippy::too_many_arguments, reason = "the results of every pass before this one")]
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &ViewBuffer,
        surface: &Surface,
        lights: &LightLists,
        visibility: Option<&Visibility<'_>>,
        first: bool,
    ) -> Result<Radiance, RenderError> {
        let solid = || scene.geometry.draws.iter().filter(|draw| draw.alpha != DrawAlpha::Blended);
        self.opaque.prepare(frame.device, scene, solid())?;
        if self.radiance.as_ref().is_none_or(|r| r.size != surface.size) {
            let usage = wgpu::TextureUsages::COPY_SRC;
            let target = target(frame.device, "radiance", surface.size, RADIANCE_FORMAT, usage);
            self.radiance = Some(Radiance { target, size: surface.size });
        }
        let radiance = self.radiance.clone().expect("made above");
        let mut bindings = view.bindings().with(&scene.bindings()).with(&lights.bindings());
        let mut rows = 0..surface.size.y;
        let visibility_bindings = visibility.map(Visibility::bindings);
        if let (Some(visibility), Some(more)) = (visibility, &visibility_bindings) {
            rows = visibility.rows.clone();
            bindings = bindings.with(more);
        }
        let load = if first { wgpu::LoadOp::Clear(sky(scene.sky)) } else { wgpu::LoadOp::Load };
        frame.render("shading/forward", &[Some(color(&radiance, load))], Some(depth(surface)), |device, pass| {
            pass.set_scissor_rect(0, rows.start, surface.size.x, rows.end - rows.start);
            self.opaque.draw(device, pass, scene, &bindings, solid());
        });
        Ok(radiance)
    }

    /// Blends the transparent surfaces over the picture, far to near, each lit and shadowed where it is.
    #[allow(clippy::too_many_arguments, reason = "the results of every pass before this one")]
    pub fn record_transparent(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &ViewBuffer,
        surface: &Surface,
        lights: &LightLists,
        radiance: &Radiance,
        depth_of: impl Fn(Vec3) -> f32,
    ) -> Result<(), RenderError> {
        let mut draws: Vec<&Draw> =
            scene.geometry.draws.iter().filter(|draw| draw.alpha == DrawAlpha::Blended).collect();
        draws.sort_by(|a, b| depth_of(b.center).total_cmp(&depth_of(a.center)));
        self.blended.prepare(frame.device, scene, draws.iter().copied())?;
        let bindings = view.bindings().with(&scene.bindings()).with(&lights.bindings());
        let color = color(radiance, wgpu::LoadOp::Load);
        frame.render("shading/transparent", &[Some(color)], Some(depth(surface)), |device, pass| {
            self.blended.draw(device, pass, scene, &bindings, draws);
        });
        Ok(())
    }
}

fn sky(radiance: Vec3) -> wgpu::Color {
    let [r, g, b] = radiance.to_array().map(f64::from);
    wgpu::Color { r, g, b, a: 0.0 }
}

fn color(radiance: &Radiance, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view: &radiance.target,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
    }
}

/// Read only.
fn depth(surface: &Surface) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment { view: &surface.depth, depth_ops: None, stencil_ops: None }
}
