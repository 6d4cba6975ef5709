//! An unbiased path tracer on the CPU, which renders the ground truth.
//!
//! It uses the renderer's shading model: [`brdf`] and [`incidence`] are CPU references of the shaders' functions, and tests of the
//! renderer compare the two. It simulates complete light transport: multiple bounces, emissive surfaces and the sky.
//!
//! Coordinates and units are those of the scene: right-handed, +y up, metres, nits, linear Rec. 709.

pub mod brdf;
mod camera;
mod error;
mod facets;
mod film;
pub mod layers;
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
