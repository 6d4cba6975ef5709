//! Everything that can be chosen. A setting says what a higher and a lower value do.

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

/// How an image is made from a scene and a camera. `Default` is what the renderer recommends, and what `lanternfish render` uses
/// without flags.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How the lights of a point are found.
    pub culling: Culling,
    /// How shadows are found.
    pub shadows: Shadows,
    /// Which shadow rays are not worth tracing.
    pub ray_culling: RayCulling,
    /// Radius of point and spot lights, m; 0: they are points, and shadows are hard. Higher: shadows are softer the farther what casts
    /// them is from what they fall on. It moves where shadow rays end and nothing else; directional lights have none.
    pub light_radius: f32,
    /// Rays from a pixel to each light that has a radius, 1 to 255, and to each disk and rectangle, of which 32 at most. More: less noise,
    /// slower in proportion.
    pub shadow_rays: u32,
    /// How light falls off with distance.
    pub attenuation: Attenuation,
    /// Intensity at which a light without a stated range ends, cd/m² of its own inverse-square law; > 0. Lower: larger
    /// ranges, less light lost, more lights a pixel [Elagabani2025, eq. 4.1].
    pub range_threshold: f32,
    /// Which surfaces are shaded.
    pub materials: Materials,
    /// How much of the environment surfaces see, and are lit by: the scene's environment, or its constant sky. They light only
    /// where this is found, or where rays of [`Self::indirect`] see them: beside [`Sampled`](crate::techniques::Sampled) it does nothing but its debug
    /// view. Transparent surfaces have what the nearest one of the pixel sees.
    pub occlusion: Occlusion,
    /// What tracers go through that are not exact: a structure with its parameters; none: the tracer's own, with its default parameters.
    pub structure: Structure,
    /// How bright the image is shown; radiance stays as it is.
    pub exposure: Exposure,
    /// From scene-referred radiance to what a display shows.
    pub tone_map: ToneMap,
    /// Shows a quantity of the frame instead of its radiance.
    pub debug_view: Option<DebugView>,
    /// How material textures reach the shader. The image is the same.
    pub textures: TextureBinding,
    /// Samples along the long axis of a pixel's footprint in a texture, at most, where all its filters are linear. More:
    /// textures seen at an angle are sharper, and cost more.
    pub anisotropy: Anisotropy,
    /// Where light comes from that is not straight from the listed lights.
    pub indirect: Indirect,
    /// Whether what pixels saw in the frames before is mixed with what they see now: indirect light, and what of a light that has a size
    /// reaches them.
    pub history: History,
    /// Samples a pixel at edges of triangles. More: smoother edges, slower; every surface that a pixel shows is still shaded
    /// once, where it covers the pixel. Debug views take one. In a mean of 8 frames or more one is better: the frames smooth edges by themselves,
    /// and four samples smear them by three eighths of a pixel to each side. What is set here is taken, also in a mean.
    pub samples: Samples,
    /// Frames whose mean an image is, each through other points of the pixels; at least 1. More: smoother edges, less noise,
    /// slower in proportion.
    pub accumulate: u32,
}

impl Settings {
    /// Light straight from the listed lights alone, with their shadows: for programs that pay for every millisecond. What no
    /// light shines on is black, emission and environment is seen and light nothing.
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

    /// What lights are packed with.
    pub fn lights(&self) -> LightSettings {
        let Self { attenuation, range_threshold, light_radius, shadow_rays, .. } = *self;
        LightSettings { attenuation, range_threshold, radius: light_radius, shadow_rays }
    }

    /// Whether any light may be seen in part.
    pub(crate) fn casts_soft_shadows(&self) -> bool {
        self.light_radius > 0.0
    }

    /// Whether anything may be mixed with what the frames before have found: motion is looked for then. Whether lights have an area the scene
    /// says, which comes later.
    pub(crate) fn keeps_history(&self) -> bool {
        let has_accumulated_ambient_visibility = self.occlusion.is_noisy() && self.finds_ambient_visibility();
        let is_noisy =
            self.indirect != Indirect::NONE || self.shadows != Shadows::None || has_accumulated_ambient_visibility;
        self.history == History::On && is_noisy
    }

