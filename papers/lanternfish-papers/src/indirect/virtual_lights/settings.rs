//! Settings of virtual lights.

use lanternfish::{
    RenderError,
    denoise::{
        IndirectClamp, IndirectResolution,
        smoothing::{CLAMP, FILTER, RESOLUTION},
    },
    gpu_scene::Parts,
    indirect::{IndirectPasses, IndirectTechnique, Quality},
    parameters,
    rays::{Structure, Tracer},
    settings::{Attenuation, Settings, Shadows},
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
    techniques::Bounces,
};

use super::{DECLARED, Emission, MapSize, MapSource, RangeAxis, Ranges, Residual, VirtualLightPasses};
use crate::PaperImages;

parameters! {
    /// Virtual point lights on the surfaces that the scene's lights hit, each with a range [Archer2019, §3.2].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct VirtualLights {
        /// Texels along an edge of the light map from which virtual lights are made; all lights share it. Larger: more
        /// virtual lights, slower.
        map: MapSize = MapSize::Texels256, "vpl-map" "TEXELS" Range::Numbers, with_default;
        /// Source of the light map.
        source: MapSource = MapSource::Rays, "vpl-source" "NAME" Range::Names, with_default;
        /// Merges texels of the light map that lie close together.
        unique: bool = true, "vpl-unique" "on|off"
            Range::Switch("Fewer lights, evenly spread over surfaces", "A light a texel"), with_default;
        /// Distance between virtual lights below which texels of their map are merged, as a fraction of the scene's
        /// radius. Larger: fewer lights, coarser light.
        spacing: f32 = 0.02, "vpl-spacing" "FRACTION" Range::Positive, with_default;
        /// Number of virtual lights, of equal flux, selected from the light map; 0: all. More: less coarse, slower.
        /// Default: 4096; with `quality best` 16384.
        count: u32 = 4096, "vpl-count" "N" Range::Count(0, 4_194_304);
        /// A pixel evaluates every Nth listed virtual light, its neighbours the others. More: faster, noisier.
        stride: u32 = 16, "vpl-stride" "N" Range::Count(1, 64), with_default;
        /// Ranges of virtual lights.
        ranges: Ranges = Ranges::Average, "vpl-ranges" "NAME" Range::Names, with_default;
        /// Axis of the rays that measure ranges.
        axis: RangeAxis = RangeAxis::Normal, "vpl-axis" "NAME" Range::Names, with_default;
        /// Tracer of these rays.
        range_tracer: Tracer = crate::deep_images::WITHIN_TEXEL,
            "vpl-range-tracer" "NAME" Range::Names, with_default;
        /// Deep images for the rays that measure ranges, if their tracer needs some.
        images: PaperImages = PaperImages::Shared, "vpl-images" "NAME" Range::Names, with_default;
        /// Deep images for shadow rays to virtual lights, if their tracer needs some.
        shadow_images: PaperImages = PaperImages::Shared, "vpl-shadow-images" "NAME" Range::Names, with_default;
        /// Range below which a virtual light is dropped, as a fraction of the scene's radius. Larger: fewer lights,
        /// darker corners.
        least_range: f32 = 0.005, "vpl-least-range" "FRACTION" Range::Positive, with_default;
        /// Range above which only some virtual lights are kept, as a fraction of the scene's radius; random ranges end
        /// there. Smaller: fewer lights per pixel.
        most_range: f32 = 0.5, "vpl-most-range" "FRACTION" Range::Positive, with_default;
        /// Percentage of virtual lights with a range above `vpl-most-range` that are kept. More: more lights per pixel.
        large_kept: u32 = 100, "vpl-large-kept" "PERCENT" Range::Count(0, 100), with_default;
        /// Distance attenuation of virtual lights.
        falloff: Attenuation = Attenuation::Gltf, "vpl-falloff" "NAME" Range::Names, with_default;
        /// Angular emission of a virtual light.
        emission: Emission = Emission::Cosine, "vpl-emission" "NAME" Range::Names, with_default;
        /// Minimum distance to a virtual light in its inverse-square law, m. Larger: darker corners, no spots. Without
        /// it, a light counts as a disk of the area that it represents.
        least_distance: Option<f32> = None, "vpl-least-distance" "METRES" Range::Positive;
        /// Flux beyond the ranges of virtual lights.
        residual: Residual = Residual::FarLights, "vpl-residual" "NAME" Range::Names, with_default;
        /// Number of virtual lights without a range that carry the flux beyond ranges, with `vpl-residual far-lights`.
        /// More: smoother, slower.
        far_lights: u32 = 512, "vpl-far-lights" "N" Range::Count(1, 4096), with_default;
        /// Weighs a pixel's light by N over the number of virtual lights that reach it, so that pixels that many lights
        /// reach are no brighter than others; 0: unweighted. Larger: brighter.
        weight_count: u32 = 0, "vpl-weight" "N" Range::Count(0, 65536), with_default;
        /// Tracer of shadow rays to virtual lights.
        shadows: Shadows = Shadows::Auto, "vpl-shadows" "NAME" Range::Names, with_default;
        /// Shadow rays per pixel to virtual lights. More: less noise, slower. Default: 4; with `quality best` 12.
        shadow_rays: u32 = 4, "vpl-shadow-rays" "N" Range::Count(1, 256);
        /// Glossy rays per pixel, traced as the shadow rays, whose hits are shaded [Niessner2010, §5]: they find the
        /// glossy light. More: less noise, slower. 0: virtual lights are reflected.
        glossy_rays: u32 = 0, "vpl-glossy-rays" "N" Range::Count(0, 256), with_default;
        /// Lists of virtual lights.
        grid: bool = false, "vpl-grid" "on|off" Range::Switch(
            "A raster grid of their own, as in Archer 2019",
            "The `culling` of the scene's lights",
        ), with_default;
        /// Resolution of indirect light.
        resolution: IndirectResolution = IndirectResolution::Full => RESOLUTION;
        /// Radius of the filter in an image of one frame, pixels, up to 64; 0: no filter.
        filter_radius: u32 = 8 => FILTER;
        /// True if what a pixel's rays bring is bounded by what those of the pixels around it do.
        clamp: IndirectClamp = IndirectClamp::On => CLAMP;
    }
}

