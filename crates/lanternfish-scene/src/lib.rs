//! Scenes without a GPU: meshes, materials, lights, cameras; glTF import; procedural scenes.
//!
//! Space: right-handed, +y up; metres, radians, linear Rec. 709; candela for point and spot lights, lux for
//! directional ones, nits for disks, rectangles and emission. Everything in a [`Scene`] is in world space: the node hierarchy of a file is
//! resolved when it is read.

#![cfg_attr(
    not(feature = "unstable"),
    allow(dead_code, private_interfaces, unused_imports, reason = "the feature makes the rest public")
)]

/// Modules of one of two lists. The name is one in which rustfmt looks for modules.
macro_rules! cfg_if {
    (if #[cfg($condition:meta)] { $($then:item)* } else { $($otherwise:item)* }) => {
        $(#[cfg($condition)] $then)*
        $(#[cfg(not($condition))] $otherwise)*
    };
}

// The modules are public for the project's other crates alone.
cfg_if! {
    if #[cfg(feature = "unstable")] {
        pub mod bvh;
        pub mod light_tree;
        pub mod rig;
        pub mod shading;
    } else {
        mod bvh;
        mod light_tree;
        mod rig;
        mod shading;
    }
}

mod camera;
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

#[cfg_attr(feature = "unstable", visibility::make(pub))]
use camera::near_plane;
pub use camera::{Camera, Projection};
#[cfg_attr(feature = "unstable", visibility::make(pub))]
use emission::mean_emission;
pub use environment::Environment;
pub use error::SceneError;
pub use fault::SceneFault;
pub use framing::Viewpoint;
pub use import::{LoadOptions, load, load_with};
#[cfg_attr(feature = "unstable", visibility::make(pub))]
use lanternfish_limits::{memory, printable, printable_name};
pub use light::{Light, LightKind};
pub use material::{AlphaMode, Material, TextureRef};
pub use mesh::{Bounds, Mesh, Primitive};
pub use named_enum::{Named, Setting, nearest};
pub use scene::{Instance, Scene};
pub use shading::{Attenuation, Coefficients, Materials};
pub use stereo::{Eye, Eyes, StereoRig};
pub use texture::{Filter, Image, MipFilter, Sampler, Texture, Wrap};
#[cfg_attr(feature = "unstable", visibility::make(pub))]
use texture::{LINEAR_FROM_SRGB, linear_from_srgb};
