//! A compute pass that traces rays with a tracer.

use lanternfish_gpu::{Bindings, ComputeKernel, Frame};

use super::{Structure, Structures, TracedStructure, Tracer};

/// A compute pass that uses the queries of `tracer.wesl`. It binds what the tracer reads in addition to the scene's
/// bindings.
///
/// A structure may have parts. The pass then runs once for each part, and each run answers for its part alone.
#[derive(Debug)]
pub struct TracePass {
    tracer: Tracer,
    structure: Structure,
    kernel: ComputeKernel,
}

impl TracePass {
    /// A pass with a kernel that was linked with the tracer's features for the chosen structure ([`Tracer::features`]).
    pub fn new(tracer: Tracer, chosen: &Structure, kernel: ComputeKernel) -> Self {
        Self { tracer, structure: tracer.structure(chosen), kernel }
    }

    /// Adds the pass to a frame with these structures.
    pub fn dispatch(&self, frame: &mut Frame<'_>, structures: &Structures, bindings: &Bindings<'_>, groups: [u32; 3]) {
        self.for_each_part(structures, bindings, &mut |bindings| frame.dispatch(&self.kernel, bindings, groups));
    }

    /// Adds the pass to a frame; a buffer holds the workgroup counts at `offset` bytes.
    pub fn dispatch_indirect(
        &self,
        frame: &mut Frame<'_>,
        structures: &Structures,
        bindings: &Bindings<'_>,
        groups: &wgpu::Buffer,
        offset: u64,
    ) {
        let mut dispatch = |bindings: &Bindings<'_>| frame.dispatch_indirect(&self.kernel, bindings, groups, offset);
        self.for_each_part(structures, bindings, &mut dispatch);
    }

    /// True if the pass may run several times. Buffers that it adds to must then be cleared before.
    pub fn runs_in_parts(&self) -> bool {
        !self.tracer.is_exact()
    }

    /// The one of these that the tracer traverses, if any.
    pub fn structure<'s>(&self, structures: &'s Structures) -> Option<&'s dyn TracedStructure> {
        let built = structures.iter().find(|(settings, _)| *settings == self.structure);
        built.map(|(_, structure)| structure.as_ref())
    }

    fn for_each_part(&self, structures: &Structures, bindings: &Bindings<'_>, dispatch: &mut dyn FnMut(&Bindings<'_>)) {
        match self.structure(structures) {
            Some(structure) => structure.for_each_part(bindings, dispatch),
            None => dispatch(bindings),
        }
    }
}
