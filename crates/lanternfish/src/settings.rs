//! All settings. The documentation of a setting states the effect of higher and lower values.

mod parameters;
mod presets;

use std::fmt;

pub use lanternfish_scene::shading::{Attenuation, Materials};
use lanternfish_scene::{named_enum, named_type_impls};

use crate::lights::LightSettings;
pub use crate::{
    indirect::{Indirect, Quality},
    light_culling::Culling,
    occlusion::Occlusion,
    rays::{Structure, Tracer, TracerChoice},
};

/// How an image is rendered from a scene and a camera. `Default` is what the renderer recommends, and what `lanternfish render` uses
/// without flags.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How lights are assigned to pixels.
    pub culling: Culling,
    /// How visibility to lights is computed.
    pub shadows: Shadows,
    /// Which shadow rays are skipped.
    pub ray_culling: RayCulling,
    /// Radius of point and spot lights, m. At 0 they are points with hard shadows. Higher values widen penumbrae in proportion to the
    /// distance between occluder and receiver. The radius only moves the end points of shadow rays; directional lights have none.
    pub light_radius: f32,
    /// Shadow rays per pixel to each light that has a radius, 1 to 255, and to each disk and rectangle, at most 32. More rays: less noise,
    /// time in proportion.
    pub shadow_rays: u32,
    /// How intensity falls off with distance.
    pub attenuation: Attenuation,
    /// Intensity at which a light without a stated range ends, cd/m² of its own inverse-square law; > 0. Lower: larger ranges, less light
    /// lost, more lights per pixel [Elagabani2025, eq. 4.1].
    pub range_threshold: f32,
    /// Which surfaces are shaded.
    pub materials: Materials,
    /// How ambient visibility is computed: the fraction of the environment that surfaces see. The environment (the scene's, or its constant
    /// sky) lights surfaces only through this setting or through rays of [`Self::indirect`]. With [`Sampled`](crate::techniques::Sampled)
    /// it affects only its debug view. Transparent surfaces use the ambient visibility of the nearest one in the pixel.
    pub occlusion: Occlusion,
    /// The acceleration structure of inexact tracers, with its parameters. None: the tracer's own structure with default parameters.
    pub structure: Structure,
    /// Exposure of the display image; radiance is not affected.
    pub exposure: Exposure,
    /// The tone mapping operator, from scene-referred radiance to the display image.
    pub tone_map: ToneMap,
    /// Shows a quantity of the frame instead of its radiance.
    pub debug_view: Option<DebugView>,
    /// How material textures are bound. The image does not change.
    pub textures: TextureBinding,
    /// Maximum samples along the long axis of a pixel's footprint in a texture with linear filters only. Higher: sharper textures at
    /// grazing angles, more time.
    pub anisotropy: Anisotropy,
    /// How indirect light is computed.
    pub indirect: Indirect,
    /// Temporal accumulation of indirect light and area-light shadows.
    pub history: History,
    /// Samples per pixel at triangle edges (MSAA). More: smoother edges, slower. Each surface in a pixel is shaded once and weighted by its
    /// coverage. Debug views use one sample. For a mean of 8 frames or more, one sample is better: the jittered frames antialias edges, and
    /// four samples blur them by three eighths of a pixel to each side. The value is never changed automatically.
    pub samples: Samples,
    /// Number of frames in the mean of an image, each with another subpixel jitter; at least 1. More: smoother edges, less noise, time in
    /// proportion.
    pub accumulate: u32,
}

impl Settings {
    /// Direct light of the listed lights with shadows, and nothing else: for programs with a tight frame budget. Surfaces that no light
    /// reaches are black. Emission and the environment are visible but light nothing.
    pub fn direct_light() -> Self {
        Self {
            culling: Culling::default(),
            shadows: Shadows::Auto,
            ray_culling: RayCulling::Surface,
            light_radius: 0.0,
            shadow_rays: 16,
            attenuation: Attenuation::Gltf,
            range_threshold: 0.02,
            materials: Materials::File,
            occlusion: Occlusion::NONE,
            structure: Structure::NONE,
            exposure: Exposure::Auto,
            tone_map: ToneMap::Neutral,
            debug_view: None,
            textures: TextureBinding::Auto,
            anisotropy: Anisotropy::Auto,
            indirect: Indirect::NONE,
            history: History::Off,
            samples: Samples::One,
            accumulate: 1,
        }
    }

