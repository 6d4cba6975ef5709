//! Building deep images: a single pass, a draw for each direction, or one for each layer of surfaces.

mod depth_peeling;

use glam::{Quat, UVec2};
use lanternfish_gpu::{
    Bindings, ComputeKernel, Frame, RasterPipeline, RasterState, primitives::Scan, storage_buffer, storage_buffer_of,
    uniform_buffer_of,
};

use self::depth_peeling::DepthPeeling;
pub use self::depth_peeling::PeeledFragment;
use super::{Chunk, DeepCounts, DeepFrame, DeepGrid, DeepImages, WIDTH, WORKGROUP, directions::Directions};
use crate::{
    error::RenderError,
    gpu_scene::GpuScene,
    settings::{DeepBuilder, DeepImageSettings},
    shaders::SHADERS,
    texture::target,
};

/// How fragments come to their lists.
#[derive(Debug)]
enum Builder {
    /// The scene is drawn once into samples, which are then put into all images, for count and for fill.
    SinglePass { sample: RasterPipeline, count: ComputeKernel, fill: ComputeKernel, capacity: u32 },
    /// The scene is drawn for each image, for count and for fill.
    PerDirection { count: RasterPipeline, fill: RasterPipeline },
    /// The scene is drawn for each layer of surfaces, of all images at once.
    DepthPeeling(DepthPeeling),
}

/// The passes.
#[derive(Debug)]
pub struct DeepImageBuilder {
    settings: DeepImageSettings,
    builder: Builder,
    sort: ComputeKernel,
    compact: ComputeKernel,
    scan: Scan,
    /// Not turned.
    directions: Directions,
    rotation: Quat,
    direction_axes: wgpu::Buffer,
    direction_cells: wgpu::Buffer,
}

/// Written by nothing: a pass needs an attachment.
const NO_TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

impl DeepImageBuilder {
    /// Compiles the passes, and lays out the directions, whose table costs time by the square of their number.
    pub fn new(device: &wgpu::Device, settings: DeepImageSettings) -> Result<Self, RenderError> {
        let directions = Directions::new(settings.directions)
            .map_err(|error| RenderError::Directions { what: error.to_string() })?;
        let none = wgpu::BufferUsages::empty();
        let nothing = wgpu::ColorTargetState { format: NO_TARGET, blend: None, write_mask: wgpu::ColorWrites::empty() };
        let targets = [Some(nothing)];
        let state = RasterState { targets: &targets, ..Default::default() };
        let raster = |module: &str, features: &[&str], label: &str| {
            let shader = SHADERS.link(module, features)?;
            Ok::<_, RenderError>(RasterPipeline::new(device, &shader, "vertex", "fragment", label, &state))
        };
        let distribute = |features: &[&str], label: &str| {
            let shader = SHADERS.link("deep_images/build/distribute", features)?;
            Ok::<_, RenderError>(ComputeKernel::new(device, &shader, "distribute", label))
        };
        let builder = match settings.builder {
            DeepBuilder::SinglePass => Builder::SinglePass {
                sample: raster("deep_images/build/single_pass", &[], "deep_images/sample")?,
                count: distribute(&[], "deep_images/count")?,
                fill: distribute(&["fill"], "deep_images/fill")?,
                // Three axes, and a few surfaces behind each other.
                capacity: 12 * (settings.resolution * settings.supersampling).pow(2),
            },
            DeepBuilder::PerDirection => Builder::PerDirection {
                count: raster("deep_images/build/per_direction", &[], "deep_images/count")?,
                fill: raster("deep_images/build/per_direction", &["fill"], "deep_images/fill")?,
            },
            DeepBuilder::DepthPeeling => Builder::DepthPeeling(DepthPeeling::new(device)?),
        };
        let sort = SHADERS.link("deep_images/sort/sort", &[])?;
        Ok(Self {
            settings,
            builder,
            sort: ComputeKernel::new(device, &sort, "sort", "deep_images/sort"),
            compact: ComputeKernel::new(device, &sort, "compact", "deep_images/compact"),
            scan: Scan::new(device, "deep_images")?,
            direction_axes: storage_buffer_of(device, "deep_images/direction_axes", &directions.gpu_axes(), none)?,
            direction_cells: storage_buffer_of(device, "deep_images/direction_cells", directions.cells(), none)?,
            directions,
            rotation: Quat::IDENTITY,
        })
    }

    /// Turns the set of directions for the images that are recorded from now on: world space from the set's own, unit.
    /// Frames whose sets are turned differently see each other's blind spots ([`super::directions::rotation_of_frame`]).
    pub fn set_rotation(&mut self, rotation: Quat) {
        self.rotation = rotation;
    }

