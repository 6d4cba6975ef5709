//! The scene as sorted rays: orthographic images of every direction of a set, each texel a list of all surfaces along its
//! axis [Archer2019, §3.1; Niessner2010, §3.1].
//!
//! 1. Grid: a sphere around the scene; images of one size around it; as many images a chunk as fit one binding.
//! 2. Build (`build/`): every triangle is put into every texel, of every image, whose axis meets it (or the scene is drawn once, and its
//!    samples are put there; or drawn once a direction, as a yardstick).
//! 3. Store (`store/`): fragments go to the lists of their texels: into an array (scan, fill, sort, merge, compact), or into linked lists.
//! 4. Trace (`rays/deep_image/`): rays read lists through one interface, `fragments.wesl`.

mod build;
pub mod directions;
mod holes;
mod kept;
pub mod settings;
mod store;
#[cfg(test)]
mod tests;

#[cfg(test)]
mod twin;
mod validate;
pub mod view;

use glam::{UVec2, Vec2, Vec3, Vec4};
use lanternfish_gpu::{Bindings, Feature, SharedStruct, gpu_struct};

use self::directions::Directions;
pub use self::{
    build::{DeepImageBuilder, PeeledFragment},
    holes::Holes,
    kept::KeptDeepImages,
    validate::{Fragment, ListFault},
};
use crate::{
    settings::{DeepDepth, DeepImageSettings, DeepStore},
    shaders::{Root, Shaders},
};

/// Stores, and whether fragments know their triangles.
const STORES: &[&[Feature]] = &[
    &[APPEND],
    &[APPEND, PAYLOAD],
    &[LINKED_LIST],
    &[LINKED_LIST, PAYLOAD],
    &[SORTED_LINKED_LIST],
    &[SORTED_LINKED_LIST, PAYLOAD],
];

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders {
    roots: &[
        Root::new("deep_images/build/single_pass"),
        Root::of("deep_images/build/distribute", &[STORES]),
        Root::of("deep_images/build/per_triangle", &[STORES]),
        Root::of("deep_images/build/per_direction", &[STORES]),
        Root::new("deep_images/build/depth_peeling"),
        Root::of("deep_images/build/peeled", &[STORES]),
        Root::of("deep_images/store/fill", &[&[&[], &[PAYLOAD]]]),
        Root::of("deep_images/store/sort", &[&[&[], &[PAYLOAD]]]),
        Root::new("deep_images/store/pack"),
        Root::of("deep_images/store/link", &[&[&[], &[PAYLOAD]]]),
        Root::of("deep_images/view/points", &[&[&[PAYLOAD]], &[&[], &[DEPTH_16]]]),
        Root::of("deep_images/view/texels", &[&[&[], &[PAYLOAD]], &[&[], &[DEPTH_16]]]),
        Root::new("deep_images/view/paint"),
    ],
    structs: &[
        SharedStruct::of::<DeepGrid>(),
        SharedStruct::of::<DeepFrame>(),
        SharedStruct::of::<PeeledFragment>(),
        SharedStruct::of::<SurfaceSample>(),
        SharedStruct::of::<view::PointRange>(),
        SharedStruct::of::<view::TexelQuery>(),
        SharedStruct::of::<view::TexelScale>(),
    ],
};

/// Fragments are put into linear arrays.
pub(crate) const APPEND: Feature = Feature("append");
/// Fragments are in linked lists, in no order.
pub(crate) const LINKED_LIST: Feature = Feature("linked_list");
/// Fragments are in linked lists, the nearest first.
pub(crate) const SORTED_LINKED_LIST: Feature = Feature("sorted_linked_list");
/// Fragments know their triangles.
pub(crate) const PAYLOAD: Feature = Feature("payload");
/// Depths of fragments have 16 bits.
pub(crate) const DEPTH_16: Feature = Feature("depth_16");

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

/// Workgroups of a pass with an invocation for each of so many.
pub(crate) fn workgroups(invocations: u32) -> [u32; 3] {
    let groups = invocations.div_ceil(WORKGROUP);
    [WIDTH.min(groups), groups.div_ceil(WIDTH), 1]
}

/// Deep images of a scene, in chunks.
#[derive(Debug)]
pub struct DeepImages {
    /// What they were built with.
    pub settings: DeepImageSettings,
    /// Their directions.
    pub directions: Directions,
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
    /// Where lists start: `store/linear_array.wesl`, `store/links.wesl`.
    pub list_starts: wgpu::Buffer,
    /// Linked lists: the link of each fragment, `store/links.wesl`.
    pub next: Option<wgpu::Buffer>,
    /// Depths of all lists, m along the image's axis from the scene's middle: `store/depths.wesl`.
    pub depths: wgpu::Buffer,
    /// Triangle of each fragment, in the order of the BVH's leaves, where there is a payload.
    pub triangles: Option<wgpu::Buffer>,
    /// Fragments of all lists.
    pub fragments: u64,
}

/// What building came to. All but `bytes` of linked lists, which depends on what was built before, is exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeepCounts {
    /// Fragments that were drawn into lists.
    pub drawn: u64,
    /// Those that are left after merging; all, of linked lists.
    pub kept: u64,
    /// Of all buffers that lists and fragments lie in: 4 a list; and a fragment, 4 or 2 for its depth, 4 for its triangle, 4 for
    /// the link of a linked list.
    pub bytes: u64,
}

impl DeepImageSettings {
    /// Features with which a shader that imports `deep_images/fragments` is linked, so that it reads images of these settings.
    pub fn fragment_features(&self) -> Vec<Feature> {
        let store = match self.store {
            DeepStore::LinearArray => None,
            DeepStore::LinkedList => Some(LINKED_LIST),
            DeepStore::SortedLinkedList => Some(SORTED_LINKED_LIST),
        };
        let depth = (self.depth == DeepDepth::Bits16).then_some(DEPTH_16);
        store.into_iter().chain(depth).chain(self.payload.then_some(PAYLOAD)).collect()
    }
}

impl DeepImages {
    /// What `nearest_image.wesl` needs beside the grid of any chunk.
    pub fn direction_bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("direction_cells", &self.direction_cells)
    }
}

impl Chunk {
    /// What shaders call it; with `frames`, of the images it is a chunk of.
    pub fn bindings<'a>(&'a self, frames: &'a wgpu::Buffer) -> Bindings<'a> {
        let bindings = Bindings::new()
            .buffer("deep_grid", &self.grid_buffer)
            .buffer("deep_frames", frames)
            .buffer("list_starts", &self.list_starts)
            .buffer("fragment_depths", &self.depths);
        let optional = [("next_fragments", &self.next), ("fragment_triangles", &self.triangles)];
        optional.into_iter().fold(bindings, |bindings, (name, buffer)| match buffer {
            Some(buffer) => bindings.buffer(name, buffer),
            None => bindings,
        })
    }

    /// Lists: a texel of an image each.
    pub fn list_count(&self) -> u32 {
        self.grid.list_count()
    }

    /// Bytes of its lists and fragments.
    fn bytes(&self) -> u64 {
        let buffers = [Some(&self.list_starts), Some(&self.depths), self.next.as_ref(), self.triangles.as_ref()];
        buffers.into_iter().flatten().map(wgpu::Buffer::size).sum()
    }
}

impl DeepGrid {
    /// Lists of the chunk in hand: a texel of an image each.
    fn list_count(&self) -> u32 {
        self.image_count * self.resolution * self.resolution
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
