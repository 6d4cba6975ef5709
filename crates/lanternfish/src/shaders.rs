//! The library's shaders, and every variant of them that a room can ask for.

use lanternfish_gpu::ShaderLibrary;

/// Every `.wesl` file of this crate; a module's path is its file's.
pub const SHADERS: ShaderLibrary = ShaderLibrary::new(include!(concat!(env!("OUT_DIR"), "/shaders.rs")));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn try_all() {
        let mut bad = 0;
        for (m, f) in [
            ("prepass/prepass", vec![]),
            ("prepass/prepass", vec!["masked", "binding_arrays"]),
            ("light_culling/tiled/bounds", vec![]),
            ("light_culling/tiled/assign", vec![]),
            ("shadows/plan", vec![]),
            ("shadows/plan", vec!["culling_all"]),
            ("shadows/trace", vec!["cull_surface"]),
            ("shadows/trace", vec!["cull_naive", "ray_counts"]),
            ("shadows/trace", vec!["cull_improved", "tracer_ray_query"]),
            ("shading/forward", vec!["shadow_bits"]),
            ("shading/forward", vec!["shadow_bits", "binding_arrays"]),
            ("shading/forward", vec!["shadow_rays", "transparent"]),
            ("shading/forward", vec!["shadow_rays", "transparent", "tracer_ray_query", "binding_arrays"]),
            ("output/output", vec![]),
            ("debug_views/debug", vec![]),
        ] {
            if let Err(e) = SHADERS.link(m, &f) {
                bad += 1;
                println!("{e}");
            }
        }
        assert_eq!(bad, 0);
    }
}
