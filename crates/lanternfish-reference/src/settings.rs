//! Settings of the path tracer.

use lanternfish_scene::{
    named_enum,
    shading::{Attenuation, Coefficients, Falloff, Materials, NEAR_RADIUS},
};

/// What the path tracer computes, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What a pixel shows.
    pub integrator: Integrator,
    /// Longest path, in segments from the camera on: 1 shows emitters only, 2 direct light, 3 one bounce; at least 1. Higher:
    /// more of the light, slower.
    pub max_depth: u32,
    /// Materials that surfaces are shaded with.
    pub materials: Materials,
    /// How punctual lights fall off.
    pub attenuation: Attenuation,
    /// Nearer than this, a light is as bright as at this distance; m, > 0 [VanGelderen2020, §A.1].
    pub attenuation_near_radius: f32,
    /// Coefficients of the attenuation `clq`.
    pub attenuation_coefficients: Coefficients,
    /// Intensity at which a light without a stated range ends: see [`lanternfish_scene::Light::effective_range`].
    pub range_threshold: f32,
    /// Radius of point and spot lights, m, 0 or more. Such a light is a disk around its centre that faces the surface; what arrives from
    /// each point of it is what would arrive from the centre. 0: lights are points. Directional lights have no radius.
    pub light_radius: f32,
    /// How one of many lights is chosen at a surface. The mean is the same.
    pub light_choice: LightChoice,
    /// Whether paths start at lights, too: at points and spots, without [`Settings::light_radius`]. The mean is the same.
    pub light_paths: LightPaths,
    /// Seed of the random numbers. Another seed: other noise, the same mean.
    pub seed: u64,
}

/// No limit on [`Settings::max_depth`].
pub const UNLIMITED: u32 = u32::MAX;

impl Default for Settings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Path,
            max_depth: UNLIMITED,
            materials: Materials::File,
            attenuation: Attenuation::Gltf,
            attenuation_near_radius: NEAR_RADIUS,
            attenuation_coefficients: Coefficients::default(),
            range_threshold: 0.02,
            light_radius: 0.0,
            light_choice: LightChoice::Tree,
            light_paths: LightPaths::On,
            seed: 0,
        }
    }
}

impl Settings {
    /// The attenuation with its parameters.
    pub fn falloff(&self) -> Falloff {
        Falloff {
            attenuation: self.attenuation,
            near_radius: self.attenuation_near_radius,
            coefficients: self.attenuation_coefficients,
        }
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// Radiance, nits.
    Path,
    /// Share of the cosine-weighted hemisphere around the shading normal that is open [Aalund2015, eq. 1]; 1 where there is
    /// no surface.
    Occlusion,
    /// The same with occluders at distance d < `max_distance` (m, > 0) weighed by 1 − (d / `max_distance`)², as
    /// screen-space methods do [Aalund2015, §3.3].
    Obscurance {
        /// Distance from which on nothing occludes, m.
        max_distance: f32,
    },
    /// The shading normal, world space, (n + 1) / 2; 0 where there is no surface.
    Normal,
}

named_enum! {
    /// How one of many lights is chosen at a surface.
    LightChoice {
        /// By a tree over the lights: power, distance, range, facing [Conty2018].
        Tree = "tree": "By a tree over the lights, those first that send most",
        /// Each alike: for comparison.
        Uniform = "uniform": "Each alike: for comparison",
    }
}

named_enum! {
    /// Whether paths start at lights, too, and not at the eye alone.
    LightPaths {
        /// From point and spot lights without a size, to the first surface: what surfaces close to a light send on has little noise.
        On = "on": "From lights without a size to the first surface as well: little noise of what surfaces close to a light send on",
        /// From the eye alone: for comparison.
        Off = "off": "From the eye alone: for comparison",
    }
}
