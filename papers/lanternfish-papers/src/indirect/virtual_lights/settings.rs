//! Settings of virtual lights.

use lanternfish::{
    RenderError,
    denoise::{
        IndirectClamp, IndirectResolution,
        smoothing::{CLAMP, FILTER, RESOLUTION},
    },
    gpu_scene::Parts,
    indirect::{IndirectPasses, IndirectTechnique, Quality},
    rays::{Structure, Tracer},
    settings::{Attenuation, Settings, Shadows},
    shaders::Shaders,
    technique::{Parameter, Range, Technique},
    techniques::Bounces,
};

use super::{DECLARED, Emission, MapSize, MapSource, RangeAxis, Ranges, Residual, VirtualLightPasses};
use crate::PaperImages;

/// Virtual point lights on the surfaces that the scene's lights hit, each with a range [Archer2019, §3.2].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualLights {
    /// Texels along an edge of the reflective shadow map, which all lights share. Larger: more virtual lights, slower.
    pub map: MapSize,
    /// How the map is computed.
    pub source: MapSource,
    /// True if texels that lie close together become one light.
    pub unique: bool,
    /// Distance between virtual lights on a surface below which texels are merged, as a fraction of the scene's radius, > 0. Larger: fewer
    /// lights, coarser light.
    pub spacing: f32,
    /// Number of lights selected from all, each with an equal fraction of the flux; 0: all. More: less coarse light, slower.
    pub count: u32,
    /// A pixel uses every nth of the lights that reach it, neighbouring pixels the others, 1 to 64. More: faster, noisier.
    pub stride: u32,
    /// The source of a light's range.
    pub ranges: Ranges,
    /// Axis of the rays that measure ranges.
    pub axis: RangeAxis,
    /// Tracer of these rays.
    pub range_tracer: Tracer,
    /// The deep images that they are traced through, if their tracer needs some.
    pub images: PaperImages,
    /// Range below which a light is dropped, as a fraction of the scene's radius, > 0. Larger: fewer lights, darker corners.
    pub least_range: f32,
    /// Range above which only some lights are kept, as a fraction of the scene's radius, > 0; also the maximum of random ranges. Smaller:
    /// fewer lights reach each pixel.
    pub most_range: f32,
    /// Percentage of lights with a range above that which are kept, up to 100. More: more lights reach each pixel.
    pub large_kept: u32,
    /// Attenuation of light at its range.
    pub falloff: Attenuation,
    /// Angular emission of a virtual light.
    pub emission: Emission,
    /// Minimum distance to a virtual light in its inverse-square law, m, > 0. Larger: darker corners, no spots. None: a light counts as a
    /// disk of the area that it represents.
    pub least_distance: Option<f32>,
    /// Treatment of the flux that ranges cut off.
    pub residual: Residual,
    /// Number of lights that carry flux beyond ranges over the whole scene, with [`Residual::FarLights`], 1 to 4096. More: smoother, slower.
    pub far_lights: u32,
    /// If it is not 0, the light of the n virtual lights that reach a pixel is weighted by this number over n, so that pixels that many
    /// lights reach are no brighter than others. Larger: brighter.
    pub weight_count: u32,
    /// Tracer of shadow rays to virtual lights.
    pub shadows: Shadows,
    /// The deep images that shadow rays are traced through, if their tracer needs some.
    pub shadow_images: PaperImages,
    /// Rays per pixel to virtual lights, 1 to 256. More: less noise, slower.
    pub shadow_rays: u32,
    /// Resolution of indirect light.
    pub resolution: IndirectResolution,
    /// Radius of the filter in an image of one frame, pixels, up to 64; 0: no filter.
    pub filter_radius: u32,
    /// True if what a pixel's rays bring is bounded by what those of the pixels around it do.
    pub clamp: IndirectClamp,
}

impl Default for VirtualLights {
    fn default() -> Self {
        Self {
            map: MapSize::Texels256,
            source: MapSource::Rays,
            unique: true,
            spacing: 0.02,
            count: 4096,
            stride: 16,
            ranges: Ranges::Average,
            axis: RangeAxis::Normal,
            range_tracer: crate::deep_images::WITHIN_TEXEL,
            images: PaperImages::Shared,
            shadow_images: PaperImages::Shared,
            least_range: 0.005,
            most_range: 0.5,
            large_kept: 100,
            falloff: Attenuation::Gltf,
            emission: Emission::Cosine,
            least_distance: None,
            residual: Residual::FarLights,
            far_lights: 512,
            weight_count: 0,
            shadows: Shadows::Auto,
            shadow_rays: 4,
            resolution: IndirectResolution::Full,
            filter_radius: 8,
            clamp: IndirectClamp::On,
        }
    }
}

