//! Virtual point lights, each with its own range [Archer2019, §3.2; Keller1997; Dachsbacher2005].
//!
//! 1. Map: the surfaces that the scene's lights see, one per texel (`light_views/`, `trace.wesl`); texels that lie close together are
//!    merged (`merge.wesl`).
//! 2. Ranges: six rays from every texel's surface (`range_rays.wesl`); lights with too small or too large a range are dropped
//!    (`ranges.wesl`); the others are compacted in order (`scatter.wesl`).
//! 3. Lists: light culling assigns lights to pixels, with the technique that the settings name.
//! 4. Gather: their light is added up (`gather.wesl`), or some are selected for each pixel and traced (`shadow.wesl`).
//! 5. The result is bounded, filtered and added to the image (`denoise/smoothing/` of the library).

mod builder;
mod choices;
mod draw;
mod parameters;
mod settings;
#[cfg(test)]
mod tests;

use lanternfish::{
    RenderError, ViewContext,
    denoise::{
        IndirectClamp,
        smoothing::{MOST_RADIUS, PixelIrradiance, Smoothed, Smoothing},
    },
    gpu_scene::{MASKED, TEXTURES},
    indirect::{DemodulatedIrradiance, IndirectPasses, IndirectTechnique as _},
    light_culling::{LightCulling, Reach},
    prepass::Surface,
    rays::{self, TracePass, Tracer},
    settings::{Materials, Settings, Shadows},
    shaders::{Root, Shaders},
    techniques::Sampled,
};
use lanternfish_gpu::{ComputeKernel, Feature, Frame, SharedStruct};

use self::{
    builder::LightBuilder,
    parameters::{LightRange, Texel, VirtualLightParameters},
};
pub use self::{
    choices::{Emission, MapSize, MapSource, RangeAxis, Ranges, Residual},
    settings::VirtualLights,
};
use super::layers::{GLOSSY_LAYERS, LayerSum};
use crate::RasterGrid;

/// Lights are selected for shadow rays instead of being added up.
const SHADOWED: Feature = Feature::new("shadowed");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::of(
    &crate::shaders::SHADERS,
    &[
        Root::of("indirect/virtual_lights/draw", &[&[&[], &[MASKED]], TEXTURES]),
        Root::new("indirect/virtual_lights/reconstruct"),
        Root::computed("indirect/virtual_lights/trace", rays::exact_tracers),
        Root::new("indirect/virtual_lights/merge"),
        Root::new("indirect/virtual_lights/thin"),
        Root::computed("indirect/virtual_lights/range_rays", || rays::every_tracer(false)),
        Root::new("indirect/virtual_lights/ranges"),
        Root::new("indirect/virtual_lights/scatter"),
        Root::computed("indirect/virtual_lights/gather", || {
            let schemes = LightCulling::every_feature().into_iter();
            schemes.flat_map(|scheme| [vec![scheme], vec![scheme, SHADOWED]]).collect()
        }),
        Root::computed("indirect/virtual_lights/shadow", || rays::every_tracer(false)),
    ],
    &[SharedStruct::of::<VirtualLightParameters>(), SharedStruct::of::<Texel>(), SharedStruct::of::<LightRange>()],
);

/// The passes.
#[derive(Debug)]
pub struct VirtualLightPasses {
    settings: VirtualLights,
    /// Minimum number of frames in the mean of an image.
    frames: u32,
    builder: LightBuilder,
    culling: LightCulling,
    gather: ComputeKernel,
    /// None: virtual lights cast no shadows.
    shadow: Option<TracePass>,
    smoothing: Smoothing,
    /// Rays for the glossy light, if there are any.
    glossy: Option<(Box<dyn IndirectPasses>, LayerSum)>,
}

impl VirtualLightPasses {
    /// Compiles the passes. `tracer`: the tracer for shadows of the scene's lights, if there are any.
    pub fn new(
        device: &wgpu::Device,
        technique: VirtualLights,
        settings: &Settings,
        tracer: Option<Tracer>,
    ) -> Result<Self, RenderError> {
        check(&technique)?;
        let kernel = |file: &str, features: &[Feature]| {
            let module = format!("indirect/virtual_lights/{file}");
            let shader = DECLARED.link(&module, features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, file, &module))
        };
        let exact = tracer.unwrap_or(Tracer::BVH).exact();
        let shadows = match technique.shadows {
            Shadows::None => None,
            Shadows::Auto => Some(exact),
            Shadows::Traced(tracer) => Some(tracer.check(device, "`vpl-shadows ray-query`", "`vpl-shadows bvh`")?),
        };
        let culling = if technique.grid { RasterGrid::default().into() } else { settings.culling.clone() };
        let mut gather = vec![LightCulling::feature(&culling)];
        gather.extend(shadows.map(|_| SHADOWED));
        let [structure, of_shadows] =
            [technique.images, technique.shadow_images].map(|images| images.structure(settings));
        let shadow = |tracer: Tracer| {
            let kernel = kernel("shadow", &tracer.features(&of_shadows, false))?;
            Ok::<_, RenderError>(TracePass::new(tracer, &of_shadows, kernel))
        };
        let has_glossy_rays = technique.glossy_rays > 0 && settings.materials.model == Materials::File;
        let rays = Sampled {
            diffuse_rays: 1,
            glossy_rays: technique.glossy_rays,
            tracer: shadows.unwrap_or(exact).into(),
            resolution: technique.resolution,
            filter_radius: technique.filter_radius,
            clamp: technique.clamp,
            ..Sampled::default().one_bounce()
        };
        let of_rays = settings.clone().with_structure(of_shadows.clone());
        let glossy =
            || Ok::<_, RenderError>((rays.build(device, &of_rays, tracer)?, LayerSum::new(device, &[GLOSSY_LAYERS])?));
        Ok(Self {
            glossy: has_glossy_rays.then(glossy).transpose()?,
            settings: technique,
            frames: settings.image.accumulate,
            builder: LightBuilder::new(device, technique, settings, &structure, exact)?,
            culling: LightCulling::new(device, &culling, 1)?,
            gather: kernel("gather", &gather)?,
            shadow: shadows.map(shadow).transpose()?,
            smoothing: Smoothing::new(device, settings.history)?,
        })
    }
}

