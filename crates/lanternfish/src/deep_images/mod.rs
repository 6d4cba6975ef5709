//! The scene as sorted rays: orthographic images of every direction of a set, each texel a list of all surfaces along its
//! axis [Archer2019, §3.1; Niessner2010, §3.1].
//!
//! 1. Grid: a sphere around the scene; images of one size around it; as many images a chunk as fit one binding.
//! 2. Sample: the scene is drawn once, and every fragment kept (or drawn once a direction, as a yardstick).
//! 3. Count: every sample adds one to the list of its texel in every image.
//! 4. Scan: counts become starts; the host reads the total and makes room.
//! 5. Fill: every sample goes to its lists.
//! 6. Sort, merge, compact: lists in ascending order, one entry a surface, nothing between them.

mod build;
pub mod directions;
mod kept;
#[cfg(test)]
mod tests;
pub mod trace;
#[cfg(test)]
mod twin;

use glam::{UVec2, Vec2, Vec3, Vec4};
use lanternfish_gpu::{Bindings, gpu_struct};

use self::directions::Directions;
pub use self::{
    build::{DeepImageBuilder, PeeledFragment},
    kept::KeptDeepImages,
};

gpu_struct! {
    /// Where deep images lie.
    pub struct DeepGrid {
        /// Of the sphere around the scene, world space, m.
        center: Vec3,
        /// Of the same, m.
        radius: f32,
        /// Texels across an image over its width in metres.
        texels_per_metre: f32,
        /// Texels across and down an image.
        resolution: u32,
        /// Images of the chunk in hand.
        image_count: u32,
        /// Images of all chunks before it.
        first_image: u32,
        /// Triangles that are drawn.
        triangle_count: u32,
        /// Fragments that the chunk's lists have room for.
        capacity: u32,
        /// Fragments of one list nearer to each other than this are one surface, m.
        merge_distance: f32,
        /// Between the single pass' samples, across the axis that a triangle is drawn along, m.
        sample_spacing: f32,
        /// Rotation into the space of the set of directions, a unit quaternion.
        set_from_world: Vec4,
    }
}

gpu_struct! {
    /// Unit axes of an image, world space.
    pub struct DeepFrame {
        /// Right.
        x: Vec3,
        /// Unused.
        _pad_x: f32,
        /// Up.
        y: Vec3,
        /// Unused.
        _pad_y: f32,
        /// Along the image's direction.
        z: Vec3,
        /// Unused.
        _pad_z: f32,
    }
}

/// Workgroups along x of passes over lists: the shaders' `WIDTH`.
pub(crate) const WIDTH: u32 = 1024;
/// Invocations of their workgroups.
pub(crate) const WORKGROUP: u32 = 64;

/// Deep images of a scene, in chunks.
#[derive(Debug)]
pub struct DeepImages {
    /// Their directions.
    pub directions: Directions,
    /// Their axes in the set's own space, bound as `direction_axes`.
    pub direction_axes: wgpu::Buffer,
    /// The table that finds the nearest, bound as `direction_cells`.
    pub direction_cells: wgpu::Buffer,
    /// Axes of all images on the device, bound as `deep_frames`.
    pub frames: wgpu::Buffer,
    /// Together they hold every image.
    pub chunks: Vec<Chunk>,
    /// What building came to.
    pub counts: DeepCounts,
}

/// Some of the images.
#[derive(Clone, Debug)]
pub struct Chunk {
    /// Where the chunk's images lie.
    pub grid: DeepGrid,
    /// The same, bound as `deep_grid`.
    pub grid_buffer: wgpu::Buffer,
    /// Where lists end: see `lists.wesl`.
    pub list_ends: wgpu::Buffer,
    /// Depths of all lists, m along the image's axis from the scene's middle.
    pub depths: wgpu::Buffer,
    /// Triangle of each fragment, in the order of the BVH's leaves.
    pub triangles: wgpu::Buffer,
    /// Fragments of all lists.
    pub fragments: u64,
}

/// What building came to; exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeepCounts {
    /// Fragments that were drawn into lists.
    pub drawn: u64,
    /// Those that are left after merging.
    pub kept: u64,
    /// Bytes of lists and fragments.
    pub bytes: u64,
}

impl DeepImages {
    /// What `nearest_image.wesl` needs beside the grid of any chunk.
    pub fn direction_bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("direction_axes", &self.direction_axes).buffer("direction_cells", &self.direction_cells)
    }
}

impl Chunk {
    /// What shaders call it; with `frames`, of the images it is a chunk of.
    pub fn bindings<'a>(&'a self, frames: &'a wgpu::Buffer) -> Bindings<'a> {
        Bindings::new()
            .buffer("deep_grid", &self.grid_buffer)
            .buffer("deep_frames", frames)
            .buffer("list_ends", &self.list_ends)
            .buffer("fragment_depths", &self.depths)
            .buffer("fragment_triangles", &self.triangles)
    }

    /// Lists: a texel of an image each.
    pub fn list_count(&self) -> u32 {
        self.grid.image_count * self.grid.resolution * self.grid.resolution
    }
}

gpu_struct! {
    /// Where the single pass meets a surface.
    pub struct SurfaceSample {
        /// World space, m.
        p_world: Vec3,
        /// In the order of the BVH's leaves.
        triangle: u32,
        /// Of the second and third corner.
        weights: Vec2,
        /// Unused.
        _pad: UVec2,
    }
}
