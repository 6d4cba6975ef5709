//! Rendering settings, with their units, ranges and effects.

mod background;
mod exposure;
mod given;
mod groups;
mod named;
mod presets;
mod structure;
#[cfg(test)]
mod tests;

pub use lanternfish_scene::shading::{Attenuation, Coefficients, Materials};
use lanternfish_scene::{named_enum, named_type_impls};
use serde::{Deserialize, Serialize};

#[doc(hidden)]
pub use crate::indirect::Caustics;
use crate::lights::LightStorage;
pub use crate::{
    direct_light::Direct,
    indirect::{Indirect, Quality},
    light_culling::Culling,
    occlusion::Occlusion,
    rays::{Structure, Tracer, TracerChoice},
};
pub use background::Background;
pub use exposure::Exposure;
#[doc(hidden)]
pub use given::GivenSettings;
pub use groups::{ImageSettings, LightSettings, MaterialSettings, ShadowSettings};
pub use named::AnyParameter;
pub use presets::Preset;

/// Rendering settings, in groups. `Default` is the recommended configuration: all light, at [`Preset::Good`].
///
/// As data, a technique is its name, or a table of its parameters under its name; what is missing has its default. An
/// unknown technique, key or value is an error that names the nearest one.
///
/// ```
/// # use lanternfish::settings::{Exposure, Settings};
/// let settings = Settings::default().with_exposure(Exposure::Ev(1.0));
/// let text = r#"{ "image": { "exposure": 1 }, "indirect": { "sampled": { "indirect-rays": 8 } } }"#;
/// assert_eq!(serde_json::from_str::<Settings>(text)?, settings);
/// # Ok::<_, serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub struct Settings {
    /// Direct light technique.
    pub direct: Direct,
    /// Light culling: how the lights of a shaded point are listed. The image does not depend on it.
    pub culling: Culling,
    /// Falloff, range and size of lights.
    pub lights: LightSettings,
    /// Shadows of all lights.
    pub shadows: ShadowSettings,
    /// Indirect light technique.
    pub indirect: Indirect,
    /// Light of mirrors on other surfaces, beside an indirect light technique that leaves it out.
    pub caustics: Caustics,
    /// Ambient visibility, and with it light from the environment or the constant sky. Without it the environment
    /// lights surfaces only if rays of [`Self::indirect`] see it: next to [`Sampled`](crate::techniques::Sampled) it
    /// affects only its debug view. Transparent surfaces use the value of the nearest one in the pixel.
    pub occlusion: Occlusion,
    /// Structure for approximate tracers, with its parameters. Without one, a tracer builds its own with default
    /// parameters.
    #[serde(with = "structure")]
    pub structure: Structure,
    /// Temporal accumulation of indirect light, area-light shadows and ambient visibility.
    pub history: History,
    /// Material model and textures.
    pub materials: MaterialSettings,
    /// From radiance to an image.
    pub image: ImageSettings,
}

impl Settings {
    /// Direct light with shadows, and nothing else: the cheapest configuration. Emission and environment are visible
    /// and light no other surface.
    pub fn direct_light() -> Self {
        Self {
            direct: Direct::default(),
            culling: Culling::default(),
            lights: LightSettings::default(),
            shadows: ShadowSettings::default(),
            indirect: Indirect::NONE,
            caustics: Caustics::NONE,
            occlusion: Occlusion::NONE,
            structure: Structure::NONE,
            history: History::Off,
            materials: MaterialSettings::default(),
            image: ImageSettings { samples: Samples::One, ..ImageSettings::default() },
        }
    }

    /// The settings that determine how lights are stored on the device.
    pub fn light_storage(&self) -> LightStorage {
        let LightSettings { range_threshold, radius, sun_diameter, .. } = self.lights;
        LightStorage {
            falloff: self.lights.falloff(),
            range_threshold,
            radius,
            sun_radius: (0.5 * sun_diameter).to_radians().tan(),
            shadow_rays: self.shadows.rays,
        }
    }

    /// True if point and spot lights have a radius, or directional lights a diameter.
    pub(crate) fn casts_soft_shadows(&self) -> bool {
        self.lights.radius > 0.0 || self.lights.sun_diameter > 0.0
    }

    /// True if anything may be accumulated over frames; then motion vectors are written. Whether lights have an area is
    /// known only with the scene.
    pub(crate) fn keeps_history(&self) -> bool {
        let has_accumulated_ambient_visibility = self.occlusion.is_noisy() && self.finds_ambient_visibility();
        let is_noisy = self.finds_indirect()
            || self.direct.is_some()
            || self.shadows.technique != Shadows::None
            || has_accumulated_ambient_visibility;
        self.history == History::On && is_noisy
    }

    /// True if caustics are computed: not beside indirect light that has them.
    #[doc(hidden)]
    pub fn finds_caustics(&self) -> bool {
        self.caustics.is_some() && self.indirect.technique().is_none_or(|technique| technique.leaves_caustics())
    }

