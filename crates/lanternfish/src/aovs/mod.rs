//! Arbitrary output variables (AOVs): what the nearest surface at each pixel's centre is, as numbers, for data sets and
//! compositing.

#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3, Vec2, Vec3};
use lanternfish_gpu::{Feature, Frame};
use lanternfish_scene::Camera;
use rayon::prelude::*;

use crate::{
    error::RenderError,
    gpu_scene::{Faces, GeometryAt, GpuScene, MASKED, PassState, SceneRaster, TEXTURES},
    prepass::{DEPTH_FORMAT, MOTION, ViewMotion},
    shaders::{Root, Shaders},
    texture::frame_target,
    view::View,
};

/// The vertex stage passes on the index of the draw instance.
const IDENTIFIED: Feature = Feature::new("identified");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders =
    Shaders::new(&[Root::of("aovs/surface", &[&[&[MOTION, IDENTIFIED]], &[&[], &[MASKED]], TEXTURES])], &[]);

/// What the texels of the two targets hold: `surface.wesl`.
const FORMATS: [wgpu::TextureFormat; 2] = [wgpu::TextureFormat::Rgba32Uint, wgpu::TextureFormat::Rgba32Float];

/// What the nearest surface at each pixel's centre is. Rows from the top, without antialiasing: no value is a mix of
/// two surfaces.
///
/// A surface counts where its opacity is at least ½, so glass counts and an alpha mask's holes do not. Where there is
/// no surface every value is 0.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Aovs {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Distance along the view axis, m.
    pub depth: Vec<f32>,
    /// Distance along the pixel's ray, m: from the eye, or from the plane of an orthographic camera.
    pub distance: Vec<f32>,
    /// Point on the surface, world space, m.
    pub position: Vec<[f32; 3]>,
    /// Unit shading normal on the viewer's side, world space; a normal map changes it.
    pub normal: Vec<[f32; 3]>,
    /// Base colour, linear Rec. 709, 0 to 1.
    pub albedo: Vec<[f32; 3]>,
    /// Where the point of the surface is in the next frame, less where it is now: x right and y down, pixels. 0 without
    /// a next frame, and for points that the next frame's camera has behind it.
    pub motion: Vec<[f32; 2]>,
    /// Index in [`Scene::instances`](lanternfish_scene::Scene::instances), plus 1.
    pub instance: Vec<u32>,
    /// Index in [`Scene::materials`](lanternfish_scene::Scene::materials), plus 1.
    pub material: Vec<u32>,
}

/// A view of a scene as it was at one time: the next frame, for [`Aovs::motion`].
#[derive(Debug)]
pub struct Moment {
    pub(crate) camera: Camera,
    pub(crate) instances: wgpu::Buffer,
    pub(crate) positions: wgpu::Buffer,
    /// The scene's instance of each draw instance.
    pub(crate) order: Vec<u32>,
}

/// The pass that draws them.
#[derive(Debug)]
pub(crate) struct AovPass {
    solid: SceneRaster,
    transparent: SceneRaster,
}

impl AovPass {
    /// Compiles nothing; the first scene compiles the pipelines.
    pub fn new() -> Self {
        let raster = |features: &[Feature], distinguishes_masked| {
            let depth = wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: Default::default(),
                bias: Default::default(),
            };
            let targets = FORMATS.map(Into::into).to_vec();
            let state = PassState { depth, targets, samples: 1, faces: Faces::Shown };
            SceneRaster::new("aovs", DECLARED, "aovs/surface", features, distinguishes_masked, state)
        };
        Self { solid: raster(&[MOTION, IDENTIFIED], true), transparent: raster(&[MOTION, IDENTIFIED, MASKED], false) }
    }

    /// Draws a view's surfaces and returns the two targets. `other_frame`: the view and the geometry to which motion is
    /// relative.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &View,
        (other_view, other_frame): (&View, GeometryAt<'_>),
    ) -> Result<[wgpu::TextureView; 2], RenderError> {
        let Self { solid, transparent } = self;
        let draws = scene.visible_draws(view);
        solid.prepare(frame.device, scene, &draws.solid)?;
        transparent.prepare(frame.device, scene, &draws.transparent)?;
        let motion = frame.uniform(&ViewMotion {
            clip_from_view: view.clip_from_view,
            previous_clip_from_view: other_view.clip_from_view,
            previous_view_from_world: other_view.view_from_world,
        });
        let (buffer, own) = (view.record(frame), scene.bindings());
        let bindings = buffer
            .bindings()
            .with(&own)
            .part("view_motion", &motion)
            .buffer("previous_instances", other_frame.instances);
        let copied = wgpu::TextureUsages::COPY_SRC;
        let targets = FORMATS.map(|format| frame_target(frame, "aovs", view.size, format, copied, 1));
        let depth = frame_target(frame, "aovs/depth", view.size, DEPTH_FORMAT, wgpu::TextureUsages::empty(), 1);
        let colors = targets.each_ref().map(|view| {
            let ops =
                wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        });
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
            stencil_ops: None,
        };
        frame.render("aovs", &colors, Some(depth), |groups, pass| {
            pass.set_vertex_buffer(2, other_frame.positions.slice(..));
            solid.draw(groups, pass, scene, &bindings, &draws.solid);
            transparent.draw(groups, pass, scene, &bindings, &draws.transparent);
        });
        Ok(targets)
    }
}

