//! Techniques of the papers for [`lanternfish`] that none of its default settings runs: the scene as deep images, and what is found through
//! them; light from virtual lights and from photons; a raster grid of lights; occlusion in screen space.
//!
//! A program calls [`register`] once, before it reads names or makes a renderer. Flags, shots, panels and reports know the techniques then.
//!
//! ```
//! use lanternfish::Settings;
//! use lanternfish_papers::{DeepImageSettings, VirtualLights};
//!
//! lanternfish_papers::register();
//! let settings = Settings {
//!     indirect: VirtualLights::default().into(),
//!     structure: DeepImageSettings { resolution: 64, ..DeepImageSettings::default() }.into(),
//!     ..Settings::default()
//! };
//! # let _ = settings;
//! ```
//!
//! | Paper | Here |
//! |---|---|
//! | Nießner 2010 | [`deep_images`], [`ACROSS_TEXELS`] |
//! | Aalund 2015 | [`deep_images`], [`occlusion::deep`], [`indirect::photon_splatting`] |
//! | Archer 2019 | the single pass of [`deep_images`], [`WITHIN_TEXEL`], [`indirect::virtual_lights`], [`light_culling::raster_grid`] |
//!
//! [`occlusion::hbao`] is there for comparison (Bavoil 2008). A technique lies in a folder below its kind, as in the library.

pub mod deep_images;
pub mod indirect;
pub mod light_culling;
pub mod occlusion;
pub mod rays;
pub mod shaders;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

use std::sync::Once;

use lanternfish::{
    settings::{Culling, Indirect, Occlusion},
    shaders::Shaders,
};

pub use self::{
    deep_images::{
        ACROSS_TEXELS, WITHIN_TEXEL,
        directions::DirectionSet,
        settings::{DeepBuilder, DeepDepth, DeepImageSettings, DeepSearch, DeepStore},
    },
    indirect::{photon_splatting::PhotonSplatting, virtual_lights::VirtualLights},
    light_culling::raster_grid::RasterGrid,
    occlusion::{deep::Deep, hbao::Hbao},
};

/// The shaders of the folders that are no technique of a kind.
pub const FOLDERS: &[Shaders] = &[deep_images::DECLARED, indirect::light_views::DECLARED];

/// Makes every technique of this crate known by name. Programs call it before they read names and before they make a renderer; more than
/// once does nothing.
pub fn register() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        WITHIN_TEXEL.register();
        ACROSS_TEXELS.register();
        Culling::from(RasterGrid::default()).register();
        Indirect::from(PhotonSplatting::default()).register();
        Indirect::from(VirtualLights::default()).register();
        Occlusion::from(Deep::default()).register();
        Occlusion::from(Hbao::default()).register();
    });
}
