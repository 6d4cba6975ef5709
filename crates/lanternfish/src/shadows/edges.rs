//! Edges of multisampled images: fragments whose surface no pixel centre shows. No pixel's visibility is theirs, so rays are traced from them.

use std::mem::offset_of;

use glam::{Vec2, Vec3};
use lanternfish_gpu::{Bindings, Counted, Frame, Growth, gpu_struct, read_back};

use super::{DECLARED, EDGES_LISTED};
use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::SceneRaster,
    prepass::{MULTISAMPLED, visible_fragments},
    settings::Samples,
};

gpu_struct! {
    /// A fragment of a multisampled image from which rays are traced.
    pub struct Edge {
        /// Where it is shaded, world space, m.
        p_world: Vec3,
        /// Index of the pixel's next edge, or 0; of element 0, the number of edges.
        next: u32,
        /// Of its triangle, unit, towards the viewer.
        geometric_normal: Vec3,
        /// Unused.
        _pad: u32,
        /// Where its lights are looked up, pixels.
        position: Vec2,
        /// Depth-buffer value there.
        depth: f32,
        /// Words from its first one to the end of its block.
        words_to_end: u32,
    }
}

/// The list of edges.
const LIST: &str = "shadows/edges";
/// Words before the heads of the pixels: `FIRST_HEAD`.
const FIRST_HEAD: u64 = 4;
/// Edges in a group of the pass that traces their rays, and greatest number of its groups along one axis.
const WORKGROUP: u32 = 64;
const MOST_GROUPS: u32 = 1 << 15;

/// The pass that lists edges.
#[derive(Debug)]
pub(super) struct EdgePass {
    list: SceneRaster,
}

/// The edges of a view.
#[derive(Debug)]
pub(super) struct Edges {
    heads: wgpu::Buffer,
    list: wgpu::Buffer,
    /// Greatest number of edges in the list.
    pub capacity: u32,
}

impl EdgePass {
    /// Compiles nothing; the first scene compiles the pipelines.
    pub fn new(samples: Samples) -> Self {
        let (module, features) = ("shadows/list_edges", [EDGES_LISTED, MULTISAMPLED]);
        Self { list: SceneRaster::new(module, DECLARED, module, &features, true, visible_fragments(samples.count())) }
    }

    /// Lists the edges of a view. An image with one sample per pixel has none.
    pub fn record(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>) -> Result<Edges, RenderError> {
        let edge_bytes = size_of::<Edge>() as u64;
        if view.surface.samples == 1 {
            let heads = frame.scratch("shadows/edge_heads", 4 * FIRST_HEAD)?;
            return Ok(Edges { heads, list: frame.scratch(LIST, edge_bytes)?, capacity: 0 });
        }
        self.list.prepare(frame.device, view.scene, &view.draws.solid)?;
        let pixels = u64::from(view.surface.size.x) * u64::from(view.surface.size.y);
        let (guess, limit) = (pixels / 8, frame.device.limits().max_storage_buffer_binding_size / edge_bytes - 1);
        let heads = frame.zeroed("shadows/edge_heads", 4 * (FIRST_HEAD + pixels))?;
        let planned = frame.planned_capacity(LIST, guess, limit);
        let edges = self.draw(frame, view, heads.clone(), planned)?;
        let may_wrap = &|_: &_| false;
        let counted = Counted { list: LIST, words: &heads, starts: (&heads, 0), may_wrap, guess, limit };
        let counted = frame.counted_capacity(&counted, planned)?;
        if counted.elements > limit {
            let remedy = "use fewer samples, or render a smaller image";
            return Err(RenderError::Overflow { list: LIST, needed: counted.elements, limit, remedy });
        }
        if frame.growth() == Growth::Deferred || counted.elements <= planned {
            return Ok(edges);
        }
        frame.encoder().clear_buffer(&heads, 0, None);
        self.draw(frame, view, heads, counted.capacity)
    }

    fn draw(
        &self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, draws, surface, center_surface, .. }: &ViewContext<'_>,
        heads: wgpu::Buffer,
        capacity: u64,
    ) -> Result<Edges, RenderError> {
        let list = frame.scratch(LIST, (capacity + 1) * size_of::<Edge>() as u64)?;
        let edges = Edges { heads, list, capacity: capacity as u32 };
        let grid = frame.uniform(&super::VisibilityGrid { edge_capacity: edges.capacity, ..Default::default() });
        let (scene_bindings, surface_bindings, edge_bindings) =
            (scene.bindings(), center_surface.bindings(), edges.bindings());
        let bindings = buffer.bindings().with(&scene_bindings).with(&surface_bindings).with(&edge_bindings);
        let bindings = bindings.texture("drawn_depth", &surface.depth).part("visibility_grid", &grid);
        frame.render(self.list.label(), &[], Some(surface.read_depth()), |groups, pass| {
            self.list.draw(groups, pass, scene, &bindings, &draws.solid);
        });
        frame.encoder().copy_buffer_to_buffer(&edges.heads, 0, &edges.list, offset_of!(Edge, next) as u64, 4);
        Ok(edges)
    }
}

impl Edges {
    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("edge_heads", &self.heads).buffer("edges", &self.list)
    }

    /// Number of edges, read after the frame.
    pub fn count(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<u64, RenderError> {
        match self.capacity {
            0 => Ok(0),
            _ => Ok(read_back::<u32>(device, queue, &self.heads, 1)?[0].into()),
        }
    }

    /// Workgroups of an invocation for each edge that fits, if there may be any.
    pub fn groups(&self) -> Option<[u32; 3]> {
        let groups = self.capacity.div_ceil(WORKGROUP);
        (groups > 0).then(|| [groups.min(MOST_GROUPS), groups.div_ceil(MOST_GROUPS), 1])
    }
}
