//! Light at the nearest transparent surface of every pixel, computed by the same techniques as for opaque surfaces. Transparent surfaces
//! behind it use the same light, so at the rim of a vase, where both walls mirror most, both mirror the same.

use lanternfish_gpu::Frame;

use super::Arriving;
use crate::{
    context::ViewContext,
    error::RenderError,
    indirect::{self, IndirectPasses},
    occlusion::{self, OcclusionPasses},
    prepass::Prepass,
    rays::Tracer,
    settings::{History, Settings},
};

/// Compiled for the first transparent surface.
#[derive(Debug)]
pub(crate) struct NearestTransparent {
    settings: Settings,
    tracer: Option<Tracer>,
    passes: Option<Passes>,
}

#[derive(Debug)]
struct Passes {
    prepass: Prepass,
    occlusion: Option<Box<dyn OcclusionPasses>>,
    indirect: Option<Box<dyn IndirectPasses>>,
}

impl NearestTransparent {
    /// Glass is smooth: rays are traced through the BVH, from every pixel, with at least one about the mirror direction.
    pub fn new(settings: &Settings, tracer: Option<Tracer>) -> Self {
        let mut settings = Settings { history: History::Off, ..settings.clone() };
        if let Some(technique) = settings.indirect.technique_mut() {
            technique.for_transparent();
        }
        Self { settings, tracer, passes: None }
    }

    /// Computes the light at the transparent surfaces of a view.
    pub fn record(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>) -> Result<Arriving, RenderError> {
        let Passes { prepass, occlusion, indirect } = match &mut self.passes {
            Some(passes) => passes,
            none => none.insert(Passes {
                prepass: Prepass::of_transparent(),
                // Rays of indirect light may reach the environment themselves.
                occlusion: match self.settings.indirect.sees_environment() {
                    false => occlusion::passes(frame.device, &self.settings)?,
                    true => None,
                },
                indirect: indirect::passes(frame.device, &self.settings, self.tracer)?,
            }),
        };
        let surface = prepass.record_transparent(frame, view)?;
        let ambient_visibility = occlusion.as_mut().map(|passes| passes.record(frame, view, &surface)).transpose()?;
        let indirect = indirect.as_mut().map(|passes| passes.record(frame, view, &surface)).transpose()?;
        Ok(Arriving { surface, ambient_visibility, indirect, direct: None })
    }
}
