//! Scenes without a GPU: meshes, materials, lights, cameras; glTF import; procedural scenes.
//!
//! Space: right-handed, +y up; metres, radians, linear Rec. 709; candela for point and spot lights, lux for
//! directional ones, nits for disks, rectangles and emission. Everything in a [`Scene`] is in world space: the node hierarchy of a file is
//! resolved when it is read.

pub mod bvh;
mod camera;
mod emission;
mod environment;
mod error;
mod framing;
pub mod generate;
pub mod import;
mod interior;
mod light;
pub mod light_tree;
mod material;
mod mesh;
pub mod motion;
mod named_enum;
pub mod rig;
mod scene;
pub mod shading;
mod sight;
mod stereo;
mod texture;
mod validate;

#[doc(hidden)]
pub use serde as __serde;

pub use camera::{Camera, Projection, near_plane};
pub use emission::mean_emission;
pub use environment::Environment;
pub use error::SceneError;
pub use framing::Viewpoint;
pub use import::{LoadOptions, load, load_with};
pub use lanternfish_limits::{memory, printable, printable_name};
pub use light::{Light, LightKind};
pub use material::{AlphaMode, Material, TextureRef};
pub use mesh::{Bounds, Mesh, Primitive};
pub use named_enum::{Named, Setting, nearest};
pub use scene::{Instance, Scene};
pub use stereo::{Eye, Eyes, StereoRig};
pub use texture::{Filter, Image, LINEAR_FROM_SRGB, MipFilter, Sampler, Texture, Wrap, linear_from_srgb};
