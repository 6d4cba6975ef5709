//! The scene as sorted rays: orthographic images of every direction of a set, each texel a list of all surfaces along its
//! axis [Archer2019, §3.1; Niessner2010, §3.1].
//!
//! 1. Grid: a sphere around the scene; images of one size around it; as many images per chunk as fit one binding.
//! 2. Build (`build/`): every triangle is put into every texel, of every image, whose axis intersects it (or the scene is drawn once, and
//!    its samples are put into the images; or it is drawn once per direction, as a baseline).
//! 3. Store (`store/`): fragments go to the lists of their texels: into an array (scan, fill, sort, merge, compact), or into linked lists.
//! 4. Trace (`rays/within_texel/`, `rays/across_texels/`): rays read lists through one interface, `fragments.wesl`.

mod build;
pub mod directions;
mod holes;
mod kept;
pub mod settings;
mod store;
mod structure;
#[cfg(test)]
mod tests;

#[cfg(test)]
mod cpu_reference;
mod validate;
pub mod view;

use glam::{UVec2, Vec2, Vec3, Vec4};
use lanternfish::shaders::{Root, Shaders};
use lanternfish_gpu::{Bindings, Feature, SharedStruct, gpu_struct};

use self::directions::Directions;
pub use self::{
    build::{DeepImageBuilder, PeeledFragment},
    holes::Holes,
    kept::KeptDeepImages,
    structure::{ACROSS_TEXELS, WITHIN_TEXEL},
    validate::{Fragment, ListFault},
};
use crate::deep_images::settings::{DeepDepth, DeepImageSettings, DeepSearch, DeepStore};

/// Features of each store, without and with the fragments' triangles.
const STORES: &[&[Feature]] = &[
    &[APPEND],
    &[APPEND, PAYLOAD],
    &[LINKED_LIST],
    &[LINKED_LIST, PAYLOAD],
    &[SORTED_LINKED_LIST],
    &[SORTED_LINKED_LIST, PAYLOAD],
];

/// The shaders of this folder.
pub(crate) const DECLARED: Shaders = Shaders::of(
    &crate::shaders::SHADERS,
    &[
        Root::new("deep_images/build/single_pass"),
        Root::of("deep_images/build/distribute", &[STORES]),
        Root::of("deep_images/build/per_triangle", &[STORES]),
        Root::of("deep_images/build/per_direction", &[STORES]),
        Root::new("deep_images/build/depth_peeling"),
        Root::of("deep_images/build/peeled", &[STORES]),
        Root::of("deep_images/store/fill", &[&[&[], &[PAYLOAD]]]),
        Root::of("deep_images/store/sort", &[&[&[], &[PAYLOAD]], &[&[], &[BLOCK_SORT]]]),
        Root::new("deep_images/store/pack"),
        Root::of("deep_images/store/link", &[&[&[], &[PAYLOAD]]]),
        Root::of("deep_images/view/points", &[&[&[PAYLOAD]], &[&[], &[DEPTH_16]]]),
        Root::of("deep_images/view/texels", &[&[&[], &[PAYLOAD]], &[&[], &[DEPTH_16]], &[&[], &[LINEAR_STEPS]]]),
        Root::new("deep_images/view/paint"),
    ],
    &[
        SharedStruct::of::<DeepGrid>(),
        SharedStruct::of::<DeepFrame>(),
        SharedStruct::of::<PeeledFragment>(),
        SharedStruct::of::<SurfaceSample>(),
        SharedStruct::of::<view::PointRange>(),
        SharedStruct::of::<view::TexelQuery>(),
        SharedStruct::of::<view::TexelScale>(),
    ],
);

/// Fragments are put into linear arrays.
pub(crate) const APPEND: Feature = Feature::new("append");
/// Fragments are in unsorted linked lists.
pub(crate) const LINKED_LIST: Feature = Feature::new("linked_list");
/// Fragments are in linked lists, the nearest first.
pub(crate) const SORTED_LINKED_LIST: Feature = Feature::new("sorted_linked_list");
/// Fragments store their triangles.
pub(crate) const PAYLOAD: Feature = Feature::new("payload");
/// Depths of fragments have 16 bits.
pub(crate) const DEPTH_16: Feature = Feature::new("depth_16");
/// Lists in linear arrays are sorted by networks, in blocks.
pub(crate) const BLOCK_SORT: Feature = Feature::new("block_sort");
/// Lists in linear arrays are searched linearly.
pub(crate) const LINEAR_STEPS: Feature = Feature::new("linear_steps");

