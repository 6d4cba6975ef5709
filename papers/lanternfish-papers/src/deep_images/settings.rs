//! Settings of deep images.

use std::{fmt, str::FromStr};

use lanternfish_scene::{Setting, named_enum};

use super::directions::{DirectionSet, Directions};

impl fmt::Display for DirectionSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ZonalEqualArea { count } => write!(f, "zonal:{count}"),
            Self::StacksSlices { stacks, slices } => write!(f, "stacks:{stacks}x{slices}"),
            Self::Cube { k } => write!(f, "cube:{k}"),
        }
    }
}

/// Reads `zonal:N`, `stacks:AxB` or `cube:K`. Too many directions are an error.
impl FromStr for DirectionSet {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = "expected zonal:N, stacks:STACKSxSLICES or cube:K, e.g. zonal:169, stacks:13x13 or cube:5";
        let number = |text: &str| {
            let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
            // Overflowing numbers are out of range too.
            if digits { Ok(text.parse::<u32>().unwrap_or(u32::MAX)) } else { Err(format!("{text:?}: {expected}")) }
        };
        let set = match text.split_once(':') {
            Some(("zonal", count)) => Self::ZonalEqualArea { count: number(count)? },
            Some(("cube", k)) => Self::Cube { k: number(k)? },
            Some(("stacks", counts)) => {
                let (stacks, slices) = counts.split_once('x').ok_or(expected)?;
                Self::StacksSlices { stacks: number(stacks)?, slices: number(slices)? }
            }
            _ => return Err(expected.to_owned()),
        };
        match set {
            _ if !(1..=u64::from(Directions::MAX_COUNT)).contains(&set.count()) => {
                Err(format!("{} directions: expected 1 to {}", set.count(), Directions::MAX_COUNT))
            }
            Self::StacksSlices { slices, .. } if slices > Directions::MAX_SLICES => {
                Err(format!("{slices} slices: expected at most {}; take more stacks", Directions::MAX_SLICES))
            }
            _ => Ok(set),
        }
    }
}

impl Setting for DirectionSet {
    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn read(&mut self, text: &str) -> Result<(), String> {
        *self = text.parse()?;
        Ok(())
    }
}

/// The scene as deep images [Archer2019; Niessner2010].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeepImageSettings {
    /// The directions of the images. More: rays closer to an image's axis, more memory.
    pub directions: DirectionSet,
    /// Texels across and down an image. More: finer, more memory (by the square).
    pub resolution: u32,
    /// How the images are built.
    pub builder: DeepBuilder,
    /// Resolution of the single pass relative to an image. More: fewer holes, slower by the square.
    pub supersampling: u32,
    /// Fragments of a texel closer to each other than this many texels are one surface. More: fewer fragments; thin
    /// walls lose their thickness. Linked lists are not merged.
    pub merge_texels: f32,
    /// Expected mean number of fragments in a texel's list. A chunk takes as many images as fit one binding with this
    /// number; rays go through one chunk after the other. More: more chunks, slower rays. Fewer: a chunk that does not
    /// fit is built in vain once, then divided.
    pub fragments_a_texel: u64,
    /// Frames, 1 to 64, over which images are rebuilt after a change with deferred readback
    /// ([`lanternfish::Renderer::record`]): each builds an equal number of directions, the oldest first. More: less
    /// time in each frame, and rays in some directions hit objects at their position up to that many frames ago.
    /// Blocking frames rebuild all images at once.
    pub slices: u32,
    /// Memory layout of the lists.
    pub store: DeepStore,
    /// Sort of a linear array's lists. The result is the same.
    pub sort: DeepSort,
    /// Search in a linear array's lists. The result is the same.
    pub search: DeepSearch,
    /// Distance beyond a texel's range of depths at which a ray across texels hits a fragment, texels: ε of
    /// [Niessner2010, §3.2]. More: fewer rays slip through steep surfaces, more hit what they pass.
    pub tolerance: f32,
    /// True if closest hits within a texel test the triangles of near fragments. Otherwise the first fragment beyond
    /// the ray's own is hit [Aalund2015, §3.1].
    pub tests_triangles: bool,
    /// Stores the triangle of each fragment, 4 bytes. Without it, rays return distances only.
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
            sort: DeepSort::Selection,
            search: DeepSearch::Bisection,
            tolerance: 0.5,
            tests_triangles: true,
            payload: true,
        }
    }
}

