//! Ground truth: an unbiased path tracer on the CPU, for any machine.
//!
//! It shades what the renderer shades: [`brdf`] and [`incidence`] are the shaders' own functions as plain Rust, and tests
//! of the renderer hold the two together. What it adds is all the light there is: bounces, emissive surfaces, the sky.
//!
//! Space and units are the scene's: right-handed, +y up, metres, nits, linear Rec. 709.

pub mod brdf;
mod camera;
mod error;
mod film;
mod light_paths;
mod lights;
mod occlusion;
mod path;
mod probe;
mod random;
pub mod settings;
#[cfg(test)]
mod statistics;
mod surface;
mod texture;
mod tracer;
mod world;

#[cfg(test)]
mod tests;

pub use self::{
    error::ReferenceError,
    film::{Film, Noise},
    lights::{Incidence, incidence, incidence_from, point_of_area},
    probe::{LightAt, Probed, RayFrom},
    random::Random,
    settings::Settings,
    surface::reflector,
    tracer::Tracer,
};
