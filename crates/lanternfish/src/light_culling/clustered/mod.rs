//! Light lists for the visible clusters of a grid [VanGelderen2020, ch. 3, 4], for one view or several at once.
//!
//! 1. Grid: computed from the frusta of the views, one grid for each view or one for all ([`grid`]).
//! 2. Mark: counts the fragments of every cluster, from depth, and those of transparent surfaces as they are drawn.
//! 3. Compact: makes the list of visible clusters.
//! 4. Assign: counts the lights of every visible cluster, scans the counts, and writes the lights ([`tree`]).

pub(crate) mod contents;
pub mod grid;
mod settings;
#[cfg(test)]
mod tests;
pub mod tree;

pub use self::{
    contents::{GridContents, VisibleCluster},
    settings::{Assignment, Clustered, Grouping},
};
use glam::{Affine3A, Mat4, UVec3, Vec3};
use lanternfish_gpu::{
    BufferPart, ComputeKernel, Counted, Feature, Frame, SharedStruct, gpu_constants, gpu_struct, primitives::Scan,
};

use self::{
    grid::{GridError, GridGeometry, MOST_CLUSTERS},
    tree::TreeBuilder,
};
use super::{LightCullingPasses, LightLists, Reach};
use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::{SceneRaster, TEXTURES},
    lights::LightSet,
    prepass::{MULTISAMPLED, visible_fragments},
    settings::Samples,
    shaders::{Root, Shaders},
    view::frustum::ViewFrustum,
};

gpu_struct! {
    /// The grid of clusters as shaders read it.
    pub struct ClusterGrid {
        /// From view space.
        cluster_from_view: Mat4,
        /// From world space.
        cluster_from_world: Mat4,
        /// Least corner of the grid. x and y: slopes (through the eye) or coordinates, m (parallel); z: distance, m.
        low: Vec3,
        /// 1: sides are parallel.
        parallel: u32,
        /// Size of a cluster in the same terms; z: logarithm of the ratio of distances, or m.
        cell: Vec3,
        /// Capacity of the list, entries.
        capacity: u32,
        /// Clusters along x, y and z.
        dimensions: UVec3,
        /// Unused.
        _pad: u32,
    }
}

/// Selects this technique for `light_list`.
pub(crate) const CULLING_CLUSTERED: Feature =
    Feature::choosing("culling_clustered", "culling", "light_culling/clustered/cluster_grid", None);
/// The shader traverses a tree over the lights.
const HIERARCHY: Feature = Feature::new("hierarchy");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[
        Root::of("light_culling/clustered/mark", &[&[&[], &[MULTISAMPLED]]]),
        Root::of("light_culling/clustered/mark_drawn", &[&[&[], &[MULTISAMPLED]], TEXTURES]),
        Root::new("light_culling/clustered/compact"),
        Root::new("light_culling/clustered/build_tree"),
        Root::of("light_culling/clustered/assign", &[&[&[], &[HIERARCHY]]]),
    ],
    &[
        SharedStruct::of::<ClusterGrid>(),
        SharedStruct::of::<tree::LightTree>(),
        SharedStruct::of::<tree::LevelToJoin>(),
    ],
);

gpu_constants! {
    /// Workgroups along x of the passes over all clusters.
    const WIDTH: u32 = 1024;
    /// Bit of a cluster's fragment count: a pixel's centre lies in the cluster, without being counted.
    const MARKED: u32 = 1 << 31;
}

/// The passes.
#[derive(Debug)]
pub struct ClusteredCulling {
    pub(super) settings: Clustered,
    mark: ComputeKernel,
    mark_drawn: SceneRaster,
    compact: ComputeKernel,
    count: ComputeKernel,
    write: ComputeKernel,
    scan: Scan,
    tree: TreeBuilder,
    /// Lists of the last call, which also hold the clusters of transparent fragments.
    lists: Vec<LightLists>,
    /// Geometry of the grid of each group of views.
    geometries: Vec<GridGeometry>,
}

impl ClusteredCulling {
    /// Compiles the passes.
    pub fn new(device: &wgpu::Device, settings: Clustered, samples: Samples) -> Result<Self, RenderError> {
        let label = |entry: &str| format!("light_culling/clustered/{entry}");
        let multisampled: &[Feature] = if samples == Samples::One { &[] } else { &[MULTISAMPLED] };
        let mark = DECLARED.link("light_culling/clustered/mark", multisampled)?;
        let compact = DECLARED.link("light_culling/clustered/compact", &[])?;
        let hierarchy: &[Feature] = if settings.assignment == Assignment::Hierarchy { &[HIERARCHY] } else { &[] };
        let assign = DECLARED.link("light_culling/clustered/assign", hierarchy)?;
        Ok(Self {
            settings,
            mark: ComputeKernel::new(device, &mark, "mark", &label("mark")),
            mark_drawn: SceneRaster::new(
                "light_culling/clustered/mark_drawn",
                DECLARED,
                "light_culling/clustered/mark_drawn",
                multisampled,
                false,
                visible_fragments(samples.count()),
            ),
            compact: ComputeKernel::new(device, &compact, "compact", &label("compact")),
            count: ComputeKernel::new(device, &assign, "count", &label("count")),
            write: ComputeKernel::new(device, &assign, "write", &label("write")),
            scan: Scan::new(device, "light_culling/clustered")?,
            tree: TreeBuilder::new(device, settings.assignment)?,
            lists: Vec::new(),
            geometries: Vec::new(),
        })
    }
}

