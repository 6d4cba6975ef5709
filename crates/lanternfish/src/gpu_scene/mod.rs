//! A scene on the device.
//!
//! ```text
//! Scene ─┬─ upload/geometry.rs   vertex and index buffers, draw instances, draws
//!        ├─ upload/materials.rs  materials ── textures.rs  textures with mip levels, samplers
//!        ├─ upload/lights.rs     as lights/mod.rs packs them
//!        ├─ tracing.rs           world-space triangles and alpha masks ─┬─ bvh.rs   compressed wide BVH ── refit.rs
//!        │                                                              └─ tlas.rs  the adapter's own structure
//!        └─ environment          its image, and the light made of it (environment_light/)
//! ```
//!
//! `scene.rs` holds all of it, and `shaders.rs` the data that shaders read. `update.rs` applies changes of the caller's
//! scene on the device, and `update/previous.rs` keeps the geometry of the previous frame; `moving/` moves and deforms
//! on the device. `visible.rs` and `raster.rs` draw.

pub(crate) mod moving;
mod raster;
mod scene;
mod shaders;
#[cfg(test)]
mod tests;
mod tracing;
mod update;
mod upload;
mod visible;

pub use moving::Sent;
pub use raster::{Faces, LAYERED, MASKED, PANES, PassState, SceneRaster, TEXTURES};
pub use scene::GpuScene;
pub(crate) use shaders::DECLARED;
#[cfg(test)]
pub(crate) use shaders::TracedLevels;
pub use shaders::{BvhTriangle, DrawInstance, HitMaterial, HitTriangle, MaskHeader, MaskRecord, Material, TextureSlot};
pub(crate) use update::previous::GeometryAt;
pub use upload::{
    cost::MemoryPlan,
    geometry::{Draw, DrawAlpha, Facing, ImageBehind, Side},
    lobes::Lobes,
    parts::Parts,
    textures::automatic_anisotropy,
};
pub(crate) use upload::{
    cost::{self, is_of_copies},
    lobes::Shading,
    needs::SceneRequirements,
};
pub use visible::VisibleDraws;
