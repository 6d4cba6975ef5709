//! Shaders that somebody edits while they run.

use lanternfish_gpu::{Growth, ShaderTexts};

use super::{
    Renderer,
    build::{Built, build},
};
use crate::{
    error::RenderError,
    gpu_scene::GpuScene,
    request::ViewRequest,
    shaders::{self, SHADERS},
};

impl Renderer {
    /// Renders with texts in the place of the library's own shaders from now on: WESL by its module path below the library's `src/`, such as
    /// `"sky/sky"`. What is not named is the library's own. What they change is compiled, and a frame of these views rendered into textures of
    /// its own, before this returns.
    ///
    /// An error that says what is wrong, and all stays as it was, for texts that do not link, or that make another interface than the
    /// library binds: other entry points, resources that are not there, other types. Means begin again, and deep images are built again.
    /// What an upload runs, and what moves things that have moved already, is compiled with the next upload. Further renderers of the same engine compile the texts, too. An error while the caller has the commands of a frame
    /// ([`RenderError::NotSubmitted`]).
    pub fn edit_shaders(
        &mut self,
        texts: ShaderTexts,
        scene: &GpuScene,
        views: &[ViewRequest<'_>],
    ) -> Result<(), RenderError> {
        self.check_device()?;
        let engine = self.engine.clone();
        let before = shaders::edit(&engine, texts);
        let Built { mut passes, mut compiled, .. } = match build(&engine, &self.settings) {
            Ok(built) => built,
            Err(error) => {
                engine.edit(SHADERS.library(), (*before).clone());
                return Err(error);
            }
        };
        let swap = |this: &mut Self, passes: &mut _, compiled: &mut _| {
            std::mem::swap(&mut this.passes, passes);
            std::mem::swap(&mut this.compiled, compiled);
            this.flight.forget();
        };
        swap(self, &mut passes, &mut compiled);
        // As after other settings; some are compiled with the first frame.
        let ready = self.use_growth(Growth::Blocking).and_then(|()| self.ready(scene, views));
        if ready.is_err() {
            engine.edit(SHADERS.library(), (*before).clone());
            swap(self, &mut passes, &mut compiled);
        }
        ready
    }
}
