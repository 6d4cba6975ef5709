//! Deep images that are kept while nothing moves, and built again when something has.

use glam::Quat;
use lanternfish_gpu::{Frame, Growth};

use super::{
    Chunk, DeepImageBuilder, DeepImages,
    store::{SLOTS, note_again},
};
use crate::{error::RenderError, gpu_scene::GpuScene, settings::DeepImageSettings};

/// Deep images of the scene as it is, asked for every frame.
#[derive(Debug)]
pub struct KeptDeepImages {
    builder: DeepImageBuilder,
    kept: Option<Kept>,
    builds: u64,
}

#[derive(Debug)]
struct Kept {
    images: DeepImages,
    /// [`GpuScene::generation`] of the scene that the images were built of.
    generation: u64,
    rotation: Quat,
    /// The last frame that has noted whether there was room for them: its number.
    noted_in: u64,
}

impl KeptDeepImages {
    /// Compiles the builder's passes.
    pub fn new(device: &wgpu::Device, settings: DeepImageSettings) -> Result<Self, RenderError> {
        Ok(Self { builder: DeepImageBuilder::new(device, settings)?, kept: None, builds: 0 })
    }

    /// Images of the scene with the set of directions turned by `rotation` (unit; world space from the set's own): built in
    /// this frame where the last ones are of another scene, of triangles that have moved since, or turned differently; else
    /// the last ones. A frame that they were built in must be submitted before they are read in another. Where frames do not wait,
    /// images for which there was no room are built again as soon as that is known; until then frames that read them are not whole.
    pub fn get(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, rotation: Quat) -> Result<&DeepImages, RenderError> {
        let generation = scene.generation();
        let [counted, images, ..] = frame.last_counted(SLOTS);
        // What is told may be of larger chunks, before they were divided.
        let has_room = |chunk: &Chunk| counted <= chunk.grid.capacity || images > chunk.grid.image_count;
        let same = |kept: &Kept| {
            let has_room = frame.growth() == Growth::Wait || kept.images.chunks.iter().all(has_room);
            (kept.generation, kept.rotation) == (generation, rotation) && has_room
        };
        if self.kept.as_ref().is_some_and(same) {
            let number = frame.number();
            if let (Growth::Later, Some(kept)) = (frame.growth(), &mut self.kept)
                && kept.noted_in != number
            {
                kept.noted_in = number;
                kept.images.chunks.iter().try_for_each(|chunk| note_again(frame, chunk))?;
            }
        } else {
            // Their memory can go before there is more.
            self.kept = None;
            frame.forget_bind_groups();
            self.builder.set_rotation(rotation);
            let images = self.builder.record(frame, scene)?;
            self.builds += 1;
            self.kept = Some(Kept { images, generation, rotation, noted_in: frame.number() });
        }
        Ok(&self.kept.as_ref().expect("just built, if not there").images)
    }

    /// Lets the next frame build them again: the one that built them was not handed to the device.
    pub fn forget(&mut self) {
        self.kept = None;
    }

    /// An error unless they can be built by frames that get their room so.
    pub(crate) fn check_growth(&self, growth: Growth) -> Result<(), RenderError> {
        self.builder.check_growth(growth)
    }

    /// How often images have been built.
    pub fn builds(&self) -> u64 {
        self.builds
    }
}
