//! Procedural scenes, equal on every machine.

mod atrium;
mod build;
mod cornell;
mod furnace;
mod hall;
mod hash;
mod rain;
mod random;
mod sky;
mod street;
mod surface;
mod texture;

pub(crate) use build::Shape;
pub use rain::{Rain, light_rain};
pub use random::random_lights;
pub use sky::sky;
pub(crate) use surface::Surface;

use crate::{Scene, SceneError};

/// Names of the scenes of [`demo`].
///
/// - `atrium`: a court with two storeys of arcades, about 24 × 15 m and 10 m high, y = 0 at the court's floor; a low
///   sun and hanging lanterns. Meant to be used with [`light_rain`].
/// - `cornell`: the Cornell box, 2 m high, y = 0 at its floor, lit by a point light under its lamp.
/// - `furnace`: two rows of white spheres of rising roughness under a white sky of radiance 1, and a directional light
///   for renderers without sky lighting.
/// - `hall`: a vaulted hall of 16 × 30 × 17 m in a dark outer shell, rotated by 30° about each axis: hits that an acceleration
///   structure misses are dark.
/// - `street`: a street of 240 m at night, about a million placed triangles and several hundred lamps, y = 0 at the
///   asphalt. For scale.
pub const DEMOS: &[&str] = &["atrium", "cornell", "furnace", "hall", "street"];

/// The generated scene of that name. Deterministic; takes a fraction of a second.
pub fn demo(name: &str) -> Result<Scene, SceneError> {
    match name {
        "atrium" => Ok(atrium::atrium()),
        "cornell" => Ok(cornell::cornell()),
        "furnace" => Ok(furnace::furnace()),
        "hall" => Ok(hall::hall()),
        "street" => Ok(street::street()),
        _ => Err(SceneError::UnknownDemo { name: name.to_owned(), known: DEMOS.join(", ") }),
    }
}

#[cfg(test)]
mod tests;