    /// [`IndirectTechnique::shares_emission`], if direct light samples emissive triangles.
    pub(crate) fn shares_emission(&self) -> Option<f32> {
        self.indirect
            .shares_emission()
            .filter(|_| self.direct.technique().is_some_and(|direct| direct.samples_emission()))
    }

    /// True if there is light from other surfaces.
    pub(crate) fn finds_indirect(&self) -> bool {
        self.indirect.is_some() || self.finds_caustics()
    }

    /// True if ambient visibility is computed: not if rays of indirect light see the environment themselves.
    pub(crate) fn finds_ambient_visibility(&self) -> bool {
        let is_used = !self.indirect.sees_environment() || self.image.debug_view == Some(DebugView::Occlusion);
        self.occlusion != Occlusion::NONE && is_used
    }
}

/// Shadow technique.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shadows {
    /// Rays through the adapter's faster exact tracer: `ray-query` on hardware that has it, otherwise `bvh`.
    Auto,
    /// No shadows.
    None,
    /// Rays through this tracer. Deep images [Niessner2010, §4] give shadows as coarse as their texels; rays from
    /// transparent surfaces and from further samples of a pixel use the BVH.
    Traced(Tracer),
}

impl Shadows {
    /// Rays through the BVH.
    pub const BVH: Self = Self::Traced(Tracer::BVH);
    /// Rays through the adapter's own acceleration structure.
    pub const RAY_QUERY: Self = Self::Traced(Tracer::RAY_QUERY);

    /// All values, in the order of help.
    #[doc(hidden)]
    pub fn all() -> Vec<Self> {
        [Self::Auto, Self::None].into_iter().chain(Tracer::all().into_iter().map(Self::Traced)).collect()
    }

    /// The name that [`FromStr`](std::str::FromStr) parses.
    #[doc(hidden)]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::None => "none",
            Self::Traced(tracer) => tracer.name(),
        }
    }

    /// One line of help.
    #[doc(hidden)]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Auto => "The faster exact tracer of this adapter",
            Self::None => "No shadows",
            Self::Traced(tracer) => tracer.words(),
        }
    }
}

named_type_impls!(Shadows);

named_enum! {
    /// Skips shadow rays where the surface faces away from the light [Elagabani2025, §4.3.1].
    RayCulling {
        /// Lights behind the surface get a ray too: the baseline.
        None = "none": "Lights behind the surface get a ray too",
        /// Normals from depth, five samples per axis: wrong only on triangles under three pixels.
        Improved = "improved": "Normals from depth, five samples per axis: wrong only on tiny triangles",
        /// As `Improved`, and rays start from depth too: the prepass writes depth alone [Elagabani2025, ch. 6].
        Depth = "depth": "As improved, and rays start by depth alone: no surface target",
        /// The surface target's own normal: exact.
        Surface = "surface": "The surface's own normal: exact",
    }
}

named_enum! {
    /// Skips shadow rays from points beyond a listed light's range. The image does not depend on it.
    #[derive(Default)]
    RayRangeCulling {
        /// Every listed light gets a ray, as in [Elagabani2025, ch. 5]: light culling alone decides.
        Off = "off": "Listed lights get a ray even from beyond their range",
        /// The range is tested for each pixel: the rays do not depend on light culling.
        #[default]
        On = "on": "Rays only from within a light's range",
    }
}

named_enum! {
    /// Temporal accumulation.
    #[derive(Default)]
    History {
        /// Every frame is independent.
        #[default]
        Off = "off": "Every frame is independent",
        /// Values of earlier frames are reprojected along motion vectors and averaged. Consecutive frames of a view
        /// then depend on each other; the first one does not.
        On = "on": "Reprojects and averages values of earlier frames",
    }
}

named_enum! {
    /// Antialiasing over frames. Frames of a mean ([`ImageSettings::accumulate`]) need none.
    #[derive(Default)]
    Antialiasing {
        /// Every frame shows the surfaces at the centres of its pixels, or at its [`Samples`].
        #[default]
        None = "none": "Edges are as smooth as the samples per pixel",
        /// Each frame shows other points of the pixels, and is mixed with the frames before it, reprojected along
        /// motion vectors ([`crate::antialiasing`]). Consecutive frames of a view then depend on each other; the first
        /// one does not.
        Temporal = "temporal": "Jitters frames and mixes them along motion: smooth edges and less noise, a little blur",
    }
}

named_enum! {
    /// Tone mapping operator from scene-referred radiance to display values. All but `none` compress highlights.
    ToneMap {
        /// Clamps to 0..1.
        None = "none": "Clamps to 0..1",
        /// Khronos PBR Neutral: keeps base colours and compresses only highlights.
        Neutral = "neutral": "Keeps colours, compresses highlights only (Khronos PBR Neutral)",
        /// x / (1 + x) on luminance.
        Reinhard = "reinhard": "x / (1 + x) on luminance: soft",
        /// A fit of the ACES reference rendering and output transforms: high contrast, warm.
        Aces = "aces": "A fit of the ACES film look: high contrast, warm",
    }
}

