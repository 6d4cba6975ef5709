//! Depth and the thin surface target of a view [Elagabani2025, §4.1], and its motion.

mod given;
mod motion;
#[cfg(test)]
mod tests;

use glam::UVec2;
use lanternfish_gpu::{Bindings, Feature, Frame, SharedStruct};

use crate::{
    error::RenderError,
    gpu_scene::{Draw, Faces, GpuScene, MASKED, PassState, SceneRaster, TEXTURES, VisibleDraws},
    shaders::{Root, Shaders},
    texture::frame_target,
    view::ViewBuffer,
};

use self::motion::MOTION_FORMAT;
pub use self::motion::{Motion, ViewMotion};
pub(crate) use self::{
    given::GivenSurfaces,
    motion::{FrameBefore, MOTION, PLACES_FORMAT, PreviousFrame, ShownViews},
};

/// Format of depth; the float precision suits reverse-Z.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Format of the surface target; `surface_target.wesl` packs it.
pub const SURFACE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Uint;

/// The draws are transparent surfaces.
const TRANSPARENT: Feature = Feature::new("transparent");
/// Of transparent surfaces those behind the nearest one.
const BEHIND: Feature = Feature::new("behind");
/// The draws have clear coats: their normals and roughness are written.
const COATS: Feature = Feature::new("coats");
/// The draws scatter light from behind: the opposite normals are written.
pub(crate) const FROM_BEHIND: Feature = Feature::new("from_behind");
/// Pixels have several samples.
pub(crate) const MULTISAMPLED: Feature = Feature::new("multisampled");

/// Variants of the prepass with a surface target.
const VARIANTS: &[&[Feature]] = &[
    &[],
    &[MASKED],
    &[TRANSPARENT],
    &[TRANSPARENT, BEHIND],
    &[COATS],
    &[COATS, MASKED],
    &[FROM_BEHIND],
    &[FROM_BEHIND, MASKED],
    &[MOTION],
    &[MOTION, MASKED],
];

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::of("prepass/prepass", &[VARIANTS, TEXTURES]),
        Root::of("prepass/depth", &[&[&[], &[MASKED]], TEXTURES]),
        given::ROOT,
    ],
    &[SharedStruct::of::<ViewMotion>()],
);

/// The pass that draws depth and the surface target.
#[derive(Debug)]
pub struct Prepass {
    raster: SceneRaster,
    writes: Writes,
    samples: u32,
}

/// The outputs of a prepass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Writes {
    Depth,
    /// Depth and the surface target.
    Surface,
    /// Depth, the surface target and motion.
    Motion,
}

/// The visible surfaces: the prepass's result.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Depth, reverse-Z; 0 where there is no surface.
    pub depth: wgpu::TextureView,
    /// Normals and roughness, if a later pass reads them.
    pub target: Option<wgpu::TextureView>,
    /// Motion since the previous frame, if a later pass reads it.
    pub motion: Option<Motion>,
    /// Size of the image, pixels.
    pub size: UVec2,
    /// Samples per pixel.
    pub samples: u32,
}

impl Surface {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        let mut bindings = Bindings::new().texture("depth_texture", &self.depth);
        if let Some(target) = &self.target {
            bindings = bindings.texture("surface_texture", target);
        }
        if let Some(motion) = &self.motion {
            bindings = bindings.with(&motion.bindings());
        }
        bindings
    }

    /// The depth attachment, tested and not written.
    pub(crate) fn read_depth(&self) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        wgpu::RenderPassDepthStencilAttachment { view: &self.depth, depth_ops: None, stencil_ops: None }
    }
}

impl Prepass {
    /// Compiles nothing; the first scene compiles the pipelines. `with_target`: true if a later pass reads normals or
    /// roughness, which need one sample per pixel.
    pub fn new(with_target: bool, samples: u32) -> Self {
        let writes = if with_target && samples == 1 { Writes::Surface } else { Writes::Depth };
        let module = if writes == Writes::Surface { "prepass/prepass" } else { "prepass/depth" };
        let raster = SceneRaster::new("prepass", DECLARED, module, &[], true, state(writes, samples));
        Self { raster, writes, samples }
    }

    /// A prepass that also writes motion, with one sample per pixel. It needs the previous frame.
    pub(crate) fn of_moving() -> Self {
        let raster =
            SceneRaster::new("prepass", DECLARED, "prepass/prepass", &[MOTION], true, state(Writes::Motion, 1));
        Self { raster, writes: Writes::Motion, samples: 1 }
    }

    /// A prepass of transparent surfaces, with normals and roughness and one sample per pixel. `are_behind`: of those
    /// behind the nearest one.
    pub fn of_transparent(are_behind: bool) -> Self {
        let features: &[Feature] = if are_behind { &[TRANSPARENT, BEHIND] } else { &[TRANSPARENT] };
        let state = state(Writes::Surface, 1);
        let raster = SceneRaster::new("prepass/transparent", DECLARED, "prepass/prepass", features, false, state);
        Self { raster, writes: Writes::Surface, samples: 1 }
    }

    /// A prepass of the clear coats of opaque surfaces, with the coats' normals and roughness and one sample per pixel.
    pub(crate) fn of_coats() -> Self {
        let state = state(Writes::Surface, 1);
        let raster = SceneRaster::new("prepass/coats", DECLARED, "prepass/prepass", &[COATS], true, state);
        Self { raster, writes: Writes::Surface, samples: 1 }
    }

