//! Other settings for a renderer that is there.

use lanternfish_gpu::Growth;

use super::{
    Renderer,
    build::{Built, build},
};
use crate::{
    error::RenderError,
    output::Output,
    settings::{Exposure, Settings},
};

/// What other settings cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// Numbers alone: frames run the same shaders.
    Uniform,
    /// Frames run other shaders, of which those are compiled that the renderer's engine has not seen: now, or where the first scene that
    /// needs them is drawn.
    Relink,
    /// The same, and scenes that were uploaded under the settings before must be uploaded again: they are
    /// [`RenderError::OtherSettings`] otherwise.
    Upload,
}

impl Renderer {
    /// Renders by other settings from now on, and says what that costs. After an error it renders by those that it had.
    ///
    /// Where exposure, tone map and the number of frames of a mean alone are others, everything that frames have kept stays. Otherwise
    /// means begin again, and deep images are built again. The last frame can no longer be read. An error while the caller has the commands
    /// of a frame ([`RenderError::NotSubmitted`]).
    pub fn set(&mut self, settings: Settings) -> Result<Change, RenderError> {
        self.check_device()?;
        let Built { effective, needs, passes, compiled } = build(&self.engine, &settings)?;
        let cost = match self.needs.lacks(&needs) {
            Some(_) => Change::Upload,
            None if compiled != self.compiled || meters(&effective) != meters(&self.effective) => Change::Relink,
            None => Change::Uniform,
        };
        let shown_alike = |settings: &Settings| {
            let Settings { exposure, tone_map, accumulate, .. } = effective;
            Settings { exposure, tone_map, accumulate, ..settings.clone() }
        };
        if shown_alike(&self.effective) == effective {
            let device = &self.engine.device;
            let output = || Output::new(device, effective.tone_map, effective.exposure);
            self.passes.output = self.engine.within(output)?;
        } else {
            self.passes = passes;
            // True if these can do without waiting is asked before the next frame that may not wait.
            self.use_growth(Growth::Blocking)?;
        }
        self.flight.forget();
        self.needs = needs.of_renderer(&self.needs);
        (self.settings, self.effective, self.compiled) = (settings, effective, compiled);
        Ok(cost)
    }
}

/// True if frames find their own exposure, which is compiled with the first of them.
fn meters(settings: &Settings) -> bool {
    settings.exposure == Exposure::Auto && settings.debug_view.is_none()
}