    /// The settings with which lights are packed.
    pub fn lights(&self) -> LightSettings {
        let Self { attenuation, range_threshold, light_radius, shadow_rays, .. } = *self;
        LightSettings { attenuation, range_threshold, radius: light_radius, shadow_rays }
    }

    /// True if any light can be partially visible.
    pub(crate) fn casts_soft_shadows(&self) -> bool {
        self.light_radius > 0.0
    }

    /// True if temporal accumulation may run; motion is computed then. The scene decides later whether there are area lights.
    pub(crate) fn keeps_history(&self) -> bool {
        let has_accumulated_ambient_visibility = self.occlusion.is_noisy() && self.finds_ambient_visibility();
        let is_noisy =
            self.indirect != Indirect::NONE || self.shadows != Shadows::None || has_accumulated_ambient_visibility;
        self.history == History::On && is_noisy
    }

    /// True if ambient visibility is computed. It is not needed if rays of indirect light reach the environment themselves.
    pub(crate) fn finds_ambient_visibility(&self) -> bool {
        let is_used = !self.indirect.sees_environment() || self.debug_view == Some(DebugView::Occlusion);
        self.occlusion != Occlusion::NONE && is_used
    }
}

/// Exposure of the display image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Automatic exposure from the radiance of the image, independent of light units; one value for all views of a frame
    /// ([`crate::output`]).
    Auto,
    /// Stops, EV: the image is multiplied by 2^EV before tone mapping. Higher: brighter.
    Ev(f32),
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Ev(ev) => ev.fmt(f),
        }
    }
}

/// How visibility to lights is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shadows {
    /// Rays through the adapter's faster exact tracer: `ray-query` on hardware that supports it, otherwise `bvh`.
    Auto,
    /// No shadows.
    None,
    /// Rays through this tracer. Deep images [Niessner2010, §4] limit shadows to their texel size; rays from transparent surfaces and from
    /// further samples of a pixel use the BVH instead.
    Traced(Tracer),
}

impl Shadows {
    /// Rays through the BVH.
    pub const BVH: Self = Self::Traced(Tracer::BVH);
    /// Rays through the adapter's own acceleration structure.
    pub const RAY_QUERY: Self = Self::Traced(Tracer::RAY_QUERY);

    /// All values, in the order of the help text.
    pub fn all() -> Vec<Self> {
        [Self::Auto, Self::None].into_iter().chain(Tracer::all().into_iter().map(Self::Traced)).collect()
    }

    /// The name that [`FromStr`](std::str::FromStr) parses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::None => "none",
            Self::Traced(tracer) => tracer.name(),
        }
    }

    /// The meaning in one line of help text.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Auto => "The adapter's faster exact tracer",
            Self::None => "No shadows",
            Self::Traced(tracer) => tracer.words(),
        }
    }
}

named_type_impls!(Shadows);

named_enum! {
    /// Which shadow rays are skipped because the surface faces away from the light [Elagabani2025, §4.3.1].
    RayCulling {
        /// Every listed light gets a ray, even beyond its range: the baseline.
        None = "none": "Every listed light gets a ray, even beyond its range",
        /// Normals from depth, two samples per axis: wrong at edges.
        Naive = "naive": "Normals from depth, two samples per axis: wrong at edges",
        /// Normals from depth, five samples per axis: wrong only on triangles under three pixels.
        Improved = "improved": "Normals from depth, five samples per axis: wrong only on tiny triangles",
        /// The surface's own normal from the G-buffer: exact.
        Surface = "surface": "The surface's own normal: exact",
    }
}

