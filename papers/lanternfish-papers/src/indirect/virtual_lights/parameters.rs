//! Parameters that host and shaders of virtual lights share.

use glam::Vec3;
use lanternfish_gpu::gpu_struct;

gpu_struct! {
    /// The uniform parameters of the passes.
    pub struct VirtualLightParameters {
        /// Coefficients of the attenuation `clq`: c0.
        constant: f32,
        /// c1, 1/m.
        linear: f32,
        /// c2, 1/m².
        quadratic: f32,
        /// Radius of a sphere around the scene's centre that holds all geometry, m.
        scene_radius: f32,
        /// Texels of all views of the reflective shadow map.
        texel_count: u32,
        /// Texels before this one are rasterized, those from it on are traced.
        first_traced: u32,
        /// Index of the frame among those averaged into one image.
        frame_index: u32,
        /// Level of this merge pass: blocks of 4^level texels are merged.
        level: u32,
        /// Distance between virtual lights on a surface below which texels are merged, m; 0: no merging.
        spacing: f32,
        /// Luminous flux that counts as one unit, lm.
        flux_unit: f32,
        /// Index of the [`Ranges`] in `ranges.wesl`.
        range_source: u32,
        /// [`RangeAxis`].
        axis: u32,
        /// 0: the average of the rays, 1: their maximum.
        statistic: u32,
        /// Range below which a light is dropped, m.
        least_range: f32,
        /// Range above which only some lights are kept, m.
        most_range: f32,
        /// Fraction of these that is kept.
        large_kept: f32,
        /// Cut-off intensity, cd, if ranges follow from it.
        threshold: f32,
        /// Index of the [`Attenuation`](lanternfish::settings::Attenuation).
        falloff: u32,
        /// [`Emission`].
        emission: u32,
        /// [`Residual`].
        residual: u32,
        /// Minimum distance to a virtual light in its inverse-square law, m; < 0: from the area that the light represents.
        least_distance: f32,
        /// Capacity of the list of lights; those that carry cut-off flux follow them.
        capacity: u32,
        /// Number of lights that carry cut-off flux.
        far_count: u32,
        /// Rays per pixel to virtual lights.
        shadow_rays: u32,
        /// Number of lights at which a pixel gets their full light, for weighting by the number of lights that reach it; 0: unweighted.
        weight_count: u32,
        /// 1: surfaces have a glossy lobe.
        glossy: u32,
        /// Number of lights selected from the texels.
        taken_count: u32,
        /// A pixel uses every nth light of its list; neighbouring pixels use the others.
        stride: u32,
        /// 1: rays were traced for ranges, so that the loss is measured.
        traces_ranges: u32,
        /// 1: light that mirrors reflect is left to caustics.
        leaves_mirrored: u32,
    }
}

gpu_struct! {
    /// The surface at a texel of the map, and the light that it reflects.
    pub struct Texel {
        /// World space, m.
        p_world: Vec3,
        /// Normal, octahedral, two times 14 bits, and the level that the texel may be merged up to.
        normal_and_level: u32,
        /// Luminous flux that is reflected, lm; zero if the ray hits nothing, or if the flux was merged into another texel.
        flux: Vec3,
        /// Direction of travel of the light, octahedral, two snorms of 8 bits; half float: radius of a disk of the lit area, m.
        incoming_and_radius: u32,
    }
}

gpu_struct! {
    /// The range of a virtual light.
    pub struct LightRange {
        /// m; 0: the light is dropped.
        range: f32,
        /// Fraction of its flux that arrives within the range.
        within: f32,
        /// Fraction that would arrive beyond it.
        beyond: f32,
        /// Factor of this light that compensates the latter, if requested.
        factor: f32,
    }
}
