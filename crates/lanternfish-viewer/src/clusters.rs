//! The cluster that contains a point, and its contents.

use glam::{UVec3, Vec3};
use lanternfish::light_culling::clustered::{GridContents, grid::GridGeometry};

/// A cluster and its contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClusterAt {
    /// Column, row (from the bottom) and layer (from the nearest).
    pub coords: UVec3,
    /// Number of lights in its list; `None` if no visible surface lies in it.
    pub lights: Option<u32>,
    /// Number of visible samples in it: one per pixel, or per sample of multisampling.
    pub fragments: u32,
}

/// The cluster that contains a world-space point, m; `None` outside all grids. If each eye has a grid, the eye's grid is used.
pub fn at(grids: &[GridContents], eye: usize, p_world: Vec3) -> Option<ClusterAt> {
    let grids = grids.get(eye..).filter(|grids| !grids.is_empty()).unwrap_or(grids);
    let (grid, coords) = grids.iter().find_map(|grid| Some((grid, coords_in(&grid.geometry, p_world)?)))?;
    let UVec3 { x, y, .. } = grid.geometry.dimensions;
    let index = coords.x + x * (coords.y + y * coords.z);
    let position = grid.visible.binary_search_by_key(&index, |cluster| cluster.index);
    let visible = position.ok().map(|i| grid.visible[i]);
    Some(ClusterAt {
        coords,
        lights: visible.map(|cluster| cluster.lights),
        fragments: visible.map_or(0, |cluster| cluster.fragments),
    })
}

/// Column, row and layer of a world-space point, as in `cluster_grid.wesl`.
fn coords_in(grid: &GridGeometry, p_world: Vec3) -> Option<UVec3> {
    let p = grid.world_from_cluster.inverse().transform_point3(p_world);
    let (distance, low) = (-p.z, grid.low);
    let (across, along) = match grid.parallel {
        true => (p.truncate(), distance - low.z),
        false => (p.truncate() / distance, (distance / low.z).ln()),
    };
    let coords = ((across - low.truncate()).extend(along) / grid.cell).floor();
    let is_inside = coords.cmpge(Vec3::ZERO).all() && coords.cmplt(grid.dimensions.as_vec3()).all();
    is_inside.then(|| coords.as_uvec3())
}

#[cfg(test)]
mod tests {
    use lanternfish::light_culling::clustered::VisibleCluster;

    use super::*;

    #[test]
    fn a_cluster_contains_its_centre() {
        for parallel in [false, true] {
            let geometry = GridGeometry {
                low: Vec3::new(-1.0, -0.5, 0.1),
                cell: Vec3::new(0.25, 0.25, 0.5),
                dimensions: UVec3::new(8, 4, 10),
                parallel,
                ..GridGeometry::default()
            };
            let visible = vec![VisibleCluster { index: 77, fragments: 5, lights: 9 }];
            let grids = [GridContents { geometry, clusters: 320, visible }];
            for index in [0, 77, 319] {
                let middle = geometry.corners(index).iter().sum::<Vec3>() / 8.0;
                let actual = at(&grids, 0, middle).unwrap();
                assert_eq!(actual.coords, UVec3::new(index % 8, index / 8 % 4, index / 32), "{actual:?}");
                assert_eq!(actual.lights, (index == 77).then_some(9));
                assert_eq!(at(&grids, 1, middle), Some(actual), "both eyes share a grid");
            }
            assert_eq!(at(&grids, 0, Vec3::Z), None, "behind");
        }
        assert_eq!(at(&[], 1, Vec3::ZERO), None);
    }
}
