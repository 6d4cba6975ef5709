//! What the settings' names mean, for `--help`.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lanternfish::settings::{
    Anisotropy, Assignment, Attenuation, ClusterTest, DebugView, DeepBuilder, Grouping, IndirectClamp,
    IndirectResolution, IndirectTracer, Materials, Quality, RayCulling, Samples, Shadows, TextureBinding, TileSize,
    ToneMap,
};
use lanternfish_reference::settings::LightChoice;
use lanternfish_scene::{Viewpoint, rig::LightRig};

/// A setting chosen by name.
pub trait Choice: Copy + Send + Sync + 'static {
    /// What can be chosen, in the order of help.
    fn all() -> &'static [Self];
    /// The name on the command line.
    fn name(self) -> &'static str;
    /// One line of help.
    fn meaning(self) -> &'static str;
}

/// Reads a [`Choice`]; unknown names are refused with the list of known ones.
pub fn choice<T: Choice>() -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(T::all().iter().map(|c| PossibleValue::new(c.name()).help(c.meaning())))
        .map(|name| *T::all().iter().find(|c| c.name() == name).expect("clap lets only known names through"))
}

/// Gives each variant of a named enum of the library its line of help. A new variant does not compile without one.
macro_rules! meanings {
    ($($name:ident { $($variant:ident: $meaning:literal),+ $(,)? })+) => { $(
        impl Choice for $name {
            fn all() -> &'static [Self] {
                Self::ALL
            }
            fn name(self) -> &'static str {
                $name::name(self)
            }
            fn meaning(self) -> &'static str {
                match self { $(Self::$variant => $meaning),+ }
            }
        }
    )+ };
}

meanings! {
    TileSize {
        Px8: "Fewest lights a pixel, most lists",
        Px16: "A good balance",
        Px32: "Fewest lists, most lights a pixel",
    }
    Grouping {
        Individual: "A grid for each view",
        Enclosed: "One grid around all views: lights are assigned once",
    }
    Assignment {
        BruteForce: "Every light is tested against every cluster",
        Hierarchy: "A tree over the lights is walked: for thousands of lights",
    }
    ClusterTest {
        Planes: "Behind none of the cluster's planes: some lights too many",
        PlanesAndBox: "And within reach of the box around it",
    }
    DeepBuilder {
        SinglePass: "All images from one draw of the scene",
        PerTriangle: "By arithmetic from every triangle: exact",
        PerDirection: "A draw for each direction: exact, and slow",
        DepthPeeling: "A draw for each layer of surfaces: the yardstick, slowest",
    }
    Shadows {
        Auto: "The faster one of this adapter",
        None: "No shadows",
        RayQuery: "The adapter's ray-tracing hardware",
        Bvh: "A bounding volume hierarchy in compute, on any adapter",
        DeepImage: "Deep images: as coarse as their texels (--deep-resolution)",
    }
    RayCulling {
        None: "Every listed light gets a ray, even from beyond its range",
        Naive: "Normals from depth, two samples an axis: wrong at edges",
        Improved: "Normals from depth, five samples an axis: wrong only on tiny triangles",
        Surface: "The surface's own normal: exact",
    }
    Attenuation {
        Gltf: "Inverse square, faded out towards the range: glTF's formula",
        Physical: "Inverse square; without end where the file states no range",
        Reduced: "Inverse square, less its value at the range",
        Smooth: "As reduced, with a slope of zero at the range",
        PhysicalReduced1: "As reduced, correct close to the light",
        PhysicalReduced2: "As physical_reduced_1, correct farther out: the same function as gltf",
        PhysicalSmooth1: "As smooth, correct close to the light",
        PhysicalSmooth2: "As physical_smooth_1, correct farther out",
        Linear: "Straight down to the range: for illustration",
        Step: "Constant up to the range: for illustration",
    }
    Materials {
        File: "The file's own metallic-roughness materials",
        Lambert: "Base colour as a two-sided diffuse surface; emission, alpha mask and blending stay",
    }
    ToneMap {
        None: "Clamps to 0..1",
        Neutral: "Keeps colours, compresses highlights only (Khronos PBR Neutral)",
        Reinhard: "x / (1 + x) on luminance: soft",
        Aces: "A fit of the ACES film look: contrasty, warm",
    }
    DebugView {
        Depth: "Distance from the camera; brighter is nearer",
        Normal: "Shading normal",
        GeometricNormal: "The triangle's own normal",
        NormalNaive: "Normal rebuilt from depth, two samples an axis",
        NormalImproved: "Normal rebuilt from depth, five samples an axis",
        Roughness: "Perceptual roughness",
        BaseColor: "Base colour after textures",
        LightCount: "Lights listed for a pixel, as a heat map",
        LightsPerPixel: "Of them, those whose range reaches the pixel, as a logarithmic heat map",
        ClusterIndex: "Places of clusters in their grid, modulo 3; magenta where none was marked",
        ClusterLights: "Lights of a pixel's cluster or tile, as a logarithmic heat map",
        ClusterFragments: "Visible fragments of a pixel's cluster, as a logarithmic heat map; magenta where none",
        RayCount: "Shadow rays of a pixel, as a heat map",
        Visibility: "Share of a pixel's listed lights that reach it",
        Occlusion: "How open a surface is to its surroundings; needs --occlusion",
        Nan: "Magenta where the result is not a number",
    }
    Quality {
        Draft: "4 and 1 rays from every fourth pixel, through the BVH",
        Good: "8 and 4 rays from every pixel, through the BVH",
        Best: "32 and 16 rays from every pixel, through the BVH, none clamped: exact",
    }
    IndirectTracer {
        WithinTexel: "The texel of a deep image that a ray starts in, along the image's axis: fastest, and coarse",
        AcrossTexels: "Every texel of a deep image that a ray crosses",
        Bvh: "The bounding volume hierarchy: exact",
        RayQuery: "The adapter's own acceleration structure: exact",
    }
    IndirectClamp {
        On: "At most the mean of the pixels around whose surfaces are alike, and five standard deviations",
        Off: "It is not: for the mean of many frames",
    }
    IndirectResolution {
        Full: "From every pixel",
        Half: "From every second pixel of every second row: four times fewer rays",
    }
    LightChoice {
        Tree: "By a tree over the lights, those first that send most",
        Uniform: "Each alike: for comparison",
    }
    Viewpoint {
        Front: "From +z, as glTF has it",
        Back: "From -z",
        Left: "From -x, to the left of who looks at the front",
        Right: "From +x",
        Top: "From +y, the front at the bottom",
        Iso: "From +x, +y and +z alike, in perspective",
    }
    LightRig {
        Studio: "Soft boxes and a grey backdrop; in a closed room, a lamp",
        Sun: "A sun over the left shoulder, and a sky",
        None: "None: the scene as it is",
    }
    Anisotropy {
        Auto: "16 on hardware, 4 on a software adapter, 1 on one that stalls on more",
        X1: "Blurs what is seen at an angle",
        X2: "A little sharper",
        X4: "Almost as sharp as 16, at a lower price",
        X8: "Hardly to be told from 16",
        X16: "Sharpest",
    }
    Samples {
        One: "One",
        Two: "Two, where the adapter has it",
        Four: "Four, on every adapter",
        Eight: "Eight, where the adapter has it",
    }
    TextureBinding {
        Auto: "array on hardware that has it",
        Array: "All textures bound at once, chosen by index",
        PerMaterial: "Bound material by material: works everywhere",
    }
}
