//! Ambient obscurance by horizons in the view's depth buffer [Bavoil2008; Jimenez2016]: the screen-space baseline.

use lanternfish::{
    RenderError, ViewContext,
    environment_light::irradiance_target,
    occlusion::{
        AmbientVisibility, OcclusionPasses, OcclusionTechnique, TILE, ambient_visibility_target,
        by_normal::LightByNormal,
    },
    parameters,
    prepass::Surface,
    settings::Settings,
    shaders::{Root, Shaders},
    technique::{Parameter, Range, Technique},
};
use lanternfish_gpu::{ComputeKernel, Feature, Frame, SharedStruct, gpu_struct, uniform_buffer_of};

use super::DISTANCE;

gpu_struct! {
    /// Parameters of the horizon search.
    pub struct HbaoParameters {
        /// Maximum distance of occluders, m.
        radius: f32,
        /// Distance between samples, pixels, if their number depends on the radius.
        step: f32,
    }
}

/// The number of samples grows with the radius in the image [Aalund2015, §5.1].
const STEPS_BY_RADIUS: Feature = Feature::new("steps_by_radius");

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::of(
    &crate::shaders::SHADERS,
    &[Root::of("occlusion/hbao/horizon", &[&[&[], &[STEPS_BY_RADIUS]]]), Root::new("occlusion/hbao/blur")],
    &[SharedStruct::of::<HbaoParameters>()],
);

parameters! {
    /// Ambient obscurance by horizons in the view's depth buffer: a baseline for comparison [Bavoil2008; Jimenez2016].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Hbao {
        /// Largest distance of occluders, m, > 0. Higher: darker, and more error from occluders outside the view.
        radius: f32 = 1.0 => DISTANCE;
        /// Distance between depth samples, pixels: their number grows with the distance of occluders [Aalund2015,
        /// §5.1]. Higher: faster, and thin occluders are missed. Without it: 12 samples to each side for any distance.
        step: Option<f32> = None, "occlusion-step" "PIXELS" Range::Positive;
    }
}

impl Technique for Hbao {
    const NAME: &'static str = "hbao";
    const SUMMARY: &'static str = "Horizons in the depth buffer: the visible scene, for comparison";
    const PARAMETERS: &'static [Parameter<Self>] = Self::ROWS;
    const SHADERS: Shaders = DECLARED;
}

impl OcclusionTechnique for Hbao {
    fn max_distance(&self) -> Option<f32> {
        Some(self.radius)
    }

    fn build(&self, device: &wgpu::Device, _settings: &Settings) -> Result<Box<dyn OcclusionPasses>, RenderError> {
        Ok(Box::new(HbaoOcclusion::new(device, self)?))
    }
}

/// The passes.
#[derive(Debug)]
struct HbaoOcclusion {
    horizons: ComputeKernel,
    blur_across: ComputeKernel,
    blur_down: ComputeKernel,
    light: LightByNormal,
    parameters: wgpu::Buffer,
}

impl HbaoOcclusion {
    /// Compiles the passes.
    fn new(device: &wgpu::Device, &Hbao { radius, step }: &Hbao) -> Result<Self, RenderError> {
        let by_radius = step.map(|_| STEPS_BY_RADIUS);
        let horizon = DECLARED.link("occlusion/hbao/horizon", by_radius.as_slice())?;
        let blur = DECLARED.link("occlusion/hbao/blur", &[])?;
        Ok(Self {
            horizons: ComputeKernel::new(device, &horizon, "horizons", "occlusion/hbao/horizons"),
            blur_across: ComputeKernel::new(device, &blur, "blur_across", "occlusion/hbao/blur_across"),
            blur_down: ComputeKernel::new(device, &blur, "blur_down", "occlusion/hbao/blur_down"),
            light: LightByNormal::new(device)?,
            parameters: uniform_buffer_of(
                device,
                "occlusion/hbao",
                &HbaoParameters { radius, step: step.unwrap_or_default() },
            ),
        })
    }
}

impl OcclusionPasses for HbaoOcclusion {
    /// Writes the ambient visibility of every pixel from the depth around it, and that fraction of the environment's
    /// light.
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<AmbientVisibility, RenderError> {
        let [raw, across, down] = std::array::from_fn(|_| ambient_visibility_target(frame, surface.size));
        let groups = [surface.size.x.div_ceil(TILE), surface.size.y.div_ceil(TILE), 1];
        let view_bindings = view.buffer.bindings();
        let shared = view_bindings.with(&surface.bindings());
        let bindings =
            shared.clone().buffer("hbao_parameters", &self.parameters).texture("ambient_visibility_target", &raw);
        frame.dispatch(&self.horizons, &bindings, groups);
        for (kernel, from, to) in [(&self.blur_across, &raw, &across), (&self.blur_down, &across, &down)] {
            let bindings =
                shared.clone().texture("unblurred_visibility", from).texture("ambient_visibility_target", to);
            frame.dispatch(kernel, &bindings, groups);
        }
        let environment_irradiance = irradiance_target(frame, surface.size);
        let ambient_visibility = AmbientVisibility { texture: down, environment_irradiance, counters: Vec::new() };
        self.light.record(frame, view, surface, &ambient_visibility);
        Ok(ambient_visibility)
    }
}
