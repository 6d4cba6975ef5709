//! The passes that take most of a frame's time, in the variants of usual settings: `cargo xtask check` compares them.

/// One entry point of one variant.
#[derive(Clone, Copy, Debug)]
pub struct Hot {
    /// The pass's label in reports, and what tells this variant from others. It stays when features change.
    pub name: &'static str,
    /// The shader's file.
    pub file: &'static str,
    pub entry: &'static str,
    pub features: &'static [&'static str],
}

impl Hot {
    /// The file and its sorted features.
    pub fn shader(&self) -> String {
        let mut features = self.features.to_vec();
        features.sort();
        features.iter().fold(self.file.to_owned(), |name, feature| format!("{name}+{feature}"))
    }
}

const fn hot(name: &'static str, file: &'static str, entry: &'static str, features: &'static [&'static str]) -> Hot {
    Hot { name, file, entry, features }
}

/// By light path. All trace through the BVH, which every card can; a card with ray queries has them compiled by hardware.
pub const HOT: &[Hot] = &[
    hot(
        "shadows/trace: points",
        "shadows/trace",
        "trace",
        &["culling_clustered", "visibility_written", "tracer_bvh", "cull_range", "cull_surface"],
    ),
    hot(
        "shadows/trace: soft",
        "shadows/trace",
        "trace",
        &["culling_clustered", "soft", "visibility_written", "tracer_bvh", "cull_range", "cull_surface"],
    ),
    hot(
        "shadows/trace: area lights",
        "shadows/trace",
        "trace",
        &["culling_clustered", "area_lights", "visibility_written", "tracer_bvh", "cull_range", "cull_surface"],
    ),
    hot(
        "shadows/trace: soft, history",
        "shadows/trace",
        "trace",
        &[
            "culling_clustered",
            "soft",
            "visibility_written",
            "tracer_bvh",
            "cull_range",
            "cull_surface",
            "shadow_history",
        ],
    ),
    hot(
        "shadows/trace_edges: points",
        "shadows/trace_edges",
        "trace_edges",
        &["culling_clustered", "visibility_written", "cull_range", "cull_triangle", "tracer_bvh"],
    ),
    hot(
        "shadows/trace_edges: soft",
        "shadows/trace_edges",
        "trace_edges",
        &["culling_clustered", "soft", "visibility_written", "cull_range", "cull_triangle", "tracer_bvh"],
    ),
    hot(
        "shading/forward: 1 sample",
        "shading/forward",
        "fragment",
        &["indirect", "culling_clustered", "shadow_bits", "binding_arrays"],
    ),
    hot(
        "shading/forward: 4 samples",
        "shading/forward",
        "fragment",
        &["indirect", "multisampled", "culling_clustered", "shadow_bits", "binding_arrays"],
    ),
    hot(
        "shading/forward: 4 samples, soft",
        "shading/forward",
        "fragment",
        &["indirect", "multisampled", "culling_clustered", "shadow_bits", "soft", "binding_arrays"],
    ),
    hot(
        "shading/forward: transparent",
        "shading/forward",
        "fragment",
        &["transparent", "indirect", "culling_clustered", "shadow_rays", "tracer_bvh", "binding_arrays"],
    ),
    hot(
        "shading/forward: transparent, soft",
        "shading/forward",
        "fragment",
        &["transparent", "indirect", "culling_clustered", "shadow_rays", "tracer_bvh", "soft", "binding_arrays"],
    ),
    hot(
        "shading/forward: transparent, sampled",
        "shading/forward",
        "fragment",
        &["transparent", "indirect", "sampled_lights", "shadow_rays", "tracer_bvh", "binding_arrays"],
    ),
    hot("direct_light/trace", "direct_light/sampled/trace", "trace", &["tiles", "shadow_rays", "tracer_bvh"]),
    hot(
        "direct_light/trace: emission",
        "direct_light/sampled/trace",
        "trace",
        &["tiles", "emission", "shadow_rays", "tracer_bvh"],
    ),
    hot("indirect/trace", "indirect/sampled/trace", "trace", &["tracer_bvh"]),
    hot("indirect/shade", "indirect/sampled/shade", "shade", &[]),
    hot("indirect/shadow", "indirect/sampled/shadow", "shadow", &["tracer_bvh"]),
    hot("indirect/emitters", "indirect/sampled/emitters", "emitters", &["tracer_bvh"]),
    hot("indirect/entries/find", "indirect/sampled/find_entries", "find_and_add", &["glossy_rays"]),
    hot("indirect/entries/gather", "indirect/sampled/gather_entries", "gather_missing", &["glossy_rays"]),
    hot("indirect/probes/refine", "indirect/sampled/probes/refine", "refine", &[]),
    hot("indirect/probes/contact", "indirect/sampled/probes/contact", "contact", &[]),
    hot("indirect/probes/aim", "indirect/sampled/probes/aim", "aim", &["guided"]),
    hot("indirect/probes/trace", "indirect/sampled/trace", "trace", &["probes", "tracer_bvh"]),
    hot("indirect/probes/shade", "indirect/sampled/shade", "shade", &["probes"]),
    hot("indirect/probes/shadow", "indirect/sampled/shadow", "shadow", &["probes", "tracer_bvh"]),
    hot("indirect/probes/interpolate", "indirect/sampled/probes/interpolate", "interpolate", &["probes"]),
    hot("radiance_cache/trace", "indirect/radiance_cache/trace", "trace", &["tracer_bvh"]),
    hot("radiance_cache/shadow", "indirect/radiance_cache/shadow", "shadow", &["tracer_bvh"]),
    hot("radiance_cache/rays", "indirect/radiance_cache/rays", "rays", &["tracer_bvh"]),
    hot("radiance_cache/light", "indirect/radiance_cache/light", "light", &["evenly_sent"]),
    hot("radiance_cache/light: environment", "indirect/radiance_cache/light", "light", &["evenly_sent", "environment"]),
    hot("indirect/firefly_clamp", "denoise/smoothing/firefly_clamp", "firefly_clamp", &[]),
    hot("direct_light/firefly_clamp", "denoise/smoothing/firefly_clamp", "firefly_clamp", &["deviations"]),
    hot("indirect/collect", "denoise/smoothing/collect", "collect", &[]),
    hot("indirect/redistribution", "denoise/smoothing/redistribution", "redistribution", &[]),
    hot("indirect/resolve", "denoise/smoothing/filter", "resolve", &[]),
    hot("indirect/filter", "denoise/smoothing/filter", "filter_axis", &[]),
    hot("indirect/history", "denoise/history/mix", "mix_history", &[]),
    hot("antialiasing", "antialiasing/resolve", "fragment", &[]),
    hot("indirect/virtual_lights/map", "indirect/virtual_lights/trace", "trace", &["tracer_bvh"]),
    hot("indirect/virtual_lights/shadow", "indirect/virtual_lights/shadow", "shadow", &["tracer_bvh"]),
    hot("indirect/photon_splatting/emit", "indirect/photon_splatting/emit", "emit", &["tracer_bvh"]),
    hot("indirect/photon_splatting/trace", "indirect/photon_splatting/trace", "trace", &["tracer_bvh"]),
];
