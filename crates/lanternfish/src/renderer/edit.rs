//! Replaces shaders at run time.

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
    /// Replaces texts of the library's own shaders from now on: WESL by its module path below the library's `src/`, such as `"sky/sky"`.
    /// Modules that are not named use the library's text. Before it returns, it compiles the affected shaders and renders a frame of these
    /// views into textures of its own.
    ///
    /// Returns an error with the cause and changes nothing if a text does not link, or if its interface (entry points, resources, types)
    /// differs from the bindings of the library. Means restart and deep images are rebuilt. Shaders of uploads, and of updates of objects
    /// that have already moved, are compiled with the next upload. Further renderers of the same engine compile the texts too. Returns an
    /// error while the caller holds the commands of a frame ([`RenderError::NotSubmitted`]).
    #[doc(hidden)]
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
        // Recompile as after a change of settings; some pipelines are compiled with the first frame.
        let ready = self.use_growth(Growth::Blocking).and_then(|()| self.ready(scene, views));
        if ready.is_err() {
            engine.edit(SHADERS.library(), (*before).clone());
            swap(self, &mut passes, &mut compiled);
        }
        ready
    }
}
