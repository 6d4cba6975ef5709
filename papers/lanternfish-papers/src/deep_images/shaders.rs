//! The shaders of this folder, their features, and the data that they share with the host.

use glam::{UVec2, Vec2, Vec3, Vec4};
use lanternfish::shaders::{Root, Shaders};
use lanternfish_gpu::{Feature, SharedStruct, gpu_struct};

use super::{
    build::shared::PeeledFragment,
    settings::{DeepImageSettings, DeepSearch, DeepStore},
};

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
        Root::of("deep_images/build/distribute", &[STORES, &[&[], &[LITERAL]]]),
        Root::of("deep_images/build/per_triangle", &[STORES, &[&[], &[SLOPES]]]),
        Root::of("deep_images/build/per_direction", &[STORES]),
        Root::new("deep_images/build/depth_peeling"),
        Root::of("deep_images/build/peeled", &[STORES]),
        Root::of("deep_images/store/fill", &[&[&[], &[PAYLOAD]]]),
        Root::of("deep_images/store/sort", &[&[&[], &[PAYLOAD]], &[&[], &[BLOCK_SORT]]]),
        Root::of("deep_images/store/link", &[&[&[], &[PAYLOAD]]]),
    ],
    &[
        SharedStruct::of::<DeepGrid>(),
        SharedStruct::of::<DeepFrame>(),
        SharedStruct::of::<PeeledFragment>(),
        SharedStruct::of::<SurfaceSample>(),
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
/// Lists in linear arrays are sorted by networks, in blocks.
pub(crate) const BLOCK_SORT: Feature = Feature::new("block_sort");
/// Samples of the single pass become fragments as they are.
pub(super) const LITERAL: Feature = Feature::new("literal");
/// Depths hold the slopes of their surfaces.
pub(crate) const SLOPES: Feature = Feature::new("slopes");
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
        /// Distance beyond a texel's range of depths at which a ray across texels hits a fragment, texels.
        tolerance: f32,
        /// 1 if rays within a texel test the triangles of near fragments.
        tests_triangles: u32,
        /// Unused.
        _pad: UVec2,
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

impl DeepGrid {
    /// Number of lists the chunk has: a texel of an image each.
    pub(super) fn list_count(&self) -> u32 {
        self.image_count * self.resolution * self.resolution
    }
}

impl DeepImageSettings {
    /// Every variant of images that shaders read differently, with triangles or without.
    pub(crate) fn every_kind(payload: bool) -> Vec<Self> {
        let of_kind = |images: Self| {
            let (searches, slopes): (&[_], &[_]) = match images.store {
                DeepStore::LinearArray => (DeepSearch::ALL, &[false, true]),
                DeepStore::LinkedList | DeepStore::SortedLinkedList => (&[DeepSearch::Bisection], &[false]),
            };
            let of = move |slopes| searches.iter().map(move |search| Self { search: *search, slopes, ..images });
            slopes.iter().flat_map(move |slopes| of(*slopes))
        };
        DeepStore::ALL.iter().flat_map(|store| of_kind(Self { store: *store, payload, ..Self::default() })).collect()
    }

    /// Features of a shader that imports `deep_images/fragments`, so that it reads images of these settings.
    pub fn fragment_features(&self) -> Vec<Feature> {
        let store = match self.store {
            DeepStore::LinearArray => None,
            DeepStore::LinkedList => Some(LINKED_LIST),
            DeepStore::SortedLinkedList => Some(SORTED_LINKED_LIST),
        };
        let steps = self.store == DeepStore::LinearArray && self.search == DeepSearch::LinearSteps;
        let search = steps.then_some(LINEAR_STEPS);
        let slopes = (self.slopes && self.store == DeepStore::LinearArray).then_some(SLOPES);
        store.into_iter().chain(search).chain(self.payload.then_some(PAYLOAD)).chain(slopes).collect()
    }
}
