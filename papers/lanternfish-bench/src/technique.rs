//! Constructors of the techniques that benchmarks use. Types of settings appear only here and where settings are destructured.

use lanternfish::{
    settings::{Culling, Indirect, Occlusion},
    techniques::{Clustered, Sampled, Tiled},
};
use lanternfish_papers::{
    Deep, Hbao, RasterGrid,
    indirect::{photon_splatting::PhotonSplatting, virtual_lights::VirtualLights},
};

pub const NO_INDIRECT: Indirect = Indirect::NONE;
pub const NO_OCCLUSION: Occlusion = Occlusion::NONE;
/// Shades every pixel with every light.
pub const NO_CULLING: Culling = Culling::NONE;

pub fn sampled(sampled: Sampled) -> Indirect {
    Indirect::from(sampled)
}

pub fn virtual_lights(lights: VirtualLights) -> Indirect {
    Indirect::from(lights)
}

pub fn photons(photons: PhotonSplatting) -> Indirect {
    Indirect::from(photons)
}

pub fn tiled(tiled: Tiled) -> Culling {
    Culling::from(tiled)
}

pub fn clustered(clustered: Clustered) -> Culling {
    Culling::from(clustered)
}

pub fn raster_grid(grid: RasterGrid) -> Culling {
    Culling::from(grid)
}

/// Occlusion with deep images, up to a distance, m; `None`: unlimited.
pub fn deep_occlusion(max_distance: Option<f32>) -> Occlusion {
    Occlusion::from(Deep { max_distance, ..Deep::default() })
}

/// The same as the paper has it, without tests of triangles [Aalund2015, §3.3].
pub fn plain_occlusion(max_distance: Option<f32>) -> Occlusion {
    Occlusion::from(Deep { max_distance, plain: true })
}

/// Screen-space occlusion from the view's depth, up to a radius, m.
pub fn hbao(radius: f32) -> Occlusion {
    Occlusion::from(Hbao { radius })
}
