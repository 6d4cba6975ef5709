//! Structures that tracers traverse and that are not part of a scene on the device. A renderer builds them, and keeps
//! them while nothing moves.

use std::{any::Any, fmt, sync::Arc};

use glam::{Quat, Vec3};
use lanternfish_gpu::{Bindings, Feature, Frame, Growth};

use super::TracedRay;
use crate::{
    error::RenderError,
    gpu_scene::GpuScene,
    technique::{AnyTechnique, Choice, Technique, clone_of},
};

/// A structure with its parameters; none: a tracer that needs one uses its default.
pub type Structure = Choice<dyn StructureTechnique>;

impl<T: Technique + StructureTechnique> From<T> for Structure {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

/// A kind of structure, with its parameters.
pub trait StructureTechnique: AnyTechnique {
    /// The features that link shaders with it; `with_triangles`: shaders also query which triangle a ray hits.
    fn features(&self, with_triangles: bool) -> Vec<Feature>;

    /// The same features for every combination of parameters.
    fn every_features(&self, with_triangles: bool) -> Vec<Vec<Feature>>;

    /// True if it reports the triangle that a ray hits.
    fn finds_triangles(&self) -> bool;

    /// Number of frames after a change of the scene until no outdated part is left.
    fn update_frames(&self) -> u32;

    /// What it lacks for shadows to be traced through it; none: nothing.
    fn lacks_for_shadows(&self) -> Option<&'static str> {
        None
    }

    /// Compiles the passes that build it.
    fn build(&self, device: &wgpu::Device) -> Result<Box<dyn KeptStructure>, RenderError>;
}

/// A structure built for the scene of each frame, and kept while nothing moves.
pub trait KeptStructure: Send + fmt::Debug {
    /// The structure of the current scene. `rotation`: of its direction set in this frame, unit, world space from the
    /// structure's own.
    fn get(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        rotation: Quat,
    ) -> Result<Arc<dyn TracedStructure>, RenderError>;

    /// Number of complete builds.
    fn builds(&self) -> u64;

    /// Age of its oldest part, frames, and the counter's name, if it is built in parts.
    fn age(&self) -> Option<(&'static str, u64)> {
        None
    }

    /// An error unless it can be built in frames with this growth of buffers.
    fn check_growth(&self, growth: Growth) -> Result<(), RenderError>;
}

/// The structures of a frame for the current scene, each beside its settings.
pub type Structures = Vec<(Structure, Arc<dyn TracedStructure>)>;

/// A structure on the device.
pub trait TracedStructure: Any + fmt::Debug + Send + Sync {
    /// The features that link shaders with it for distances.
    fn distance_features(&self) -> Vec<Feature>;

    /// A ray along `direction` (unit) that ignores surfaces nearer than `offset`, m.
    fn ray(&self, origin: Vec3, direction: Vec3, offset: f32) -> TracedRay {
        TracedRay::new(origin, direction, offset, 0, false)
    }

    /// Calls `dispatch` once for each of its parts, with that part's bindings added to these. Each run answers for its
    /// part alone.
    fn for_each_part(&self, bindings: &Bindings<'_>, dispatch: &mut dyn FnMut(&Bindings<'_>));
}