impl Technique for VirtualLights {
    const NAME: &'static str = "virtual-lights";
    const SUMMARY: &'static str =
        "Point lights on the surfaces that the scene's lights hit, each with a range: one bounce";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl IndirectTechnique for VirtualLights {
    fn bounces(&self) -> Option<Bounces> {
        Some(Bounces::ONE)
    }

    fn spend(&mut self, quality: Quality) {
        let (count, shadow_rays, resolution) = match quality {
            Quality::Draft => (4096, 4, IndirectResolution::Half),
            Quality::Good => (4096, 4, IndirectResolution::Full),
            Quality::Best => (16384, 12, IndirectResolution::Full),
        };
        (self.count, self.shadow_rays, self.resolution) = (count, shadow_rays, resolution);
        self.clamp = if quality == Quality::Best { IndirectClamp::Off } else { IndirectClamp::On };
    }

    fn parts(&self) -> Parts {
        Parts::HITS | Parts::BVH
    }

    fn tracers(&self) -> Vec<Tracer> {
        let shadows = match self.shadows {
            Shadows::Traced(tracer) => Some(tracer),
            Shadows::Auto | Shadows::None => None,
        };
        self.traces_ranges().then_some(self.range_tracer).into_iter().chain(shadows).collect()
    }

    fn structures(&self, settings: &Settings) -> Vec<Structure> {
        let ranges = self.traces_ranges().then(|| self.range_tracer.structure(&self.images.structure(settings)));
        let shadows = match self.shadows {
            Shadows::Traced(tracer) => Some(tracer.structure(&self.shadow_images.structure(settings))),
            Shadows::Auto | Shadows::None => None,
        };
        ranges.into_iter().chain(shadows).collect()
    }

    fn sees_environment(&self) -> bool {
        false
    }

    /// A drawn map keeps what mirrors reflect.
    fn leaves_caustics(&self) -> bool {
        self.source == MapSource::Rays
    }

    fn for_transparent(&mut self) {
        self.range_tracer = self.range_tracer.exact();
        if let Shadows::Traced(tracer) = &mut self.shadows {
            *tracer = tracer.exact();
        }
        (self.resolution, self.glossy_rays) = (IndirectResolution::Full, 0);
    }

    fn build(
        &self,
        device: &wgpu::Device,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        Ok(Box::new(VirtualLightPasses::new(device, *self, settings, tracer)?))
    }
}

impl VirtualLights {
    /// True if rays are traced for every light: for its range, or for the loss that it causes.
    pub(super) fn traces_ranges(&self) -> bool {
        matches!(self.ranges, Ranges::Average | Ranges::Maximum) || self.residual != Residual::Lost
    }
}
