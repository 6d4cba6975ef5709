//! Parameters that host and shaders of virtual lights share.

use glam::Vec3;
use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// What the passes are told.
    pub struct VirtualLightParameters {
        /// Radius of a sphere about the scene's middle that holds everything, m.
        scene_radius: f32,
        /// Texels of all views of the reflective shadow map.
        texel_count: u32,
        /// Texels before this one are rendered, those from it on are traced.
        first_traced: u32,
        /// Which of the frames that are averaged into one image this is.
        frame_index: u32,
        /// Blocks of 4^level texels are merged.
        level: u32,
        /// Distance between virtual lights on a surface from which on texels are merged, m; 0: none are.
        spacing: f32,
        /// Luminous flux that is counted as one, lm.
        flux_unit: f32,
        /// [`Ranges`], as `ranges.wesl` counts them.
        range_source: u32,
        /// [`RangeAxis`].
        axis: u32,
        /// 0: the average of the rays, 1: their maximum.
        statistic: u32,
        /// Range below which a light is left out, m.
        least_range: f32,
        /// Range above which only some are kept, m.
        most_range: f32,
        /// Share of these that is kept.
        large_kept: f32,
        /// Cut-off intensity, cd: where ranges follow from it.
        threshold: f32,
        /// Index of the [`Attenuation`](lanternfish::settings::Attenuation).
        falloff: u32,
        /// [`Emission`].
        emission: u32,
        /// [`Residual`].
        residual: u32,
        /// Least distance to a virtual light that counts, m; < 0: from the area that the light stands for.
        least_distance: f32,
        /// Lights that there is room for; those that carry what ranges cut off follow them.
        capacity: u32,
        /// How many of these there are.
        far_count: u32,
        /// Rays from a pixel to virtual lights.
        shadow_rays: u32,
        /// Number of lights whose light a pixel gets in full, where it is weighed by how many reach it; 0: it is not.
        weight_count: u32,
        /// 1: surfaces have a glossy lobe.
        glossy: u32,
        /// Lights that are taken of the texels.
        taken_count: u32,
        /// A pixel looks at every nth light of its list; pixels nearby at the others.
        stride: u32,
        /// 1: rays were cast for ranges, so that it is known what these cut off.
        traces_ranges: u32,
    }
}

gpu_struct! {
    /// What a texel of the map sees: light that a surface there reflects.
    pub struct Texel {
        /// World space, m.
        p_world: Vec3,
        /// Normal, octahedral, two times 14 bits, and the level that the texel may be merged up to.
        normal_and_level: u32,
        /// Luminous flux that is reflected, lm; zero where nothing is seen, or another texel has taken it over.
        flux: Vec3,
        /// Direction that light came along, octahedral, two snorms of 8 bits; half float: radius of a disk of the area that is lit, m.
        incoming_and_radius: u32,
    }
}

gpu_struct! {
    /// The range of a virtual light.
    pub struct LightRange {
        /// m; 0: the light is left out.
        range: f32,
        /// Share of its flux that arrives within the range.
        within: f32,
        /// Share that would arrive beyond it.
        beyond: f32,
        /// What makes up for the latter, where that is requested: a factor for this light.
        factor: f32,
    }
}
