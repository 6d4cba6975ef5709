//! Parameters that the passes share with the host.

use glam::Vec3;
use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// Parameters of the passes of a frame.
    pub struct RadianceCacheParameters {
        /// Slots of the table, a power of two, less one.
        slot_mask: u32,
        /// Edge of the smallest voxels, m.
        edge: f32,
        /// Distance from the eye up to which voxels have that edge, m; it doubles with the distance.
        near: f32,
        /// Roughness whose lobe covers the solid angle that one sample of an entry represents; it prefilters the environment.
        blur: f32,
        /// Frames of the cache so far.
        frame: u32,
        /// Frames after which an entry that nothing has requested is evicted.
        kept: u32,
        /// Entries of rank 0 with fewer samples than this are scheduled in every update.
        fewest: u32,
        /// Longest history of an entry, samples: later samples all have the same weight.
        most: f32,
        /// One of so many entries is scheduled at least, whatever its rank and its history; a power of two.
        most_fraction: u32,
        /// Number of times that the history was cut. It is added to an entry's number of samples, so that samples also differ from frame to frame in a
        /// scene that keeps changing.
        changes: u32,
        /// Number of radiance levels per entry beside the total: `level_at` of `table.wesl`.
        bounce_levels: u32,
        /// First level that propagation reads.
        first_level: u32,
        /// Number of means of earlier hits per entry: `earlier_at` of `accumulate.wesl`.
        earlier_steps: u32,
        /// Number of lights per entry whose parts of its direct light are known: `known_light_at` of `accumulate.wesl`.
        known_lights: u32,
    }
}

gpu_struct! {
    /// Parameters of the passes of an update. A frame has several updates.
    pub struct CacheUpdate {
        /// Number of updates so far, independent of frame numbers.
        update: u32,
        /// Update stride: one of so many entries of rank 0 is scheduled. The stride doubles with each rank, and is two or four times as large for entries
        /// with a long history, up to `most_fraction`. A power of two, or 0: no entries.
        fraction: u32,
        /// Length to which the history is cut, samples.
        remembered: f32,
        /// 1: unrequested entries age to the next rank, at a stride of their own.
        ages: u32,
        /// 1: entries are counted where they are scheduled.
        counts: u32,
        /// Samples of the update, nearly: strides are such that no more entries are scheduled. 0: not limited.
        budget: u32,
    }
}

gpu_struct! {
    /// Parameters of a propagation sweep.
    pub struct CacheSweep {
        /// The level that is read.
        read_level: u32,
        /// The level that is written.
        written_level: u32,
        /// Index of the mean of earlier hits for these levels.
        step: u32,
        /// The entries that read; 0: those with even keys, 1: with odd keys, 2: all.
        turn: u32,
        /// Index in `next_sweeps` of `propagate.wesl` of the workgroups of the next pair of sweeps; 0: none waits for this one.
        next: u32,
        /// Unused.
        _pad: u32,
    }
}

gpu_struct! {
    /// Sample position of an entry.
    pub struct EntrySample {
        /// Position, world space, m.
        p_world: Vec3,
        /// Index of the triangle, in the order of the BVH's leaves. Top bit: the sample is on the side from which the corners are clockwise. The three bits
        /// below: 7 less the entry's rank (`vote.wesl`).
        triangle: u32,
    }
}

gpu_struct! {
    /// A hit in an entry's hit list.
    pub struct Link {
        /// Slot of the entry at the hit; slot of the ray's own entry if that is unknown.
        slot: u32,
        /// Reflectance at the ray's origin: square roots of three channels, 10 bits each. 0: the ray left the scene, or was not traced.
        reflectance: u32,
    }
}

gpu_struct! {
    /// An entry that gets another sample.
    pub struct ScheduledEntry {
        /// The entry's slot. Top bit: rays of pixels have hit the entry since it was last scheduled.
        slot: u32,
        /// Sample number for the entry's sequences. Lower 16 bits: the entry's shift; upper 16 bits: number of earlier samples, modulo 2^16.
        sample: u32,
    }
}

#[cfg(test)]
impl ScheduledEntry {
    /// The bit of `slot`.
    pub const IS_HIT: u32 = 1 << 31;

    /// The entry's slot.
    pub fn of_slot(self) -> u32 {
        self.slot & !Self::IS_HIT
    }
}

gpu_struct! {
    /// Another sample of an entry; world space, m, nits.
    pub struct SampledEntry {
        /// Sample position.
        p_world: Vec3,
        /// The entry's slot.
        slot: u32,
        /// Position of the chosen light, m.
        light_end: Vec3,
        /// Geometric normal; octahedral, two snorms of 16 bits, as every direction here.
        geometric_normal: u32,
        /// Reflected radiance of that light.
        reflected: Vec3,
        /// Direction of the ray for light from other entries.
        direction: u32,
        /// Emitted radiance.
        sent: Vec3,
        /// Triangle that the ray hit; NOTHING of `rays/hit.wesl`.
        triangle: u32,
        /// Reflectance of the surface for light along that ray.
        reflectance: Vec3,
        /// Distance to the hit, m.
        distance: f32,
        /// Direction along which the distance is measured.
        hit_direction: u32,
        /// Slot of the entry at the hit; NO_SLOT of `table.wesl`.
        slot_hit: u32,
        /// Three bits: rank of the sampled entry (`vote.wesl`). Above: number of the chosen light, plus 1; 0: none, or a triangle or the environment.
        rank: u32,
        /// Priority of this sample's vote for the entry at the hit; 0: it has none, or it has lost. The winner sets the entry's sample position.
        vote: u32,
    }
}
