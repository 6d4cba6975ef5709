//! The reflective shadow map by rasterization: the scene from each of the strongest lights, into squares of one target.

use glam::{Affine3A, Mat3, UVec2, Vec3};
use lanternfish::{
    RenderError,
    common::workgroups,
    gpu_scene::{Faces, GpuScene, PassState, SceneRaster},
    prepass::DEPTH_FORMAT,
    texture::frame_target,
    view::View,
};
use lanternfish_gpu::{Bindings, ComputeKernel, Frame};
use lanternfish_scene::{Bounds, Camera, Projection};

use super::DECLARED;
use crate::indirect::light_views::{LightView, Source, radius_of};

/// Maximum number of rasterized views: ten point lights. The others are traced.
const MOST_DRAWN: usize = 60;
/// Texels along an edge of the smallest rasterized view.
const LEAST_SIDE: u32 = 8;

/// The format that `draw.wesl` writes.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// The passes.
#[derive(Debug)]
pub(super) struct MapRaster {
    raster: SceneRaster,
    reconstruct: ComputeKernel,
}

impl MapRaster {
    pub fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let depth = wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: Default::default(),
            bias: Default::default(),
        };
        let state = PassState { depth, targets: vec![FORMAT.into()], samples: 1, faces: Faces::Both };
        let label = "indirect/virtual_lights/draw";
        let reconstruct = DECLARED.link("indirect/virtual_lights/reconstruct", &[])?;
        Ok(Self {
            raster: SceneRaster::new(label, DECLARED, label, &[], true, state),
            reconstruct: ComputeKernel::new(device, &reconstruct, "reconstruct", "indirect/virtual_lights/reconstruct"),
        })
    }

    /// Number of views that are drawn: the first ones.
    pub fn texels(views: &[LightView]) -> u32 {
        drawn(views).last().map_or(0, |view| view.first + view.side * view.side)
    }

    /// Rasterizes them, and writes their texels. `bindings`: the inputs of emission.wesl, and the texels. `edge`: of the complete map,
    /// texels.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        views: &[LightView],
        edge: u32,
        bindings: &Bindings<'_>,
    ) -> Result<(), RenderError> {
        let drawn = drawn(views);
        if drawn.is_empty() {
            return Ok(());
        }
        let none = wgpu::TextureUsages::empty();
        let mut target = |label, format| frame_target(frame, label, UVec2::splat(edge), format, none, 1);
        let depth = target("indirect/virtual_lights/depth", DEPTH_FORMAT);
        let surfaces = target("indirect/virtual_lights/surfaces", FORMAT);
        let looks: Vec<View> = drawn.iter().map(|view| look(view, scene)).collect();
        let buffers: Vec<_> = looks.iter().map(|look| look.record(frame)).collect();
        let draws: Vec<_> = looks.iter().map(|look| scene.visible_draws(look).solid).collect();
        for draws in &draws {
            self.raster.prepare(frame.device, scene, draws)?;
        }
        let color = wgpu::RenderPassColorAttachment {
            view: &surfaces,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let attachment = wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        let scene_bindings = scene.bindings();
        frame.render(self.raster.label(), &[Some(color)], Some(attachment), |groups, pass| {
            for ((view, buffer), draws) in drawn.iter().zip(&buffers).zip(&draws) {
                let corner = texel_from_code(view.first).as_vec2();
                let side = view.side as f32;
                pass.set_viewport(corner.x, corner.y, side, side, 0.0, 1.0);
                self.raster.draw(groups, pass, scene, &buffer.bindings().with(&scene_bindings), draws);
            }
        });
        let reading = bindings.clone().texture("drawn_depth", &depth).texture("drawn_surfaces", &surfaces);
        frame.dispatch(&self.reconstruct, &reading, workgroups(Self::texels(views)));
        Ok(())
    }
}

/// The rasterized views: the largest.
fn drawn(views: &[LightView]) -> &[LightView] {
    // An area light has no single viewpoint.
    let is_drawn = |view: &&LightView| view.side >= LEAST_SIDE && view.source < Source::Area as u32;
    let count = views.iter().take(MOST_DRAWN).take_while(is_drawn).count();
    &views[..count]
}

/// A light's view as a camera's. Its x is the axis up and its y the one to the right: the third axis is the direction of view.
fn look(view: &LightView, scene: &GpuScene) -> View {
    let half_width = view.right.length();
    let axes = Mat3::from_cols(view.up / half_width, view.right / half_width, -view.forward);
    let radius = radius_of(scene.bounds());
    let (eye, projection) = match view.far > 0.0 {
        true => {
            let planes = Projection::Orthographic { half_height: half_width, near: view.near, far: view.far };
            (view.origin - 2.0 * radius * view.forward, planes)
        }
        false => {
            let fov_y = 2.0 * half_width.atan();
            (view.origin, Projection::Perspective { fov_y, near: view.near })
        }
    };
    let camera =
        Camera { name: String::new(), world_from_camera: Affine3A::from_mat3_translation(axes, eye), projection };
    // A box that extends beyond both planes, so that they stay unchanged.
    let center = scene.bounds().center();
    let mut around = Bounds::EMPTY;
    [-radius, radius].into_iter().for_each(|offset| around.add_point(center + offset));
    View::new(&camera, UVec2::splat(view.side), Vec3::ZERO, &around)
}

/// Every second bit of a number, and the others: `light_views/rays.wesl`.
fn texel_from_code(code: u32) -> UVec2 {
    let compact = |code: u32| (0..16).fold(0, |sum, bit| sum | (code >> (2 * bit) & 1) << bit);
    UVec2::new(compact(code), compact(code >> 1))
}
