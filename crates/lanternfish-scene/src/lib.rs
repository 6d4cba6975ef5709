//! Scenes without a GPU: meshes, materials, lights, cameras; glTF import; procedural scenes.
//!
//! Space: right-handed, +y up; metres, radians, linear Rec. 709; candela for point and spot lights, lux for
//! directional ones, nits for disks, rectangles and emission. Everything in a [`Scene`] is in world space: the node
//! hierarchy of a file is resolved when it is read.

// Public for the project's other crates alone: no part of the interface, without promises.
#[doc(hidden)]
pub mod bvh;
#[doc(hidden)]
pub mod light_tree;
#[doc(hidden)]
pub mod rig;
#[doc(hidden)]
pub mod shading;

mod camera;
mod controls;
mod emission;
mod environment;
mod error;
mod fault;
mod framing;
pub mod generate;
mod import;
mod interior;
mod light;
mod material;
mod mesh;
pub mod motion;
mod named_enum;
mod scene;
mod sight;
mod stereo;
mod texture;
mod validate;

#[doc(hidden)]
pub use serde as __serde;

#[doc(hidden)]
pub use camera::near_plane;
pub use camera::{Camera, Projection};
#[doc(hidden)]
pub use controls::{Controls, Recorder};
pub use controls::{Move, RecordKeeper, Recording, Way};
#[doc(hidden)]
pub use emission::mean_emission;
pub use environment::Environment;
pub use error::SceneError;
pub use fault::SceneFault;
pub use framing::Viewpoint;
#[doc(hidden)]
pub use import::hold_files;
pub use import::{LoadOptions, UpAxis, load, load_files, load_with};
#[doc(hidden)]
pub use lanternfish_limits::read_text;
#[doc(hidden)]
pub use lanternfish_limits::{memory, printable, printable_name};
pub use light::{Light, LightKind};
#[doc(hidden)]
pub use material::LayerTextures;
pub use material::{AlphaMode, Material, TextureRef};
pub use mesh::{Bounds, Mesh, Primitive};
#[doc(hidden)]
pub use named_enum::{AnySetting, Value};
pub use named_enum::{Named, Setting, nearest};
pub use scene::{Instance, Scene};
pub use shading::{Attenuation, Coefficients, Materials};
pub use stereo::{Eye, Eyes, StereoRig};
pub use texture::{Filter, Image, MipFilter, Sampler, Texture, Wrap};
#[doc(hidden)]
pub use texture::{LINEAR_FROM_SRGB, linear_from_srgb};