impl DeepImageSettings {
    /// As in [Archer2019, §3.1, §3.2, §4]: 13 stacks of 13 slices, 64² texels, one draw, arrays sorted in blocks, of
    /// which no fragment is merged with another, and linear search. His fragments have no triangles; `payload` has no
    /// effect on distances.
    pub const ARCHER: Self = Self {
        directions: DirectionSet::StacksSlices { stacks: 13, slices: 13 },
        resolution: 64,
        builder: DeepBuilder::SinglePassLiteral,
        supersampling: 1,
        merge_texels: 0.0,
        fragments_a_texel: 8,
        slices: 1,
        store: DeepStore::LinearArray,
        sort: DeepSort::Blocks,
        search: DeepSearch::LinearSteps,
        tolerance: 0.5,
        tests_triangles: true,
        payload: true,
    };
}

named_enum! {
    /// How deep images are built.
    DeepBuilder {
        /// All from one draw of the scene [Archer2019, §3.1].
        SinglePass = "single_pass": "All images from one draw of the scene",
        /// The same as the paper has it [Archer2019, fig. 3]: every sample becomes a fragment of every image, at the
        /// sample's own depth, in the texel that it falls into. Ours moves it to the texel's axis, leaves it out where
        /// that misses the triangle, and stores one of several in a texel.
        SinglePassLiteral = "single_pass_literal": "The same as in Archer 2019: no sample is moved to a texel's axis or left out",
        /// Every triangle is put into each image's texels by computation: the result of a draw for each direction,
        /// without a rasterizer.
        PerTriangle = "per_triangle": "By computation from every triangle: exact",
        /// One draw per direction: the baseline.
        PerDirection = "per_direction": "One draw per direction: exact, but slow",
        /// One draw per layer of surfaces of all images at once [Niessner2010, §3.1]: another baseline, the slowest
        /// builder.
        DepthPeeling = "depth_peeling": "One draw per layer of surfaces: the baseline, slowest",
    }
}

named_enum! {
    /// Memory layout of the lists of deep images. Bytes per fragment include 32 bits of depth and a triangle; 4 fewer
    /// without it.
    DeepStore {
        /// Contiguous in one array, sorted, surfaces merged: 8 bytes per fragment, 4 per texel [Archer2019, fig. 5].
        LinearArray = "linear_array": "Contiguous in one array, sorted",
        /// Each fragment links to another, unsorted: no pass after the builder, 12 bytes per fragment.
        LinkedList = "linked_list": "Each fragment links to another, unsorted",
        /// Each fragment links to the next by depth: 12 bytes per fragment. A pass of its own inserts them, after the
        /// builder has written them, in time of the square of the list lengths; the paper inserts them while it draws
        /// [Aalund2015, §3].
        SortedLinkedList = "sorted_linked_list": "Each fragment links to the next by depth, as in Aalund 2015",
    }
}

named_enum! {
    /// Sort of the lists of a linear array. The result is the same.
    DeepSort {
        /// Short lists by selection, long ones by Shell's sort, in memory.
        Selection = "selection": "By selection, long lists by Shell's sort",
        /// By bitonic networks in registers, 32 fragments at a time; the blocks of longer lists are merged [Archer2019,
        /// §3.1]. Lists of more than 512 fragments are sorted as with `Selection`.
        Blocks = "blocks": "By bitonic networks, in blocks of 32, which are merged",
    }
}

named_enum! {
    /// Search for the next fragment in a sorted list.
    DeepSearch {
        /// Bisection: as many reads as the list's length has binary digits.
        Bisection = "bisection": "By bisection",
        /// Linearly from the end where the ray enters [Archer2019, §3.2].
        LinearSteps = "linear_steps": "From fragment to fragment",
    }
}

impl DeepBuilder {
    /// True of builders that draw the scene once, and sample it then.
    pub const fn is_single_pass(self) -> bool {
        matches!(self, Self::SinglePass | Self::SinglePassLiteral)
    }
}
