//! Five papers as one system, for [`lanternfish`]: [`Paper::settings`] has each of them, and all five in one frame.
//! Here are the techniques that are no default of the renderer: deep images of the scene, with shadows, occlusion and
//! indirect light traced through them; virtual lights and photons; a raster grid for light culling; screen-space
//! occlusion.
//!
//! A program calls [`register`] once, before it parses names or creates a renderer. After that, flags, shots, panels
//! and reports include the techniques.
//!
//! ```
//! use lanternfish::Settings;
//! use lanternfish_papers::{DeepImageSettings, VirtualLights};
//!
//! lanternfish_papers::register();
//! let images = DeepImageSettings { resolution: 64, ..DeepImageSettings::default() };
//! let settings = Settings::default().with_indirect(VirtualLights::default()).with_structure(images);
//! # let _ = settings;
//! ```
//!
//! | Paper | Here |
//! |---|---|
//! | Elagabani 2025 | [`normals`]; the rest is in the library |
//! | Nießner 2010 | [`deep_images`], [`ACROSS_TEXELS`] |
//! | Aalund 2015 | [`deep_images`], [`occlusion::deep`], [`indirect::photon_splatting`], [`indirect::caustics`] |
//! | Archer 2019 | [`DeepImageSettings::ARCHER`], [`WITHIN_TEXEL`], [`indirect::virtual_lights`], [`light_culling::raster_grid`] |
//!
//! [`occlusion::hbao`] is a baseline for comparison (Bavoil 2008). As in the library, each technique has a folder below
//! its kind.

#[cfg(test)]
#[macro_use]
extern crate lanternfish_gpu_test;

pub mod deep_images;
pub mod indirect;
pub mod light_culling;
pub mod normals;
pub mod occlusion;
mod presets;
pub mod rays;
pub mod shaders;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

use std::sync::Once;

use lanternfish::{
    settings::{Caustics, Culling, Indirect, Occlusion},
    shaders::Shaders,
};

pub use self::{
    deep_images::{
        ACROSS_TEXELS, PaperImages, WITHIN_TEXEL,
        directions::DirectionSet,
        settings::{DeepBuilder, DeepImageSettings, DeepSearch, DeepSort, DeepStore},
    },
    indirect::{caustics::CausticPhotons, photon_splatting::PhotonSplatting, virtual_lights::VirtualLights},
    light_culling::raster_grid::RasterGrid,
    occlusion::{deep::Deep, hbao::Hbao},
    presets::{Paper, PaperSetting},
};

/// Shaders of the folders that belong to no single technique.
pub const FOLDERS: &[Shaders] = &[deep_images::DECLARED, rays::DECLARED, indirect::light_views::DECLARED];

/// Registers every technique of this crate by name. Call it before names are parsed and before a renderer is created;
/// further calls do nothing.
pub fn register() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        WITHIN_TEXEL.register();
        ACROSS_TEXELS.register();
        Culling::from(RasterGrid::default()).register();
        Indirect::from(PhotonSplatting::default()).register();
        Indirect::from(VirtualLights::default()).register();
        Caustics::from(CausticPhotons::default()).register();
        Occlusion::from(Deep::default()).register();
        Occlusion::from(Hbao::default()).register();
    });
}
