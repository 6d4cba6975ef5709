//! Validation of deep images by any builder: every list and fragment, read back from the device.

use lanternfish::RenderError;
use lanternfish_gpu::read_back;

use super::{
    images::{Chunk, DeepImages},
    settings::DeepStore,
    shaders::DeepFrame,
};

/// A surface on a texel's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Depth along the image's axis from the scene's middle, m.
    pub depth: f32,
    /// Its triangle, in the order of the BVH's leaves; none without a payload.
    pub triangle: Option<u32>,
}

/// A violated invariant of deep images. Lists and fragments are counted from the chunk's first.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ListFault {
    /// Chunks omit images or hold them twice.
    #[error("chunks hold images up to {found}; image {expected} is expected next")]
    Images {
        /// First image of a chunk, or the number of images in all chunks.
        found: u32,
        /// The image expected after the previous chunk, or the total number of images.
        expected: u32,
    },
    /// An image's axes on the device are not those of its direction, or the opposite direction does not read the same
    /// image backwards.
    #[error("image {image} does not lie along its direction and the opposite one")]
    Direction {
        /// Index of the image.
        image: u32,
    },
    /// The list starts of a linear array descend or do not begin at zero.
    #[error("list {list} starts at {start}, the one before it at {before}")]
    Start {
        /// Index of the list; the number of lists stands for the end of the last one.
        list: usize,
        /// Index of its first fragment.
        start: u32,
        /// Index of the first fragment of the list before it.
        before: u32,
    },
    /// Lists hold more or fewer fragments than there are.
    #[error("lists end at {end}, but there are {fragments} fragments")]
    End {
        /// Fragments of a linear array's lists, or slots that linked lists have taken.
        end: u32,
        /// Fragments that there are.
        fragments: u64,
    },
    /// Fragments were lost between drawing and storing, though none are merged.
    #[error("{drawn} fragments were drawn, {kept} kept")]
    Lost {
        /// Fragments that were drawn into lists.
        drawn: u64,
        /// Fragments that are left, in all chunks.
        kept: u64,
    },
    /// A fragment was counted, but never written.
    #[error("fragment {index} was never written")]
    Unwritten {
        /// Index of the fragment.
        index: usize,
    },
    /// A depth that is NaN or that no surface of the scene can have.
    #[error("fragment {index} has the depth {depth} m; the scene ends at {end} m")]
    Depth {
        /// Index of the fragment.
        index: usize,
        /// Its depth, m along the image's axis from the scene's middle.
        depth: f32,
        /// The largest depth that a fragment can have, m.
        end: f32,
    },
    /// A triangle index out of range.
    #[error("fragment {index} has triangle index {triangle}, of {count} triangles")]
    Triangle {
        /// Index of the fragment.
        index: usize,
        /// Index of its triangle, in the order of the BVH's leaves.
        triangle: u32,
        /// Number of triangles.
        count: u32,
    },
    /// Fragments out of order.
    #[error("list {list} is not sorted")]
    Unsorted {
        /// Index of the list.
        list: usize,
    },
    /// A link to a slot out of range.
    #[error("list {list} has a link to slot {slot}, of {fragments} slots")]
    Link {
        /// Index of the list.
        list: usize,
        /// The slot of the link.
        slot: u32,
        /// Slots that are taken.
        fragments: u64,
    },
    /// A fragment with two links to it: a cycle, or two lists that join.
    #[error("list {list} reaches fragment {index}, which is already in a list")]
    Twice {
        /// Index of the second list that reaches the fragment.
        list: usize,
        /// Index of the fragment.
        index: usize,
    },
    /// A fragment that is in no list.
    #[error("fragment {index} is in no list")]
    Unlisted {
        /// Index of the fragment.
        index: usize,
    },
}

impl From<ListFault> for RenderError {
    fn from(fault: ListFault) -> Self {
        Self::Check { what: "deep images", fault: Box::new(fault) }
    }
}

