//! Settings of the path tracer.

use lanternfish_scene::{
    named_enum,
    shading::{Attenuation, Coefficients, Falloff, Materials, NEAR_RADIUS},
};

/// Settings of the path tracer.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The computed quantity.
    pub integrator: Integrator,
    /// Maximum number of path segments, counted from the camera, at least 1: 1 gives emitters only, 2 direct light, 3 one bounce. A higher
    /// value gives more light and is slower.
    pub max_depth: u32,
    /// Material model.
    pub materials: Materials,
    /// Distance attenuation of lights.
    pub attenuation: Attenuation,
    /// Nearer than this, a light is as bright as at this distance; m, > 0 [VanGelderen2020, §A.1].
    pub attenuation_near_radius: f32,
    /// Coefficients of the attenuation `clq`.
    pub attenuation_coefficients: Coefficients,
    /// Intensity at which a light without a stated range ends: see [`lanternfish_scene::Light::effective_range`].
    pub range_threshold: f32,
    /// Radius of point and spot lights, m, at least 0; 0 means points. With a radius, a light is a disk around its centre that faces the
    /// surface. Each point of it has the irradiance of the centre.
    pub light_radius: f32,
    /// Angular diameter of directional lights, degrees, 0 to 90; 0 means a single direction. With a diameter, such a light is a disk at
    /// distance 1 that faces the surface, sampled uniformly; as seen along its centre, it has the light's irradiance.
    pub sun_diameter: f32,
    /// Selection of a light for light sampling. It does not affect the mean.
    pub light_choice: LightChoice,
    /// Light paths from point and spot lights, if [`Settings::light_radius`] is 0. They do not affect the mean.
    pub light_paths: LightPaths,
    /// Seed of the random numbers. It affects the noise, but not the mean.
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
            sun_diameter: 0.0,
            light_choice: LightChoice::Tree,
            light_paths: LightPaths::On,
            seed: 0,
        }
    }
}

impl Settings {
    /// The attenuation with its parameters.
    #[doc(hidden)]
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
    /// Ambient visibility: unoccluded fraction of the cosine-weighted hemisphere around the shading normal [Aalund2015, eq. 1]; 1 where
    /// there is no surface.
    Occlusion,
    /// Like [`Self::Occlusion`], with occluders at distance d < `max_distance` weighted by 1 − (d / `max_distance`)², as in screen-space
    /// methods [Aalund2015, §3.3].
    Obscurance {
        /// Maximum distance of occluders, m, above 0.
        max_distance: f32,
    },
    /// The shading normal, world space, (n + 1) / 2; 0 where there is no surface.
    Normal,
}

named_enum! {
    /// Selection of a light for light sampling.
    LightChoice {
        /// Importance sampling with a light tree: power, distance, range, orientation [Conty2018].
        Tree = "tree": "Importance sampling with a light tree",
        /// Uniform sampling, for comparison.
        Uniform = "uniform": "Uniform sampling, for comparison",
    }
}

named_enum! {
    /// Light paths in addition to camera paths.
    LightPaths {
        /// Light paths of one segment from point and spot lights: less noise in light reflected by surfaces close to a light.
        On = "on": "Light paths of one segment from point and spot lights: less noise from surfaces close to a light",
        /// Camera paths only, for comparison.
        Off = "off": "Camera paths only, for comparison",
    }
}
