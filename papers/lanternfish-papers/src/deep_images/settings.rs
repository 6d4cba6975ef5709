//! Settings of deep images.

use std::{fmt, str::FromStr};

use lanternfish::{parameters, technique::Range};
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

parameters! {
    /// The scene as deep images [Archer2019; Niessner2010].
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct DeepImageSettings {
        /// Texels across and down each deep image. More: finer, and more memory by the square. Without it: 64, or the
        /// value of `quality`.
        resolution: u32 = 64, "deep-resolution" "N" Range::Count(4, 1024);
        /// Set of deep-image directions: zonal:N, stacks:AxB or cube:K. More: smoother, slower.
        ///
        /// zonal: N of equal area each. stacks: A steps from the pole down, B around it. cube: K x K on each face. Each
        /// direction also serves its opposite.
        directions: DirectionSet = DirectionSet::ZonalEqualArea { count: 169 },
            "deep-directions" "SET" Range::Text, with_default;
        /// Frames over which deep images are rebuilt after something moved, in a window and in replays. More: less time
        /// per frame, and some directions lag by up to this many frames.
        slices: u32 = 1, "deep-slices" "N" Range::Count(1, 64), with_default;
        /// Builder of deep images. In windows and replays per_triangle stands for those that read counts on the host:
        /// the single passes and depth_peeling.
        ///
        /// As in Archer 2019: `deep-directions stacks:13x13` `deep-resolution 64` `deep-builder single_pass_literal`
        /// `deep-merge 0` `deep-sort blocks` `deep-search linear_steps`.
        builder: DeepBuilder = DeepBuilder::PerTriangle, "deep-builder" "NAME" Range::Names, with_default;
        /// Sort of the lists of deep images. The image is the same.
        sort: DeepSort = DeepSort::Selection, "deep-sort" "NAME" Range::Names, with_default;
        /// Distance below which fragments of a list are merged, texel widths; 0: none is. More: less memory, thin walls
        /// get thinner. Linked lists are not merged.
        merge_texels: f32 = 0.02, "deep-merge" "TEXELS" Range::Number(0.0, 1.0), with_default;
        /// Search in the lists of deep images. The image is the same.
        search: DeepSearch = DeepSearch::Bisection, "deep-search" "NAME" Range::Names, with_default;
        /// Memory layout of the lists of deep images. Shadow rays need linear_array, and so do windows.
        store: DeepStore = DeepStore::LinearArray, "deep-store" "NAME" Range::Names, with_default;
        /// Tests of triangles for the closest hits of rays within a texel [Aalund2015, §3.1].
        tests_triangles: bool = true, "deep-test" "on|off" Range::Switch(
            "Triangles of near fragments are tested",
            "The first fragment is the hit, as in Aalund 2015",
        ), with_default;
        /// Tolerance of rays across texels in depth [Niessner2010, §3.2]. More: fewer rays slip through steep surfaces,
        /// more hit what they pass.
        tolerance: f32 = 0.5, "deep-tolerance" "TEXELS" Range::Number(0.0, 4.0), with_default;
        /// Slopes of surfaces in the low bits of their depths, for rays across texels. Needs per_triangle and
        /// linear_array.
        slopes: bool = false, "deep-slopes" "on|off" Range::Switch(
            "Rays hit the planes of fragments: finer near their ends, slower",
            "Rays hit fragments at their depths, as in Nießner 2010",
        ), with_default;
    }
    and {
        /// Resolution of the single pass relative to an image. More: fewer holes, slower by the square.
        supersampling: u32 = 1;
        /// Expected mean number of fragments in a texel's list. A chunk takes as many images as fit one binding with
        /// this number; rays go through one chunk after the other. More: more chunks, slower rays. Fewer: a chunk that
        /// does not fit is built in vain once, then divided.
        fragments_a_texel: u64 = 8;
        /// Stores the triangle of each fragment, 4 bytes. Without it, rays return distances only.
        payload: bool = true;
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
        merge_texels: 0.0,
        store: DeepStore::LinearArray,
        sort: DeepSort::Blocks,
        search: DeepSearch::LinearSteps,
        ..Self::DEFAULT
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
