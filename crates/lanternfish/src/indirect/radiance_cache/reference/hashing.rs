//! The entry of a surface point.

use glam::{UVec4, Vec2, Vec3};

use crate::{common::random::random_words, indirect::radiance_cache::RadianceCacheParameters};

/// Levels of voxels: each has twice the edge of the one before.
const LEVELS: i32 = 16;
/// Offset of a point along the normal, edges.
const LIFT: f32 = 0.25;
/// Layers per edge, along the normal.
const LAYERS: f32 = 2.0;
/// Added to a float, it leaves the nearest integer in the lowest bits.
const WHOLE: f32 = 12_582_912.0;

/// Key and hash of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in super::super) struct Entry {
    /// Never 0.
    pub key: u32,
    /// Selects the first bucket.
    pub hash: u32,
}

/// Level of the voxels at a point: one more for each doubling of the distance from the eye, from `near` on.
pub(in super::super) fn level(p_world: Vec3, eye: Vec3, near: f32) -> i32 {
    let to_eye = (p_world - eye) * (1.0 / near);
    let square = to_eye.x * to_eye.x + to_eye.y * to_eye.y + to_eye.z * to_eye.z;
    let exponent = (square.to_bits() >> 23) as i32 - 127;
    (exponent.div_euclid(2) + 1).clamp(0, LEVELS - 1)
}

/// Facing direction: twice the axis nearest to the normal, the first one of equals; plus 1 if the normal points against it.
fn facing(normal: Vec3) -> u32 {
    let size = normal.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    2 * axis as u32 + u32::from(normal[axis] < 0.0)
}

/// Two unit tangents of a unit vector: `across` of `common/math.wesl`.
fn across(n: Vec3) -> [Vec3; 2] {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    [Vec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), Vec3::new(b, s + n.y * n.y * a, -n.y)]
}

/// The entry of a surface point with this unit normal, jittered along the surface by up to half an edge: by `u`, in 0..1.
pub(in super::super) fn entry_at(
    parameters: &RadianceCacheParameters,
    eye: Vec3,
    p_world: Vec3,
    normal: Vec3,
    u: Vec2,
) -> Entry {
    let level = level(p_world, eye, parameters.near);
    let jittered = jittered(parameters, level, p_world, normal, u);
    let voxel = (jittered + LIFT * normal).floor();
    let within = jittered - voxel - 0.5;
    let height = normal.x * within.x + normal.y * within.y + normal.z * within.z;
    let layer = (LAYERS * height + WHOLE).to_bits();
    let rest = facing(normal) | ((level as u32) << 3) | (layer << 7);
    let [x, y, z] = (voxel + WHOLE).to_array().map(f32::to_bits);
    let words = random_words(UVec4::new(x, y, z, rest));
    Entry { key: words.x.max(1), hash: words.y }
}

/// A point moved along the surface by up to half an edge: by `u`, in 0..1. In edges.
fn jittered(parameters: &RadianceCacheParameters, level: i32, p_world: Vec3, normal: Vec3, u: Vec2) -> Vec3 {
    let [right, up] = across(normal);
    let u = u - 0.5;
    p_world * ((1.0 / parameters.edge) * (-level as f32).exp2()) + (right * u.x + up * u.y)
}

/// The way from a point to the middle of the voxel of [`entry_at`], along the surface, m.
pub(in super::super) fn to_middle(
    parameters: &RadianceCacheParameters,
    eye: Vec3,
    p_world: Vec3,
    normal: Vec3,
    u: Vec2,
) -> Vec3 {
    let level = level(p_world, eye, parameters.near);
    let voxel = (jittered(parameters, level, p_world, normal, u) + LIFT * normal).floor();
    let edge = parameters.edge * (level as f32).exp2();
    let way = (voxel + 0.5) * edge - p_world;
    way - way.dot(normal) * normal
}

/// Voxel edges double at `near`, and at each doubling of that.
#[test]
fn levels_follow_the_distance() {
    for i in -40..400 {
        // No power of two, at whose border either level is right.
        let exponent = (i as f32 + 0.5) / 20.0;
        let expected = (exponent.floor() as i32 + 1).clamp(0, LEVELS - 1);
        assert_eq!(level(3.0 * exponent.exp2() * Vec3::Y, Vec3::ZERO, 3.0), expected, "{exponent}");
    }
}