named_enum! {
    /// Temporal accumulation.
    #[derive(Default)]
    History {
        /// Each frame is independent.
        #[default]
        Off = "off": "Each frame is independent",
        /// Reprojects each pixel's surface into the previous frame and mixes its history with the estimate of this frame. Successive frames
        /// of a view of one renderer then depend on each other; the first frame is as without history.
        On = "on": "Accumulates each surface's light over frames, reprojected as the view moves",
    }
}

named_enum! {
    /// The tone mapping operator, from scene-referred radiance to the display image. All but `none` compress highlights.
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
        /// Distance from the camera plane, logarithmic; nearer is brighter.
        Depth = "depth": "Distance from the camera; brighter is nearer",
        /// The shading normal, world space, (n + 1) / 2.
        Normal = "normal": "Shading normal",
        /// The triangle's own normal, world space.
        GeometricNormal = "geometric-normal": "The triangle's own normal",
        /// The normal reconstructed from depth with two samples per axis.
        NormalNaive = "normal-naive": "Normal reconstructed from depth, two samples per axis",
        /// The normal reconstructed from depth with five samples per axis.
        NormalImproved = "normal-improved": "Normal reconstructed from depth, five samples per axis",
        /// Perceptual roughness.
        Roughness = "roughness": "Perceptual roughness",
        /// Base colour after textures and vertex colours.
        BaseColor = "base-color": "Base colour after textures",
        /// Listed lights per pixel, as a heat map.
        LightCount = "light-count": "Listed lights per pixel, as a heat map",
        /// Listed lights per pixel whose range exceeds their distance, as a logarithmic heat map.
        LightsPerPixel = "lights-per-pixel": "Listed lights whose range reaches the pixel, as a logarithmic heat map",
        /// The cluster's grid coordinates, each modulo 3; magenta if the cluster has no visible fragment.
        ClusterIndex = "cluster-index": "Grid coordinates of clusters, modulo 3; magenta where no cluster is marked",
        /// Lights in the pixel's cluster or tile, as a logarithmic heat map.
        ClusterLights = "cluster-lights": "Lights in the pixel's cluster or tile, as a logarithmic heat map",
        /// Visible fragments in the pixel's cluster, as a logarithmic heat map; magenta if there are none.
        ClusterFragments = "cluster-fragments":
            "Visible fragments in the pixel's cluster, as a logarithmic heat map; magenta where none",
        /// Shadow rays per pixel, as a heat map.
        RayCount = "ray-count": "Shadow rays per pixel, as a heat map",
        /// Fraction of the pixel's listed lights that are visible.
        Visibility = "visibility": "Fraction of the pixel's listed lights that are visible",
        /// Screen-space motion since the previous frame: hue is direction, brightness is distance.
        Motion = "motion": "Screen-space motion since the previous frame; hue is direction, brightness is distance",
        /// Ambient visibility: white where nothing occludes the environment.
        Occlusion = "occlusion": "Ambient visibility, white where nothing occludes; needs `occlusion`",
        /// Indirect light on a white surface: from other surfaces, and from the environment where rays reach it; 1 nit is half of white.
        Indirect = "indirect": "Indirect light on a white surface, 1 nit is half of white; needs `indirect`",
        /// Magenta where the radiance is not finite, grey elsewhere.
        Nan = "nan": "Magenta where the radiance is not finite",
    }
}

named_enum! {
    /// Samples per pixel at triangle edges (MSAA).
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
        /// A bind group per material: works on every device.
        PerMaterial = "per-material": "One bind group per material: works on every device",
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques::TileSize;

    #[test]
    fn names_are_parsed_and_others_are_rejected_with_the_list() {
        for attenuation in Attenuation::ALL {
            assert_eq!(attenuation.name().parse::<Attenuation>(), Ok(*attenuation));
        }
        // Two values of one name could not be told apart.
        for shadows in Shadows::all() {
            assert_eq!(shadows.name().parse::<Shadows>(), Ok(shadows));
        }
        assert!("16px".parse::<TileSize>().unwrap_err().contains("8, 16, 32"));
    }
}
