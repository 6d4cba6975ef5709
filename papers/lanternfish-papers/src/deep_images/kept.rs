//! Cached deep images, rebuilt when the scene has changed.

use std::sync::Arc;

use glam::Quat;
use lanternfish::{RenderError, gpu_scene::GpuScene};
use lanternfish_gpu::{AcrossFrames, Frame, Growth};
use lanternfish_scene::Bounds;

use super::{
    build::DeepImageBuilder,
    images::{Chunk, DeepImages},
    settings::DeepImageSettings,
    store::{SLOTS, note_again},
};

/// Deep images of the current scene, for every frame.
#[derive(Debug)]
pub struct KeptDeepImages {
    builder: DeepImageBuilder,
    kept: AcrossFrames<Option<CurrentImages>>,
    builds: u64,
    slices: u32,
    /// Number of requesting frames, and the number of the last one.
    frames: u64,
    last_frame: u64,
}

#[derive(Debug)]
struct CurrentImages {
    images: Arc<DeepImages>,
    /// [`GpuScene::triangle_order`] of the scene that the images were built from.
    order: u64,
    rotation: Quat,
    /// State of each chunk.
    built: Vec<Built>,
    /// Number of the last frame that recorded if the capacity of the others sufficed.
    noted_in: u64,
}

/// The scene from which a chunk was built, and the last frame in which it was up to date.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Built {
    /// Index among the requesting frames.
    frame: u64,
    /// [`GpuScene::generation`] of the scene.
    generation: u64,
}

impl KeptDeepImages {
    /// Compiles the builder's passes.
    pub fn new(device: &wgpu::Device, settings: DeepImageSettings) -> Result<Self, RenderError> {
        Ok(Self {
            builder: DeepImageBuilder::new(device, settings)?,
            kept: AcrossFrames::default(),
            builds: 0,
            slices: settings.slices,
            frames: 0,
            last_frame: 0,
        })
    }

    /// Images of the scene with the set of directions rotated by `rotation` (unit; world space from the set's own). They are built in this
    /// frame if the last ones are of another scene, of triangles that have moved since, or of another rotation; otherwise the last ones are
    /// returned. A frame in which they were built must be submitted before another reads them. With deferred readback, images that exceed
    /// their capacity are built again as soon as the counts are read; until then frames that read them are not complete. With
    /// [`DeepImageSettings::slices`], the oldest slice that is out of date is built again, one per frame.
    pub fn get(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        rotation: Quat,
    ) -> Result<&Arc<DeepImages>, RenderError> {
        let [counted, images, ..] = frame.last_counted(SLOTS);
        // The count may be of larger chunks, before they were divided.
        let is_large_enough = |chunk: &Chunk| counted <= chunk.grid.capacity || images > chunk.grid.image_count;
        let number = frame.number();
        let is_deferred = frame.growth() == Growth::Deferred;
        if std::mem::replace(&mut self.last_frame, number) != number {
            self.frames += 1;
        }
        let now = Built { frame: self.frames, generation: scene.generation() };
        let is_usable = |kept: &CurrentImages| {
            let is_large_enough = !is_deferred || kept.images.chunks.iter().all(is_large_enough);
            let is_of_now = kept.built.iter().all(|built| built.generation == now.generation);
            let may_be_old = is_deferred && self.slices > 1;
            let is_same = (kept.order, kept.rotation) == (scene.triangle_order(), rotation);
            is_same && is_large_enough && (is_of_now || (may_be_old && kept.hold(scene.bounds())))
        };
        let is_usable = self.kept.get(frame).as_ref().is_some_and(is_usable);
        // Slices that no longer fit one binding are rebuilt in smaller chunks.
        let is_renewed = is_usable && (!is_deferred || self.renew(frame, scene, now)?);
        if !is_renewed {
            // Their memory is freed before more is allocated.
            *self.kept.get(frame) = None;
            frame.forget_bind_groups();
            self.builder.set_rotation(rotation);
            let images = Arc::new(self.builder.record(frame, scene)?);
            self.builds += 1;
            let built = vec![now; images.chunks.len()];
            let order = scene.triangle_order();
            *self.kept.get(frame) = Some(CurrentImages { images, order, rotation, built, noted_in: number });
        }
        let kept = self.kept.get(frame).as_mut().expect("built above if it was missing");
        kept.built.iter_mut().filter(|built| built.generation == now.generation).for_each(|built| *built = now);
        Ok(&kept.images)
    }

    /// Builds the oldest out-of-date slice again, once per frame, and records if the capacity of the others sufficed.
    /// Returns false if the slice exceeds one binding.
    fn renew(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, now: Built) -> Result<bool, RenderError> {
        let number = frame.number();
        let Some(kept) = self.kept.get(frame).as_mut().filter(|kept| kept.noted_in != number) else { return Ok(true) };
        kept.noted_in = number;
        let oldest = kept.oldest(now.generation);
        if let Some(oldest) = oldest {
            frame.forget_bind_groups();
            match self.builder.renew(frame, scene, Arc::make_mut(&mut kept.images), oldest) {
                Err(RenderError::Overflow { .. }) => return Ok(false),
                other => other?,
            }
            kept.built[oldest] = now;
        }
        let others = kept.images.chunks.iter().enumerate().filter(|(chunk, _)| Some(*chunk) != oldest);
        others.map(|(_, chunk)| chunk).try_for_each(|chunk| note_again(frame, chunk))?;
        Ok(true)
    }

    /// Frames since the oldest images were up to date, in the last requesting frame: 0 if all are of the scene at that time. None if all
    /// images are built at once.
    pub fn age(&self) -> Option<u64> {
        let kept = self.kept.last().as_ref().filter(|_| self.slices > 1)?;
        let frames = || kept.built.iter().map(|built| built.frame);
        Some(frames().max()? - frames().min()?)
    }

    /// An error unless they can be built by frames with this kind of readback.
    pub(crate) fn check_growth(&self, growth: Growth) -> Result<(), RenderError> {
        self.builder.check_growth(growth)
    }

    /// Number of complete builds of all images.
    pub fn builds(&self) -> u64 {
        self.builds
    }
}

impl CurrentImages {
    /// True if all of a scene within these bounds is in every image.
    fn hold(&self, bounds: &Bounds) -> bool {
        let grids = self.images.chunks.iter().map(|chunk| &chunk.grid);
        grids.into_iter().all(|grid| bounds.corners().iter().all(|corner| corner.distance(grid.center) <= grid.radius))
    }

    /// The chunk of the oldest out-of-date images.
    fn oldest(&self, generation: u64) -> Option<usize> {
        let old = (0..self.built.len()).filter(|chunk| self.built[*chunk].generation != generation);
        old.min_by_key(|chunk| (self.built[*chunk].frame, *chunk))
    }
}