impl DeepImages {
    /// Reads all lists back and checks that
    ///
    /// - chunks hold every image once, and each image lies along its direction, whose opposite reads it backwards;
    /// - lists of a linear array are contiguous, from the first fragment to the last;
    /// - linked lists end, and reach every fragment exactly once;
    /// - they are in order, if the store sorts: by depth, then by triangle;
    /// - every fragment was written, with a depth in the scene's range and a valid triangle;
    /// - as many fragments were stored as were drawn if none are merged, and at most as many otherwise.
    ///
    /// Returns the first fault as [`RenderError::Check`]: a bug, or a device that computes wrongly.
    pub fn validate(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(), RenderError> {
        let mut expected = 0;
        for chunk in &self.chunks {
            let found = chunk.grid.first_image;
            if found != expected {
                return Err(ListFault::Images { found, expected }.into());
            }
            expected += chunk.grid.image_count;
            self.read_lists(device, queue, chunk)?;
        }
        let images = self.directions.len();
        if expected as usize != images {
            return Err(ListFault::Images { found: expected, expected: images as u32 }.into());
        }
        let frames = read_back::<DeepFrame>(device, queue, &self.frames, images)?;
        if let Some(image) = (0..).zip(&frames).find_map(|(image, frame)| (!self.lies(image, frame)).then_some(image)) {
            return Err(ListFault::Direction { image }.into());
        }
        let (drawn, kept) = (self.counts.drawn, self.chunks.iter().map(|chunk| chunk.fragments).sum());
        let merges = self.settings.store == DeepStore::LinearArray && self.settings.merge_texels > 0.0;
        if (merges && kept > drawn) || (!merges && kept != drawn) {
            return Err(ListFault::Lost { drawn, kept }.into());
        }
        Ok(())
    }

    /// True if an image lies along its direction, and serves the opposite one from the other end.
    fn lies(&self, image: u32, frame: &DeepFrame) -> bool {
        let axes = self.directions.frame(image);
        let axis = self.directions.axes()[image as usize];
        let (forwards, backwards) = (self.directions.nearest(axis), self.directions.nearest(-axis));
        // Two axes closer than rounding may represent each other.
        let is_near = |(found, reversed): (u32, bool)| {
            let other = self.directions.axes()[found as usize];
            axis.dot(if reversed { -other } else { other }) > 1.0 - 1e-6
        };
        (frame.x, frame.y, frame.z) == (axes.x_axis, axes.y_axis, axes.z_axis)
            && frame.z.abs_diff_eq(axis, 1e-6)
            && backwards == (forwards.0, !forwards.1)
            && is_near(forwards)
    }

    /// The lists of one of its chunks, each with its fragments in stored order, after the same checks.
    pub fn read_lists(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        chunk: &Chunk,
    ) -> Result<Vec<Vec<Fragment>>, RenderError> {
        let count = chunk.fragments as usize;
        let lists = chunk.list_count() as usize;
        let fragments = self.read_fragments(device, queue, chunk)?;
        for (index, fragment) in fragments.iter().enumerate() {
            check(chunk, index, fragment)?;
        }
        let all = match &chunk.next {
            None => {
                let starts = read_back::<u32>(device, queue, &chunk.list_starts, lists + 2)?;
                arrays(&starts, &fragments)?
            }
            Some(next) => {
                let starts = read_back::<u32>(device, queue, &chunk.list_starts, lists + 1)?;
                chains(&starts, &read_back::<u32>(device, queue, next, count)?, &fragments)?
            }
        };
        if self.settings.store != DeepStore::LinkedList {
            let in_order =
                |a: &Fragment, b: &Fragment| a.depth < b.depth || (a.depth == b.depth && a.triangle <= b.triangle);
            if let Some(list) = all.iter().position(|list| !list.is_sorted_by(in_order)) {
                return Err(ListFault::Unsorted { list }.into());
            }
        }
        Ok(all)
    }

    /// All fragments of a chunk, in stored order; the depth of those that were never written is NaN.
    fn read_fragments(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        chunk: &Chunk,
    ) -> Result<Vec<Fragment>, RenderError> {
        let count = chunk.fragments as usize;
        let words = read_back::<u32>(device, queue, &chunk.depths, count)?;
        let depths = words.iter().map(|word| if *word == 0 { f32::NAN } else { f32::from_bits(*word) });
        let triangles: Vec<Option<u32>> = match &chunk.triangles {
            Some(triangles) => read_back::<u32>(device, queue, triangles, count)?.into_iter().map(Some).collect(),
            None => vec![None; count],
        };
        Ok(depths.zip(triangles).map(|(depth, triangle)| Fragment { depth, triangle }).collect())
    }
}

/// Checks one fragment: that it was written, its depth, its triangle.
fn check(chunk: &Chunk, index: usize, fragment: &Fragment) -> Result<(), ListFault> {
    // Where a texel's axis passes beside a triangle, its plane is followed for up to a texel.
    let end = chunk.grid.radius + 1.0 / chunk.grid.texels_per_metre;
    let (depth, count) = (fragment.depth, chunk.grid.triangle_count);
    if depth.is_nan() {
        return Err(ListFault::Unwritten { index });
    }
    if depth.abs() > end {
        return Err(ListFault::Depth { index, depth, end });
    }
    match fragment.triangle {
        Some(triangle) if triangle >= count => Err(ListFault::Triangle { index, triangle, count }),
        _ => Ok(()),
    }
}

/// Lists of a linear array: `store/linear_array.wesl`.
fn arrays(starts: &[u32], fragments: &[Fragment]) -> Result<Vec<Vec<Fragment>>, ListFault> {
    let starts = &starts[1..];
    let (first, end) = (starts[0], starts[starts.len() - 1]);
    if first != 0 {
        return Err(ListFault::Start { list: 0, start: first, before: 0 });
    }
    if let Some(list) = starts.windows(2).position(|pair| pair[1] < pair[0]) {
        return Err(ListFault::Start { list: list + 1, start: starts[list + 1], before: starts[list] });
    }
    if end as usize != fragments.len() {
        return Err(ListFault::End { end, fragments: fragments.len() as u64 });
    }
    Ok(starts.windows(2).map(|pair| fragments[pair[0] as usize..pair[1] as usize].to_vec()).collect())
}

/// Lists of links: `store/links.wesl`.
fn chains(starts: &[u32], next: &[u32], fragments: &[Fragment]) -> Result<Vec<Vec<Fragment>>, ListFault> {
    let total = fragments.len() as u64;
    if u64::from(starts[0]) != total {
        return Err(ListFault::End { end: starts[0], fragments: total });
    }
    let mut is_listed = vec![false; fragments.len()];
    let mut lists = Vec::with_capacity(starts.len() - 1);
    for (list, head) in starts[1..].iter().enumerate() {
        let mut chain = Vec::new();
        let mut link = *head;
        // Each iteration reaches a fragment that was in no list, so the loop ends.
        while link != 0 {
            let slot = link - 1;
            let index = slot as usize;
            if index >= fragments.len() {
                return Err(ListFault::Link { list, slot, fragments: total });
            }
            if std::mem::replace(&mut is_listed[index], true) {
                return Err(ListFault::Twice { list, index });
            }
            chain.push(fragments[index]);
            link = next[index];
        }
        lists.push(chain);
    }
    match is_listed.iter().position(|listed| !listed) {
        Some(index) => Err(ListFault::Unlisted { index }),
        None => Ok(lists),
    }
}
