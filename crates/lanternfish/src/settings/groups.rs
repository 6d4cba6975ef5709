//! The groups of [`Settings`](super::Settings).

use lanternfish_scene::shading::{Falloff, NEAR_RADIUS};
use serde::{Deserialize, Serialize};

use super::{
    Anisotropy, Antialiasing, Attenuation, Background, Coefficients, Culling, DebugView, Direct, Exposure, History,
    Indirect, Materials, Occlusion, RayCulling, RayRangeCulling, Samples, Settings, Shadows, Structure, TextureBinding,
    ToneMap,
};

/// Falloff, range and size of lights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct LightSettings {
    /// Distance attenuation of punctual lights.
    pub attenuation: Attenuation,
    /// Near radius R0 of the attenuation [VanGelderen2020, §A.1], m, > 0: nearer than this, a light is as bright as at this distance. Larger:
    /// no bright spots around lights. The default, 1 mm, only avoids division by zero.
    pub near_radius: f32,
    /// Coefficients of the attenuation `clq` [VanGelderen2020, eq. A.2]. Larger: less light.
    #[serde(with = "crate::technique::data::text")]
    pub coefficients: Coefficients,
    /// Illuminance at which a light without a stated range ends, lx, by its inverse-square law I / d²; > 0. Lower values give larger ranges,
    /// less lost light and more lights per pixel [Elagabani2025, eq. 4.1].
    pub range_threshold: f32,
    /// Radius of point and spot lights for soft shadows, m. 0 gives hard shadows. Moves the end points of shadow rays only;
    /// irradiance is that of a point. Directional lights have a [diameter](Self::sun_diameter) instead.
    pub radius: f32,
    /// Angular diameter of directional lights for soft shadows, degrees, 0 to 90; the sun's is 0.53. Larger: wider penumbrae. 0 gives hard
    /// shadows. Moves the end points of shadow rays only; irradiance is that of the centre.
    pub sun_diameter: f32,
}

impl Default for LightSettings {
    fn default() -> Self {
        Self {
            attenuation: Attenuation::Gltf,
            near_radius: NEAR_RADIUS,
            coefficients: Coefficients::default(),
            range_threshold: 0.02,
            radius: 0.0,
            sun_diameter: 0.0,
        }
    }
}

impl LightSettings {
    /// The attenuation with its parameters.
    pub fn falloff(&self) -> Falloff {
        Falloff { attenuation: self.attenuation, near_radius: self.near_radius, coefficients: self.coefficients }
    }
}

/// Shadows of all lights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct ShadowSettings {
    /// Shadow technique for all lights.
    pub technique: Shadows,
    /// Shadow rays per pixel to each light with a radius, 1 to 255, and to each disk or rectangle, at most 32. Noise falls with the
    /// square root; time grows in proportion.
    pub rays: u32,
    /// Which shadow rays are skipped because the surface faces away from the light.
    pub ray_culling: RayCulling,
    /// Whether shadow rays to listed lights that do not reach the point are skipped.
    pub ray_range_culling: RayRangeCulling,
}

impl Default for ShadowSettings {
    fn default() -> Self {
        Self {
            technique: Shadows::Auto,
            rays: 16,
            ray_culling: RayCulling::Surface,
            ray_range_culling: RayRangeCulling::On,
        }
    }
}

/// Material model and textures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct MaterialSettings {
    /// Material model: the file's materials, or a simplified one for comparisons.
    pub model: Materials,
    /// How material textures are bound. The image does not depend on it.
    pub textures: TextureBinding,
    /// Maximum anisotropy of texture filtering, for textures whose filters are all linear. Higher values keep textures at grazing angles
    /// sharp, and cost more. Frames of a mean after the first, and those of temporal antialiasing, take up to 8 samples.
    pub anisotropy: Anisotropy,
}

impl Default for MaterialSettings {
    fn default() -> Self {
        Self { model: Materials::File, textures: TextureBinding::Auto, anisotropy: Anisotropy::Auto }
    }
}

/// From radiance to an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct ImageSettings {
    /// Exposure of [`RenderedImage::display`](crate::RenderedImage::display). Radiance is not affected.
    #[serde(with = "crate::technique::data::text")]
    pub exposure: Exposure,
    /// Tone mapping operator from scene-referred radiance to display values.
    pub tone_map: ToneMap,
    /// What the image shows where it shows no surface.
    #[serde(with = "crate::technique::data::text")]
    pub background: Background,
    /// A quantity of the frame to show instead of radiance.
    pub debug_view: Option<DebugView>,
    /// Antialiasing over the frames of a moving view.
    pub antialiasing: Antialiasing,
    /// Samples per pixel at triangle edges (MSAA). Every surface in a pixel is shaded once, at a point that it covers. Debug views use one
    /// sample. For a mean of 8 frames or more, one sample is better: the frames smooth edges, and four samples widen them by 3/8 pixel.
    pub samples: Samples,
    /// Number of frames averaged into one image, at least 1, each through other points of the pixels. Smoother edges and less noise; time
    /// grows in proportion.
    pub accumulate: u32,
}

impl Default for ImageSettings {
    fn default() -> Self {
        Self {
            exposure: Exposure::Auto,
            tone_map: ToneMap::Neutral,
            background: Background::Environment,
            debug_view: None,
            antialiasing: Antialiasing::None,
            samples: Samples::Four,
            accumulate: 1,
        }
    }
}

/// Declares functions that return the settings with another value, for use in a chain.
macro_rules! setters {
    ($($name:ident($type:ty) => $first:ident $(.$second:ident)?),+ $(,)?) => {
        impl Settings { $(
            #[doc = concat!("The settings with another `", stringify!($first), $(".", stringify!($second),)? "`.")]
            #[must_use]
            pub fn $name(mut self, value: $type) -> Self {
                self.$first$(.$second)? = value.into();
                self
            }
        )+ }
    };
}

setters! {
    with_direct(impl Into<Direct>) => direct,
    with_culling(impl Into<Culling>) => culling,
    with_attenuation(Attenuation) => lights.attenuation,
    with_attenuation_near_radius(f32) => lights.near_radius,
    with_attenuation_coefficients(Coefficients) => lights.coefficients,
    with_range_threshold(f32) => lights.range_threshold,
    with_light_radius(f32) => lights.radius,
    with_sun_diameter(f32) => lights.sun_diameter,
    with_shadows(Shadows) => shadows.technique,
    with_shadow_rays(u32) => shadows.rays,
    with_ray_culling(RayCulling) => shadows.ray_culling,
    with_ray_range_culling(RayRangeCulling) => shadows.ray_range_culling,
    with_indirect(impl Into<Indirect>) => indirect,
    with_occlusion(impl Into<Occlusion>) => occlusion,
    with_structure(impl Into<Structure>) => structure,
    with_history(History) => history,
    with_materials(Materials) => materials.model,
    with_textures(TextureBinding) => materials.textures,
    with_anisotropy(Anisotropy) => materials.anisotropy,
    with_exposure(Exposure) => image.exposure,
    with_tone_map(ToneMap) => image.tone_map,
    with_background(Background) => image.background,
    with_debug_view(impl Into<Option<DebugView>>) => image.debug_view,
    with_antialiasing(Antialiasing) => image.antialiasing,
    with_samples(Samples) => image.samples,
    with_accumulate(u32) => image.accumulate,
}
