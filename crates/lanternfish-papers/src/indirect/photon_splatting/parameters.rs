//! Parameters that host and shaders of photon splatting share.

use glam::Vec3;
use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// What the passes are told.
    pub struct PhotonParameters {
        /// Photons that are split: one a texel of the lights' views.
        primary_count: u32,
        /// Directions that each is split into: the axes of the images. Then there are two more: the mirror direction, and where a photon
        /// arrived.
        direction_count: u32,
        /// The first of those that the chunk in hand has.
        first_direction: u32,
        /// How many of them it has.
        chunk_directions: u32,
        /// Photons of the chunk at most: a slot for each of its directions and each photon that is split.
        slot_count: u32,
        /// Which of the frames that are averaged into one image this is.
        frame_index: u32,
        /// How often light has been scattered before.
        bounce: u32,
        /// Radius of a footprint over that of the ellipse in its parallelogram [Aalund2015, §3.4].
        radius: f32,
        /// 1: footprints are widened to the cell of the direction.
        widened: u32,
        /// 1: surfaces have a glossy lobe.
        glossy: u32,
        /// Luminous flux that is counted as one, lm.
        flux_unit: f32,
        /// Tiles of the image across.
        columns: u32,
        /// Tiles of the image down.
        rows: u32,
        /// Least width of a footprint beside a pixel's, m: that of a texel, where deep images say where photons land.
        least_width: f32,
        /// 1: nothing was added to the pixels' sums before.
        is_first: u32,
        /// 1: photons turn the directions, each few their own way.
        own_directions: u32,
    }
}

gpu_struct! {
    /// A photon that has come to a surface, where it is split.
    pub struct PrimaryPhoton {
        /// World space, m.
        p_world: Vec3,
        /// Normal of the triangle, unit, towards where the photon came from: octahedral, two snorms of 16 bits.
        normal: u32,
        /// Luminous flux that the surface scatters, lm; zero where there is none.
        scattered: Vec3,
        /// Sum over the directions above the surface of their cosine times their solid angle, sr.
        cosine_sum: f32,
        /// Luminous flux that it mirrors, lm.
        mirrored: Vec3,
        /// GGX alpha of the lobe of that.
        blur: f32,
        /// Unit, the way it came.
        direction: Vec3,
        /// Which of its directions goes on where light is scattered more than once.
        next_direction: u32,
        /// Differential of the position across the footprint, m.
        position_u: Vec3,
        /// Differential of the direction.
        direction_u_x: f32,
        /// The same the other way.
        position_v: Vec3,
        /// Differential of the direction.
        direction_u_y: f32,
        /// The same the other way.
        direction_v: Vec3,
        /// Differential of the direction.
        direction_u_z: f32,
        /// Luminous flux that came here straight from an emissive triangle, which is splatted too, lm: nothing else brings it. Else zero.
        arrived: Vec3,
        /// Luminous flux that came here from a light or from what shines, lm; zero after the first bounce.
        arriving: f32,
    }
}

gpu_struct! {
    /// Where a photon has come to.
    pub struct PhotonHit {
        /// Where it starts, world space, m.
        start: Vec3,
        /// Index of the triangle, in the order of the BVH's leaves; else a constant of the shaders.
        triangle: u32,
        /// Normal of the triangle where it starts, on its side: octahedral, two snorms of 16 bits.
        normal: u32,
        /// Octahedral, two snorms of 16 bits: the way it goes; a deep image's axis where it was traced along that.
        direction: u32,
        /// m.
        distance: f32,
        /// Unused.
        _pad: u32,
    }
}