gpu_struct! {
    /// Placement of deep images.
    pub struct DeepGrid {
        /// Centre of the sphere around the scene, world space, m.
        center: Vec3,
        /// Radius of that sphere, m.
        radius: f32,
        /// Texels per metre: texels across an image over its width.
        texels_per_metre: f32,
        /// Texels across and down an image.
        resolution: u32,
        /// Images of the current chunk.
        image_count: u32,
        /// Images of all chunks before it.
        first_image: u32,
        /// Number of drawn triangles.
        triangle_count: u32,
        /// Capacity of the chunk's lists, fragments.
        capacity: u32,
        /// Fragments of one list closer to each other than this are one surface, m.
        merge_distance: f32,
        /// Distance between the single pass' samples, across the axis along which a triangle is drawn, m.
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

/// Deep images of a scene, in chunks. A clone shares their buffers.
#[derive(Clone, Debug)]
pub struct DeepImages {
    /// The settings they were built with.
    pub settings: DeepImageSettings,
    /// The directions of the images.
    pub directions: Directions,
    /// The table that maps a direction to the image of the nearest axis, bound as `direction_cells`.
    pub direction_cells: wgpu::Buffer,
    /// Axes of all images on the device, bound as `deep_frames`.
    pub frames: wgpu::Buffer,
    /// The images' lists; every image is in one chunk.
    pub chunks: Vec<Chunk>,
    /// Number of fragments building drew and kept, and the bytes they take.
    pub counts: DeepCounts,
}

/// Some of the images, with the buffers of their lists and fragments.
#[derive(Clone, Debug)]
pub struct Chunk {
    /// Placement of the chunk's images.
    pub grid: DeepGrid,
    /// The grid as a uniform, bound as `deep_grid`.
    pub grid_buffer: wgpu::Buffer,
    /// Start of each list: `store/linear_array.wesl`, `store/links.wesl`.
    pub list_starts: wgpu::Buffer,
    /// Linked lists: the link of each fragment, `store/links.wesl`.
    pub next: Option<wgpu::Buffer>,
    /// Depths of all lists, m along the image's axis from the scene's middle: `store/depths.wesl`.
    pub depths: wgpu::Buffer,
    /// Triangle of each fragment, in the order of the BVH's leaves, if there is a payload.
    pub triangles: Option<wgpu::Buffer>,
    /// Number of fragments all lists of the chunk hold; where frames do not wait, how many there is room for.
    pub fragments: u64,
    /// Number of fragments drawn into them.
    drawn: u64,
    /// Number of fragments put into lists before merging, in the first of four words: of linear arrays.
    counted: Option<wgpu::Buffer>,
}

/// Number of fragments building drew and kept, and the bytes they take. All but `bytes` of linked lists, which depends on what was built
/// before, is exact; where frames do not wait it is what there is room for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeepCounts {
    /// Fragments that were drawn into lists.
    pub drawn: u64,
    /// Fragments left after merging; in linked lists, all that were drawn.
    pub kept: u64,
    /// Bytes of all buffers of lists and fragments: 4 per list; per fragment 4 or 2 for its depth, 4 for its triangle, 4 for the link of a
    /// linked list.
    pub bytes: u64,
}

impl DeepImageSettings {
    /// Every variant of images that shaders read differently, with triangles or without.
    pub(crate) fn every_kind(payload: bool) -> Vec<Self> {
        let stores = DeepStore::ALL.iter().copied();
        let depths = stores.flat_map(|store| {
            let held = DeepDepth::ALL.iter().copied().filter(move |depth| store.holds(*depth));
            held.map(move |depth| Self { store, depth, payload, ..Self::default() })
        });
        let of_kind = |images: Self| {
            let searches = match images.store {
                DeepStore::LinearArray => DeepSearch::ALL,
                DeepStore::LinkedList | DeepStore::SortedLinkedList => &[DeepSearch::Bisection],
            };
            searches.iter().map(move |search| Self { search: *search, ..images })
        };
        depths.flat_map(of_kind).collect()
    }

    /// Features of a shader that imports `deep_images/fragments`, so that it reads images of these settings.
    pub fn fragment_features(&self) -> Vec<Feature> {
        let store = match self.store {
            DeepStore::LinearArray => None,
            DeepStore::LinkedList => Some(LINKED_LIST),
            DeepStore::SortedLinkedList => Some(SORTED_LINKED_LIST),
        };
        let depth = (self.depth == DeepDepth::Bits16).then_some(DEPTH_16);
        let steps = self.store == DeepStore::LinearArray && self.search == DeepSearch::LinearSteps;
        let search = steps.then_some(LINEAR_STEPS);
        store.into_iter().chain(depth).chain(search).chain(self.payload.then_some(PAYLOAD)).collect()
    }
}

impl DeepImages {
    /// Counts the chunks' fragments.
    fn count(&mut self) {
        let sum = |of: fn(&Chunk) -> u64| self.chunks.iter().map(of).sum();
        self.counts = DeepCounts { drawn: sum(|c| c.drawn), kept: sum(|c| c.fragments), bytes: sum(Chunk::bytes) };
    }

    /// Bindings of `nearest_image.wesl`, in addition to the grid of any chunk.
    pub fn direction_bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("direction_cells", &self.direction_cells)
    }
}

impl Chunk {
    /// Bindings under the names in the shaders; `frames`: [`DeepImages::frames`] of the images that this chunk belongs to.
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

    /// Number of lists the chunk has: a texel of an image each.
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
    /// Number of lists the chunk has: a texel of an image each.
    fn list_count(&self) -> u32 {
        self.image_count * self.resolution * self.resolution
    }
}

gpu_struct! {
    /// A sample of the scene's surfaces from the single pass.
    pub struct SurfaceSample {
        /// Position, world space, m.
        p_world: Vec3,
        /// Index of the triangle, in the order of the BVH's leaves.
        triangle: u32,
        /// Barycentric weights of the triangle's second and third corner.
        weights: Vec2,
        /// Unused.
        _pad: UVec2,
    }
}
