//! Indirect light from photons and from virtual lights.

pub mod caustics;
pub(crate) mod layers;
pub(crate) mod light_views;
pub mod photon_splatting;
#[cfg(test)]
mod tests;
pub mod virtual_lights;