impl IndirectPasses for VirtualLightPasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError> {
        let lights = self.builder.get(frame, view)?;
        // The lit surface is this one, independent of the other surfaces of the view.
        let lit = view.showing(surface);
        let lists = self.culling.record(frame, std::slice::from_ref(&lit), Reach::Surface, &lights.set)?.remove(0);

        let frames = self.frames.max(view.view.frame_index.saturating_add(1));
        let (resolution, radius) = (self.settings.resolution, self.settings.filter_radius);
        // Without shadows and stride each pixel sums all of its light, so there is no noise.
        let (radius, clamp) = match self.shadow.is_some() || self.settings.stride > 1 {
            true => (radius, self.settings.clamp),
            false => (0, IndirectClamp::Off),
        };
        let smoothed = Smoothed::new(radius, clamp == IndirectClamp::On, frames);
        let irradiance = PixelIrradiance::new(frame, surface.size, resolution, smoothed)?;
        let [width, height, _] = self.gather.workgroup_size();
        let groups = [irradiance.size.x.div_ceil(width), irradiance.size.y.div_ceil(height), 1];
        let surfaces = view.buffer.bindings().with(&surface.bindings());
        let uniform = frame.uniform(&lights.parameters);
        let scene_bindings = view.scene.bindings();
        let lit = scene_bindings.with(&surfaces).with(&irradiance.bindings()).with(&lights.set.bindings());
        let lit = lit.part("virtual_lights", &uniform).buffer("pixel_irradiance", &irradiance.irradiance);
        let gathering = lit.clone().with(&lists.bindings());
        match &self.shadow {
            None => frame.dispatch(&self.gather, &gathering, groups),
            Some(shadow) => {
                let pixels = u64::from(irradiance.size.x) * u64::from(irradiance.size.y);
                let words = pixels * (u64::from(self.settings.shadow_rays) + 1);
                let limit = frame.device.limits().max_storage_buffer_binding_size / 4;
                if words > limit {
                    let remedy = "choose fewer `vpl-shadow-rays`, `indirect-resolution half`, or a smaller image";
                    return Err(RenderError::Overflow { list: "rays to virtual lights", needed: words, limit, remedy });
                }
                let chosen = frame.scratch("indirect/virtual_lights/chosen", 4 * words)?;
                frame.dispatch(&self.gather, &gathering.buffer("chosen_lights", &chosen), groups);
                shadow.dispatch(frame, &view.structures, &lit.buffer("chosen_lights", &chosen), groups);
            }
        }
        let layers = self.smoothing.record(frame, view, surface, &irradiance)?;
        let light = DemodulatedIrradiance::new(layers).with_counters(vec![lights.counters.clone()]);
        let Some((rays, sum)) = &mut self.glossy else { return Ok(light) };
        let reflected = rays.record(frame, view, surface)?;
        Ok(sum.record(frame, surface, [light, reflected]))
    }
}

/// An error if a number is out of range.
fn check(technique: &VirtualLights) -> Result<(), RenderError> {
    let wrong = |needed| Err(RenderError::Together { setting: "`indirect virtual-lights`", needed });
    let are_there = (1..=256).contains(&technique.shadow_rays) && (1..=4096).contains(&technique.far_lights);
    if !are_there || !(1..=64).contains(&technique.stride) {
        return wrong("1 to 256 rays per pixel, 1 to 4096 far lights, and a stride of 1 to 64");
    }
    if technique.filter_radius > MOST_RADIUS || technique.large_kept > 100 {
        return wrong("a filter of at most 64 pixels, and at most 100 percent of large lights");
    }
    let fractions = [technique.spacing, technique.least_range, technique.most_range];
    // NaN is not above 0 either.
    let is_above = |number: &f32| *number > 0.0;
    if !fractions.iter().chain(&technique.least_distance).all(is_above) {
        return wrong("spacing and ranges above 0, and a least distance above 0");
    }
    Ok(())
}