impl LightCullingPasses for ClusteredCulling {
    /// Views that share a grid share its lists.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        reach: Reach,
        set: &LightSet,
    ) -> Result<Vec<LightLists>, RenderError> {
        if reach == Reach::Anywhere {
            // The clusters of transparent fragments are already in the lists of the surfaces.
            return Ok(self.lists.clone());
        }
        let groups: Vec<&[ViewContext<'_>]> = match self.settings.grouping {
            Grouping::Individual => views.chunks(1).collect(),
            Grouping::Enclosed => vec![views],
        };
        let (mut lists, mut geometries) = (Vec::new(), Vec::new());
        for group in groups {
            let (geometry, of_group) = self.record_group(frame, group, set)?;
            lists.extend(of_group);
            geometries.push(geometry);
        }
        self.geometries = geometries;
        self.lists.clone_from(&lists);
        Ok(lists)
    }

    fn forget(&mut self) {
        self.lists.clear();
        self.geometries.clear();
    }
}

impl ClusteredCulling {
    fn record_group(
        &mut self,
        frame: &mut Frame<'_>,
        views: &[ViewContext<'_>],
        set: &LightSet,
    ) -> Result<(GridGeometry, Vec<LightLists>), RenderError> {
        let limit = super::most_indices(frame.device);
        let scene = views[0].scene;
        let least = self.settings.depth as f32;
        let frustum = |view: &ViewContext<'_>| {
            let frustum = view.view.frustum(&scene.bounds);
            ViewFrustum { far: frustum.far.max(least), ..frustum }
        };
        let frusta: Vec<ViewFrustum> = views.iter().map(frustum).collect();
        let (geometry, larger) = GridGeometry::fitting(&frusta, self.settings.shape).map_err(refused)?;
        if let Some(pixels) = larger {
            tracing::info!(pixels, "clusters are larger than requested: there would be too many");
        }
        let clusters = geometry.cluster_count() as u32;
        let grids: Vec<ClusterGrid> = frusta.iter().map(|f| self.grid(&geometry, &f.world_from_view)).collect();
        let uploaded: Vec<BufferPart> = grids.iter().map(|grid| frame.uniform(grid)).collect();

        // Mark the clusters with visible fragments.
        let fragments = frame.zeroed("light_culling/fragments", 4 * u64::from(clusters))?;
        for (view, grid) in views.iter().zip(&uploaded) {
            self.mark(frame, view, grid, &fragments)?;
        }
        let visible = frame.zeroed("light_culling/visible", 4 * (u64::from(clusters) + 1))?;
        let workgroups = frame.zeroed("light_culling/workgroups", 16)?;
        let grid = &uploaded[0];
        let all = [WIDTH.min(clusters.div_ceil(64)), clusters.div_ceil(64 * WIDTH), 1];
        let bindings = lanternfish_gpu::Bindings::new()
            .part("cluster_grid", grid)
            .buffer("cluster_fragments", &fragments)
            .buffer("visible_clusters", &visible)
            .buffer("visible_dispatch", &workgroups);
        frame.dispatch(&self.compact, &bindings, all);

        // Assign lights: count, scan, write. A list that is too small grows before it is written.
        let lights = self.tree.record(frame, set, grid)?;
        let cells = frame.zeroed("light_culling/cells", 4 * (u64::from(clusters) + 1))?;
        let tests = frame.zeroed("light_culling/tests", 8)?;
        let set_bindings = set.bindings();
        let shared = set_bindings
            .with(&lights.bindings())
            .buffer("visible_clusters", &visible)
            .buffer("cell_starts", &cells)
            .buffer("light_tests", &tests);
        let no_list = frame.scratch("light_culling/no_list", 4)?;
        let bindings = shared.clone().part("cluster_grid", grid).buffer("listed_lights", &no_list);
        frame.dispatch_indirect(&self.count, &bindings, &workgroups, 0);
        let total = self.scan.record(frame, &cells, clusters + 1)?;
        // Results for the host, in one read: total, visible clusters, tests in two words.
        let host_words = frame.scratch("light_culling/known", 16)?;
        frame.encoder().copy_buffer_to_buffer(&total, 0, &host_words, 0, 4);
        frame.encoder().copy_buffer_to_buffer(&visible, 0, &host_words, 4, 4);
        frame.encoder().copy_buffer_to_buffer(&tests, 0, &host_words, 8, 8);
        let capacity = frame.capacity_for(&Counted {
            list: set.list,
            words: &host_words,
            starts: (&cells, clusters as usize + 1),
            // Unless all visible clusters could list all lights.
            may_wrap: &|words| words[1].checked_mul(set.capacity).is_none(),
            guess: 0,
            limit,
        })?;
        let remedy =
            "give the lights a shorter range (`range-threshold`), or choose larger clusters (`clusters persp:64`)";
        super::check_capacity(&capacity, limit, set, remedy)?;
        let [_, visible_count, tests @ ..] = capacity.words;
        let indices = frame.scratch("light_culling/indices", 4 * capacity.capacity)?;
        let uploaded =
            grids.iter().map(|grid| frame.uniform(&ClusterGrid { capacity: capacity.capacity as u32, ..*grid }));
        let uploaded: Vec<BufferPart> = uploaded.collect();
        let bindings = shared.part("cluster_grid", &uploaded[0]).buffer("listed_lights", &indices);
        frame.dispatch_indirect(&self.write, &bindings, &workgroups, 0);

        let counts = vec![
            ("light_culling/clusters", clusters.into()),
            ("light_culling/visible_clusters", visible_count.into()),
            ("light_culling/cluster_bytes", 12 * u64::from(clusters) + 4 * capacity.capacity + lights.bytes),
        ];
        let tests = u64::from(tests[0]) | u64::from(tests[1]) << 32;
        let lists = |(i, grid): (usize, BufferPart)| LightLists {
            cells: cells.clone(),
            indices: indices.clone(),
            grid: Some(("cluster_grid", grid)),
            // Views that share lists count their entries once.
            listed: if i == 0 { capacity.elements } else { 0 },
            tests: if i == 0 { tests } else { 0 },
            counters: if i == 0 { counts.clone() } else { Vec::new() },
            fragments: Some(fragments.clone()),
        };
        Ok((geometry, uploaded.into_iter().enumerate().map(lists).collect()))
    }

