//! Contents of a frame's clusters, read back for measurements [VanGelderen2020, §6.1.1].

use lanternfish_gpu::read_back;

use super::{ClusteredCulling, Grids, MARKED, grid::GridGeometry};
use crate::error::RenderError;

/// A cluster grid of the last frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridContents {
    /// Geometry of the grid.
    pub geometry: GridGeometry,
    /// Number of clusters of the grid, including those that no view shows.
    pub clusters: u32,
    /// Clusters with visible fragments, in the order of their indices.
    pub visible: Vec<VisibleCluster>,
}

/// A cluster with visible fragments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VisibleCluster {
    /// Index in the grid: x fastest, then y, then z.
    pub index: u32,
    /// Visible fragments that the grid's views shade in it; 0 if only rays of multisampled images start in it.
    pub fragments: u32,
    /// Number of lights in its list.
    pub lights: u32,
}

impl GridContents {
    /// Number of visible fragments of all clusters.
    pub fn fragments(&self) -> u64 {
        self.visible.iter().map(|cluster| u64::from(cluster.fragments)).sum()
    }

    /// Number of light evaluations: each fragment evaluates every light of its cluster's list.
    pub fn lighting_operations(&self) -> u64 {
        self.visible.iter().map(|cluster| u64::from(cluster.fragments) * u64::from(cluster.lights)).sum()
    }
}

/// The grids of the last frame, in the order of their first views.
pub(crate) fn contents_of_grids(
    passes: &ClusteredCulling,
    device: &wgpu::Device,
    queue: &wgpu::Queue,
) -> Result<Vec<GridContents>, RenderError> {
    let mut grids = Vec::new();
    // Views that share a grid: its counters belong to the first view.
    let Grids { geometries, lists } = passes.grids.last();
    let first = lists.iter().filter(|lists| !lists.counters.is_empty());
    for (lists, geometry) in first.zip(geometries.iter().copied()) {
        let Some(fragments) = &lists.fragments else { continue };
        let count = geometry.cluster_count() as usize;
        let starts = read_back::<u32>(device, queue, &lists.cells, count + 1)?;
        let fragments = read_back::<u32>(device, queue, fragments, count)?;
        let cluster = |(index, fragments): (usize, u32)| VisibleCluster {
            index: index as u32,
            fragments: fragments & !MARKED,
            lights: starts[index + 1].wrapping_sub(starts[index]),
        };
        let visible = fragments.into_iter().enumerate().filter(|(_, fragments)| *fragments > 0);
        grids.push(GridContents { geometry, clusters: count as u32, visible: visible.map(cluster).collect() });
    }
    Ok(grids)
}
