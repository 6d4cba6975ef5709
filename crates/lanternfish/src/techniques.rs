//! The list of all techniques of this crate, and the help text of each kind.

pub use crate::{
    denoise::{IndirectClamp, IndirectResolution},
    direct_light::sampled::{Denoise, LightSamples, SampledLights},
    indirect::{
        radiance_cache::Bounces,
        sampled::{HitLight, Sampled, probes::Probes},
    },
    light_culling::{
        TileSize,
        clustered::{Assignment, Clustered, Grouping, grid::ClusterShape},
        tiled::Tiled,
    },
};
use crate::{
    direct_light::{Direct, DirectTechnique},
    error::RenderError,
    indirect::{CausticTechnique, Indirect, IndirectTechnique, Quality},
    light_culling::{
        CullingTechnique, LightCullingPasses,
        clustered::{GridContents, contents::contents_of_grids},
        tiled::{TileContents, contents::tiles_of_views},
    },
    occlusion::OcclusionTechnique,
    rays::{OwnTracers, Tracer},
    renderer::Renderer,
    shaders::Shaders,
    technique::{AnyTechnique, Choice, Kind, Registry},
};

impl Kind for dyn CullingTechnique {
    const FLAG: &'static str = "culling";
    const HELP: &'static str = "Light culling. The image does not depend on it.";
    const IS_EVERYDAY: bool = false;
    const NONE_NAME: &'static str = "all";
    const NONE_SUMMARY: &'static str = "Every light for every pixel: the baseline";

    fn default_choice() -> Choice<Self> {
        Clustered::default().into()
    }

    fn registry() -> &'static Registry<Self> {
        static REGISTRY: Registry<dyn CullingTechnique> =
            Registry::new(|| vec![Tiled::default().into(), Clustered::default().into()]);
        &REGISTRY
    }
}

impl Renderer {
    /// Contents of the last frame's clusters, one item per grid ([`Grouping`]), read back from the device for
    /// measurements. Empty before the first frame, and without [`Clustered`].
    #[doc(hidden)]
    pub fn cluster_contents(&self) -> Result<Vec<GridContents>, RenderError> {
        self.culled(contents_of_grids)
    }

    /// Light counts of the last frame's tiles for each of its views, read back from the device. Empty before the first
    /// frame, and without [`Tiled`].
    #[doc(hidden)]
    pub fn tile_contents(&self) -> Result<Vec<TileContents>, RenderError> {
        self.culled(tiles_of_views)
    }

    /// What `read` finds in the light culling passes, if they are of this type.
    fn culled<P: LightCullingPasses, T>(
        &self,
        read: fn(&P, &wgpu::Device, &wgpu::Queue) -> Result<Vec<T>, RenderError>,
    ) -> Result<Vec<T>, RenderError> {
        let passes = self.passes.light_culling.passes();
        passes.map_or(Ok(Vec::new()), |passes| read(passes, &self.device, &self.queue))
    }
}

impl Kind for dyn DirectTechnique {
    const FLAG: &'static str = "direct";
    const HELP: &'static str =
        "Direct light: which lights get shadow rays.\n\nDefault: all, or sampled with `quality realtime`.";
    const IS_EVERYDAY: bool = false;
    const HAS_ONE_DEFAULT: bool = false;
    const NONE_NAME: &'static str = "all";
    const NONE_SUMMARY: &'static str = "A shadow ray to every listed light of a pixel: the baseline";

    fn default_choice() -> Choice<Self> {
        Choice::NONE
    }

    fn registry() -> &'static Registry<Self> {
        static REGISTRY: Registry<dyn DirectTechnique> = Registry::new(|| vec![SampledLights::default().into()]);
        &REGISTRY
    }
}

impl Direct {
    /// A fixed number of shadow rays a pixel, for any number of lights.
    #[doc(hidden)]
    pub fn sampled() -> Self {
        SampledLights::default().into()
    }
}