impl Technique for VirtualLights {
    const NAME: &'static str = "virtual-lights";
    const SUMMARY: &'static str =
        "Point lights on the surfaces that the scene's lights hit, each with a range: one bounce";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new(
            "vpl-map",
            "TEXELS",
            Range::Numbers,
            "Texels along an edge of the light map from which virtual lights are made",
            |room: &mut Self| &mut room.map,
        )
        .with_default(),
        Parameter::new("vpl-source", "NAME", Range::Names, "Source of the light map", |room: &mut Self| &mut room.source)
            .with_default(),
        Parameter::new(
            "vpl-unique",
            "on|off",
            Range::Switch("Fewer lights, evenly spread over surfaces", "A light a texel"),
            "Merges texels of the light map that lie close together",
            |room: &mut Self| &mut room.unique,
        )
        .with_default(),
        Parameter::new(
            "vpl-spacing",
            "FRACTION",
            Range::Positive,
            "Distance between virtual lights below which texels of their map are merged, as a fraction of the scene's radius. Larger: fewer \
             lights",
            |s: &mut Self| &mut s.spacing,
        )
        .with_default(),
        Parameter::new(
            "vpl-count",
            "N",
            Range::Count(0, 4_194_304),
            "Number of virtual lights, of equal flux, selected from the light map; 0: all. More: less coarse, slower. \
             Default: 4096; with `quality best` 16384",
            |room: &mut Self| &mut room.count,
        ),
        Parameter::new(
            "vpl-stride",
            "N",
            Range::Count(1, 64),
            "A pixel evaluates every Nth listed virtual light, its neighbours the others. More: faster, noisier",
            |room: &mut Self| &mut room.stride,
        )
        .with_default(),
        Parameter::new("vpl-ranges", "NAME", Range::Names, "Ranges of virtual lights", |room: &mut Self| {
            &mut room.ranges
        })
        .with_default(),
        Parameter::new(
            "vpl-axis",
            "NAME",
            Range::Names,
            "Axis of the rays that measure ranges",
            |room: &mut Self| &mut room.axis,
        )
        .with_default(),
        Parameter::new("vpl-range-tracer", "NAME", Range::Names, "Tracer of these rays", |room: &mut Self| {
            &mut room.range_tracer
        })
        .with_default(),
        Parameter::new(
            "vpl-images",
            "NAME",
            Range::Names,
            "Deep images for the rays that measure ranges",
            |s: &mut Self| &mut s.images,
        )
        .with_default(),
        Parameter::new(
            "vpl-shadow-images",
            "NAME",
            Range::Names,
            "Deep images for shadow rays to virtual lights",
            |s: &mut Self| &mut s.shadow_images,
        )
        .with_default(),
        Parameter::new(
            "vpl-least-range",
            "FRACTION",
            Range::Positive,
            "Range below which a virtual light is dropped, as a fraction of the scene's radius. Larger: fewer lights",
            |room: &mut Self| &mut room.least_range,
        )
        .with_default(),
        Parameter::new(
            "vpl-most-range",
            "FRACTION",
            Range::Positive,
            "Range above which only some virtual lights are kept, as a fraction of the scene's radius; random ranges end there. Smaller: fewer lights per pixel",
            |room: &mut Self| &mut room.most_range,
        )
        .with_default(),
        Parameter::new(
            "vpl-large-kept",
            "PERCENT",
            Range::Count(0, 100),
            "Percentage of virtual lights with a range above `vpl-most-range` that are kept. More: more lights per pixel",
            |room: &mut Self| &mut room.large_kept,
        )
        .with_default(),
        Parameter::new("vpl-falloff", "NAME", Range::Names, "Distance attenuation of virtual lights", |room: &mut Self| {
            &mut room.falloff
        })
        .with_default(),
        Parameter::new(
            "vpl-emission",
            "NAME",
            Range::Names,
            "Angular emission of a virtual light",
            |room: &mut Self| &mut room.emission,
        )
        .with_default(),
        Parameter::new(
            "vpl-least-distance",
            "METRES",
            Range::Positive,
            "Minimum distance to a virtual light in its inverse-square law. Larger: darker corners, no spots. Without it, a light counts as a \
             disk of the area that it represents",
            |s: &mut Self| &mut s.least_distance,
        ),
        Parameter::new(
            "vpl-residual",
            "NAME",
            Range::Names,
            "Flux beyond the ranges of virtual lights",
            |room: &mut Self| &mut room.residual,
        )
        .with_default(),
        Parameter::new(
            "vpl-far-lights",
            "N",
            Range::Count(1, 4096),
            "Number of virtual lights without a range that carry the flux beyond ranges, with `vpl-residual far-lights`. More: smoother, slower",
            |room: &mut Self| &mut room.far_lights,
        )
        .with_default(),
        Parameter::new(
            "vpl-weight",
            "N",
            Range::Count(0, 65536),
            "Weighs a pixel's light by N over the number of virtual lights that reach it; 0: unweighted",
            |s: &mut Self| &mut s.weight_count,
        )
        .with_default(),
        Parameter::new(
            "vpl-shadows",
            "NAME",
            Range::Names,
            "Tracer of shadow rays to virtual lights",
            |room: &mut Self| &mut room.shadows,
        )
        .with_default(),
        Parameter::new(
            "vpl-shadow-rays",
            "N",
            Range::Count(1, 256),
            "Shadow rays per pixel to virtual lights. More: less noise, slower. Default: 4; with `quality best` 12",
            |room: &mut Self| &mut room.shadow_rays,
        ),
        Parameter { info: RESOLUTION, of: |s| &mut s.resolution },
        Parameter { info: FILTER, of: |s| &mut s.filter_radius },
        Parameter { info: CLAMP, of: |s| &mut s.clamp },
    ];
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

    fn for_transparent(&mut self) {
        self.range_tracer = self.range_tracer.exact();
        if let Shadows::Traced(tracer) = &mut self.shadows {
            *tracer = tracer.exact();
        }
        self.resolution = IndirectResolution::Full;
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
