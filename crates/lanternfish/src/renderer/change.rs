//! Changes the settings of a renderer.

use lanternfish_gpu::Growth;

use super::{
    Renderer,
    build::{Built, build},
};
use crate::{
    error::RenderError,
    output::Output,
    settings::{Exposure, ImageSettings, Settings},
};

/// The cost of a change of settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// Only uniform values change: frames run the same shaders.
    Uniform,
    /// Frames run other shaders. Those that the engine has not compiled yet are compiled, now or when the first scene that needs them is
    /// drawn.
    Relink,
    /// The cost of [`Self::Relink`], and scenes uploaded under the previous settings must be uploaded again; they are
    /// [`RenderError::OtherSettings`] otherwise.
    Upload,
}

impl Renderer {
    /// Changes the settings and returns the cost. After an error the previous settings stay in effect.
    ///
    /// If only exposure, tone mapping and the number of frames of a mean change, all state of frames is preserved. Otherwise means restart
    /// and deep images are rebuilt. The last frame can no longer be read. Returns an error while the caller holds the commands of a frame
    /// ([`RenderError::NotSubmitted`]).
    pub fn set(&mut self, settings: Settings) -> Result<Change, RenderError> {
        self.check_device()?;
        let Built { effective, needs, passes, compiled } = build(&self.engine, &settings)?;
        let cost = match self.needs.lacks(&needs) {
            Some(_) => Change::Upload,
            None if compiled != self.compiled || meters(&effective) != meters(&self.effective) => Change::Relink,
            None => Change::Uniform,
        };
        let shown_alike = |settings: &Settings| {
            let ImageSettings { exposure, tone_map, background, accumulate, .. } = effective.image;
            let is_hidden = background.hides_environment() == settings.image.background.hides_environment();
            let background = if is_hidden { background } else { settings.image.background };
            let alike = settings.clone().with_exposure(exposure).with_tone_map(tone_map);
            alike.with_background(background).with_accumulate(accumulate)
        };
        if shown_alike(&self.effective) == effective {
            let device = &self.engine.device;
            let output = || Output::new(device, &effective.image);
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
    settings.image.exposure == Exposure::Auto && settings.image.debug_view.is_none()
}
