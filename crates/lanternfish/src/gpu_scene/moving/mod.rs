//! Moving instances and deformed meshes on the device: transforms the triangles and refits the BVH's boxes. The host uploads only
//! transforms, joints and weights.
//!
//! ```text
//! joints, weights ─▶ bend.wesl ─▶ vertices ─┐
//! transforms ───────────────────────────────┴▶ pose.wesl ─▶ bvh_triangles, hit_triangles, corners of the adapter's own structure ─▶ refit.wesl, a level a pass
//! ```
//!
//! `passes.rs` holds the passes; `instances.rs` moves instances, `bending.rs` holds the data of deformation, `animate.rs` applies an animation at a time, `rebuild.rs`
//! builds another BVH when this one has become costly.

mod animate;
pub(super) mod bending;
mod instances;
pub(super) mod passes;
pub mod rebuild;
pub(super) mod sent;
mod shaders;
#[cfg(test)]
pub(super) mod tests;

pub use sent::Sent;
pub(crate) use shaders::DECLARED;