    /// Whether ambient visibility is looked for: rays of indirect light may see the environment themselves.
    pub(crate) fn finds_ambient_visibility(&self) -> bool {
        let is_used = !self.indirect.sees_environment() || self.debug_view == Some(DebugView::Occlusion);
        self.occlusion != Occlusion::NONE && is_used
    }
}

/// How bright an image is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// So that it can be seen, whatever the unit of its lights: found from the radiance of the image itself, one for all views of
    /// a frame ([`crate::output`]).
    Auto,
    /// Stops, EV: the image is multiplied by two to this power before tone mapping. Higher: brighter.
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

/// How shadows are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shadows {
    /// By rays through the faster exact tracer of this adapter: `ray-query` on hardware that has it, else `bvh`.
    Auto,
    /// No shadows.
    None,
    /// By rays through this tracer. Through deep images [Niessner2010, §4] they are as coarse as texels, and rays from blended surfaces, and of
    /// further samples of a pixel, go through the BVH.
    Traced(Tracer),
}

impl Shadows {
    /// By rays through the BVH.
    pub const BVH: Self = Self::Traced(Tracer::BVH);
    /// By rays through the adapter's own acceleration structure.
    pub const RAY_QUERY: Self = Self::Traced(Tracer::RAY_QUERY);

    /// Every one, in the order in which help lists them.
    pub fn all() -> Vec<Self> {
        [Self::Auto, Self::None].into_iter().chain(Tracer::all().into_iter().map(Self::Traced)).collect()
    }

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::None => "none",
            Self::Traced(tracer) => tracer.name(),
        }
    }

    /// What it means, in a line of help.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Auto => "The faster exact one of this adapter",
            Self::None => "No shadows",
            Self::Traced(tracer) => tracer.words(),
        }
    }
}

named_type_impls!(Shadows);

named_enum! {
    /// Which shadow rays are not traced because the surface faces away from the light [Elagabani2025, §4.3.1].
    RayCulling {
        /// Every listed light gets a ray, even from beyond its range: the baseline.
        None = "none": "Every listed light gets a ray, even from beyond its range",
        /// Normals from depth, two samples an axis: wrong at edges.
        Naive = "naive": "Normals from depth, two samples an axis: wrong at edges",
        /// Normals from depth, five samples an axis: wrong only on triangles under three pixels.
        Improved = "improved": "Normals from depth, five samples an axis: wrong only on tiny triangles",
        /// The surface target's own normal: exact.
        Surface = "surface": "The surface's own normal: exact",
    }
}

named_enum! {
    /// Whether pixels keep what they saw in the frames before.
    #[derive(Default)]
    History {
        /// Each frame is by itself.
        #[default]
        Off = "off": "Each frame is by itself",
        /// What a pixel's surface got in the frames before is mixed with what it gets now, wherever the view has gone since. Frames of a view that
        /// one renderer makes one after the other depend on each other then, images too; the first is as without.
        On = "on": "Mixed with what each pixel's surface got in the frames before, wherever the view has gone",
    }
}

named_enum! {
    /// From scene-referred radiance to what a display shows. All but `none` compress highlights.
    ToneMap {
        /// Clamps to 0..1.
        None = "none": "Clamps to 0..1",
        /// Khronos PBR Neutral: base colours stay as they are, only highlights are compressed.
        Neutral = "neutral": "Keeps colours, compresses highlights only (Khronos PBR Neutral)",
        /// x / (1 + x) on luminance.
        Reinhard = "reinhard": "x / (1 + x) on luminance: soft",
        /// A fit of the ACES reference rendering and output transforms: contrasty, warm.
        Aces = "aces": "A fit of the ACES film look: contrasty, warm",
    }
}

