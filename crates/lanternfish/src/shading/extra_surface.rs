//! Light at a surface of every pixel beside the opaque one, computed by the same techniques: at the nearest transparent
//! surface, at the clear coat, or at the other side of a surface that scatters light through.
//!
//! Transparent surfaces behind the nearest one use the same light, so at the rim of a vase, where both walls mirror
//! most, both mirror the same. Sampled direct light, which differs more, is found for the second one, too.

use lanternfish_gpu::Frame;

use super::Arriving;
use crate::{
    context::ViewContext,
    direct_light::{Direct, DirectPasses},
    error::RenderError,
    gpu_scene::{Draw, Lobes},
    indirect::{self, IndirectPasses},
    occlusion::{self, OcclusionPasses},
    prepass::Prepass,
    rays::Tracer,
    settings::{History, Settings},
};

/// Compiled for the first such surface.
#[derive(Debug)]
pub(crate) struct ExtraSurface {
    kind: Kind,
    settings: Settings,
    tracer: Option<Tracer>,
    passes: Option<Passes>,
}

/// The surface of a pixel at which light is found.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    NearestTransparent,
    /// Direct light alone.
    SecondTransparent,
    Coat,
    OtherSide,
}

#[derive(Debug)]
struct Passes {
    prepass: Prepass,
    direct: Option<Box<dyn DirectPasses>>,
    occlusion: Option<Box<dyn OcclusionPasses>>,
    indirect: Option<Box<dyn IndirectPasses>>,
}

impl ExtraSurface {
    /// Transparent surfaces. Glass is smooth: rays are traced through the BVH, from every pixel, with at least one
    /// about the mirror direction.
    pub fn nearest_transparent(settings: &Settings, tracer: Option<Tracer>) -> Self {
        Self::new(Kind::NearestTransparent, settings, tracer)
    }

    /// Transparent surfaces behind the nearest one.
    pub fn second_transparent(settings: &Settings, tracer: Option<Tracer>) -> Self {
        Self::new(Kind::SecondTransparent, settings, tracer)
    }

    /// Clear coats of opaque surfaces, which mirror with their own normal and roughness.
    pub fn coats(settings: &Settings, tracer: Option<Tracer>) -> Self {
        Self::new(Kind::Coat, settings, tracer)
    }

    /// The other sides of opaque surfaces that scatter light through.
    pub fn other_sides(settings: &Settings, tracer: Option<Tracer>) -> Self {
        Self::new(Kind::OtherSide, settings, tracer)
    }

    fn new(kind: Kind, settings: &Settings, tracer: Option<Tracer>) -> Self {
        let mut settings = settings.clone().with_history(History::Off);
        if kind == Kind::Coat {
            // Direct light that coats mirror is that of their surface, and samples no emission.
            settings.direct = Direct::NONE;
        }
        if let Some(technique) = settings.indirect.technique_mut() {
            match kind {
                Kind::NearestTransparent | Kind::SecondTransparent => technique.for_transparent(),
                Kind::Coat => technique.for_coats(),
                Kind::OtherSide => technique.for_other_sides(),
            }
        }
        Self { kind, settings, tracer, passes: None }
    }

    /// Computes the light at these surfaces of a view; nothing if there is none. `nearest`: depth of the nearest transparent surface, for the second one.
    pub fn record(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        nearest: Option<&wgpu::TextureView>,
    ) -> Result<Option<Arriving>, RenderError> {
        let is_second = self.kind == Kind::SecondTransparent;
        let Passes { prepass, direct, occlusion, indirect } = match &mut self.passes {
            Some(passes) => passes,
            none => none.insert(Passes {
                prepass: match self.kind {
                    Kind::NearestTransparent => Prepass::of_transparent(false),
                    Kind::SecondTransparent => Prepass::of_transparent(true),
                    Kind::Coat => Prepass::of_coats(),
                    Kind::OtherSide => Prepass::of_other_sides(),
                },
                direct: match self.settings.direct.technique() {
                    Some(technique) => Some(technique.build(frame.device, &self.settings, self.tracer)?),
                    None => None,
                },
                // Rays of indirect light may reach the environment themselves.
                occlusion: match self.settings.indirect.sees_environment() || is_second {
                    false => occlusion::passes(frame.device, &self.settings)?,
                    true => None,
                },
                indirect: match is_second {
                    false => indirect::passes(frame.device, &self.settings, self.tracer)?,
                    true => None,
                },
            }),
        };
        if direct.is_none() && occlusion.is_none() && indirect.is_none() {
            return Ok(None);
        }
        let ViewContext { scene, buffer, draws, center_surface, .. } = view;
        let opaque = |is_drawn: fn(&Draw) -> bool| draws.solid.iter().copied().filter(|draw| is_drawn(draw)).collect();
        let drawn: Vec<&Draw> = match self.kind {
            Kind::NearestTransparent | Kind::SecondTransparent => draws.transparent.clone(),
            Kind::Coat => opaque(|draw| draw.lobes == Lobes::Coated),
            Kind::OtherSide => opaque(|draw| draw.scatters_from_behind),
        };
        let surface = prepass.record_some(frame, scene, buffer, center_surface, &drawn, nearest)?;
        let ambient_visibility = occlusion.as_mut().map(|passes| passes.record(frame, view, &surface)).transpose()?;
        let indirect = indirect.as_mut().map(|passes| passes.record(frame, view, &surface)).transpose()?;
        let direct = direct.as_mut().map(|passes| passes.record(frame, view, &surface)).transpose()?;
        Ok(Some(Arriving { surface, ambient_visibility, indirect, direct, coat: None, second: None }))
    }
}
