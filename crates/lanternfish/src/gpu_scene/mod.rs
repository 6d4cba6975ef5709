//! A scene on the device.
//!
//! ```text
//! Scene ─┬─ geometry.rs   vertex and index buffers, draw instances, draws
//!        ├─ materials.rs  materials ── textures.rs  textures with mip levels, samplers
//!        ├─ tracing.rs    world-space triangles and alpha masks ─┬─ bvh.rs   compressed wide BVH ── refit.rs
//!        │                                                       └─ tlas.rs  the adapter's own structure
//!        ├─ environment   the image of the environment, and the light made of it (environment_light/)
//!        └─ lights.rs     as lights/mod.rs packs them
//! ```
//!
//! `scene.rs` holds all of it. `update.rs` applies changes of the caller's scene on the device; `previous.rs` keeps the
//! geometry of the previous frame.

mod bvh;
mod cost;
mod emissive;
mod geometry;
mod hits;
mod lights;
mod lobes;
mod materials;
mod mips;
pub(crate) mod moving;
mod needs;
mod parts;
mod previous;
mod raster;
mod refit;
mod scene;
#[cfg(test)]
mod tests;
mod textures;
mod tlas;
mod tracing;
mod update;
mod visible;

pub use bvh::BvhTriangle;
pub use geometry::{Draw, DrawAlpha, DrawInstance, Facing, ImageBehind, Side};
pub use hits::{HitMaterial, HitTriangle};
pub use lobes::Lobes;
pub(crate) use lobes::Shading;
pub use materials::{Material, TextureSlot};
pub use moving::Sent;
pub(crate) use needs::SceneRequirements;
pub use parts::Parts;
pub(crate) use previous::GeometryAt;
pub use raster::{Faces, LAYERED, MASKED, PassState, SceneRaster, TEXTURES};
pub use scene::GpuScene;
pub use textures::automatic_anisotropy;
pub use tracing::{MaskHeader, MaskRecord};
pub use visible::VisibleDraws;

use lanternfish_gpu::SharedStruct;

use crate::shaders::Shaders;

/// The shaders of this folder: files of functions, and what they read.
pub(crate) const DECLARED: Shaders = Shaders::new(
    &[],
    &[
        SharedStruct::of::<lights::SoftShadows>(),
        SharedStruct::of::<DrawInstance>(),
        SharedStruct::of::<Material>(),
        SharedStruct::of::<TextureSlot>(),
        SharedStruct::of::<BvhTriangle>(),
        SharedStruct::of::<HitTriangle>(),
        SharedStruct::of::<HitMaterial>(),
        SharedStruct::of::<MaskRecord>(),
        SharedStruct::of::<MaskHeader>(),
    ],
);