named_enum! {
    /// A quantity of the frame, shown instead of its radiance.
    DebugView {
        /// Distance from the camera plane, logarithmic; brighter is nearer.
        Depth = "depth": "Distance from the camera; brighter is nearer",
        /// The shading normal, world space, (n + 1) / 2.
        Normal = "normal": "Shading normal",
        /// The triangle's own normal, world space.
        GeometricNormal = "geometric-normal": "The triangle's own normal",
        /// Perceptual roughness.
        Roughness = "roughness": "Perceptual roughness",
        /// Base colour after textures and vertex colours.
        BaseColor = "base-color": "Base colour after textures",
        /// Listed lights per pixel, as a heat map.
        LightCount = "light-count": "Lights listed for a pixel, as a heat map",
        /// Listed lights that reach the pixel: those whose range is above their distance, as a logarithmic heat map.
        LightsPerPixel = "lights-per-pixel": "Of them, those whose range reaches the pixel, as a logarithmic heat map",
        /// The cluster's index in the grid, each coordinate modulo 3; magenta if it has no visible fragment.
        ClusterIndex = "cluster-index": "Indices of clusters in their grid, modulo 3; magenta where none was marked",
        /// Lights of the pixel's cluster or tile, as a logarithmic heat map.
        ClusterLights = "cluster-lights": "Lights of a pixel's cluster or tile, as a logarithmic heat map",
        /// Visible fragments of the pixel's cluster, as a logarithmic heat map; magenta where there are none.
        ClusterFragments = "cluster-fragments":
            "Visible fragments of a pixel's cluster, as a logarithmic heat map; magenta where none",
        /// Shadow rays per pixel, as a heat map.
        RayCount = "ray-count": "Shadow rays of a pixel, as a heat map",
        /// Fraction of listed lights that reach the pixel.
        Visibility = "visibility": "Fraction of a pixel's listed lights that reach it",
        /// Motion vectors since the previous frame: hue is direction, brightness distance.
        Motion = "motion": "Motion vectors: hue is direction, brightness distance",
        /// Ambient visibility: white where nothing occludes.
        Occlusion = "occlusion": "Ambient visibility; needs `occlusion`",
        /// Indirect light on white surfaces, with the environment if rays see it; half of white is 1 nit.
        Indirect = "indirect": "Indirect light on white surfaces, half of white is 1 nit; needs `indirect`",
        /// Magenta where the radiance is not finite, grey elsewhere.
        Nan = "nan": "Magenta where the radiance is not finite",
    }
}

named_enum! {
    /// Samples per pixel at triangle edges (multisample antialiasing).
    Samples {
        /// One sample.
        One = "1": "One sample",
        /// Two samples, if the adapter supports it.
        Two = "2": "Two samples, if the adapter supports it",
        /// Four samples, on every adapter.
        Four = "4": "Four samples, on every adapter",
        /// Eight samples, if the adapter supports it.
        Eight = "8": "Eight samples, if the adapter supports it",
    }
}

impl Samples {
    /// The number of samples.
    pub const fn count(self) -> u32 {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Four => 4,
            Self::Eight => 8,
        }
    }
}

named_enum! {
    /// How material textures are bound.
    TextureBinding {
        /// `array` if the hardware supports it, otherwise `per-material`.
        Auto = "auto": "array if the hardware supports it",
        /// One binding array of all textures, indexed in the shader.
        Array = "array": "One binding array of all textures",
        /// A bind group for materials of the same textures: works on every device.
        PerMaterial = "per-material": "A bind group for materials of the same textures: works on every device",
    }
}

named_enum! {
    /// Maximum samples along the long axis of a pixel's footprint in a texture.
    Anisotropy {
        /// 16 on hardware, 4 on a software adapter, 1 on an adapter that hangs with more.
        Auto = "auto": "16 on hardware, 4 on a software adapter, 1 on an adapter that hangs with more",
        /// 1: the footprint's long axis selects the mip level, so textures blur across it.
        X1 = "1": "Blurs textures at grazing angles",
        /// Two.
        X2 = "2": "A little sharper",
        /// Four.
        X4 = "4": "Almost as sharp as 16, at a lower cost",
        /// Eight.
        X8 = "8": "Almost the same as 16",
        /// Sixteen.
        X16 = "16": "Sharpest",
    }
}

impl Anisotropy {
    /// The number of samples; none if the adapter decides.
    pub const fn samples(self) -> Option<u16> {
        match self {
            Self::Auto => None,
            Self::X1 => Some(1),
            Self::X2 => Some(2),
            Self::X4 => Some(4),
            Self::X8 => Some(8),
            Self::X16 => Some(16),
        }
    }
}
