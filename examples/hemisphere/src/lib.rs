//! A technique of indirect light that is no part of the library: hemisphere lighting.
//!
//! It uses the interface of `lanternfish` alone. A program makes it known in one line, [`register`]; from then on `--indirect hemisphere`
//! with its two parameters is in help, in the window's panel, in shots and in `doctor`. A program that fills in
//! [`Settings::indirect`](lanternfish::Settings::indirect) itself need not register it.

use lanternfish::{
    DemodulatedIrradiance, Indirect, IndirectPasses, IndirectTechnique, Package, RenderError, Root, Settings, Shaders,
    Surface, Tracer, ViewContext, layers_target,
    technique::{Parameter, Range, Technique},
};
use lanternfish_gpu::{ComputeKernel, Frame, SharedStruct, gpu_struct, uniform_buffer_of};

static SHADERS: Package = Package::new(&[("hemisphere/find", include_str!("find.wesl"))]);

/// Light of a sky above and of a ground below, by a surface's normal: cheap, and blind to everything between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hemisphere {
    /// Radiance from above, nits, > 0.
    pub sky: f32,
    /// Radiance from below, nits, > 0.
    pub ground: f32,
}

impl Default for Hemisphere {
    fn default() -> Self {
        Self { sky: 1.0, ground: 0.3 }
    }
}

/// Makes it known by name to whatever reads or lists names.
pub fn register() {
    Indirect::from(Hemisphere::default()).register();
}

impl Technique for Hemisphere {
    const NAME: &'static str = "hemisphere";
    const SUMMARY: &'static str = "Light of a sky above and of a ground below, by a surface's normal";
    const PARAMETERS: &'static [Parameter<Self>] = &[
        Parameter::new("hemisphere-sky", "NITS", Range::Positive, "Radiance from above, nits", |h| &mut h.sky),
        Parameter::new("hemisphere-ground", "NITS", Range::Positive, "Radiance from below, nits", |h| &mut h.ground),
    ];
    const SHADERS: Shaders =
        Shaders::of(&SHADERS, &[Root::new("hemisphere/find")], &[SharedStruct::of::<HemisphereParameters>()]);
}

impl IndirectTechnique for Hemisphere {
    fn build(
        &self,
        device: &wgpu::Device,
        _settings: &Settings,
        _tracer: Option<Tracer>,
    ) -> Result<Box<dyn IndirectPasses>, RenderError> {
        let shader = Self::SHADERS.link("hemisphere/find", &[])?;
        let parameters = HemisphereParameters { sky: self.sky, ground: self.ground };
        Ok(Box::new(HemispherePasses {
            find: ComputeKernel::new(device, &shader, "find", "indirect/hemisphere"),
            parameters: uniform_buffer_of(device, "indirect/hemisphere", &parameters),
        }))
    }
}

gpu_struct! {
    /// The parameters on the device.
    pub struct HemisphereParameters {
        /// Radiance from above, nits.
        sky: f32,
        /// Radiance from below, nits.
        ground: f32,
    }
}

/// The pass.
#[derive(Debug)]
struct HemispherePasses {
    find: ComputeKernel,
    parameters: wgpu::Buffer,
}

impl IndirectPasses for HemispherePasses {
    fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        surface: &Surface,
    ) -> Result<DemodulatedIrradiance, RenderError> {
        let layers = layers_target(frame, surface.size);
        let [width, height, _] = self.find.workgroup_size();
        let groups = [surface.size.x.div_ceil(width), surface.size.y.div_ceil(height), 1];
        let bindings = view.buffer.bindings().with(&surface.bindings());
        let bindings = bindings.buffer("hemisphere", &self.parameters).texture("found_layers", &layers);
        frame.dispatch(&self.find, &bindings, groups);
        Ok(DemodulatedIrradiance::new(layers))
    }
}

/// The code in the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// The code in the guide compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/6-in-your-program.md")]
struct Guide;
