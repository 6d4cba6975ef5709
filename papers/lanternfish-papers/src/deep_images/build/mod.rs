//! Builds deep images: a builder generates fragments and puts them into lists, a store finalizes the lists.

mod depth_peeling;
mod draw;
mod per_direction;
mod per_triangle;
pub(super) mod shared;
mod single_pass;

use glam::Quat;
use lanternfish::{
    RenderError,
    gpu_scene::{GpuScene, Parts},
};
use lanternfish_gpu::{Bindings, Frame, Growth, faulty_software, storage_buffer_of};

pub use self::shared::PeeledFragment;
use self::{
    depth_peeling::DepthPeeling,
    per_direction::PerDirection,
    per_triangle::PerTriangle,
    single_pass::{Samples, SinglePass},
};
use super::{
    directions::Directions,
    images::{DeepCounts, DeepImages},
    settings::{DeepBuilder, DeepImageSettings, DeepStore},
    shaders::{DeepFrame, DeepGrid},
    store::{Source, Store},
};

/// How fragments are generated.
#[derive(Debug)]
enum Builder {
    /// The scene is drawn once into samples, which are then put into all images.
    SinglePass(SinglePass),
    /// Every triangle is put into all images by computation.
    PerTriangle(PerTriangle),
    /// The scene is drawn for each image.
    PerDirection(PerDirection),
    /// The scene is drawn for each layer of surfaces, for all images at once.
    DepthPeeling(DepthPeeling),
}

/// Results of a builder before the first chunk.
#[derive(Debug)]
enum Prepared {
    /// Samples of all surfaces.
    Samples(Samples),
    /// Nothing.
    Nothing,
}

impl Builder {
    fn new(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        Self::of(device, sound_builder(settings.builder, &device.adapter_info()), settings)
    }

    /// One that counts on the device, with the same images.
    fn deferred(device: &wgpu::Device, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        let is_sound = !faulty_software(&device.adapter_info());
        Self::of(device, if is_sound { DeepBuilder::PerTriangle } else { DeepBuilder::PerDirection }, settings)
    }

    fn of(device: &wgpu::Device, builder: DeepBuilder, settings: &DeepImageSettings) -> Result<Self, RenderError> {
        if settings.slopes && (builder != DeepBuilder::PerTriangle || settings.store != DeepStore::LinearArray) {
            let needed = "`deep-builder per_triangle` and `deep-store linear_array`";
            return Err(RenderError::Together { setting: "`deep-slopes on`", needed });
        }
        Ok(match builder {
            DeepBuilder::SinglePass | DeepBuilder::SinglePassLiteral => {
                Self::SinglePass(SinglePass::new(device, settings)?)
            }
            DeepBuilder::PerTriangle => Self::PerTriangle(PerTriangle::new(device, settings)?),
            DeepBuilder::PerDirection => Self::PerDirection(PerDirection::new(device, settings)?),
            DeepBuilder::DepthPeeling => Self::DepthPeeling(DepthPeeling::new(device, settings)?),
        })
    }

    /// Work that is done once for all chunks.
    fn begin(&mut self, frame: &mut Frame<'_>, scene: &GpuScene, grid: &DeepGrid) -> Result<Prepared, RenderError> {
        match self {
            Self::SinglePass(builder) => builder.sample(frame, scene, grid).map(Prepared::Samples),
            Self::PerTriangle(_) | Self::PerDirection(_) | Self::DepthPeeling(_) => Ok(Prepared::Nothing),
        }
    }

    /// Puts every fragment of a chunk's images, once, into its list.
    fn gather(
        &mut self,
        frame: &mut Frame<'_>,
        prepared: &Prepared,
        grid: &DeepGrid,
        bindings: &Bindings<'_>,
    ) -> Result<(), RenderError> {
        match (self, prepared) {
            (Self::SinglePass(builder), Prepared::Samples(samples)) => builder.gather(frame, samples, bindings),
            (Self::PerTriangle(builder), _) => builder.gather(frame, grid, bindings),
            (Self::PerDirection(builder), _) => builder.gather(frame, grid, bindings),
            (Self::DepthPeeling(builder), _) => builder.gather(frame, grid, bindings)?,
            (Self::SinglePass(_), Prepared::Nothing) => unreachable!("a single pass has taken its samples"),
        }
        Ok(())
    }
}

/// The passes.
#[derive(Debug)]
pub struct DeepImageBuilder {
    settings: DeepImageSettings,
    builder: Builder,
    /// True if it stands for the requested one, in deferred frames.
    is_replaced: bool,
    store: Store,
    /// The set without rotation.
    directions: Directions,
    rotation: Quat,
    direction_cells: wgpu::Buffer,
    /// Maximum number of images per chunk, lowered if their fragments exceeded a binding; with the scene's [`GpuScene::triangle_order`]:
    /// while it moves, the limit stays.
    most_images: (u64, u32),
}

