//! Visibility of the listed lights at each pixel, by ray tracing [Elagabani2025, §4.3].
//!
//! The result is one bit for each pixel and listed light. Where lights have an area it is eight bits: the number of
//! unoccluded rays. In scenes with area lights it is 32 bits, of which an area light uses one for each ray. The number
//! of words follows the length of the lists. If the words of all pixels do not fit one buffer, the frame is rendered in
//! bands of pixel rows; no light is left out.

mod bands;
mod edges;
mod features;
mod kernels;
#[cfg(test)]
mod tests;

use std::ops::Range;

use lanternfish_gpu::{
    Bindings, BufferPart, Counted, Feature, Frame, Growth, SharedStruct, faulty_software, gpu_constants, gpu_struct,
    primitives::Scan, read_back,
};

pub(crate) use self::features::{ShadowFeatures, features};
use self::{
    bands::{bands, even_row_starts, row_starts, split},
    edges::{Edge, EdgePass, Edges},
    kernels::Kernels,
};
use crate::{
    context::ViewContext,
    denoise::layers::layers_target,
    error::RenderError,
    gpu_scene::{GpuScene, MASKED, TEXTURES},
    light_culling::LightLists,
    prepass::MULTISAMPLED,
    rays::Tracer,
    settings::{DebugView, RayCulling, Samples, Settings},
    shaders::{Root, Shaders},
    texture::frame_target,
};

gpu_struct! {
    /// Layout of the visibility bits.
    pub struct VisibilityGrid {
        /// Blocks across.
        columns: u32,
        /// Blocks down.
        rows: u32,
        /// First row of blocks of the current band.
        first_row: u32,
        /// Capacity of the buffer, words.
        capacity: u32,
        /// First row of blocks after the current band.
        end_row: u32,
        /// First row of blocks of a dispatch of `trace` or `trace_edges`.
        traced_row: u32,
        /// First row of blocks after those of the dispatch.
        traced_end: u32,
        /// Capacity of the list of edges; 0: there is none.
        edge_capacity: u32,
    }
}

/// Lights have a radius: several rays go to each.
pub(crate) const SOFT: Feature = Feature::new("soft");
/// Shadows have a history: the rays to area lights sample other points in each frame, and shading blends the visibility
/// ratio of each light with that of earlier frames.
pub(crate) const SHADOW_HISTORY: Feature = Feature::new("shadow_history");
/// Visibility bits are written, not read.
const VISIBILITY_WRITTEN: Feature = Feature::new("visibility_written");
/// Ray culling by the lights' ranges.
const CULL_RANGE: Feature = Feature::new("cull_range");
/// Ray culling by normals from five depth samples per axis.
const CULL_IMPROVED: Feature = Feature::new("cull_improved");
/// Rays start from depth, without the surface target.
const DEPTH_ALONE: Feature = Feature::new("depth_alone");
/// Ray culling by the surface's normals.
const CULL_SURFACE: Feature = Feature::new("cull_surface");
/// Ray culling by the triangle alone, exact.
const CULL_TRIANGLE: Feature = Feature::new("cull_triangle");
/// The pass finds the edges of a multisampled image.
const EDGES_LISTED: Feature = Feature::new("edges_listed");
/// The pass assigns words to the edges of a multisampled image.
const EDGES_PLANNED: Feature = Feature::new("edges_planned");
/// The rays of each pixel are counted.
const RAY_COUNTS: Feature = Feature::new("ray_counts");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::by_settings("shadows/plan"),
        Root::by_settings("shadows/trace"),
        Root::by_settings("shadows/trace_edges"),
        Root::of("shadows/list_edges", &[&[&[EDGES_LISTED, MULTISAMPLED]], &[&[], &[MASKED]], TEXTURES]),
    ],
    &[SharedStruct::of::<VisibilityGrid>(), SharedStruct::of::<Edge>()],
);

gpu_constants! {
    /// Edge of a block of pixels.
    pub const BLOCK_EDGE: u32 = 8;
    /// Bits of a light with a radius. More rays than they can count are an error.
    const SOFT_LIGHT_BITS: u32 = 8;
}
/// Words before the starts of the blocks; there is one start more than blocks: `FIRST_START`.
const FIRST_START: u64 = 1;

/// The list of visibility bits.
const WORDS: &str = "shadows/words";

/// The setting in errors about tracers through deep images.
const DEEP_SHADOWS: &str = "`shadows` through deep images";

