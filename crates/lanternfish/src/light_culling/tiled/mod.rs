//! Lists per screen tile [Elagabani2025, §4.2; Harada2012].

pub(crate) mod contents;
mod settings;

use glam::UVec2;
use lanternfish_gpu::{
    AcrossFrames, ComputeKernel, Counted, Feature, Frame, SharedStruct, gpu_struct, primitives::Scan,
};

pub use self::{contents::TileContents, settings::Tiled};
use super::{LightCullingPasses, LightLists, Reach, Volume};
use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::{SceneRaster, TEXTURES},
    lights::LightSet,
    prepass::{DEPTH_FORMAT, MULTISAMPLED, visible_fragments},
    shaders::{Root, Shaders},
    texture::frame_target,
};

gpu_struct! {
    /// The grid of tiles.
    pub struct TileGrid {
        /// Edge of a tile, pixels.
        tile_size: u32,
        /// Tiles across.
        columns: u32,
        /// Tiles down.
        rows: u32,
        /// Capacity of the list, entries.
        capacity: u32,
        /// 1: lights are also tested against the box around the tile's frustum.
        aabb_test: u32,
        /// 1: tiles extend from the near plane to infinity, for transparent surfaces.
        unbounded: u32,
        /// 1: there is a depth buffer with one sample per pixel.
        reads_depth: u32,
    }
}

/// Selects this technique for `light_list`.
pub(crate) const CULLING_TILED: Feature =
    Feature::choosing("culling_tiled", "culling", "light_culling/tiled/cell", None);

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::of("light_culling/tiled/bounds", &[&[&[], &[MULTISAMPLED]]]),
        Root::of("light_culling/tiled/bounds_drawn", &[&[&[MULTISAMPLED]], TEXTURES]),
        Root::new("light_culling/tiled/assign"),
    ],
    &[SharedStruct::of::<TileGrid>()],
);

/// Initial capacity of the list, lights per tile; it grows.
const FIRST_LIGHTS_PER_TILE: u32 = 64;

/// The passes.
#[derive(Debug)]
pub struct TiledCulling {
    settings: Tiled,
    bounds: ComputeKernel,
    /// With several samples per pixel.
    bounds_drawn: Option<SceneRaster>,
    count: ComputeKernel,
    write: ComputeKernel,
    scan: Scan,
    /// Tiles across and down of each view of the last frame, and the starts of their lists.
    cells: AcrossFrames<Vec<(UVec2, wgpu::Buffer)>>,
}

impl LightCullingPasses for TiledCulling {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        reach: Reach,
        lights: &LightSet,
    ) -> Result<Vec<LightLists>, RenderError> {
        let record = |view: &ViewContext<'_>| self.record_view(frame, view, reach, lights);
        let lists = views.iter().map(record).collect::<Result<Vec<_>, _>>()?;
        if reach == Reach::Surface {
            let tiles = |view: &ViewContext<'_>| self.dimensions(view.surface.size);
            *self.cells.get(frame) =
                views.iter().map(tiles).zip(lists.iter().map(|lists| lists.cells.clone())).collect();
        }
        Ok(lists)
    }
}