named_enum! {
    /// A quantity of the frame, shown instead of its radiance.
    DebugView {
        /// Distance from the camera plane, brighter is nearer, logarithmic.
        Depth = "depth": "Distance from the camera; brighter is nearer",
        /// The shading normal, world space, (n + 1) / 2.
        Normal = "normal": "Shading normal",
        /// The triangle's own normal, world space.
        GeometricNormal = "geometric-normal": "The triangle's own normal",
        /// The normal rebuilt from depth with two samples an axis.
        NormalNaive = "normal-naive": "Normal rebuilt from depth, two samples an axis",
        /// The normal rebuilt from depth with five samples an axis.
        NormalImproved = "normal-improved": "Normal rebuilt from depth, five samples an axis",
        /// Perceptual roughness.
        Roughness = "roughness": "Perceptual roughness",
        /// Base colour after textures and vertex colours.
        BaseColor = "base-color": "Base colour after textures",
        /// Listed lights a pixel, as a heat map.
        LightCount = "light-count": "Lights listed for a pixel, as a heat map",
        /// Listed lights that reach the pixel: those whose range is above their distance, as a logarithmic heat map.
        LightsPerPixel = "lights-per-pixel": "Of them, those whose range reaches the pixel, as a logarithmic heat map",
        /// The cluster's place in the grid, each coordinate modulo 3; magenta where it has no visible fragment.
        ClusterIndex = "cluster-index": "Places of clusters in their grid, modulo 3; magenta where none was marked",
        /// Lights of the pixel's cluster or tile, as a logarithmic heat map.
        ClusterLights = "cluster-lights": "Lights of a pixel's cluster or tile, as a logarithmic heat map",
        /// Visible fragments of the pixel's cluster, as a logarithmic heat map; magenta where there are none.
        ClusterFragments = "cluster-fragments":
            "Visible fragments of a pixel's cluster, as a logarithmic heat map; magenta where none",
        /// Shadow rays a pixel, as a heat map.
        RayCount = "ray-count": "Shadow rays of a pixel, as a heat map",
        /// Share of listed lights that reach the pixel.
        Visibility = "visibility": "Share of a pixel's listed lights that reach it",
        /// How far what a pixel shows has come since the frame before: the hue is the direction, the brightness the distance.
        Motion = "motion": "How far things move from frame to frame: hue is direction, brightness distance",
        /// How open a surface is to its environment: white where nothing occludes.
        Occlusion = "occlusion": "How open a surface is to its environment; needs `occlusion`",
        /// Light from other surfaces, and from the environment where rays see them, on surfaces without colours; half of white is 1 nit.
        Indirect = "indirect": "Light from other surfaces on white ones, half of white is 1 nit; needs `indirect`",
        /// Magenta where the radiance is not finite, grey elsewhere.
        Nan = "nan": "Magenta where the result is not a number",
    }
}

named_enum! {
    /// Samples a pixel at edges of triangles (multisample antialiasing).
    Samples {
        /// One.
        One = "1": "One",
        /// Two, where the adapter has it.
        Two = "2": "Two, where the adapter has it",
        /// Four: on every adapter.
        Four = "4": "Four, on every adapter",
        /// Eight, where the adapter has it.
        Eight = "8": "Eight, where the adapter has it",
    }
}

impl Samples {
    /// The number.
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
    /// How material textures reach the shader.
    TextureBinding {
        /// `array` on hardware that has it, else `per-material`.
        Auto = "auto": "array on hardware that has it",
        /// One array of all textures, chosen by index.
        Array = "array": "All textures bound at once, chosen by index",
        /// A bind group for every material: works everywhere.
        PerMaterial = "per-material": "Bound material by material: works everywhere",
    }
}

named_enum! {
    /// Samples along the long axis of a pixel's footprint in a texture, at most.
    Anisotropy {
        /// 16 on hardware, 4 on a software adapter, 1 on one that stalls on more.
        Auto = "auto": "16 on hardware, 4 on a software adapter, 1 on one that stalls on more",
        /// None: the footprint's long axis decides, and the texture is blurred across it.
        X1 = "1": "Blurs what is seen at an angle",
        /// Two.
        X2 = "2": "A little sharper",
        /// Four.
        X4 = "4": "Almost as sharp as 16, at a lower price",
        /// Eight.
        X8 = "8": "Hardly to be told from 16",
        /// Sixteen.
        X16 = "16": "Sharpest",
    }
}

impl Anisotropy {
    /// The number; none where the adapter decides.
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
    fn names_are_read_back_and_others_are_refused_with_the_list() {
        for attenuation in Attenuation::ALL {
            assert_eq!(attenuation.name().parse::<Attenuation>(), Ok(*attenuation));
        }
        // Of two of one name the second could not be asked for.
        for shadows in Shadows::all() {
            assert_eq!(shadows.name().parse::<Shadows>(), Ok(shadows));
        }
        assert!("16px".parse::<TileSize>().unwrap_err().contains("8, 16, 32"));
    }
}
