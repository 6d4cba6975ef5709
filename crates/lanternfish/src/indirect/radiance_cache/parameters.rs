//! Parameters that the passes share with the host.

use glam::Vec3;
use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// What the passes of a frame are told.
    pub struct RadianceCacheParameters {
        /// Slots of the table, a power of two, less one.
        slot_mask: u32,
        /// Edge of the smallest voxels, m.
        edge: f32,
        /// Distance from the eye up to which voxels have that edge, m; it doubles with the distance.
        near: f32,
        /// Roughness of the surface that would see as much of the environment at once as one sample of an entry stands for.
        blur: f32,
        /// Frames of the cache so far.
        frame: u32,
        /// Frames after which an entry that nothing has requested is evicted.
        kept: u32,
        /// Entries of rank 0 with fewer samples than this are scheduled in every update.
        fewest: u32,
        /// From this sample on each counts as much as that one.
        most: f32,
        /// One of so many entries is scheduled at least, whatever its rank and its history; a power of two.
        most_fraction: u32,
        /// Times so far that the history was cut. Added to an entry's number of samples, it makes its sample another in each frame of a scene
        /// that keeps changing, too.
        changes: u32,
        /// Levels of radiance that entries keep beside all that is asked of them: `level_at` of `table.wesl`.
        bounce_levels: u32,
        /// The level that entries read of each other first.
        first_level: u32,
        /// Means of earlier hits that entries keep: `earlier_at` of `accumulate.wesl`.
        earlier_steps: u32,
        /// Unused.
        _pad: u32,
    }
}

gpu_struct! {
    /// What the passes of an update are told, of which a frame has several.
    pub struct CacheUpdate {
        /// Updates so far, whatever frames are numbered.
        update: u32,
        /// One of so many entries of rank 0 is scheduled, of each later rank half as many, and of entries with a long history a half or a
        /// quarter of those, but no fewer than `most_fraction` says; a power of two, or 0: none.
        fraction: u32,
        /// Length to which the history is cut, samples.
        remembered: f32,
        /// 1: entries that nothing requests go on to the next rank, when it is their turn.
        ages: u32,
        /// 1: entries are counted where they are scheduled.
        counts: u32,
        /// Unused.
        _pad: u32,
    }
}

gpu_struct! {
    /// What a sweep of propagation is told.
    pub struct CacheSweep {
        /// The level that entries read of each other.
        read_level: u32,
        /// The level that they write.
        written_level: u32,
        /// Which mean of earlier hits belongs to them.
        step: u32,
        /// Which entries read; 0: those of even keys, 1: of odd ones, 2: all.
        turn: u32,
    }
}

gpu_struct! {
    /// Where an entry is sampled.
    pub struct EntrySample {
        /// World space, m.
        p_world: Vec3,
        /// In the order of the BVH's leaves; in the top bit, whether the triangle is looked at from where its corners go clockwise; in the
        /// three bits below, 7 less the entry's rank (`vote.wesl`).
        triangle: u32,
    }
}

gpu_struct! {
    /// Where a ray of an entry hit.
    pub struct Link {
        /// Slot of the entry there; that of the ray's own entry where that is not known.
        slot: u32,
        /// Ratio that the ray's entry reflects: square roots of three channels, 10 bits each. Zero: the ray left the scene, or was not traced.
        reflectance: u32,
    }
}

gpu_struct! {
    /// An entry that gets another sample.
    pub struct ScheduledEntry {
        /// The entry's slot.
        slot: u32,
        /// Which sample it is, of its ray and of lights: by which the entry's sequences are shifted, of 16 bits; and in the upper bits how many
        /// came before, modulo 2^16.
        sample: u32,
    }
}

gpu_struct! {
    /// What one more sample of an entry finds; world space, m, nits.
    pub struct SampledEntry {
        /// Where the sample is.
        p_world: Vec3,
        /// The entry's slot.
        slot: u32,
        /// Where the light is that was chosen, m.
        light_end: Vec3,
        /// Octahedral, two snorms of 16 bits, as every direction here.
        geometric_normal: u32,
        /// What the surface reflects of that light.
        reflected: Vec3,
        /// Of a ray that looks for light from other entries.
        direction: u32,
        /// What the surface emits.
        sent: Vec3,
        /// What the ray hit; NOTHING of `rays/hit.wesl`.
        triangle: u32,
        /// Ratio that the surface reflects of what comes along that ray.
        reflectance: Vec3,
        /// How far away that is, m.
        distance: f32,
        /// The direction along which the distance is, packed as the other.
        hit_direction: u32,
        /// Slot of the entry there; NO_SLOT of `table.wesl`.
        slot_hit: u32,
        /// The entry's: `vote.wesl`.
        rank: u32,
        /// 1: of all whose rays have hit the entry there, this one says where it is sampled.
        is_selected: u32,
    }
}