impl DeepImageBuilder {
    /// Compiles the passes, and lays out the directions, whose table costs time by the square of their number. An error if the settings do
    /// not go together.
    pub fn new(device: &wgpu::Device, settings: DeepImageSettings) -> Result<Self, RenderError> {
        if !(1..=64).contains(&settings.slices) {
            return Err(RenderError::Together { setting: "deep images", needed: "1 to 64 slices" });
        }
        let (store, builder) = (Store::new(device, &settings)?, Builder::new(device, &settings)?);
        let directions = Directions::new(settings.directions)
            .map_err(|error| RenderError::Directions { what: error.to_string() })?;
        let none = wgpu::BufferUsages::empty();
        Ok(Self {
            settings,
            builder,
            is_replaced: false,
            store,
            direction_cells: storage_buffer_of(device, "deep_images/direction_cells", directions.cells(), none)?,
            directions,
            rotation: Quat::IDENTITY,
            most_images: (0, u32::MAX),
        })
    }

    /// An error unless frames with this readback can build them: linked lists are counted on the host.
    pub(crate) fn check_growth(&self, growth: Growth) -> Result<(), RenderError> {
        if growth == Growth::Blocking || self.settings.store == DeepStore::LinearArray {
            return Ok(());
        }
        Err(RenderError::Together { setting: "a frame that does not wait", needed: "deep images in a linear_array" })
    }

    /// Replaces a builder that reads counts on the host for deferred frames, and takes the requested one again for others.
    fn take_builder(&mut self, device: &wgpu::Device, growth: Growth) -> Result<(), RenderError> {
        let is_deferred = growth == Growth::Deferred;
        let counts_on_the_device = matches!(self.builder, Builder::PerTriangle(_) | Builder::PerDirection(_));
        if is_deferred && !counts_on_the_device {
            (self.builder, self.is_replaced) = (Builder::deferred(device, &self.settings)?, true);
        } else if !is_deferred && self.is_replaced {
            (self.builder, self.is_replaced) = (Builder::new(device, &self.settings)?, false);
        }
        Ok(())
    }

    /// Rotates the set of directions for the images recorded from now on: world space from the set's own, unit. Frames with different
    /// rotations cover each other's gaps ([`lanternfish::view::rotations`]).
    pub fn set_rotation(&mut self, rotation: Quat) {
        self.rotation = rotation;
    }

