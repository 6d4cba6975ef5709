//! Structures that tracers go through and that are no part of a scene on the device: a renderer builds them and keeps them while nothing
//! moves.

use std::{any::Any, fmt, sync::Arc};

use glam::Quat;
use lanternfish_gpu::{Bindings, Feature, Frame, Growth};

use crate::{
    error::RenderError,
    gpu_scene::GpuScene,
    technique::{AnyTechnique, Choice, Technique, clone_of},
};

/// A structure with its parameters, or none: its tracer's default is taken where a tracer needs one.
pub type Structure = Choice<dyn StructureTechnique>;

impl<T: Technique + StructureTechnique> From<T> for Structure {
    fn from(technique: T) -> Self {
        Self::new(Box::new(technique), |technique| clone_of::<T>(technique))
    }
}

/// A kind of structure, with its parameters.
pub trait StructureTechnique: AnyTechnique {
    /// The features that make shaders read it; `with_triangles`: they also ask which triangle a ray hits.
    fn features(&self, with_triangles: bool) -> Vec<Feature>;

    /// Those features under every choice of parameters.
    fn every_features(&self, with_triangles: bool) -> Vec<Vec<Feature>>;

    /// True if it knows the triangle that a ray hits.
    fn finds_triangles(&self) -> bool;

    /// Frames after a change of the scene until it holds nothing older.
    fn update_frames(&self) -> u32;

    /// What it would need for shadows to be traced through it, if it is not so.
    fn lacks_for_shadows(&self) -> Option<&'static str> {
        None
    }

    /// Compiles what builds it.
    fn build(&self, device: &wgpu::Device) -> Result<Box<dyn KeptStructure>, RenderError>;
}

/// A structure that is built of the scene of each frame, and kept while nothing moves.
pub trait KeptStructure: fmt::Debug {
    /// The structure of the scene as it is. `rotation`: of its directions in this frame, unit, world space from its own.
    fn get(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        rotation: Quat,
    ) -> Result<Arc<dyn TracedStructure>, RenderError>;

    /// How often all of it has been built.
    fn builds(&self) -> u64;

    /// Frames since its oldest part was built, and the counter's name, where it is built in parts.
    fn age(&self) -> Option<(&'static str, u64)> {
        None
    }

    /// An error unless it can be built by frames that get their room so.
    fn check_growth(&self, growth: Growth) -> Result<(), RenderError>;

    /// Forgets what is kept from frame to frame: the last one was not handed to the device.
    fn forget(&mut self);
}

/// A structure on the device.
pub trait TracedStructure: Any + fmt::Debug + Send + Sync {
    /// The features that make shaders read it for distances.
    fn distance_features(&self) -> Vec<Feature>;

    /// Calls `dispatch` with the bindings of each of its parts beside these. Each run answers for its part alone.
    fn for_each_part(&self, bindings: &Bindings<'_>, dispatch: &mut dyn FnMut(&Bindings<'_>));
}