    /// Builds the images of the scene's triangles, which must have been uploaded for the BVH; blended surfaces are not in them.
    pub fn record(&mut self, frame: &mut Frame<'_>, scene: &GpuScene) -> Result<DeepImages, RenderError> {
        let directions = self.directions.rotated(self.rotation);
        let axes: Vec<DeepFrame> = (0..directions.len() as u32)
            .map(|image| {
                let axes = directions.frame(image);
                DeepFrame { x: axes.x_axis, y: axes.y_axis, z: axes.z_axis, ..DeepFrame::default() }
            })
            .collect();
        let frames = storage_buffer_of(frame.device, "deep_images/frames", &axes, wgpu::BufferUsages::empty())?;
        let resolution = self.settings.resolution;
        let radius = 0.5 * scene.bounds.size().length() * 1.001 + 1e-4;
        let texels_per_metre = resolution as f32 / (2.0 * radius);
        let grid = DeepGrid {
            center: scene.bounds.center(),
            radius,
            texels_per_metre,
            resolution,
            triangle_count: scene.traced_triangles,
            merge_distance: self.settings.merge_texels / texels_per_metre,
            sample_spacing: 2.0 * radius / (resolution * self.settings.supersampling) as f32,
            set_from_world: directions.rotation().inverse().into(),
            ..DeepGrid::default()
        };
        let mut images = DeepImages {
            directions,
            direction_axes: self.direction_axes.clone(),
            direction_cells: self.direction_cells.clone(),
            frames,
            chunks: Vec::new(),
            counts: DeepCounts::default(),
        };
        let samples = self.sample(frame, scene, &grid)?;
        let most = self.images_a_chunk(frame.device);
        let mut first_image = 0;
        while first_image < axes.len() as u32 {
            let image_count = most.min(axes.len() as u32 - first_image);
            let grid = DeepGrid { first_image, image_count, ..grid };
            let chunk = self.record_chunk(frame, scene, &images.frames, samples.as_ref(), grid, &mut images.counts)?;
            images.chunks.push(chunk);
            first_image += image_count;
        }
        Ok(images)
    }

    /// Images whose lists fit one binding, and, at a guess, whose fragments do.
    fn images_a_chunk(&self, device: &wgpu::Device) -> u32 {
        let texels = u64::from(self.settings.resolution).pow(2);
        let entries = device.limits().max_storage_buffer_binding_size / 4;
        let most = (entries / (texels * self.settings.fragments_a_texel.max(1))).clamp(1, 1 << 16) as u32;
        match self.builder {
            Builder::DepthPeeling(_) => most.min(DepthPeeling::most_images(device, self.settings.resolution)),
            _ => most,
        }
    }

    fn record_chunk(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        frames: &wgpu::Buffer,
        samples: Option<&Samples>,
        mut grid: DeepGrid,
        counts: &mut DeepCounts,
    ) -> Result<Chunk, RenderError> {
        let device = frame.device;
        let lists = grid.image_count * grid.resolution * grid.resolution;
        let list_bytes = 4 * (u64::from(lists) + 2);
        let uniform = |grid: &DeepGrid| uniform_buffer_of(device, "deep_images/grid", grid);
        let list_ends = storage_buffer(device, "deep_images/list_ends", list_bytes)?;
        let scene_bindings = scene.bindings();
        let grid_buffer = uniform(&grid);
        let mut shared = scene_bindings.buffer("deep_frames", frames).buffer("list_counters", &list_ends);
        if let Some(samples) = samples {
            shared = shared.buffer("surface_samples", &samples.samples).buffer("sample_count", &samples.count);
        }

        // Count, scan, make room.
        self.gather(frame, false, samples, &grid, &shared.clone().buffer("deep_grid", &grid_buffer))?;
        let total = self.scan.record(frame, &list_ends, lists + 2)?.clone();
        let drawn = u64::from(frame.read_now::<u32>(&total, 1)?[0]);
        let limit = device.limits().max_storage_buffer_binding_size / 4;
        if drawn > limit {
            return Err(RenderError::Overflow {
                list: "deep_images/fragments",
                needed: drawn,
                limit,
                remedy: "use fewer or coarser deep images, or less supersampling",
            });
        }
        grid.capacity = drawn as u32;
        let grid_buffer = uniform(&grid);

        // Fill, sort, merge.
        let depths = storage_buffer(device, "deep_images/filled_depths", 4 * drawn)?;
        let triangles = storage_buffer(device, "deep_images/filled_triangles", 4 * drawn)?;
        let shared = shared
            .buffer("deep_grid", &grid_buffer)
            .buffer("filled_depths", &depths)
            .buffer("filled_triangles", &triangles);
        self.gather(frame, true, samples, &grid, &shared)?;
        let kept = storage_buffer(device, "deep_images/kept", list_bytes)?;
        let all = [WIDTH.min(lists.div_ceil(WORKGROUP)), lists.div_ceil(WORKGROUP * WIDTH), 1];
        let sorting = shared.buffer("list_ends", &list_ends).buffer("kept", &kept);
        frame.dispatch(&self.sort, &sorting, all);

        // Compact: `kept` becomes the starts of what is left, in the same form as list_ends.
        let total = self.scan.record(frame, &kept, lists + 2)?.clone();
        let left = u64::from(frame.read_now::<u32>(&total, 1)?[0]);
        let compact_depths = storage_buffer(device, "deep_images/depths", 4 * left)?;
        let compact_triangles = storage_buffer(device, "deep_images/triangles", 4 * left)?;
        let compacting =
            sorting.buffer("compact_depths", &compact_depths).buffer("compact_triangles", &compact_triangles);
        frame.dispatch(&self.compact, &compacting, all);
        counts.drawn += drawn;
        counts.kept += left;
        counts.bytes += 8 * left + list_bytes;
        Ok(Chunk {
            grid,
            grid_buffer: grid_buffer.clone(),
            list_ends: kept.clone(),
            depths: compact_depths,
            triangles: compact_triangles,
            fragments: left,
        })
    }

