//! The cluster at a position, and its contents.

use glam::{UVec3, Vec3};
use lanternfish::light_culling::clustered::{GridContents, grid::GridGeometry};

/// The cluster of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClusterAt {
    /// Its column, row (from the lowest) and layer (from the nearest).
    pub place: UVec3,
    /// Lights of its list; none where no pixel showed anything in it.
    pub lights: Option<u32>,
    /// Pixels, or samples of them, that show something in it.
    pub fragments: u32,
}

/// The cluster that a place of the world, m, is in; none where it is in no grid. Where each eye has a grid, it is that of the eye.
pub fn at(grids: &[GridContents], eye: usize, p_world: Vec3) -> Option<ClusterAt> {
    let grids = grids.get(eye..).filter(|grids| !grids.is_empty()).unwrap_or(grids);
    let (grid, place) = grids.iter().find_map(|grid| Some((grid, place_in(&grid.geometry, p_world)?)))?;
    let UVec3 { x, y, .. } = grid.geometry.dimensions;
    let index = place.x + x * (place.y + y * place.z);
    let found = grid.visible.binary_search_by_key(&index, |cluster| cluster.index);
    let found = found.ok().map(|i| grid.visible[i]);
    Some(ClusterAt {
        place,
        lights: found.map(|cluster| cluster.lights),
        fragments: found.map_or(0, |cluster| cluster.fragments),
    })
}

/// Column, row and layer of a place, as `cluster_grid.wesl` finds them.
fn place_in(grid: &GridGeometry, p_world: Vec3) -> Option<UVec3> {
    let p = grid.world_from_cluster.inverse().transform_point3(p_world);
    let (distance, low) = (-p.z, grid.low);
    let (across, along) = match grid.parallel {
        true => (p.truncate(), distance - low.z),
        false => (p.truncate() / distance, (distance / low.z).ln()),
    };
    let place = ((across - low.truncate()).extend(along) / grid.cell).floor();
    let is_inside = place.cmpge(Vec3::ZERO).all() && place.cmplt(grid.dimensions.as_vec3()).all();
    is_inside.then(|| place.as_uvec3())
}

#[cfg(test)]
mod tests {
    use lanternfish::light_culling::clustered::VisibleCluster;

    use super::*;

    #[test]
    fn the_middle_of_a_cluster_is_in_it() {
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
                let found = at(&grids, 0, middle).unwrap();
                assert_eq!(found.place, UVec3::new(index % 8, index / 8 % 4, index / 32), "{found:?}");
                assert_eq!(found.lights, (index == 77).then_some(9));
                assert_eq!(at(&grids, 1, middle), Some(found), "both eyes share a grid");
            }
            assert_eq!(at(&grids, 0, Vec3::Z), None, "behind");
        }
        assert_eq!(at(&[], 1, Vec3::ZERO), None);
    }
}
