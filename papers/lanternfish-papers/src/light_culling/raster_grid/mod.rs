//! Lists for the cells of a grid over the image, computed by rasterizing the lights: the hybrid light grid [Archer2019, §3.2].
//!
//! 1. Mask: the layers of every tile in which a surface is visible.
//! 2. Outlines: the tiles that every light may touch.
//! 3. Count, scan, write: the outlines are drawn twice, with one pixel per tile; a fragment puts its light into the layers between the
//!    front and the back of its sphere.
//! 4. Sort: each list in ascending order.

mod settings;
#[cfg(test)]
mod tests;

use glam::UVec2;
use lanternfish::{
    RenderError, ViewContext,
    light_culling::{LightCullingPasses, LightLists, Reach},
    lights::LightSet,
    shaders::{Root, Shaders},
    texture::frame_target,
    view::frustum::ViewFrustum,
};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Counted, Feature, Frame, LinkedShader, RasterPipeline, RasterState, SharedStruct,
    gpu_struct, primitives::Scan,
};

pub use self::settings::RasterGrid;

gpu_struct! {
    /// The grid of cells.
    pub struct RasterCells {
        /// Edge of a tile, pixels.
        tile_size: u32,
        /// Tiles across.
        columns: u32,
        /// Tiles down.
        rows: u32,
        /// Layers of a tile; at most 32, one bit each in the mask.
        layers: u32,
        /// Distance from which layers are counted, m.
        nearest: f32,
        /// Logarithm of the ratio between the start distances of neighbouring layers.
        log_ratio: f32,
        /// Capacity of the list, entries.
        capacity: u32,
        /// 1: cells list their lights even if no surface is visible in them (for transparent surfaces).
        unmasked: u32,
    }
}

/// This technique provides `light_list`.
pub(crate) const CULLING_RASTER_GRID: Feature = Feature::choosing(
    "culling_raster_grid",
    "culling",
    "light_culling/raster_grid/cell",
    Some(crate::shaders::SHADERS.library()),
);

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::of(
    &crate::shaders::SHADERS,
    &[
        Root::new("light_culling/raster_grid/mask"),
        Root::new("light_culling/raster_grid/outline"),
        Root::new("light_culling/raster_grid/list"),
        Root::new("light_culling/raster_grid/sort"),
    ],
    &[SharedStruct::of::<RasterCells>()],
);

/// Maximum layers of a tile: the bits of its mask, and the shader's workgroup for a tile.
const MOST_LAYERS: u32 = 32;
/// Layers begin at this fraction of the farthest distance; anything nearer is in the first. With the default of 32 each is a quarter deeper
/// than the one before it.
const NEAREST_FRACTION: f32 = 1e-3;
/// Minimum ratio between the farthest distance and the nearest, so that layers are deeper than rounding errors.
const LEAST_RATIO: f32 = 2.0;
/// Format of the render target of the lights; nothing is written to it.
const TARGET_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// The passes.
#[derive(Debug)]
pub struct RasterGridCulling {
    settings: RasterGrid,
    mask: ComputeKernel,
    outlines: ComputeKernel,
    count: Drawing,
    write: Drawing,
    sort: ComputeKernel,
    scan: Scan,
}

impl LightCullingPasses for RasterGridCulling {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        reach: Reach,
        lights: &LightSet,
    ) -> Result<Vec<LightLists>, RenderError> {
        views.iter().map(|view| self.record_view(frame, view, reach, lights)).collect()
    }
}

