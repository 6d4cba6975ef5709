//! The techniques that benches choose, by a constructor each: what a setting's type is, matters here and where it is taken apart.

use lanternfish::{
    indirect::{photon_splatting::PhotonSplatting, virtual_lights::VirtualLights},
    settings::{Clustered, Culling, Hbao, Indirect, Occlusion, RasterGrid, Sampled, Tiled},
};

pub const NO_INDIRECT: Indirect = Indirect::None;
pub const NO_OCCLUSION: Occlusion = Occlusion::None;
/// Every light for every pixel.
pub const NO_CULLING: Culling = Culling::All;

pub fn sampled(sampled: Sampled) -> Indirect {
    Indirect::Sampled(sampled)
}

pub fn virtual_lights(lights: VirtualLights) -> Indirect {
    Indirect::VirtualLights(lights)
}

pub fn photons(photons: PhotonSplatting) -> Indirect {
    Indirect::PhotonSplatting(photons)
}

pub fn tiled(tiled: Tiled) -> Culling {
    Culling::Tiled(tiled)
}

pub fn clustered(clustered: Clustered) -> Culling {
    Culling::Clustered(clustered)
}

pub fn raster_grid(grid: RasterGrid) -> Culling {
    Culling::RasterGrid(grid)
}

/// By deep images, up to a distance, m, or without an end.
pub fn deep_occlusion(max_distance: Option<f32>) -> Occlusion {
    Occlusion::deep(max_distance)
}

/// By the view's depth, up to a radius, m.
pub fn hbao(radius: f32) -> Occlusion {
    Occlusion::Hbao(Hbao { radius })
}
