//! Settings of deep images.

use lanternfish_scene::named_enum;

use super::directions::DirectionSet;

/// How the scene is kept as deep images [Archer2019; Niessner2010].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeepImageSettings {
    /// Which directions there are images of. More: rays closer to an image's axis, more memory.
    pub directions: DirectionSet,
    /// Texels across and down an image. More: finer, more memory (by the square).
    pub resolution: u32,
    /// How they are built.
    pub builder: DeepBuilder,
    /// How many times finer than an image the single pass draws. More: fewer holes, slower by the square.
    pub supersampling: u32,
    /// Fragments of a texel nearer to each other than so many texels are one surface. More: fewer fragments; thin walls lose
    /// their thickness. Linked lists are not merged.
    pub merge_texels: f32,
    /// Fragments that a texel's list is expected to have in the mean. A chunk takes as many images as fit one binding with so many; rays go through
    /// one chunk after the other. More: more chunks, slower rays. Fewer: a chunk that does not fit is built in vain once, then divided.
    pub fragments_a_texel: u64,
    /// Frames, 1 to 64, over which images are built again once something has moved, where frames do not wait ([`lanternfish::Renderer::record`]): each builds
    /// those of as many directions, the oldest first. More: less time in each frame, and rays in some directions meet things where they
    /// were so many frames ago. Images always have all of them again.
    pub slices: u32,
    /// How lists lie in memory.
    pub store: DeepStore,
    /// How a depth lies in memory.
    pub depth: DeepDepth,
    /// How a linear array's lists are searched. The result is the same.
    pub search: DeepSearch,
    /// Whether a fragment knows its triangle: 4 bytes each. Without, rays find distances alone.
    pub payload: bool,
}

impl Default for DeepImageSettings {
    fn default() -> Self {
        Self {
            directions: DirectionSet::ZonalEqualArea { count: 169 },
            resolution: 64,
            builder: DeepBuilder::PerTriangle,
            supersampling: 1,
            merge_texels: 0.02,
            fragments_a_texel: 8,
            slices: 1,
            store: DeepStore::LinearArray,
            depth: DeepDepth::Bits32,
            search: DeepSearch::Bisection,
            payload: true,
        }
    }
}

named_enum! {
    /// How deep images are built.
    DeepBuilder {
        /// All from one draw of the scene [Archer2019, §3.1].
        SinglePass = "single_pass": "All images from one draw of the scene",
        /// Every triangle is put into each image's texels by arithmetic: what a draw for each direction finds, without one.
        PerTriangle = "per_triangle": "By arithmetic from every triangle: exact",
        /// A draw for each direction: the baseline.
        PerDirection = "per_direction": "A draw for each direction: exact, and slow",
        /// A draw for each layer of surfaces of all images at once [Niessner2010, §3.1]: another baseline, which is the slowest.
        DepthPeeling = "depth_peeling": "A draw for each layer of surfaces: the baseline, slowest",
    }
}

named_enum! {
    /// How the lists of deep images lie in memory. Bytes a fragment are with 32 bits of depth and a triangle; 4 fewer without.
    DeepStore {
        /// Behind each other in one array, sorted, surfaces merged: 8 bytes a fragment, 4 a texel [Archer2019, fig. 5].
        LinearArray = "linear_array",
        /// Each fragment names another, in no order: nothing is done after the builder, 12 bytes a fragment.
        LinkedList = "linked_list",
        /// Each fragment names the next by depth: put there while the lists are built, in time of the square of their
        /// lengths; 12 bytes a fragment [Aalund2015, §3].
        SortedLinkedList = "sorted_linked_list",
    }
}

named_enum! {
    /// How the next fragment of a sorted list is looked for.
    DeepSearch {
        /// By halves: as many reads as the list's length has binary digits.
        Bisection = "bisection",
        /// One after the other from the end that the ray comes from [Archer2019, §3.2].
        LinearSteps = "linear_steps",
    }
}

impl DeepStore {
    /// Whether it can hold such depths: linked lists are built where they stay, and two builders cannot write halves of a word.
    pub const fn holds(self, depth: DeepDepth) -> bool {
        matches!((self, depth), (Self::LinearArray, _) | (_, DeepDepth::Bits32))
    }
}

named_enum! {
    /// How a depth of deep images lies in memory.
    DeepDepth {
        /// As a float.
        Bits32 = "32",
        /// In 65,534 steps of the diameter of the sphere around the scene: 2 bytes less a fragment. Linear arrays only.
        Bits16 = "16",
    }
}