impl RasterGridCulling {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, settings: RasterGrid) -> Result<Self, RenderError> {
        let label = |entry: &str| format!("light_culling/raster_grid/{entry}");
        let kernel = |module: &str, entry: &str| {
            let shader = DECLARED.link(module, &[])?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, entry, &label(entry)))
        };
        let list = DECLARED.link("light_culling/raster_grid/list", &[])?;
        Ok(Self {
            settings,
            mask: kernel("light_culling/raster_grid/mask", "mask")?,
            outlines: kernel("light_culling/raster_grid/outline", "outlines")?,
            count: drawing(device, &list, "count", label("count")),
            write: drawing(device, &list, "write", label("write")),
            sort: kernel("light_culling/raster_grid/sort", "sort")?,
            scan: Scan::new(device, "light_culling/raster_grid")?,
        })
    }

    /// Mask, outlines, count, scan, write, sort. A list that is too small is grown before it is written.
    fn record_view(
        &self,
        frame: &mut Frame<'_>,
        ViewContext { scene, view, buffer, surface, .. }: &ViewContext<'_>,
        reach: Reach,
        lights: &LightSet,
    ) -> Result<LightLists, RenderError> {
        // Shading uses the pixel's centre, whose depth may differ from that of every sample.
        let unmasked = reach == Reach::Anywhere || surface.samples > 1;
        let grid = self.grid(surface.size, &view.frustum(scene.bounds()), unmasked);
        let limit = lanternfish::light_culling::most_indices(frame.device);
        let tile_count = u64::from(grid.columns) * u64::from(grid.rows);
        let cell_count = tile_count * u64::from(grid.layers);
        if cell_count >= limit {
            let remedy = "choose larger tiles (`tile-size`) or fewer layers (`grid-layers`)";
            return Err(RenderError::Overflow { list: "light_culling/cells", needed: cell_count + 1, limit, remedy });
        }
        let start_count = cell_count as u32 + 1;
        let grid_buffer = frame.uniform(&grid);
        let masks = frame.scratch("light_culling/masks", 4 * tile_count)?;
        let outlines = frame.scratch("light_culling/outlines", 8 * u64::from(lights.capacity.max(1)))?;
        let tests = frame.zeroed("light_culling/tests", 8)?;
        let cells = frame.zeroed("light_culling/cells", 4 * u64::from(start_count))?;
        let (view_bindings, set_bindings) = (buffer.bindings(), lights.bindings());
        let shared = view_bindings.with(&set_bindings).buffer("tile_masks", &masks).buffer("light_tiles", &outlines);

        let bindings = shared.clone().part("raster_cells", &grid_buffer);
        let a_tile = [grid.columns, grid.rows, 1];
        if !unmasked {
            frame.dispatch(&self.mask, &bindings.clone().texture("depth_texture", &surface.depth), a_tile);
        }
        let a_light = lights.capacity.div_ceil(self.outlines.workgroup_size()[0]).max(1);
        frame.dispatch(&self.outlines, &bindings.clone().buffer("light_tests", &tests), [a_light, 1, 1]);

        // Count, then scan the counts into starts. The value after the last is zero and ends up as the total.
        draw(frame, &self.count, &bindings.buffer("cell_slots", &cells), &grid, lights.capacity);
        let total = self.scan.record(frame, &cells, start_count)?;

        // The host reads both in one readback: total, tests in two words.
        let counted = frame.scratch("light_culling/known", 16)?;
        frame.encoder().copy_buffer_to_buffer(&total, 0, &counted, 0, 4);
        frame.encoder().copy_buffer_to_buffer(&tests, 0, &counted, 4, 8);
        // Grow before writing, so that no image is made from a truncated list.
        let tests = |words: &[u32; 4]| u64::from(words[1]) | u64::from(words[2]) << 32;
        let grown = frame.capacity_for(&Counted {
            list: lights.list,
            words: &counted,
            starts: (&cells, start_count as usize),
            // The bound: every light is listed in every layer of each tile that it is tested against.
            may_wrap: &|words| tests(words).saturating_mul(grid.layers.into()) > u32::MAX.into(),
            guess: 0,
            limit,
        })?;
        let remedy = "give the lights a shorter range, use larger tiles (`tile-size`), or render a smaller image";
        lanternfish::light_culling::check_capacity(&grown, limit, lights, remedy)?;
        let grid = RasterCells { capacity: grown.capacity as u32, ..grid };
        let grid_buffer = frame.uniform(&grid);
        let indices = frame.scratch("light_culling/indices", 4 * grown.capacity)?;
        let slots = frame.scratch("light_culling/slots", 4 * cell_count)?;
        frame.encoder().copy_buffer_to_buffer(&cells, 0, &slots, 0, 4 * cell_count);
        let bindings = shared.part("raster_cells", &grid_buffer).buffer("listed_lights", &indices);
        draw(frame, &self.write, &bindings.clone().buffer("cell_slots", &slots), &grid, lights.capacity);
        frame.dispatch(&self.sort, &bindings.buffer("cell_starts", &cells), a_tile);
        Ok(LightLists {
            cells,
            indices,
            grid: Some(("raster_cells", grid_buffer)),
            listed: grown.elements,
            tests: tests(&grown.words),
            counters: Vec::new(),
            fragments: None,
        })
    }

    /// The grid of an image of `size` pixels, with capacity 0.
    fn grid(&self, size: UVec2, frustum: &ViewFrustum, unmasked: bool) -> RasterCells {
        let tile_size = self.settings.tile_size.pixels();
        let layers = self.settings.layers.clamp(1, MOST_LAYERS);
        // Parallel views may begin at the eye or behind it.
        let nearest = frustum.near.max(NEAREST_FRACTION * frustum.far).max(1e-6);
        RasterCells {
            tile_size,
            columns: size.x.div_ceil(tile_size),
            rows: size.y.div_ceil(tile_size),
            layers,
            nearest,
            log_ratio: (frustum.far / nearest).max(LEAST_RATIO).ln() / layers as f32,
            capacity: 0,
            unmasked: u32::from(unmasked),
        }
    }
}

/// A pipeline that draws the outlines of lights.
#[derive(Debug)]
struct Drawing {
    label: String,
    pipeline: RasterPipeline,
}

fn drawing(device: &wgpu::Device, shader: &LinkedShader, fragment: &str, label: String) -> Drawing {
    let target = wgpu::ColorTargetState { format: TARGET_FORMAT, blend: None, write_mask: wgpu::ColorWrites::empty() };
    let topology = wgpu::PrimitiveTopology::TriangleStrip;
    let primitive = wgpu::PrimitiveState { topology, ..Default::default() };
    let state = RasterState { primitive, targets: &[Some(target)], ..Default::default() };
    Drawing { pipeline: RasterPipeline::new(device, shader, "rectangle", fragment, &label, &state), label }
}

/// Draws the outlines of at most `capacity` lights, with one pixel per tile.
fn draw(frame: &mut Frame<'_>, drawing: &Drawing, bindings: &Bindings<'_>, grid: &RasterCells, capacity: u32) {
    let size = UVec2::new(grid.columns, grid.rows);
    let target = frame_target(frame, "light_culling/tiles", size, TARGET_FORMAT, wgpu::TextureUsages::empty(), 1);
    let color = wgpu::RenderPassColorAttachment {
        view: &target,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
    };
    frame.render(&drawing.label, &[Some(color)], None, |groups, pass| {
        drawing.pipeline.set(pass);
        drawing.pipeline.bind(groups, pass, bindings, 4);
        pass.draw(0..4, 0..capacity);
    });
}
