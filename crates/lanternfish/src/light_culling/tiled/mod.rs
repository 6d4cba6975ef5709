//! Lists per screen tile [Elagabani2025, §4.2; Harada2012].

use glam::UVec2;
use lanternfish_gpu::{ComputeKernel, Frame, SharedStruct, gpu_struct, primitives::Scan};

use super::{LightLists, Reach, Volume};
use crate::{
    context::ViewContext,
    error::RenderError,
    prepass::DEPTH_FORMAT,
    settings::Tiled,
    shaders::{Root, SHADERS, Shaders},
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
        /// Lights to test.
        light_count: u32,
        /// Entries that the list has room for.
        capacity: u32,
        /// 1: also test the box around the frustum.
        aabb_test: u32,
        /// 1: from the near plane to infinity.
        unbounded: u32,
        /// Unused.
        _pad: u32,
    }
}

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders {
    roots: &[Root::new("light_culling/tiled/bounds"), Root::new("light_culling/tiled/assign")],
    structs: &[SharedStruct::of::<TileGrid>()],
};

/// Lights a tile that the list has room for at first; it grows.
const FIRST_LIGHTS_PER_TILE: u32 = 64;

/// The passes, and a list that keeps its size from frame to frame.
#[derive(Debug)]
pub struct TiledCulling {
    settings: Tiled,
    bounds: ComputeKernel,
    count: ComputeKernel,
    write: ComputeKernel,
    scan: Scan,
    capacity: u32,
}

impl TiledCulling {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, settings: Tiled) -> Result<Self, RenderError> {
        let bounds = SHADERS.link("light_culling/tiled/bounds", &[])?;
        let assign = SHADERS.link("light_culling/tiled/assign", &[])?;
        Ok(Self {
            settings,
            bounds: ComputeKernel::new(device, &bounds, "bounds", "light_culling/tiled/bounds"),
            count: ComputeKernel::new(device, &assign, "count", "light_culling/tiled/count"),
            write: ComputeKernel::new(device, &assign, "write", "light_culling/tiled/write"),
            scan: Scan::new(device, "light_culling/tiled")?,
            capacity: 0,
        })
    }

    /// Tile bounds, count, scan, write. A list that is too small is grown before it is written.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer: view, surface, .. }: &ViewContext<'_>,
        reach: Reach,
    ) -> Result<LightLists, RenderError> {
        let tile_size = self.settings.tile_size.pixels();
        let columns = surface.size.x.div_ceil(tile_size);
        let rows = surface.size.y.div_ceil(tile_size);
        let tile_count = columns * rows;
        let workgroups = [columns, rows, 1];
        let limit = (frame.device.limits().max_storage_buffer_binding_size / 4).min(u32::MAX.into()) as u32;
        let guess = tile_count.saturating_mul(scene.light_count.min(FIRST_LIGHTS_PER_TILE));
        self.capacity = self.capacity.max(guess.min(limit));
        let mut grid = TileGrid {
            tile_size,
            columns,
            rows,
            light_count: scene.light_count,
            capacity: self.capacity,
            aabb_test: u32::from(self.settings.aabb_test),
            unbounded: u32::from(reach == Reach::Anywhere),
            _pad: 0,
        };
        let mut grid_buffer = frame.uniform(&grid);
        let tiles = frame.scratch("light_culling/tiles", u64::from(tile_count) * size_of::<Volume>() as u64)?;
        let cells = frame.zeroed("light_culling/cells", 4 * (u64::from(tile_count) + 1))?;
        // The depths of several samples a pixel bound no tile: the caller asks for unbounded ones.
        let no_depth = (surface.samples > 1)
            .then(|| frame_target(frame, "no_depth", UVec2::ONE, DEPTH_FORMAT, wgpu::TextureUsages::empty(), 1));
        let depth = no_depth.as_ref().unwrap_or(&surface.depth);
        let shared = view.bindings().with(&scene.bindings()).texture("depth_texture", depth).buffer("tiles", &tiles);

        // Count, and turn the counts into starts. The value after the last is zero and ends up as the total.
        let bindings = shared.clone().part("tile_grid", &grid_buffer).buffer("cell_starts", &cells);
        frame.dispatch(&self.bounds, &bindings, workgroups);
        frame.dispatch(&self.count, &bindings, workgroups);
        let total = self.scan.record(frame, &cells, tile_count + 1)?;

        // Grow before writing, so that no image is ever made from a list that was cut.
        let listed = match tile_count.checked_mul(scene.light_count) {
            Some(_) => u64::from(frame.read_now::<u32>(&total, 1)?[0]),
            // The device's sum may have started over at 2³²: add up what lies between the starts.
            None => super::total(&frame.read_now::<u32>(&cells, tile_count as usize + 1)?),
        };
        if listed > u64::from(limit) {
            return Err(RenderError::Overflow {
                list: "light_culling/indices",
                needed: listed,
                limit: limit.into(),
                remedy: "give the lights a shorter range, use larger tiles, or render a smaller image",
            });
        }
        let listed = listed as u32;
        if listed > self.capacity {
            tracing::debug!(listed, capacity = self.capacity, "light_culling/indices grows");
            self.capacity = listed;
            grid.capacity = listed;
            grid_buffer = frame.uniform(&grid);
        }
        let indices = frame.scratch("light_culling/indices", 4 * u64::from(self.capacity))?;
        let bindings =
            shared.part("tile_grid", &grid_buffer).buffer("cell_starts", &cells).buffer("listed_lights", &indices);
        frame.dispatch(&self.write, &bindings, workgroups);
        Ok(LightLists {
            cells,
            indices,
            grid: Some(("tile_grid", grid_buffer)),
            listed: listed.into(),
            tests: u64::from(tile_count) * u64::from(scene.light_count),
            clusters: None,
            fragments: None,
        })
    }
}
