//! A compressed wide BVH, walked in compute: exact.

use lanternfish_gpu::Feature;

use super::{Room, Structure};

pub(super) const ROOM: Room = Room {
    name: "bvh",
    words: "The bounding volume hierarchy in compute: exact, on any adapter",
    feature: Feature("tracer_bvh"),
    structure: Structure::Bvh,
};