/// The passes of shadows for every listed light.
#[derive(Debug)]
pub struct Shadows {
    settings: Settings,
    tracer: Tracer,
    /// For scenes without area lights and with, in each without panes and with. The first is compiled at once, others
    /// for the first such scene.
    kernels: [[Option<Kernels>; 2]; 2],
    scan: Scan,
    /// Finds the edges of multisampled images.
    edges: EdgePass,
    /// Upper bound of the words of a band, in addition to the device's binding limit and the countable rays; a lower
    /// number gives more bands.
    pub(crate) word_limit: u64,
    /// Upper bound of the words of a dispatch, in addition to that of the kernels; a lower number gives more
    /// dispatches.
    pub(crate) dispatch_limit: u64,
}

/// Division of a frame's visibility into bands.
#[derive(Debug)]
pub struct VisibilityPlan {
    words: wgpu::Buffer,
    /// Two words a band: rays of pixels, and all rays.
    ray_totals: wgpu::Buffer,
    ray_counts: Option<wgpu::TextureView>,
    /// Light that reaches pixels through panes, if there are any: four layers.
    tinted: Option<wgpu::TextureView>,
    grid: VisibilityGrid,
    bands: Vec<Range<u32>>,
    /// Rows of blocks of the dispatches of each band.
    dispatches: Vec<Vec<Range<u32>>>,
    edges: Edges,
}

/// The visibility bits of one band of pixel rows.
#[derive(Debug)]
pub struct Visibility<'p> {
    plan: &'p VisibilityPlan,
    grid: BufferPart,
    /// Pixel rows of the image that the band covers.
    pub rows: Range<u32>,
}

impl Visibility<'_> {
    /// Blocks of its pixels, across and down: one workgroup each.
    pub fn blocks(&self) -> [u32; 3] {
        [self.plan.grid.columns, (self.rows.end - self.rows.start).div_ceil(BLOCK_EDGE), 1]
    }

    /// Bindings under the names that the shaders use.
    pub fn bindings(&self) -> Bindings<'_> {
        let bindings = self.plan.edges.bindings().part("visibility_grid", &self.grid);
        let bindings = bindings.buffer("visibility_words", &self.plan.words);
        self.plan.tinted.iter().fold(bindings, |bindings, tinted| bindings.texture("tinted_layers", tinted))
    }
}

impl VisibilityPlan {
    /// The bands, as ranges of rows of blocks, from top to bottom.
    pub fn bands(&self) -> impl ExactSizeIterator<Item = (usize, Range<u32>)> {
        self.bands.iter().cloned().enumerate()
    }

