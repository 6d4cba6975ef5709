//! What the passes share with the host.

use glam::Vec3;
use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// What the passes are told.
    pub struct RadianceCacheParameters {
        /// Slots of the table, a power of two, less one.
        slot_mask: u32,
        /// Updates of the cache so far, whatever frames are numbered.
        update: u32,
        /// Edge of the smallest cells, m.
        edge: f32,
        /// Distance from the eye up to which cells have that edge, m; it doubles with the distance.
        near: f32,
        /// One of so many cells of generation 0 gets another sample in an update, of each later generation half as many, and of cells of which
        /// much is known a half or a quarter of those; 0: none.
        share: u32,
        /// And one of so many at least.
        most_share: u32,
        /// Cells with fewer samples than this get another, whatever their share.
        fewest: u32,
        /// From this sample on each counts as much as that one.
        most: f32,
        /// Frames after which a cell that nothing has asked for is left out.
        kept: u32,
        /// Roughness of the surface that would see as much of the surroundings at once as one sample of a cell stands for.
        blur: f32,
        /// Samples that what a cell has kept so far counts for, at most.
        remembered: f32,
        /// Frames of the cache so far.
        frame: u32,
        /// 1: cells that nothing asks for go on to the next generation, when it is their turn.
        fades: u32,
        /// Times so far that what was known counted for few samples: cells have other samples each time.
        changes: u32,
        /// Parts that cells keep beside all that is asked of them: `bounce_levels.wesl`.
        bounce_levels: u32,
        /// The part that cells read of each other.
        read_level: u32,
        /// The part that they write.
        written_level: u32,
        /// Which mean of earlier rays belongs to them: `links.wesl`.
        step: u32,
        /// How many such means there are.
        earlier_steps: u32,
        /// Which half of the cells takes a bounce; 0: those of even keys, 1: of odd ones, 2: all.
        turn: u32,
        /// 1: cells are counted where they are chosen.
        counts: u32,
    }
}

gpu_struct! {
    /// Where the light of a cell is sampled.
    pub struct CellSample {
        /// World space, m.
        p_world: Vec3,
        /// In the order of the BVH's leaves; the four top bits say which side of it, and the cell's generation.
        triangle: u32,
    }
}

gpu_struct! {
    /// Where a ray of a cell ended.
    pub struct Link {
        /// Slot of the cell there.
        slot: u32,
        /// Share that the ray's cell sends on: `links.wesl`.
        reflectance: u32,
    }
}

gpu_struct! {
    /// A cell that gets another sample.
    pub struct DueCell {
        /// The cell's slot.
        slot: u32,
        /// Which of its samples: `due_list.wesl`.
        sample: u32,
    }
}

gpu_struct! {
    /// What one more sample of a cell finds; world space, m, nits.
    pub struct SampledCell {
        /// Where the sample is.
        p_world: Vec3,
        /// The cell's slot.
        slot: u32,
        /// Where the light is that was chosen.
        light_end: Vec3,
        /// Octahedral, two snorms of 16 bits, as every direction here.
        geometric_normal: u32,
        /// What the surface sends on of that light.
        reflected: Vec3,
        /// Of a ray that looks for light from other cells.
        direction: u32,
        /// What the surface sends by itself.
        sent: Vec3,
        /// What the ray met.
        triangle: u32,
        /// Share that the surface sends on of what comes along that ray.
        reflectance: Vec3,
        /// How far away that is.
        distance: f32,
        /// Along this direction.
        direction_met: u32,
        /// Slot of the cell there.
        slot_met: u32,
        /// The cell's: `sample.wesl`.
        generation: u32,
        /// 1: of all who have met the cell there, this one has won.
        has_won: u32,
    }
}