impl Kind for dyn IndirectTechnique {
    const FLAG: &'static str = "indirect";
    const HELP: &'static str = "Indirect light.\n\nDefault: sampled, or probes with `quality draft`. \
                                Light from other surfaces, emission and the environment.";
    const IS_EVERYDAY: bool = true;
    const HAS_ONE_DEFAULT: bool = false;
    const NONE_NAME: &'static str = "none";
    const NONE_SUMMARY: &'static str = "Direct light only";

    fn default_choice() -> Choice<Self> {
        Sampled::default().into()
    }

    fn registry() -> &'static Registry<Self> {
        static REGISTRY: Registry<dyn IndirectTechnique> =
            Registry::new(|| vec![Sampled::default().into(), Probes::default().into()]);
        &REGISTRY
    }
}

impl Indirect {
    /// The technique of a quality.
    #[doc(hidden)]
    pub fn preset(quality: Quality) -> Self {
        match quality {
            Quality::Draft => Probes::of(quality).into(),
            Quality::Good | Quality::Best => quality.sampled().into(),
        }
    }
}

impl Kind for dyn CausticTechnique {
    const FLAG: &'static str = "caustics";
    const HELP: &'static str = "Light that mirrors throw onto other surfaces, if `indirect` is none or virtual-lights.";
    const IS_EVERYDAY: bool = false;
    const NONE_NAME: &'static str = "none";
    const NONE_SUMMARY: &'static str = "What `indirect` finds of it";

    fn default_choice() -> Choice<Self> {
        Choice::NONE
    }

    fn registry() -> &'static Registry<Self> {
        static REGISTRY: Registry<dyn CausticTechnique> = Registry::new(Vec::new);
        &REGISTRY
    }
}

impl Kind for dyn OcclusionTechnique {
    const FLAG: &'static str = "occlusion";
    const HELP: &'static str = "Ambient visibility: how the visible fraction of the environment (`sky`, `environment`) is computed, \
                                which then lights surfaces; with `indirect none`.";
    const IS_EVERYDAY: bool = false;
    const NONE_NAME: &'static str = "none";
    const NONE_SUMMARY: &'static str = "No ambient visibility: the environment lights nothing";

    fn default_choice() -> Choice<Self> {
        Choice::NONE
    }

    fn registry() -> &'static Registry<Self> {
        static REGISTRY: Registry<dyn OcclusionTechnique> = Registry::new(Vec::new);
        &REGISTRY
    }
}

/// The shaders of every folder: those of each registered technique, and all others.
pub fn shaders() -> Vec<Shaders> {
    fn of<K: Kind + ?Sized>() -> impl Iterator<Item = Shaders> {
        Choice::<K>::all().into_iter().filter_map(|choice| choice.technique().map(AnyTechnique::shaders))
    }
    let techniques = of::<dyn CullingTechnique>()
        .chain(of::<dyn DirectTechnique>())
        .chain(of::<dyn IndirectTechnique>())
        .chain(of::<dyn CausticTechnique>())
        .chain(of::<dyn OcclusionTechnique>());
    FOLDERS.iter().copied().chain(techniques).collect()
}

impl OwnTracers for Tracer {
    fn own() -> Vec<Tracer> {
        vec![Tracer::BVH, Tracer::RAY_QUERY, Tracer::TWO_LEVEL]
    }
}

/// The shaders of every folder that is not a technique.
const FOLDERS: &[Shaders] = &[
    crate::view::DECLARED,
    crate::gpu_scene::DECLARED,
    crate::gpu_scene::moving::DECLARED,
    crate::lights::DECLARED,
    crate::prepass::DECLARED,
    crate::aovs::DECLARED,
    crate::light_culling::DECLARED,
    crate::indirect::radiance_cache::DECLARED,
    crate::rays::DECLARED,
    crate::environment_light::DECLARED,
    crate::denoise::smoothing::DECLARED,
    crate::denoise::history::DECLARED,
    crate::occlusion::DECLARED,
    crate::shadows::DECLARED,
    crate::shading::DECLARED,
    crate::sky::DECLARED,
    crate::progressive::DECLARED,
    crate::antialiasing::DECLARED,
    crate::output::DECLARED,
    crate::debug_views::DECLARED,
];
