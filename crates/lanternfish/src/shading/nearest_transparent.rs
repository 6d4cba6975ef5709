//! What arrives at the nearest blended surface of every pixel: what is found for opaque surfaces, found again. Those behind it take
//! the same; at the rim of a vase, where both of its walls mirror most, both mirror the same.

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

/// Compiled when the first blended surface is drawn.
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
    /// Glass is smooth: rays go through the BVH, from every pixel, and there is one about the mirror direction at least.
    pub fn new(settings: &Settings, tracer: Option<Tracer>) -> Self {
        let mut settings = Settings { history: History::Off, ..settings.clone() };
        if let Some(room) = settings.indirect.technique_mut() {
            room.for_transparent();
        }
        Self { settings, tracer, passes: None }
    }

    /// Finds it for the blended surfaces of a view.
    pub fn record(&mut self, frame: &mut Frame<'_>, view: &ViewContext<'_>) -> Result<Arriving, RenderError> {
        let Passes { prepass, occlusion, indirect } = match &mut self.passes {
            Some(passes) => passes,
            none => none.insert(Passes {
                prepass: Prepass::of_transparent(),
                // Rays of indirect light may see the environment themselves.
                occlusion: match self.settings.indirect.sees_environment() {
                    false => occlusion::passes(frame.device, &self.settings)?,
                    true => None,
                },
                indirect: indirect::passes(frame.device, &self.settings, self.tracer)?,
            }),
        };
        let surface = prepass.record_transparent(frame, view)?;
        let ambient_visibility = occlusion.as_mut().map(|room| room.record(frame, view, &surface)).transpose()?;
        let indirect = indirect.as_mut().map(|room| room.record(frame, view, &surface)).transpose()?;
        Ok(Arriving { surface, ambient_visibility, indirect })
    }
}
