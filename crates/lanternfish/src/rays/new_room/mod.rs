//! Every triangle of the scene, one after the other: what a tracer has, and no more.

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin;

use lanternfish_gpu::Feature;

use super::{Room, Structure};

pub(super) const ROOM: Room = Room {
    name: "new-room",
    words: "Every triangle of the scene, one after the other: exact, for a few hundred triangles",
    feature: Feature("tracer_new_room"),
    structure: Structure::Bvh,
};
