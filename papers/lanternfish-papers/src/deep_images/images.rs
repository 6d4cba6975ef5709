//! Deep images on the device, in chunks.

use lanternfish_gpu::Bindings;

use super::{directions::Directions, settings::DeepImageSettings, shaders::DeepGrid};

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
    pub(super) drawn: u64,
    /// Number of fragments put into lists before merging, in the first of four words: of linear arrays.
    pub(super) counted: Option<wgpu::Buffer>,
}

/// Number of fragments building drew and kept, and the bytes they take. All but `bytes` of linked lists, which depends
/// on what was built before, is exact; where frames do not wait it is what there is room for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeepCounts {
    /// Fragments that were drawn into lists.
    pub drawn: u64,
    /// Fragments left after merging; in linked lists, all that were drawn.
    pub kept: u64,
    /// Bytes of all buffers of lists and fragments: 4 per list; per fragment 4 for its depth, 4 for its triangle, 4 for
    /// the link of a linked list.
    pub bytes: u64,
}

impl DeepImages {
    /// Counts the chunks' fragments.
    pub(super) fn count(&mut self) {
        let sum = |of: fn(&Chunk) -> u64| self.chunks.iter().map(of).sum();
        self.counts = DeepCounts { drawn: sum(|c| c.drawn), kept: sum(|c| c.fragments), bytes: sum(Chunk::bytes) };
    }

    /// Bindings of `nearest_image.wesl`, in addition to the grid of any chunk.
    pub fn direction_bindings(&self) -> Bindings<'_> {
        Bindings::new().buffer("direction_cells", &self.direction_cells)
    }
}

impl Chunk {
    /// Bindings under the names in the shaders; `frames`: [`DeepImages::frames`] of the images that this chunk belongs
    /// to.
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
