//! Light through rough thin surfaces and through volumes (`KHR_materials_transmission`, `KHR_materials_volume`):
//! refracted in image space, and read from the image of what lies behind.

#[cfg(test)]
mod tests;

use glam::UVec2;
use lanternfish_gpu::{BindGroups, Bindings, Frame, RasterPipeline, RasterState};

use super::{DECLARED, TRANSPARENT, UNCOVERED};
use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::{Draw, Faces, ImageBehind, LAYERED, PassState, SceneRaster, TEXTURES},
    prepass::{Prepass, Surface},
    shaders::Root,
    texture::{RADIANCE_FORMAT, Radiance, described},
};

pub(super) const ROOTS: [Root; 2] = [
    Root::of(
        "shading/refraction/refract",
        &[&[&[TRANSPARENT], &[TRANSPARENT, LAYERED]], &[&[], &[UNCOVERED]], TEXTURES],
    ),
    Root::new("shading/refraction/shrink"),
];

/// Texels along the shorter edge of the last level of the image behind. A lobe that is wider than a quarter of the
/// image is as good as diffuse.
const LEAST_EDGE: u32 = 4;

/// The passes. Compiled for the first such surface.
#[derive(Debug)]
pub(super) struct Refraction {
    raster: SceneRaster,
    backs: Prepass,
    /// The surface at each pixel's centre, if pixels have several samples and no other pass needs it.
    opaque: Prepass,
    shrink: Option<(RasterPipeline, wgpu::Sampler)>,
}

/// The surfaces of a view in image space.
#[derive(Debug)]
pub(super) struct Seen {
    opaque: wgpu::TextureView,
    backs: Surface,
}

/// Everything behind a surface, with levels of means.
#[derive(Debug)]
pub(super) struct Image {
    levels: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

impl Refraction {
    /// Compiles nothing. `state`: that of a pass over transparent surfaces. `hides_environment`: alpha is opacity.
    pub fn new(state: &PassState, hides_environment: bool) -> Self {
        let over = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::SrcAlpha,
            dst_factor: wgpu::BlendFactor::OneMinusSrcAlpha,
            operation: wgpu::BlendOperation::Add,
        };
        let kept = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::Zero,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let target = wgpu::ColorTargetState {
            format: RADIANCE_FORMAT,
            // With a hidden background, the shader reads the pixel itself.
            blend: (!hides_environment).then_some(wgpu::BlendState { color: over, alpha: kept }),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let state = PassState { targets: vec![target], faces: Faces::Shown, ..state.clone() };
        let raster = SceneRaster::new(
            "shading/transparent",
            DECLARED,
            "shading/refraction/refract",
            if hides_environment { &[TRANSPARENT, UNCOVERED] } else { &[TRANSPARENT] },
            false,
            state,
        );
        Self { raster: raster.with_layers(), backs: Prepass::of_backs(), opaque: Prepass::new(false, 1), shrink: None }
    }

    /// Draws the back faces of the refracting surfaces among these, and compiles what is missing. `None` if there are
    /// none.
    pub fn record(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>) -> Result<Option<Seen>, RenderError> {
        let draws: Vec<&Draw> =
            view.draws.transparent.iter().copied().filter(|draw| draw.behind == ImageBehind::Refracts).collect();
        if draws.is_empty() {
            return Ok(None);
        }
        self.raster.prepare(frame.device, view.scene, &draws)?;
        let opaque = match view.center_surface.samples {
            1 => view.center_surface.depth.clone(),
            _ => self.opaque.record(frame, view.scene, &view.draws, &view.buffer, view.view.size, None)?.depth,
        };
        Ok(Some(Seen {
            opaque,
            backs: self.backs.record_backs(frame, view.scene, &view.buffer, view.view.size, &draws)?,
        }))
    }

    /// Copies the image as it is so far, and computes its levels.
    pub fn image(&mut self, frame: &mut Frame<'_>, size: UVec2, radiance: &Radiance) -> Result<Image, RenderError> {
        let (pipeline, sampler) = match &mut self.shrink {
            Some(shrink) => shrink,
            none => none.insert((shrink(frame.device)?, sampler(frame.device))),
        };
        let level_count = (size.min_element() / LEAST_EDGE).max(1).ilog2() + 1;
        let whole = described("refraction/image", size, RADIANCE_FORMAT, wgpu::TextureUsages::empty(), 1);
        let levels = frame.texture(&wgpu::TextureDescriptor { mip_level_count: level_count, ..whole });
        let mut finer = radiance.target.clone();
        for level in 0..level_count {
            let target = levels.texture().create_view(&wgpu::TextureViewDescriptor {
                base_mip_level: level,
                mip_level_count: Some(1),
                ..Default::default()
            });
            let color = wgpu::RenderPassColorAttachment {
                view: &target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            };
            let bindings = Bindings::new().texture("finer_image", &finer).sampler("image_sampler", sampler);
            frame.render("refraction/shrink", &[Some(color)], None, |groups, pass| {
                pipeline.set(pass);
                pipeline.bind(groups, pass, &bindings, 4);
                pass.draw(0..3, 0..1);
            });
            finer = target;
        }
        Ok(Image { levels, sampler: sampler.clone() })
    }

    /// Draws refracting surfaces: what is behind them replaces the image.
    pub fn draw(
        &self,
        groups: &mut BindGroups,
        pass: &mut wgpu::RenderPass<'_>,
        view: &ViewContext<'_>,
        (seen, image): (&Seen, &Image),
        draws: &[&Draw],
    ) {
        let bindings = view.buffer.bindings().with(&view.scene.bindings());
        let bindings = bindings.texture("depth_texture", &seen.opaque).texture("back_depth", &seen.backs.depth);
        let bindings = seen.backs.target.iter().fold(bindings, |all, backs| all.texture("back_surface", backs));
        let bindings = bindings.texture("image_behind", &image.levels).sampler("image_sampler", &image.sampler);
        self.raster.draw(groups, pass, view.scene, &bindings, draws);
    }
}

/// Greatest number of images of what is behind refracting surfaces. The nearest draws have one each, and the others
/// share one.
const MOST_IMAGES: usize = 8;

/// Draws from far to near, split before each one that needs a new image of what is behind it; true: it does.
pub(super) fn split_for_images<'a, 'd>(runs: &'a [&'d [&'d Draw]]) -> Vec<(bool, &'a [&'d [&'d Draw]])> {
    let refracting: Vec<usize> = (0..runs.len()).filter(|i| runs[*i][0].behind == ImageBehind::Refracts).collect();
    let shared = refracting.len().saturating_sub(MOST_IMAGES);
    let starts: Vec<usize> = refracting.iter().take(1).chain(refracting.iter().skip(shared + 1)).copied().collect();
    let ends = starts.iter().copied().chain([runs.len()]);
    let parts = [0].into_iter().chain(starts.iter().copied()).zip(ends);
    parts.filter(|(start, end)| start < end).map(|(start, end)| (starts.contains(&start), &runs[start..end])).collect()
}

/// Trilinear; what lies beyond the image is like its edge.
fn sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("refraction"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    })
}

fn shrink(device: &wgpu::Device) -> Result<RasterPipeline, RenderError> {
    let shader = DECLARED.link("shading/refraction/shrink", &[])?;
    let state = RasterState { targets: &[Some(RADIANCE_FORMAT.into())], ..Default::default() };
    Ok(RasterPipeline::new(device, &shader, "vertex", "fragment", "refraction/shrink", &state))
}