    fn grid(&self, geometry: &GridGeometry, world_from_view: &Affine3A) -> ClusterGrid {
        let cluster_from_world = geometry.world_from_cluster.inverse();
        let same = geometry.world_from_cluster == *world_from_view;
        // In double precision: far from the origin the two transforms nearly cancel.
        let composed = || geometry.world_from_cluster.as_daffine3().inverse() * world_from_view.as_daffine3();
        let cluster_from_view = if same { Affine3A::IDENTITY } else { composed().as_affine3a() };
        ClusterGrid {
            cluster_from_view: Mat4::from(cluster_from_view),
            cluster_from_world: Mat4::from(cluster_from_world),
            low: geometry.low,
            parallel: u32::from(geometry.parallel),
            cell: geometry.cell,
            capacity: 0,
            dimensions: geometry.dimensions,
            _pad: 0,
        }
    }

    /// Marks the clusters of a view's fragments: those at the pixel centres, by depth. Fragments without such a depth
    /// are marked as they are drawn: transparent ones, and all fragments of multisampled images, which are counted
    /// there alone.
    fn mark(
        &mut self,
        frame: &mut Frame<'_>,
        ViewContext { scene, buffer, draws, surface, middle, .. }: &ViewContext<'_>,
        grid: &BufferPart,
        fragments: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        let view_bindings = buffer.bindings();
        let bindings = view_bindings.part("cluster_grid", grid).buffer("cluster_fragments", fragments);
        let size = surface.size;
        let mut drawn = draws.transparent.clone();
        if middle.samples == 1 {
            let surface_bindings = middle.bindings();
            let from_depth = bindings.clone().with(&surface_bindings);
            frame.dispatch(&self.mark, &from_depth, [size.x.div_ceil(8), size.y.div_ceil(8), 1]);
        }
        if surface.samples > 1 {
            // A multisampled fragment is shaded at a depth that no sample holds: only drawing it again gives it.
            drawn.splice(0..0, draws.solid.iter().copied());
        }
        if !drawn.is_empty() {
            self.mark_drawn.prepare(frame.device, scene, &drawn)?;
            let scene_bindings = scene.bindings();
            let bindings = bindings.with(&scene_bindings).texture("drawn_depth", &surface.depth);
            let depth = surface.read_depth();
            frame.render("light_culling/clustered/mark_drawn", &[], Some(depth), |groups, pass| {
                self.mark_drawn.draw(groups, pass, scene, &bindings, &drawn);
            });
        }
        Ok(())
    }
}

fn refused(error: GridError) -> RenderError {
    match error {
        GridError::Unaligned => RenderError::Unaligned,
        GridError::TooMany { needed, .. } => {
            let remedy = "choose larger ones with `clusters`, or `culling tiled`";
            RenderError::Overflow { list: "clusters", needed, limit: MOST_CLUSTERS, remedy }
        }
    }
}