    /// The bits of one traced band of an image with `height` rows.
    pub fn band(&self, frame: &mut Frame<'_>, height: u32, band: &Range<u32>) -> Visibility<'_> {
        let grid = VisibilityGrid { first_row: band.start, end_row: band.end, ..self.grid };
        let rows = BLOCK_EDGE * band.start..(BLOCK_EDGE * band.end).min(height);
        Visibility { plan: self, grid: frame.uniform(&grid), rows }
    }

    /// Rays (low 16 bits) and unoccluded rays (high 16 bits) of every pixel, if they were requested.
    pub fn ray_counts(&self) -> Option<&wgpu::TextureView> {
        self.ray_counts.as_ref()
    }

    /// Counters by name, read after the frame.
    pub fn counters(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<[(&'static str, u64); 5], RenderError> {
        let totals: Vec<[u32; 2]> = read_back(device, queue, &self.ray_totals, self.bands.len())?;
        let sum = |of: fn(&[u32; 2]) -> u32| totals.iter().map(|totals| u64::from(of(totals))).sum();
        Ok([
            ("shadows/rays", sum(|[_, all]| *all)),
            ("shadows/edges", self.edges.count(device, queue)?),
            ("shadows/edge_rays", sum(|[of_pixels, all]| all - of_pixels)),
            ("shadows/bands", self.bands.len() as u64),
            ("shadows/bits_bytes", 4 * u64::from(self.grid.capacity)),
        ])
    }
}

impl Shadows {
    /// Compiles the passes for a tracer.
    pub fn new(device: &wgpu::Device, settings: &Settings, tracer: Tracer) -> Result<Self, RenderError> {
        check_driver(tracer, &device.adapter_info())?;
        Ok(Self {
            kernels: [[Some(Kernels::new(device, settings, tracer, false, false)?), None], [None, None]],
            scan: Scan::new(device, "shadows")?,
            edges: EdgePass::new(settings.image.samples),
            settings: settings.clone(),
            tracer,
            word_limit: u64::MAX,
            dispatch_limit: u64::MAX,
        })
    }

    /// The passes for a scene. [`Shadows::plan`] must have compiled them.
    fn kernels(&self, scene: &GpuScene) -> &Kernels {
        let [areas, panes] = self.variant(scene);
        let Some(kernels) = &self.kernels[areas][panes] else { unreachable!("the plan compiles them") };
        kernels
    }

    /// Index of the kernels for a scene.
    fn variant(&self, scene: &GpuScene) -> [usize; 2] {
        let has_panes = scene.has_panes() && sees_panes(&self.settings, self.tracer);
        [scene.has_area_lights, has_panes].map(usize::from)
    }

    /// Counts the words that each block needs, and divides the frame into bands that fit.
    pub fn plan(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
    ) -> Result<VisibilityPlan, RenderError> {
        let ViewContext { scene, buffer, center_surface: surface, .. } = view;
        let device = frame.device;
        let [areas, panes] = self.variant(scene);
        if self.kernels[areas][panes].is_none() {
            let kernels = Kernels::new(device, &self.settings, self.tracer, areas == 1, panes == 1)?;
            self.kernels[areas][panes] = Some(kernels);
        }
        let columns = surface.size.x.div_ceil(BLOCK_EDGE);
        check_row(columns, scene.lights.capacity.div_ceil(self.kernels(scene).lights_a_word))?;
        let rows = surface.size.y.div_ceil(BLOCK_EDGE);
        let blocks = columns * rows;
        let edges = self.edges.record(frame, view)?;
        let mut grid = VisibilityGrid { columns, rows, edge_capacity: edges.capacity, ..VisibilityGrid::default() };
        let starts = frame.zeroed("shadows/starts", 4 * (u64::from(blocks) + 1))?;
        let grid_buffer = frame.uniform(&grid);
        let bindings = buffer
            .bindings()
            .with(&surface.bindings())
            .with(&lights.bindings())
            .with(&edges.bindings())
            .part("visibility_grid", &grid_buffer)
            .buffer("word_counts", &starts);
        frame.dispatch(&self.kernels(scene).plan, &bindings, [columns, rows, 1]);
        let total = self.scan.record(frame, &starts, blocks + 1)?;

        let first_bits = FIRST_START + u64::from(blocks) + 1;
        let binding_words = device.limits().max_storage_buffer_binding_size / 4;
        let limit = self.word_limit.min(self.kernels(scene).most_words).min(binding_words.saturating_sub(first_bits));
        let starts_of_blocks = (&starts, blocks as usize + 1);
        let (bands, words, row_starts) = match frame.growth() {
            Growth::Blocking => {
                let row_starts = row_starts(&frame.read_now::<u32>(&starts, starts_of_blocks.1)?, columns as usize);
                let bands = bands(&row_starts, limit)?;
                let words_of = |b: &Range<u32>| row_starts[b.end as usize] - row_starts[b.start as usize];
                let words = bands.iter().map(words_of).max().unwrap_or(0);
                (bands, words, row_starts)
            }
            // One band: the host would have to wait for the device to learn the number of bands.
            Growth::Deferred => {
                let capacity = frame.capacity_for(&Counted {
                    list: WORDS,
                    words: &total,
                    starts: starts_of_blocks,
                    may_wrap: &|_| false,
                    guess: u64::from(blocks * BLOCK_EDGE * BLOCK_EDGE),
                    limit,
                })?;
                if capacity.elements > limit {
                    let remedy = "use fewer lights, give them a shorter range, or render a smaller image";
                    return Err(RenderError::Overflow { list: WORDS, needed: capacity.elements, limit, remedy });
                }
                (std::iter::once(0..rows).collect(), capacity.capacity, even_row_starts(rows, capacity.elements))
            }
        };
        let dispatch_limit = self.dispatch_limit.min(self.kernels(scene).most_words_of_dispatch);
        let dispatches = bands.iter().map(|band| split(&row_starts, band.clone(), dispatch_limit)).collect();
        // Without lights there are no words; a buffer must not be empty.
        let capacity = first_bits + words.max(1);
        grid.capacity = capacity as u32;
        let words = frame.scratch(WORDS, 4 * capacity)?;
        frame.encoder().copy_buffer_to_buffer(&starts, 0, &words, 4 * FIRST_START, 4 * (u64::from(blocks) + 1));
        let usage = wgpu::TextureUsages::STORAGE_BINDING;
        let format = wgpu::TextureFormat::R32Uint;
        let counts = || frame_target(frame, "shadows/ray_counts", surface.size, format, usage, 1);
        let ray_counts = counts_rays(&self.settings).then(counts);
        Ok(VisibilityPlan {
            tinted: (panes == 1).then(|| layers_target(frame, surface.size)),
            words,
            ray_totals: frame.scratch("shadows/ray_totals", 8 * bands.len() as u64)?,
            ray_counts,
            grid,
            bands,
            dispatches,
            edges,
        })
    }

    /// Traces the rays of one band.
    pub fn record<'p>(
        &self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
        plan: &'p VisibilityPlan,
        index: usize,
        band: Range<u32>,
    ) -> Visibility<'p> {
        let ViewContext { scene, buffer, center_surface: surface, .. } = view;
        let trace = &self.kernels(scene).trace;
        let visibility = plan.band(frame, surface.size.y, &band);
        let mut bindings = buffer
            .bindings()
            .with(&scene.bindings())
            .with(&surface.bindings())
            .with(&lights.bindings())
            .with(&plan.edges.bindings())
            .buffer("visibility_words", &plan.words);
        if let Some(counts) = &plan.ray_counts {
            bindings = bindings.texture("ray_counts", counts);
        }
        if let Some(tinted) = &plan.tinted {
            bindings = bindings.texture("tinted_light", tinted);
        }
        frame.encoder().clear_buffer(&plan.words, 0, Some(4));
        if trace.runs_in_parts() {
            // Each chunk adds its bits.
            let first_bits = FIRST_START + u64::from(plan.grid.columns * plan.grid.rows) + 1;
            frame.encoder().clear_buffer(&plan.words, 4 * first_bits, None);
        }
        let count_rays = |frame: &mut Frame<'_>, word: u64| {
            frame.encoder().copy_buffer_to_buffer(&plan.words, 0, &plan.ray_totals, 8 * index as u64 + 4 * word, 4);
        };
        let grids: Vec<_> = plan.dispatches[index]
            .iter()
            .map(|rows| {
                let (first_row, end_row) = (band.start, band.end);
                let (traced_row, traced_end) = (rows.start, rows.end);
                (frame.uniform(&VisibilityGrid { first_row, end_row, traced_row, traced_end, ..plan.grid }), rows)
            })
            .collect();
        for (grid, rows) in &grids {
            let groups = [plan.grid.columns, rows.end - rows.start, 1];
            trace.dispatch(frame, &view.structures, &bindings.clone().part("visibility_grid", grid), groups);
        }
        count_rays(frame, 0);
        if let (Some(trace), Some(groups)) = (&self.kernels(scene).trace_edges, plan.edges.groups()) {
            for (grid, _) in &grids {
                frame.dispatch(trace, &bindings.clone().part("visibility_grid", grid), groups);
            }
        }
        count_rays(frame, 1);
        visibility
    }
}