    /// Builds the images of the scene's triangles; transparent surfaces are omitted. A scene that was not uploaded for the BVH is an error.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene) -> Result<DeepImages, RenderError> {
        self.check_growth(frame.growth())?;
        self.take_builder(frame.device, frame.growth())?;
        scene.check_parts(frame.device, Parts::BVH)?;
        let directions = self.directions.rotated(self.rotation);
        let axes: Vec<DeepFrame> = (0..directions.len() as u32)
            .map(|image| {
                let axes = directions.frame(image);
                DeepFrame { x: axes.x_axis, y: axes.y_axis, z: axes.z_axis, ..DeepFrame::default() }
            })
            .collect();
        let frames = storage_buffer_of(frame.device, "deep_images/frames", &axes, wgpu::BufferUsages::empty())?;
        let images = axes.len() as u32;
        let (order, stored) = self.most_images;
        let most_images = if order == scene.triangle_order() { stored } else { u32::MAX };
        let slices = if frame.growth() == Growth::Deferred { self.settings.slices.max(1) } else { 1 };
        let mut most = self.images_a_chunk(frame.device).min(most_images).min(images.div_ceil(slices));
        let mut chunks = Vec::new();
        let mut was_divided = false;
        self.gathered(frame, scene, &directions, &frames, |store, frame, grid, source| {
            let mut first_image = 0;
            while first_image < images {
                let image_count = most.min(images - first_image);
                match store.record(frame, DeepGrid { first_image, image_count, ..grid }, source) {
                    // Several images exceed one binding; fewer may fit.
                    Err(RenderError::Overflow { .. }) if image_count > 1 => {
                        (most, was_divided) = (image_count / 2, true);
                        continue;
                    }
                    other => chunks.push(other?),
                }
                first_image += image_count;
            }
            Ok(())
        })?;
        if was_divided {
            self.most_images = (scene.triangle_order(), most);
        }
        let (settings, direction_cells) = (self.settings, self.direction_cells.clone());
        let counts = DeepCounts::default();
        let mut images = DeepImages { settings, directions, direction_cells, frames, chunks, counts };
        images.count();
        Ok(images)
    }

    /// Builds the images of one chunk again from the current scene, whose triangles must be in the same order as when the others were
    /// built.
    pub fn renew(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        images: &mut DeepImages,
        chunk: usize,
    ) -> Result<(), RenderError> {
        let DeepGrid { first_image, image_count, .. } = images.chunks[chunk].grid;
        let renewed = |store: &mut Store, frame: &mut Frame<'_>, grid, source: &mut Source<'_>| {
            store.record(frame, DeepGrid { first_image, image_count, ..grid }, source)
        };
        images.chunks[chunk] = self.gathered(frame, scene, &images.directions, &images.frames, renewed)?;
        images.count();
        Ok(())
    }

    /// Runs `work` with the builder's results for the scene, and the grid of its images.
    fn gathered<R>(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        directions: &Directions,
        frames: &wgpu::Buffer,
        work: impl FnOnce(&mut Store, &mut Frame<'_>, DeepGrid, &mut Source<'_>) -> Result<R, RenderError>,
    ) -> Result<R, RenderError> {
        let resolution = self.settings.resolution;
        let radius = 0.5 * scene.bounds().size().length() * 1.001 + 1e-4;
        let texels_per_metre = resolution as f32 / (2.0 * radius);
        let grid = DeepGrid {
            center: scene.bounds().center(),
            radius,
            texels_per_metre,
            resolution,
            triangle_count: scene.traced_triangles(),
            merge_distance: self.settings.merge_texels / texels_per_metre,
            sample_spacing: 2.0 * radius / (resolution * self.settings.supersampling) as f32,
            set_from_world: directions.rotation().inverse().into(),
            tolerance: self.settings.tolerance,
            tests_triangles: u32::from(self.settings.tests_triangles),
            ..DeepGrid::default()
        };
        let builder = &mut self.builder;
        let prepared = builder.begin(frame, scene, &grid)?;
        let scene_bindings = scene.bindings();
        let mut bindings = scene_bindings.buffer("deep_frames", frames);
        if let Prepared::Samples(samples) = &prepared {
            bindings = samples.bind(bindings);
        }
        let mut gather = |frame: &mut Frame<'_>, grid: &DeepGrid, bindings: &Bindings<'_>| {
            builder.gather(frame, &prepared, grid, bindings)
        };
        work(&mut self.store, frame, grid, &mut Source { bindings, gather: &mut gather })
    }

    /// Number of images whose lists, and by estimate whose fragments, fit one binding.
    fn images_a_chunk(&self, device: &wgpu::Device) -> u32 {
        let entries = device.limits().max_storage_buffer_binding_size / 4;
        let most = images_that_fit(entries, self.settings.resolution, self.settings.fragments_a_texel);
        match self.builder {
            Builder::DepthPeeling(_) => most.min(DepthPeeling::most_images(device, self.settings.resolution)),
            Builder::SinglePass(_) | Builder::PerTriangle(_) | Builder::PerDirection(_) => most,
        }
    }
}

/// The builder used for the requested one: on a driver that ends loops early, which would silently lose triangles, the single pass replaces
/// the computation.
pub(super) fn sound_builder(requested: DeepBuilder, adapter: &wgpu::AdapterInfo) -> DeepBuilder {
    if requested == DeepBuilder::PerTriangle && faulty_software(adapter) {
        tracing::warn!(
            driver = adapter.driver_info,
            "deep images are built by single_pass: per_triangle would lose triangles"
        );
        return DeepBuilder::SinglePass;
    }
    requested
}

/// Number of images whose lists, with this many fragments each, fit a binding of this many entries; at least one.
fn images_that_fit(entries: u64, resolution: u32, fragments_a_texel: u64) -> u32 {
    let texels = u64::from(resolution).pow(2);
    // There are two entries more than lists.
    (entries.saturating_sub(2) / (texels * fragments_a_texel.max(1))).clamp(1, 1 << 16) as u32
}

#[cfg(test)]
mod tests {
    use super::{DeepImageSettings, Directions, images_that_fit};

    #[test]
    fn a_chunk_has_capacity_for_the_ends_of_its_lists() {
        // 128 images of 512 x 512 texels would take all of 128 MiB.
        assert_eq!(images_that_fit(1 << 25, 512, 1), 127);
        assert_eq!(images_that_fit(1 << 25, 512, 0), 127);
        assert_eq!(images_that_fit((1 << 25) + 2, 512, 1), 128);
        assert_eq!(images_that_fit(1 << 25, 64, 32), 255);
        assert_eq!(images_that_fit(16, 512, 1), 1);
    }

    /// Rays go through one chunk after the other, and most chunks do not hold their image.
    #[test]
    fn the_usual_images_are_in_one_chunk_at_128_texels() {
        let DeepImageSettings { directions, fragments_a_texel, .. } = DeepImageSettings::default();
        let images = Directions::new(directions).unwrap().len() as u32;
        // Every device can bind 128 MiB.
        assert!(images_that_fit(1 << 25, 128, fragments_a_texel) >= images);
    }
}