    /// A prepass of opaque surfaces that scatter light from behind, with the normals of their other sides and one
    /// sample per pixel.
    pub(crate) fn of_other_sides() -> Self {
        let state = state(Writes::Surface, 1);
        let raster = SceneRaster::new("prepass/from_behind", DECLARED, "prepass/prepass", &[FROM_BEHIND], true, state);
        Self { raster, writes: Writes::Surface, samples: 1 }
    }

    /// A prepass of back faces, with normals and one sample per pixel. It keeps the nearest.
    pub(crate) fn of_backs() -> Self {
        let state = PassState { faces: Faces::Backs, ..state(Writes::Surface, 1) };
        let raster = SceneRaster::new("prepass/backs", DECLARED, "prepass/prepass", &[], false, state);
        Self { raster, writes: Writes::Surface, samples: 1 }
    }

    /// Draws all but the transparent surfaces of a view. `before` is the previous frame, which only a prepass
    /// [`Self::of_moving`] needs.
    pub(crate) fn record(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        draws: &VisibleDraws<'_>,
        view: &ViewBuffer,
        size: UVec2,
        before: Option<&FrameBefore<'_>>,
    ) -> Result<Surface, RenderError> {
        let before = before.filter(|_| self.writes == Writes::Motion);
        let (own, compared) = (scene.bindings(), before.map(FrameBefore::bindings).unwrap_or_default());
        let bindings = view.bindings().with(&own).with(&compared);
        self.draw(frame, scene, &draws.solid, &bindings, size, before)
    }

    /// Draws some of a view's surfaces: the transparent ones that are nearer than the opaque surface at the pixel's
    /// centre, of which it keeps the nearest, or some opaque ones again. For a prepass [`Self::of_transparent`],
    /// [`Self::of_coats`] or [`Self::of_other_sides`]. `nearest`: depth of the transparent surfaces behind which it draws.
    pub(crate) fn record_some(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &ViewBuffer,
        opaque: &Surface,
        draws: &[&Draw],
        nearest: Option<&wgpu::TextureView>,
    ) -> Result<Surface, RenderError> {
        let mut bindings = view.bindings().with(&scene.bindings()).texture("depth_texture", &opaque.depth);
        if let Some(nearest) = nearest {
            bindings = bindings.texture("nearest_depth", nearest);
        }
        self.draw(frame, scene, draws, &bindings, opaque.size, None)
    }

    /// Draws the back faces of these draws. For a prepass [`Self::of_backs`].
    pub(crate) fn record_backs(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        view: &ViewBuffer,
        size: UVec2,
        draws: &[&Draw],
    ) -> Result<Surface, RenderError> {
        let bindings = view.bindings().with(&scene.bindings());
        self.draw(frame, scene, draws, &bindings, size, None)
    }

    fn draw(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        draws: &[&Draw],
        bindings: &Bindings<'_>,
        size: UVec2,
        before: Option<&FrameBefore<'_>>,
    ) -> Result<Surface, RenderError> {
        self.raster.prepare(frame.device, scene, draws)?;
        let surface = self.surface(frame, size, before);
        let targets = surface.target.iter().chain(surface.motion.iter().map(|motion| &motion.target));
        let color = |view| wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let colors: Vec<_> = targets.map(|target| Some(color(target))).collect();
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &surface.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        let label = self.raster.label();
        frame.render(label, &colors, Some(depth), |groups, pass| {
            if let Some(before) = before {
                pass.set_vertex_buffer(2, before.positions().slice(..));
            }
            self.raster.draw(groups, pass, scene, bindings, draws);
        });
        Ok(surface)
    }

    fn surface(&self, frame: &mut Frame<'_>, size: UVec2, before: Option<&FrameBefore<'_>>) -> Surface {
        let none = wgpu::TextureUsages::empty();
        let mut target = |label, format| frame_target(frame, label, size, format, none, self.samples);
        let depth = target("depth", DEPTH_FORMAT);
        Surface {
            depth,
            target: (self.writes >= Writes::Surface).then(|| target("surface", SURFACE_FORMAT)),
            motion: before.map(|before| before.found(target("motion", MOTION_FORMAT))),
            size,
            samples: self.samples,
        }
    }
}

/// State of a pass that draws the visible fragments again, after the prepass, and writes storage alone.
pub(crate) fn visible_fragments(samples: u32) -> PassState {
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(false),
        depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
        stencil: Default::default(),
        bias: Default::default(),
    };
    PassState { depth, targets: Vec::new(), samples, faces: Faces::Shown }
}

fn state(writes: Writes, samples: u32) -> PassState {
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        // Of two surfaces with equal depth the later one is kept, as in shading, which tests for equal depth.
        depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
        stencil: Default::default(),
        bias: Default::default(),
    };
    let targets = match writes {
        Writes::Depth => Vec::new(),
        Writes::Surface => vec![SURFACE_FORMAT.into()],
        Writes::Motion => vec![SURFACE_FORMAT.into(), MOTION_FORMAT.into()],
    };
    PassState { depth, targets, samples, faces: Faces::Shown }
}