/// True if the debug view shows rays.
fn counts_rays(settings: &Settings) -> bool {
    matches!(settings.image.debug_view, Some(DebugView::RayCount | DebugView::Visibility))
}

/// True if shadows read the surface target. Edges of multisampled images are found by it.
pub(crate) fn reads_surface(settings: &Settings) -> bool {
    settings.shadows.ray_culling != RayCulling::Depth || settings.image.samples != Samples::One
}

/// True if opaque surfaces receive light through panes: through deep images, and without normals, panes cast no shadow.
pub(crate) fn sees_panes(settings: &Settings, tracer: Tracer) -> bool {
    tracer.is_exact() && settings.shadows.ray_culling != RayCulling::Depth
}

/// An error if the words of one row of blocks exceed a u32, in which the device counts them.
fn check_row(columns: u32, words_a_pixel: u32) -> Result<(), RenderError> {
    let most = u64::from(columns) * u64::from(BLOCK_EDGE * BLOCK_EDGE) * u64::from(words_a_pixel);
    if most <= u64::from(u32::MAX) {
        return Ok(());
    }
    let remedy = "use fewer lights, or render a narrower image";
    Err(RenderError::Overflow { list: WORDS, needed: most, limit: u32::MAX.into(), remedy })
}

/// An error if the lights' radius is negative or not finite, the sun's diameter out of range, or if a light has no ray
/// or more rays than can be counted.
pub(crate) fn check(settings: &Settings) -> Result<(), RenderError> {
    if !(settings.lights.radius >= 0.0 && settings.lights.radius.is_finite()) {
        return Err(RenderError::Together { setting: "`light-radius`", needed: "a number of metres, 0 or more" });
    }
    if !(0.0..=90.0).contains(&settings.lights.sun_diameter) {
        return Err(RenderError::Together { setting: "`sun-diameter`", needed: "a number of degrees, 0 to 90" });
    }
    if !(1..1 << SOFT_LIGHT_BITS).contains(&settings.shadows.rays) {
        return Err(RenderError::Together {
            setting: "`shadow-rays`",
            needed: "1 to 255 rays; `accumulate` adds to them",
        });
    }
    Ok(())
}

/// An error for the driver that crashes on shadows through deep images: Mesa 22.3.6, when it compiles `trace`.
pub(crate) fn check_driver(tracer: Tracer, adapter: &wgpu::AdapterInfo) -> Result<(), RenderError> {
    if tracer.is_exact() || !faulty_software(adapter) {
        return Ok(());
    }
    let (driver, fault) = (adapter.driver_info.clone(), "crashes on it");
    Err(RenderError::Driver { setting: DEEP_SHADOWS, driver, fault, instead: "`shadows bvh`" })
}
