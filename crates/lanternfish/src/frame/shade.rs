//! Direct light and shading of one view: from listed lights with their shadow rays, or from samples.

use lanternfish_gpu::Frame;

use super::Passes;
use crate::{
    context::ViewContext,
    error::RenderError,
    gpu_scene::Draw,
    indirect::DemodulatedIrradiance,
    light_culling::LightLists,
    shading::{AccumulatedRatios, Arriving, DirectFrom, Shaded, Shadowing, Sums},
    shadows::{Visibility, VisibilityPlan},
    texture::Radiance,
};

/// The visibility bits that are in the buffer.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Traced {
    /// No bits.
    Nothing,
    /// The bits of the last band.
    LastBand,
}

impl Passes {
    /// Shades opaque surfaces with shadows.
    pub(super) fn shade(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: Option<&LightLists>,
        arriving: &Arriving,
    ) -> Result<(Radiance, Option<VisibilityPlan>), RenderError> {
        let radiance = self.forward.target(frame, view.view.size);
        let Some(lights) = lights.filter(|_| arriving.direct.is_none()) else {
            let shadows = Shadowing { visibility: None, fractions: None };
            self.forward.record(frame, view, DirectFrom::Samples, arriving, &shadows, &radiance)?;
            return Ok((radiance, None));
        };
        let plan = self.plan(frame, view, lights)?;
        let fractions = self.accumulated_ratios(frame, view, lights, plan.as_ref())?;
        let traced = fractions.as_ref().map_or(Traced::Nothing, |_| Traced::LastBand);
        self.by_bands(frame, view, lights, plan.as_ref(), traced, |passes, frame, visibility| {
            let shadows = Shadowing { visibility, fractions: fractions.as_ref() };
            passes.forward.record(frame, view, DirectFrom::Lists(lights), arriving, &shadows, &radiance)
        })?;
        Ok((radiance, plan))
    }

    /// Writes demodulated irradiance with shadows.
    pub(super) fn sum(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: Option<LightLists>,
        arriving: Arriving,
    ) -> Result<Shaded, RenderError> {
        let irradiance = self.irradiance.target(frame, view);
        let plan = match lights.as_ref().filter(|_| arriving.direct.is_none()) {
            Some(lights) => {
                let plan = self.plan(frame, view, lights)?;
                self.by_bands(frame, view, lights, plan.as_ref(), Traced::Nothing, |passes, frame, visibility| {
                    let direct = DirectFrom::Lists(lights);
                    passes.irradiance.record(frame, view, direct, &arriving, visibility, &irradiance)
                })?;
                plan
            }
            None => {
                self.irradiance.record(frame, view, DirectFrom::Samples, &arriving, None, &irradiance)?;
                None
            }
        };
        let Sums { direct, indirect } = irradiance;
        let shaded = Shaded::of_lights(Radiance { target: direct, drawn: None }, lights);
        Ok(Shaded {
            indirect_light: Some(indirect),
            visibility: plan,
            ambient_visibility: arriving.ambient_visibility,
            direct: arriving.direct,
            ..shaded
        })
    }

    /// The plan for the shadow rays of a view, if there are shadows.
    fn plan(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
    ) -> Result<Option<VisibilityPlan>, RenderError> {
        self.shadows.as_mut().map(|shadows| shadows.plan(frame, view, lights)).transpose()
    }

    /// Visibility ratios of area lights at each pixel, accumulated over frames, if there is a history.
    fn accumulated_ratios(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
        plan: Option<&VisibilityPlan>,
    ) -> Result<Option<AccumulatedRatios>, RenderError> {
        let Some(mut fractions) = self.visibility_ratios.take_if(|fractions| fractions.are_of(view.scene)) else {
            return Ok(None);
        };
        let estimate = fractions.target(frame, view.view.size);
        let recorded = self.by_bands(frame, view, lights, plan, Traced::Nothing, |_, frame, visibility| {
            visibility.map_or(Ok(()), |visibility| fractions.find(frame, view, lights, visibility, &estimate))
        });
        let accumulated = recorded.and_then(|()| fractions.accumulated(frame, view, estimate));
        self.visibility_ratios = Some(fractions);
        accumulated.map(Some)
    }

    /// Traces the shadows of a view and runs the next pass with them. If the visibility of all pixels exceeds one
    /// buffer, both run in bands of rows.
    fn by_bands(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: &LightLists,
        plan: Option<&VisibilityPlan>,
        traced: Traced,
        mut go_on: impl FnMut(&mut Self, &mut Frame<'_>, Option<&Visibility<'_>>) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        let Some(plan) = plan else { return go_on(self, frame, None) };
        let is_traced = traced == Traced::LastBand && plan.bands().len() == 1;
        for (index, band) in plan.bands() {
            let Some(shadows) = &mut self.shadows else { unreachable!("they made the plan") };
            let visibility = match is_traced {
                true => plan.band(frame, view.center_surface.size.y, &band),
                false => shadows.record(frame, view, lights, plan, index, band),
            };
            go_on(self, frame, Some(&visibility))?;
        }
        Ok(())
    }

    /// Adds the light from behind that opaque surfaces scatter through.
    pub(super) fn add_from_behind(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: Option<&LightLists>,
        radiance: &Radiance,
    ) -> Result<(), RenderError> {
        let draws: Vec<&Draw> = view.draws.solid.iter().copied().filter(|draw| draw.scatters_from_behind).collect();
        if draws.is_empty() {
            return Ok(());
        }
        // Debug views have lists beside samples.
        let lights = lights.filter(|_| self.direct.is_none());
        let direct = lights.map_or(DirectFrom::Samples, DirectFrom::Lists);
        let arriving = self.other_sides.record(frame, view, None)?;
        self.forward.record_from_behind(frame, view, direct, arriving.as_ref(), radiance, &draws)
    }

    /// Blends transparent surfaces over the image; returns the indirect light at the nearest of them.
    pub(super) fn blend(
        &mut self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        lights: Option<&LightLists>,
        radiance: &Radiance,
    ) -> Result<Option<DemodulatedIrradiance>, RenderError> {
        if view.draws.transparent.is_empty() {
            return Ok(None);
        }
        let mut nearest = self.nearest_transparent.record(frame, view, None)?;
        if let (None, Some(nearest)) = (lights, &mut nearest) {
            let depth = Some(&nearest.surface.depth);
            nearest.second = self.second_transparent.record(frame, view, depth)?.map(Box::new);
        }
        let direct = lights.map_or(DirectFrom::Samples, DirectFrom::Lists);
        self.forward.record_transparent(frame, view, direct, nearest.as_ref(), radiance)?;
        Ok(nearest.and_then(|nearest| nearest.indirect))
    }
}
