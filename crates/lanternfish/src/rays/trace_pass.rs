//! A compute pass whose rays go through a tracer.

use lanternfish_gpu::{Bindings, ComputeKernel, Frame};

use super::Tracer;
use crate::{context::ViewContext, deep_images::DeepImages};

/// A compute pass that asks a tracer the questions of `tracer.wesl`. It binds what the tracer reads beside the scene's bindings.
///
/// Deep images are in chunks. The pass runs once for each chunk then, and each run answers for the chunk's images alone.
#[derive(Debug)]
pub(crate) struct TracePass {
    tracer: Tracer,
    kernel: ComputeKernel,
}

impl TracePass {
    /// A pass of a kernel that was linked with the tracer's features ([`Tracer::features`]).
    pub fn new(tracer: Tracer, kernel: ComputeKernel) -> Self {
        Self { tracer, kernel }
    }

    /// Adds the pass to a frame.
    pub fn dispatch(&self, frame: &mut Frame<'_>, view: &ViewContext<'_>, bindings: &Bindings<'_>, groups: [u32; 3]) {
        let images = self.deep_images(view);
        for_each_chunk(images, bindings, |bindings| frame.dispatch(&self.kernel, bindings, groups));
    }

    /// Adds the pass to a frame; a buffer holds the number of workgroups.
    pub fn dispatch_indirect(
        &self,
        frame: &mut Frame<'_>,
        view: &ViewContext<'_>,
        bindings: &Bindings<'_>,
        groups: &wgpu::Buffer,
    ) {
        let images = self.deep_images(view);
        for_each_chunk(images, bindings, |bindings| frame.dispatch_indirect(&self.kernel, bindings, groups));
    }

    /// Whether the pass may run several times, so that what it adds to has to be cleared before.
    pub fn runs_in_chunks(&self) -> bool {
        self.tracer.uses_deep_images()
    }

    /// The view's deep images, if the rays go through them.
    pub fn deep_images<'v>(&self, view: &'v ViewContext<'_>) -> Option<&'v DeepImages> {
        view.deep_images.as_deref().filter(|_| self.tracer.uses_deep_images())
    }
}

/// Calls `dispatch` with the bindings of each chunk of deep images, or once if there are none.
pub(super) fn for_each_chunk(
    images: Option<&DeepImages>,
    bindings: &Bindings<'_>,
    mut dispatch: impl FnMut(&Bindings<'_>),
) {
    let Some(images) = images else { return dispatch(bindings) };
    for chunk in &images.chunks {
        let of_chunk = chunk.bindings(&images.frames).with(&images.direction_bindings());
        dispatch(&bindings.clone().with(&of_chunk));
    }
}