impl TiledCulling {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, settings: Tiled, samples: u32) -> Result<Self, RenderError> {
        let multisampled: &[Feature] = if samples == 1 { &[] } else { &[MULTISAMPLED] };
        let bounds = DECLARED.link("light_culling/tiled/bounds", multisampled)?;
        let drawn =
            |module| SceneRaster::new(module, DECLARED, module, multisampled, false, visible_fragments(samples));
        let assign = DECLARED.link("light_culling/tiled/assign", &[])?;
        Ok(Self {
            settings,
            bounds: ComputeKernel::new(device, &bounds, "bounds", "light_culling/tiled/bounds"),
            bounds_drawn: (samples > 1).then(|| drawn("light_culling/tiled/bounds_drawn")),
            count: ComputeKernel::new(device, &assign, "count", "light_culling/tiled/count"),
            write: ComputeKernel::new(device, &assign, "write", "light_culling/tiled/write"),
            scan: Scan::new(device, "light_culling/tiled")?,
            cells: AcrossFrames::default(),
        })
    }

    /// Tiles across and down of an image.
    fn dimensions(&self, size: UVec2) -> UVec2 {
        let tile_size = self.settings.tile_size.pixels();
        UVec2::new(size.x.div_ceil(tile_size), size.y.div_ceil(tile_size))
    }

    /// Records tile bounds, count, scan and write. A list that is too small grows before it is written.
    fn record_view(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer: view, draws, surface, center_surface, .. }: &ViewContext<'_>,
        reach: Reach,
        lights: &LightSet,
    ) -> Result<LightLists, RenderError> {
        let tile_size = self.settings.tile_size.pixels();
        let UVec2 { x: columns, y: rows } = self.dimensions(surface.size);
        let tile_count = columns * rows;
        let workgroups = [columns, rows, 1];
        let limit = super::most_indices(frame.device);
        let grid = TileGrid {
            tile_size,
            columns,
            rows,
            capacity: 0,
            aabb_test: u32::from(self.settings.aabb_test),
            unbounded: u32::from(reach == Reach::Anywhere),
            reads_depth: u32::from(center_surface.samples == 1),
        };
        let grid_buffer = frame.uniform(&grid);
        let tiles = frame.scratch("light_culling/tiles", u64::from(tile_count) * size_of::<Volume>() as u64)?;
        let cells = frame.zeroed("light_culling/cells", 4 * (u64::from(tile_count) + 1))?;
        let (view_bindings, light_bindings) = (view.bindings(), lights.bindings());
        let shared = view_bindings.clone().with(&light_bindings).buffer("tiles", &tiles);

        // Bounds from the depth buffer and, with several samples per pixel, from the fragments themselves.
        let no_depth = (center_surface.samples > 1)
            .then(|| frame_target(frame, "no_depth", UVec2::ONE, DEPTH_FORMAT, wgpu::TextureUsages::empty(), 1));
        let depth = no_depth.as_ref().unwrap_or(&center_surface.depth);
        let depths = frame.zeroed("light_culling/tile_depths", 8 * u64::from(tile_count))?;
        if let Some(drawn) = self.bounds_drawn.as_mut().filter(|_| reach == Reach::Surface && surface.samples > 1) {
            drawn.prepare(frame.device, scene, &draws.solid)?;
            let scene_bindings = scene.bindings();
            let bindings = view_bindings.with(&scene_bindings).part("tile_grid", &grid_buffer);
            let bindings = bindings.buffer("tile_depths", &depths).texture("drawn_depth", &surface.depth);
            frame.render("light_culling/tiled/bounds_drawn", &[], Some(surface.read_depth()), |groups, pass| {
                drawn.draw(groups, pass, scene, &bindings, &draws.solid);
            });
        }
        let bindings = shared.clone().part("tile_grid", &grid_buffer).texture("depth_texture", depth);
        frame.dispatch(&self.bounds, &bindings.buffer("tile_depths", &depths), workgroups);

        // Count, and scan the counts into starts. The element after the last is zero and becomes the total.
        let bindings = shared.clone().part("tile_grid", &grid_buffer).buffer("cell_starts", &cells);
        frame.dispatch(&self.count, &bindings, workgroups);
        let total = self.scan.record(frame, &cells, tile_count + 1)?;

        // Grow before writing: no image is made from a truncated list.
        let capacity = frame.capacity_for(&Counted {
            list: lights.list,
            words: &total,
            starts: (&cells, tile_count as usize + 1),
            may_wrap: &|_| tile_count.checked_mul(lights.capacity).is_none(),
            guess: tile_count.saturating_mul(lights.capacity.min(FIRST_LIGHTS_PER_TILE)).into(),
            limit,
        })?;
        let remedy = "give the lights a shorter range, use larger tiles, or render a smaller image";
        super::check_capacity(&capacity, limit, lights, remedy)?;
        let tile_bytes = u64::from(tile_count) * size_of::<Volume>() as u64 + cells.size() + 4 * capacity.elements;
        let grid_buffer = frame.uniform(&TileGrid { capacity: capacity.capacity as u32, ..grid });
        let indices = frame.scratch("light_culling/indices", 4 * capacity.capacity)?;
        let bindings =
            shared.part("tile_grid", &grid_buffer).buffer("cell_starts", &cells).buffer("listed_lights", &indices);
        frame.dispatch(&self.write, &bindings, workgroups);
        Ok(LightLists {
            cells,
            indices,
            grid: Some(("tile_grid", grid_buffer)),
            listed: capacity.elements,
            tests: u64::from(tile_count) * u64::from(lights.capacity),
            counters: vec![("light_culling/tile_bytes", tile_bytes)],
            fragments: None,
        })
    }
}
