//! The radiance of the surroundings about each direction of a set, kept while neither changes.

use std::sync::Arc;

use glam::Quat;
use lanternfish_gpu::storage_buffer_of;

use crate::{
    deep_images::directions::Directions,
    environment_light::{EnvironmentSample, cell_radiances},
    error::RenderError,
};

/// Mean radiance of one image of the surroundings about each direction of one set. The set must be the same whenever the buffer is asked
/// for, but for its rotation.
#[derive(Debug, Default)]
pub(super) struct CellRadiances {
    kept: Option<Kept>,
}

#[derive(Debug)]
struct Kept {
    samples: Arc<[EnvironmentSample]>,
    rotation: Quat,
    buffer: wgpu::Buffer,
}

impl CellRadiances {
    /// Lets the next frame fill the buffer anew.
    pub fn forget(&mut self) {
        self.kept = None;
    }

    /// The radiances, bound as `cell_radiances`; made anew where the image or the rotation is not that of before.
    pub fn get(
        &mut self,
        device: &wgpu::Device,
        samples: &Arc<[EnvironmentSample]>,
        directions: &Directions,
    ) -> Result<&wgpu::Buffer, RenderError> {
        let rotation = directions.rotation();
        let same = |kept: &Kept| Arc::ptr_eq(&kept.samples, samples) && kept.rotation == rotation;
        if !self.kept.as_ref().is_some_and(same) {
            let cells = cell_radiances(samples, directions);
            let buffer = storage_buffer_of(device, "occlusion/cells", &cells, wgpu::BufferUsages::empty())?;
            self.kept = Some(Kept { samples: samples.clone(), rotation, buffer });
        }
        Ok(&self.kept.as_ref().expect("just made, if not there").buffer)
    }
}
