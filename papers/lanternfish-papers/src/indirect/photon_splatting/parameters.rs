//! Parameters that host and shaders of photon splatting share.

use glam::Vec3;
use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// The uniform parameters of the passes.
    pub struct PhotonParameters {
        /// Photons that are split: one per texel of the lights' views.
        primary_count: u32,
        /// Directions that each is split into: the axes of the images; 0: it is mirrored alone. Two more follow: the mirror direction,
        /// and the photon's own hit point.
        direction_count: u32,
        /// First direction of the current chunk.
        first_direction: u32,
        /// Number of directions in the current chunk.
        chunk_directions: u32,
        /// Maximum number of photons in the chunk: a slot for each of its directions and each photon that is split.
        slot_count: u32,
        /// Index of the frame among those averaged into one image.
        frame_index: u32,
        /// Number of earlier bounces.
        bounce: u32,
        /// Radius of a footprint relative to the ellipse in its parallelogram [Aalund2015, §3.4].
        radius: f32,
        /// 1: footprints are widened to the cell of the direction.
        widened: u32,
        /// 1: surfaces have a glossy lobe.
        glossy: u32,
        /// Luminous flux that counts as one unit, lm.
        flux_unit: f32,
        /// Tiles of the image across.
        columns: u32,
        /// Tiles of the image down.
        rows: u32,
        /// Minimum width of a footprint in addition to a pixel's, m: that of a texel, if photons are traced through deep images.
        least_width: f32,
        /// 1: the pixels' sums start at 0.
        is_first: u32,
        /// 1: each group of a few photons has its own rotation of the directions.
        own_directions: u32,
    }
}

gpu_struct! {
    /// A photon that has hit a surface, where it is split.
    pub struct PrimaryPhoton {
        /// World space, m.
        p_world: Vec3,
        /// Normal of the triangle, unit, towards the photon's origin: octahedral, two snorms of 16 bits.
        normal: u32,
        /// Luminous flux that the surface scatters, lm; zero if there is none.
        scattered: Vec3,
        /// Sum over the directions above the surface of their cosine times their solid angle, sr.
        cosine_sum: f32,
        /// Luminous flux that it mirrors, lm.
        mirrored: Vec3,
        /// GGX alpha of the lobe of the mirrored flux.
        blur: f32,
        /// Direction of travel, unit.
        direction: Vec3,
        /// Index of the direction that continues if light is scattered more than once.
        next_direction: u32,
        /// Differential of the position across the footprint, m.
        position_u: Vec3,
        /// Differential of the direction.
        direction_u_x: f32,
        /// Differential of the position in the other direction, m.
        position_v: Vec3,
        /// Differential of the direction.
        direction_u_y: f32,
        /// Differential of the direction in the other direction.
        direction_v: Vec3,
        /// Differential of the direction.
        direction_u_z: f32,
        /// Luminous flux directly from an emissive triangle, lm, which is splatted too, since no other pass adds it; otherwise zero.
        arrived: Vec3,
        /// Luminous flux directly from a light or an emissive surface, lm; zero after the first bounce.
        arriving: f32,
    }
}

gpu_struct! {
    /// The hit of a photon.
    pub struct PhotonHit {
        /// Start of its path, world space, m.
        start: Vec3,
        /// Index of the triangle, in the order of the BVH's leaves; otherwise a constant of the shaders.
        triangle: u32,
        /// Normal of the triangle at its start, on its side: octahedral, two snorms of 16 bits.
        normal: u32,
        /// Direction of travel, octahedral, two snorms of 16 bits; a deep image's axis if it was traced along one.
        direction: u32,
        /// m.
        distance: f32,
        /// Unused.
        _pad: u32,
    }
}
