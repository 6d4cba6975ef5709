//! Helpers of the tests: rigs of cameras, and the distance of a point from a frustum.

mod clusters;
mod cpu_reference;
mod enclosing;

use glam::{Affine3A, DVec3, EulerRot, Quat, UVec2, Vec3, vec3};
use proptest::{
    prelude::*,
    test_runner::{RngAlgorithm, TestCaseResult, TestRng, TestRunner},
};

use super::{ClusterShape, GridGeometry, ViewFrustum};

/// Error of a corner on a side in double precision, in widths of the frustum.
const EXACT: f64 = 1e-9;
/// Error due to rounding a grid's `low` and `cell` to f32, in widths of the grid.
const ROUNDED: f64 = 1e-6;

/// Half-angle tangents of the HTC Vive's left eye; the right one's are mirrored.
const VIVE: [f32; 4] = [-1.39, 1.25, -1.47, 1.46];

/// A head-mounted display.
#[derive(Clone, Copy, Debug)]
struct Rig {
    head: Affine3A,
    /// Distance between the eyes, m.
    ipd: f32,
    /// Height of the right eye above the left one, m.
    disparity: f32,
    /// Outward rotation of the displays, radians.
    cant: f32,
    /// Slopes of the left eye's frustum.
    slopes: [f32; 4],
    near: f32,
    far: f32,
}

impl Rig {
    fn eyes(&self) -> [ViewFrustum; 2] {
        let [l, r, b, t] = self.slopes;
        [(-0.5, [l, r, b, t]), (0.5, [-r, -l, b, t])].map(|(side, slopes)| {
            let rotation = Quat::from_rotation_y(-2.0 * side * self.cant);
            let eye = Affine3A::from_rotation_translation(rotation, vec3(self.ipd, self.disparity, 0.0) * side);
            let size = UVec2::new(1080, 1200);
            let Self { head, near, far, .. } = *self;
            ViewFrustum { world_from_view: head * eye, slopes, near, far, parallel: false, size }
        })
    }
}

fn view(slopes: [f32; 4], near: f32, far: f32) -> ViewFrustum {
    let world_from_view = Affine3A::IDENTITY;
    ViewFrustum { world_from_view, slopes, near, far, parallel: false, size: UVec2::new(1080, 1200) }
}

fn vive() -> Rig {
    let head = Affine3A::IDENTITY;
    Rig { head, ipd: 0.063, disparity: 0.0, cant: 0.0, slopes: VIVE, near: 0.1, far: 100.0 }
}

fn pose() -> impl Strategy<Value = Affine3A> {
    (prop::array::uniform3(-50.0f32..50.0), prop::array::uniform3(-3.2f32..3.2)).prop_map(|(p, [y, x, z])| {
        Affine3A::from_rotation_translation(Quat::from_euler(EulerRot::YXZ, y, x, z), Vec3::from(p))
    })
}

fn slopes() -> impl Strategy<Value = [f32; 4]> {
    prop::array::uniform4(0.3f32..2.0).prop_map(|[l, r, b, t]| [-l, r, -b, t])
}

/// Rigs as the thesis assumes them: two translated views of the same orientation.
fn straight_rig() -> impl Strategy<Value = Rig> {
    (pose(), 0.03f32..0.08, slopes(), 0.05f32..1.0, 1.0f32..4.0).prop_map(|(head, ipd, slopes, near, log_ratio)| Rig {
        head,
        ipd,
        disparity: 0.0,
        cant: 0.0,
        slopes,
        near,
        far: near * 10f32.powf(log_ratio),
    })
}

/// General rigs: canted displays, unequal heights, far planes nearer than far.
fn rig() -> impl Strategy<Value = Rig> {
    let canted = (straight_rig(), -0.26f32..0.26, -0.005f32..0.005, 0.05f32..5.0);
    canted.prop_map(|(rig, cant, disparity, log_ratio)| Rig {
        cant,
        disparity,
        far: rig.near * 10f32.powf(log_ratio),
        ..rig
    })
}

fn any_shape() -> impl Strategy<Value = ClusterShape> {
    prop_oneof![
        (24u32..200).prop_map(|pixels| ClusterShape::Perspective { pixels }),
        (0.5f32..20.0).prop_map(|side| ClusterShape::Orthographic { side }),
        (24u32..200, 0.0f32..2000.0).prop_map(|(pixels, distance)| ClusterShape::Displaced { pixels, distance }),
    ]
}

fn check<S: Strategy>(strategy: S, test: impl Fn(S::Value) -> TestCaseResult) {
    let config = ProptestConfig { cases: 512, failure_persistence: None, ..Default::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    if let Err(error) = runner.run(&strategy, test) {
        panic!("{error}");
    }
}

/// Greatest distance of these points outside the frustum, in widths of the frustum; negative if all are inside.
fn outside(frustum: &ViewFrustum, p_worlds: &[DVec3]) -> f64 {
    let [left, right, bottom, top] = frustum.slopes.map(f64::from);
    let low = DVec3::new(left, bottom, frustum.near.into());
    let high = DVec3::new(right, top, frustum.far.into());
    let view_from_world = frustum.world_from_view.as_daffine3().inverse();
    let excess = |p_world: &DVec3| {
        let p = view_from_world.transform_point3(*p_world);
        let scale = if frustum.parallel { 1.0 } else { -p.z };
        let p = DVec3::new(p.x / scale, p.y / scale, -p.z);
        let beyond = (low - p).max(p - high) / (high - low);
        if scale > 0.0 { beyond.max_element() } else { f64::INFINITY }
    };
    p_worlds.iter().map(excess).fold(f64::NEG_INFINITY, f64::max)
}

/// The volume that a grid divides, as a frustum.
fn grid_frustum(grid: &GridGeometry) -> ViewFrustum {
    let high = grid.low.as_dvec3() + grid.cell.as_dvec3() * grid.dimensions.as_dvec3();
    let layers = f64::from(grid.cell.z) * f64::from(grid.dimensions.z);
    let far = if grid.parallel { high.z } else { f64::from(grid.low.z) * layers.exp() };
    ViewFrustum {
        world_from_view: grid.world_from_cluster,
        slopes: [grid.low.x, high.x as f32, grid.low.y, high.y as f32],
        near: grid.low.z,
        far: far as f32,
        parallel: grid.parallel,
        size: UVec2::ONE,
    }
}

/// Volume of a frustum, m³ [VanGelderen2020, eq. 4.2].
fn volume(frustum: &ViewFrustum) -> f64 {
    let [l, r, b, t] = frustum.slopes.map(f64::from);
    let (near, far) = (f64::from(frustum.near), f64::from(frustum.far));
    let depth = if frustum.parallel { far - near } else { (far.powi(3) - near.powi(3)) / 3.0 };
    (r - l) * (t - b) * depth
}

/// The frustum with one side moved inwards by 1 % of its width: left, right, bottom, top, near, far.
fn narrowed(frustum: &ViewFrustum, side: usize) -> ViewFrustum {
    let mut narrowed = *frustum;
    let [left, right, bottom, top] = frustum.slopes;
    match side {
        0 | 1 => narrowed.slopes[side] += [0.01, -0.01][side] * (right - left),
        2 | 3 => narrowed.slopes[side] += [0.01, -0.01][side - 2] * (top - bottom),
        4 => narrowed.near *= 1.01,
        _ => narrowed.far *= 0.99,
    }
    narrowed
}
