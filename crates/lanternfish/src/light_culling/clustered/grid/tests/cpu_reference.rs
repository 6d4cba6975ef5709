//! CPU reference of the shaders' arithmetic: a point lies in the volume of the cluster that the shader assigns it to.

use std::cell::Cell;

use glam::{DVec3, UVec3, Vec3};
use proptest::prelude::*;

use super::{
    super::{GridGeometry, ViewFrustum, extent},
    Rig, any_shape, check, rig,
};
use crate::shaders::constant;

/// The bounds of a cluster in cluster space, as `cluster_volume.wesl` computes them.
struct Volume {
    slopes: [f32; 4],
    nearest: f32,
    farthest: f32,
    parallel: bool,
}

impl Volume {
    fn contains(&self, p_cluster: DVec3) -> bool {
        let distance = -p_cluster.z;
        let scale = if self.parallel { 1.0 } else { distance };
        let [left, right, bottom, top] = self.slopes.map(|slope| f64::from(slope) * scale);
        (left..=right).contains(&p_cluster.x)
            && (bottom..=top).contains(&p_cluster.y)
            && (f64::from(self.nearest)..=f64::from(self.farthest)).contains(&distance)
    }
}

/// Error of WGSL's `log` and `exp`: 1 and −1 for the greatest error that the standard allows, 0 for this machine's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wrong(pub f32);

impl Wrong {
    fn log(self, x: f32) -> f32 {
        let right = x.ln();
        let error = if (0.5..=2.0).contains(&x) { 2f32.powi(-21) } else { 3.0 * (right.abs().next_up() - right.abs()) };
        right + self.0 * error
    }

    fn exp(self, x: f32) -> f32 {
        let right = x.exp();
        right + self.0 * (3.0 + 2.0 * x.abs()) * (right.next_up() - right)
    }
}

/// `cluster_grid.wesl` and `cluster_volume.wesl`, operation by operation.
impl GridGeometry {
    pub(super) fn grid_from_cluster(&self, p_cluster: Vec3, wrong: Wrong) -> Vec3 {
        let distance = -p_cluster.z;
        if self.parallel {
            return (p_cluster.truncate().extend(distance) - self.low) / self.cell;
        }
        let ahead = distance.max(1e-6);
        let slopes = (p_cluster.truncate() / ahead - self.low.truncate()) / self.cell.truncate();
        slopes.extend(wrong.log(ahead / self.low.z) / self.cell.z)
    }

    pub(super) fn cluster_from_grid(&self, p_grid: Vec3) -> UVec3 {
        p_grid.clamp(Vec3::ZERO, self.dimensions.as_vec3() - 1.0).as_uvec3()
    }

    fn cluster_index(&self, cluster: UVec3) -> u32 {
        (cluster.z * self.dimensions.y + cluster.y) * self.dimensions.x + cluster.x
    }

    fn cluster_from_index(&self, index: u32) -> UVec3 {
        let row = index / self.dimensions.x;
        UVec3::new(index % self.dimensions.x, row % self.dimensions.y, row / self.dimensions.y)
    }

    fn cluster_volume(&self, cluster: UVec3, padding: f32, wrong: Wrong) -> Volume {
        let low = self.low + self.cell * (cluster.as_vec3() - padding);
        let high = self.low + self.cell * (cluster.as_vec3() + 1.0 + padding);
        let distance = |layer: f32| self.low.z * wrong.exp(self.cell.z * layer);
        let layers = [cluster.z as f32 - padding, cluster.z as f32 + 1.0 + padding];
        let [mut nearest, mut farthest] = if self.parallel { [low.z, high.z] } else { layers.map(distance) };
        if cluster.z == 0 {
            nearest = if self.parallel { f32::NEG_INFINITY } else { 0.0 };
        }
        if cluster.z == self.dimensions.z - 1 {
            farthest = f32::INFINITY;
        }
        Volume { slopes: [low.x, high.x, low.y, high.y], nearest, farthest, parallel: self.parallel }
    }
}

/// A point of a view, world space: `across` and `along` from 0 to 1.
pub(super) fn point_of(view: &ViewFrustum, across: [f64; 2], along: f64) -> DVec3 {
    let low = DVec3::new(view.slopes[0].into(), view.slopes[2].into(), 0.0);
    let (near, far) = (f64::from(view.near), f64::from(view.far));
    let p = low + extent(view) * DVec3::new(across[0], across[1], 0.0);
    let distance = if view.parallel { near + (far - near) * along } else { near * (far / near).powf(along) };
    let scale = if view.parallel { 1.0 } else { distance };
    view.world_from_view.as_daffine3().transform_point3((p.truncate() * scale).extend(-distance))
}

/// Rigs that include telescopes and long thin boxes.
fn narrow_rig() -> impl Strategy<Value = Rig> {
    (rig(), -4.0f32..0.0).prop_map(|(rig, log_fraction)| {
        let fraction = if log_fraction > -2.0 { 1.0 } else { 10f32.powf(log_fraction + 2.0) };
        Rig { slopes: rig.slopes.map(|slope| slope * fraction), ..rig }
    })
}

#[test]
fn points_lie_in_the_volume_of_their_cluster() {
    let padding = constant("light_culling/clustered/cluster_volume", "PADDING") as f32;
    // Includes the edges; proptest's closed ranges of floats sometimes panic.
    let fraction = || (0..=4096).prop_map(|part| f64::from(part) / 4096.0);
    let points = prop::collection::vec((0..2usize, [fraction(), fraction()], fraction()), 64);
    let wrong = (-1..=1, -1..=1).prop_map(|(log, exp)| (Wrong(log as f32), Wrong(exp as f32)));
    let (tested, lost) = (Cell::new(0), Cell::new(0));
    let strategy = (narrow_rig(), any_shape(), points, any::<bool>(), 1..=2usize, wrong);
    check(strategy, |(rig, shape, points, parallel, count, (log, exp))| {
        let views = rig.eyes().map(|eye| ViewFrustum { parallel, ..eye });
        let Ok(grid) = GridGeometry::new(&views[..count], shape) else { return Ok(()) };
        for (eye, across, along) in points {
            let eye = &views[eye.min(count - 1)];
            let world_from_view = eye.world_from_view.as_daffine3();
            let p_view = world_from_view.inverse().transform_point3(point_of(eye, across, along)).as_vec3();
            // Inputs that the host uploads, and the shader's results from them.
            let cluster_from_view = grid.world_from_cluster.as_daffine3().inverse() * world_from_view;
            let p_cluster = cluster_from_view.as_affine3a().transform_point3(p_view);
            let cluster = grid.cluster_from_grid(grid.grid_from_cluster(p_cluster, log));
            let index = grid.cluster_index(cluster);
            prop_assert!(u64::from(index) < grid.cluster_count());
            prop_assert_eq!(grid.cluster_from_index(index), cluster);
            let exact = cluster_from_view.transform_point3(p_view.as_dvec3());
            let volume = grid.cluster_volume(cluster, padding, exp);
            prop_assert!(volume.contains(exact), "{exact} is not in {cluster} of {grid:?}");
            tested.set(tested.get() + 1);
            lost.set(lost.get() + u32::from(!grid.cluster_volume(cluster, -0.02, exp).contains(exact)));
        }
        Ok(())
    });
    assert!(tested.get() > 15_000, "only {} points", tested.get());
    // A shell of 2 % at each of six sides holds about one point in ten.
    assert!(lost.get() > tested.get() / 20, "insensitive to clusters that are 2 % too small: {} lost", lost.get());
}