    /// Samples of all surfaces, where the builder takes samples. The list is grown and drawn again where it was too small.
    fn sample(
        &mut self,
        frame: &mut Frame<'_>,
        scene: &GpuScene,
        grid: &DeepGrid,
    ) -> Result<Option<Samples>, RenderError> {
        let Builder::SinglePass { sample, capacity, .. } = &mut self.builder else { return Ok(None) };
        let raster = grid.resolution * self.settings.supersampling;
        let grid_buffer = uniform_buffer_of(frame.device, "deep_images/grid", grid);
        loop {
            let samples = storage_buffer(frame.device, "deep_images/samples", 32 * u64::from(*capacity))?;
            let count = storage_buffer(frame.device, "deep_images/sample_count", 4)?;
            let scene_bindings = scene.bindings();
            let bindings = scene_bindings
                .buffer("deep_grid", &grid_buffer)
                .buffer("surface_samples", &samples)
                .buffer("sample_count", &count);
            draw(frame, sample, "deep_images/sample", UVec2::new(3 * raster, raster), grid, 1, &bindings);
            let taken = frame.read_now::<u32>(&count, 1)?[0];
            if taken <= *capacity {
                return Ok(Some(Samples { samples, count, taken }));
            }
            tracing::debug!(taken, capacity = *capacity, "deep_images/samples grows");
            *capacity = taken;
        }
    }

    /// Counts or fills the lists of a chunk.
    fn gather(
        &mut self,
        frame: &mut Frame<'_>,
        fills: bool,
        samples: Option<&Samples>,
        grid: &DeepGrid,
        bindings: &Bindings<'_>,
    ) -> Result<(), RenderError> {
        match (&mut self.builder, samples) {
            (Builder::SinglePass { count, fill, .. }, Some(samples)) => {
                let groups = samples.taken.div_ceil(WORKGROUP).max(1);
                let groups = [WIDTH.min(groups), groups.div_ceil(WIDTH), 1];
                frame.dispatch(if fills { fill } else { count }, bindings, groups);
            }
            (Builder::PerDirection { count, fill }, _) => {
                let (pipeline, label) = if fills { (fill, "deep_images/fill") } else { (count, "deep_images/count") };
                let size = UVec2::splat(grid.resolution);
                draw(frame, pipeline, label, size, grid, grid.image_count, bindings);
            }
            (Builder::DepthPeeling(peeling), _) if fills => peeling.fill(frame, bindings),
            (Builder::DepthPeeling(peeling), _) => peeling.count(frame, grid, bindings)?,
            (Builder::SinglePass { .. }, None) => unreachable!("a single pass has taken its samples"),
        }
        Ok(())
    }
}

/// What the single pass has met.
#[derive(Debug)]
struct Samples {
    samples: wgpu::Buffer,
    count: wgpu::Buffer,
    taken: u32,
}

/// Draws all triangles, pulled by their index, into nothing.
fn draw(
    frame: &mut Frame<'_>,
    pipeline: &RasterPipeline,
    label: &str,
    size: UVec2,
    grid: &DeepGrid,
    instances: u32,
    bindings: &Bindings<'_>,
) {
    let nothing = target(frame.device, label, size, NO_TARGET, wgpu::TextureUsages::empty());
    let color = wgpu::RenderPassColorAttachment {
        view: &nothing,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
    };
    frame.render(label, &[Some(color)], None, |device, pass| {
        pipeline.set(pass);
        pipeline.bind(device, pass, bindings, 4);
        pass.draw(0..3 * grid.triangle_count, 0..instances);
    });
}
