//! Every shader with entry points, and what it may be linked with.

/// A file with entry points, and all that a room can choose when it links it.
pub(super) struct Root {
    pub module: &'static str,
    pub entries: &'static [&'static str],
    /// Of each list, one choice: features joined by `+`, or none.
    pub choices: &'static [&'static [&'static str]],
}

const CULLING: &[&str] = &["", "culling_all", "culling_clustered"];
/// Choices of a room that says itself which features settings ask for: [`asked_by_settings`].
const BY_SETTINGS: &[&[&str]] = &[];
pub(super) const TEXTURES: &[&str] = &["", "binding_arrays"];

/// Stores of deep images, and whether fragments know their triangles.
const STORES: &[&str] = &[
    "append",
    "append+payload",
    "linked_list",
    "linked_list+payload",
    "sorted_linked_list",
    "sorted_linked_list+payload",
];

pub(super) const ROOTS: &[Root] = &[
    Root {
        module: "prepass/prepass",
        entries: &["vertex", "fragment"],
        choices: &[&["", "masked", "blended"], TEXTURES],
    },
    Root { module: "prepass/depth", entries: &["vertex"], choices: &[&["", "masked"], TEXTURES] },
    Root { module: "light_culling/tiled/bounds", entries: &["bounds"], choices: &[] },
    Root { module: "light_culling/tiled/assign", entries: &["count", "write"], choices: &[] },
    Root { module: "light_culling/clustered/mark", entries: &["mark"], choices: &[] },
    Root {
        module: "light_culling/clustered/mark_drawn",
        entries: &["vertex", "fragment"],
        choices: &[&["", "multisampled"]],
    },
    Root { module: "light_culling/clustered/compact", entries: &["flag", "compact"], choices: &[] },
    Root { module: "light_culling/clustered/build_tree", entries: &["keys", "place", "leaves", "join"], choices: &[] },
    Root { module: "light_culling/clustered/assign", entries: &["count", "write"], choices: &[&["", "hierarchy"]] },
    Root { module: "deep_images/build/single_pass", entries: &["vertex", "fragment"], choices: &[] },
    Root { module: "deep_images/build/distribute", entries: &["distribute"], choices: &[STORES] },
    Root { module: "deep_images/build/per_triangle", entries: &["put"], choices: &[STORES] },
    Root { module: "deep_images/build/per_direction", entries: &["vertex", "fragment"], choices: &[STORES] },
    Root { module: "deep_images/build/depth_peeling", entries: &["vertex", "fragment"], choices: &[] },
    Root { module: "deep_images/build/peeled", entries: &["keep", "put"], choices: &[STORES] },
    Root { module: "deep_images/store/fill", entries: &["fill"], choices: &[&["", "payload"]] },
    Root { module: "deep_images/store/sort", entries: &["sort", "compact"], choices: &[&["", "payload"]] },
    Root { module: "deep_images/store/pack", entries: &["pack"], choices: &[] },
    Root { module: "deep_images/store/link", entries: &["link"], choices: &[&["", "payload"]] },
    Root {
        module: "rays/list",
        entries: &["trace"],
        choices: &[&[
            "",
            "tracer_ray_query",
            "tracer_within_texel",
            "tracer_across_texels",
            "linked_list+tracer_within_texel",
            "linked_list+tracer_across_texels",
            "sorted_linked_list+tracer_within_texel",
            "sorted_linked_list+tracer_across_texels",
            "depth_16+tracer_within_texel",
            "depth_16+tracer_across_texels",
        ]],
    },
    Root {
        module: "deep_images/view/points",
        entries: &["vertex", "fragment"],
        choices: &[&["payload"], &["", "depth_16"]],
    },
    Root {
        module: "deep_images/view/texels",
        entries: &["count", "layer"],
        choices: &[&["", "payload"], &["", "depth_16"]],
    },
    Root { module: "deep_images/view/paint", entries: &["vertex", "fragment"], choices: &[] },
    Root {
        module: "indirect/sampled/trace",
        entries: &["trace"],
        choices: &[&[
            "",
            "tracer_ray_query",
            "payload+tracer_within_texel",
            "payload+tracer_across_texels",
            "payload+depth_16+tracer_within_texel",
            "payload+depth_16+tracer_across_texels",
            "payload+linked_list+tracer_within_texel",
            "payload+linked_list+tracer_across_texels",
            "payload+sorted_linked_list+tracer_within_texel",
            "payload+sorted_linked_list+tracer_across_texels",
        ]],
    },
    Root { module: "indirect/sampled/shade", entries: &["shade"], choices: &[&["", "environment"]] },
    Root { module: "indirect/sampled/shadow", entries: &["shadow"], choices: &[&["", "tracer_ray_query"]] },
    Root { module: "indirect/sampled/emitters", entries: &["emitters"], choices: &[&["", "tracer_ray_query"]] },
    Root { module: "indirect/sampled/bound", entries: &["bound"], choices: &[] },
    Root { module: "indirect/sampled/filter", entries: &["resolve", "filter_axis"], choices: &[] },
    Root { module: "shadows/plan", entries: &["plan"], choices: BY_SETTINGS },
    Root { module: "shadows/trace", entries: &["trace"], choices: BY_SETTINGS },
    Root { module: "shading/forward", entries: &["vertex", "fragment"], choices: BY_SETTINGS },
    Root { module: "shading/dim", entries: &["vertex", "fragment"], choices: &[TEXTURES] },
    Root { module: "environment_light/levels", entries: &["fill", "halve", "filter_level"], choices: &[] },
    Root { module: "occlusion/hbao/by_normal", entries: &["by_normal"], choices: &[] },
    Root {
        module: "occlusion/deep/accumulate",
        entries: &["accumulate", "resolve"],
        choices: &[&["payload"], &["", "linked_list", "sorted_linked_list", "depth_16"], &["", "environment"]],
    },
    Root { module: "occlusion/hbao/horizon", entries: &["horizons"], choices: &[] },
    Root { module: "occlusion/hbao/blur", entries: &["blur_across", "blur_down"], choices: &[] },
    Root { module: "sky/sky", entries: &["vertex", "fragment"], choices: &[] },
    Root { module: "progressive/mean", entries: &["vertex", "fragment"], choices: &[] },
    Root { module: "output/meter", entries: &["count", "expose"], choices: &[] },
    Root { module: "output/output", entries: &["vertex", "fragment"], choices: &[] },
    Root { module: "debug_views/debug", entries: &["vertex", "fragment"], choices: &[CULLING, &["", "occlusion"]] },
];