impl Aovs {
    /// Memory of a pixel while they are read back, bytes: the texels and the values.
    #[doc(hidden)]
    pub const BYTES_PER_PIXEL: u64 = 32 + 4 * (1 + 1 + 3 + 3 + 3 + 2 + 1 + 1);

    pub(crate) fn of_texels(scene: &GpuScene, view: &View, identity: &[[u32; 4]], place: &[[f32; 4]]) -> Self {
        let (width, height) = view.size.into();
        // Texels without a surface are 0.
        let drawn = |texel: &[u32; 4]| Some(scene.geometry.draw_instance(texel[0].checked_sub(1)?));
        let p_view = |i: usize, depth: f32| {
            let pixel = DVec2::new(f64::from(i as u32 % width), f64::from(i as u32 / width)) + 0.5;
            view_from_distance(view, pixel, f64::from(depth))
        };
        let world_from_view = view.world_from_view.as_dmat4();
        let depths = || place.par_iter().map(|texel| texel[0]);
        let distance = |(i, depth)| if view.orthographic == 1 { depth } else { p_view(i, depth).length() as f32 };
        let position = |(i, depth)| match depth {
            0.0 => [0.0; 3],
            _ => world_from_view.transform_point3(p_view(i, depth)).as_vec3().to_array(),
        };
        let unorm = |bits: u32| (bits & 0xffff) as f32 / 65535.0;
        Self {
            width,
            height,
            depth: depths().collect(),
            distance: depths().enumerate().map(distance).collect(),
            position: depths().enumerate().map(position).collect(),
            normal: identity.par_iter().map(|[id, bits, ..]| unit_from_packed(*id, *bits).to_array()).collect(),
            albedo: identity.par_iter().map(|[.., rg, b]| [unorm(*rg), unorm(*rg >> 16), unorm(*b)]).collect(),
            motion: place.par_iter().map(|[_, x, y, _]| [*x, *y]).collect(),
            instance: identity.par_iter().map(|texel| drawn(texel).map_or(0, |drawn| drawn.instance + 1)).collect(),
            material: identity.par_iter().map(|texel| drawn(texel).map_or(0, |drawn| drawn.material + 1)).collect(),
        }
    }
}

/// The point at this distance along the view axis that a point of the image shows, view space: as `view_from_depth` of
/// `view.wesl`.
fn view_from_distance(view: &View, pixel: DVec2, distance: f64) -> DVec3 {
    let ndc = pixel / view.size.as_dvec2() * DVec2::new(2.0, -2.0) + DVec2::new(-1.0, 1.0);
    let [x, y, z, w] = [0, 1, 2, 3].map(|column| view.clip_from_view.col(column).as_dvec4());
    let scale = DVec2::new(x.x, y.y);
    let p = match view.orthographic == 1 {
        true => (ndc - DVec2::new(w.x, w.y)) / scale,
        false => (ndc + DVec2::new(z.x, z.y)) / scale * distance,
    };
    p.extend(-distance)
}

/// The unit vector of `pack2x16snorm(octahedral_from_unit(v))`; 0 if there is no surface, whose `id` is 0.
fn unit_from_packed(id: u32, bits: u32) -> Vec3 {
    if id == 0 {
        return Vec3::ZERO;
    }
    let snorm = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let e = Vec2::new(snorm(bits), snorm(bits >> 16));
    let z = 1.0 - e.x.abs() - e.y.abs();
    let folded = (1.0 - Vec2::new(e.y, e.x).abs()) * Vec2::new(1f32.copysign(e.x), 1f32.copysign(e.y));
    (if z < 0.0 { folded } else { e }).extend(z).normalize()
}
