//! Variants of the traversal: the library's shaders with texts replaced.

use lanternfish::{settings::Tracer, shaders::SHADERS};
use lanternfish_gpu::ShaderTexts;

use crate::error::CliError;

/// A file, a text that it has once, and the text that replaces it.
pub type Edit = (&'static str, &'static str, &'static str);

/// A variant of the traversal.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    pub name: &'static str,
    pub edits: &'static [Edit],
    pub tracer: Tracer,
    pub checks: wgpu::ShaderRuntimeChecks,
    /// True if it is also measured in frames. Others change the entry point of lists.
    pub is_for_frames: bool,
}

const WALK: &str = "rays/bvh/walk";
const LIST: &str = "rays/list";

const AS_IT_IS: Variant = Variant {
    name: "as it is",
    edits: &[],
    tracer: Tracer::BVH,
    checks: wgpu::ShaderRuntimeChecks::checked(),
    is_for_frames: true,
};

/// A variant with another constant for the depth of the stack.
macro_rules! stack {
    ($size:literal) => {
        Variant {
            name: concat!("stack of ", $size, " entries"),
            edits: &[(
                WALK,
                "const STACK_SIZE = ",
                concat!("const STACK_SIZE = ", $size, "u;\nconst STACK_SIZE_OF_THE_LIBRARY = "),
            )],
            ..AS_IT_IS
        }
    };
}

/// A variant with groups of another size.
macro_rules! group {
    ($size:literal) => {
        Variant {
            name: concat!("groups of ", $size),
            edits: &[
                (LIST, "@workgroup_size(WORKGROUP)", concat!("@workgroup_size(", $size, ")")),
                (LIST, "id.y * WIDTH * WORKGROUP", concat!("id.y * WIDTH * ", $size, "u")),
            ],
            is_for_frames: false,
            ..AS_IT_IS
        }
    };
}

/// All variants, the library's own first.
pub const VARIANTS: [Variant; 11] = [
    AS_IT_IS,
    // At most 256 bytes, which some compilers keep in registers.
    stack!(32),
    stack!(48),
    Variant {
        name: "stack of 32 entries in workgroup memory",
        edits: &[
            (
                WALK,
                "const NODE_VECTORS = 5u;",
                "const NODE_VECTORS = 5u;\nvar<private> lane: u32;\nvar<workgroup> stacks: array<array<vec2u, 64>, 32>;",
            ),
            (WALK, "var<private> stack: array<vec2u, STACK_SIZE>;\n", ""),
            (WALK, "nodes = stack[depth];", "nodes = stacks[depth][lane];"),
            (WALK, "stack[depth] = vec2u(nodes.x, rest);", "stacks[depth][lane] = vec2u(nodes.x, rest);"),
            (
                LIST,
                "import package::rays::tracer::first_distance;",
                "import package::rays::tracer::first_distance;\nimport package::rays::bvh::walk::lane;",
            ),
            (LIST, "id: vec3u) {", "id: vec3u, @builtin(local_invocation_index) local: u32) {\n    lane = local;"),
        ],
        is_for_frames: false,
        ..AS_IT_IS
    },
    group!(32),
    group!(128),
    Variant {
        name: "bytes to floats by bits",
        edits: &[(
            WALK,
            "vec4f(unpack4xU8(select(words[half], words[2u + half], negative)))",
            "(bitcast<vec4f>((unpack4xU8(select(words[half], words[2u + half], negative)) << vec4u(15u)) | vec4u(0x3f800000u)) \
             * 256.0 - 256.0)",
        )],
        ..AS_IT_IS
    },
    Variant {
        name: "without masks",
        edits: &[("rays/triangle", "if triangle.record == 0u { return t; }", "if triangle.record >= 0u { return t; }")],
        ..AS_IT_IS
    },
    Variant {
        name: "loops without bounds",
        checks: wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() },
        ..AS_IT_IS
    },
    Variant { name: "without runtime checks", checks: wgpu::ShaderRuntimeChecks::unchecked(), ..AS_IT_IS },
    Variant { name: "ray query", tracer: Tracer::RAY_QUERY, ..AS_IT_IS },
];

/// Numbers that a ray writes in place of its distance.
pub const NODES: &[Edit] = &[
    (WALK, "const NODE_VECTORS = 5u;", "const NODE_VECTORS = 5u;\nvar<private> count: u32;"),
    (WALK, "let bits = intersect_children(node, ray);", "count++;\n        let bits = intersect_children(node, ray);"),
    COUNTED[0],
    COUNTED[1],
];
pub const TRIANGLES: &[Edit] = &[
    (WALK, "const NODE_VECTORS = 5u;", "const NODE_VECTORS = 5u;\nvar<private> count: u32;"),
    (WALK, "triangles &= triangles - 1u;", "triangles &= triangles - 1u;\n            count++;"),
    COUNTED[0],
    COUNTED[1],
];
const COUNTED: [Edit; 2] = [
    (
        LIST,
        "import package::rays::tracer::first_distance;",
        "import package::rays::tracer::first_distance;\nimport package::rays::bvh::walk::count;",
    ),
    (
        LIST,
        "if distance != DISTANCE_ELSEWHERE { traced_distances[index] = distance; }",
        "if distance != DISTANCE_ELSEWHERE { traced_distances[index] = f32(count); }",
    ),
];

/// The edited files. An error if a text does not occur exactly once: the shaders have changed, and the variant must follow.
pub fn edited(edits: &[Edit]) -> Result<ShaderTexts, CliError> {
    let mut texts = ShaderTexts::new();
    for (file, from, to) in edits {
        let own = SHADERS.sources().iter().find(|(path, _)| path == file).map_or("", |(_, text)| *text);
        let text = texts.entry((*file).to_owned()).or_insert_with(|| own.to_owned());
        if text.matches(from).count() != 1 {
            let hint = "the shaders have changed: adapt the variant";
            return Err(CliError::new(format_args!("{file} does not have {from:?} exactly once"), hint));
        }
        *text = text.replace(from, to);
    }
    Ok(texts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_edit_applies_to_the_shaders() {
        for edits in VARIANTS.iter().map(|variant| variant.edits).chain([NODES, TRIANGLES]) {
            let texts = edited(edits).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(texts.is_empty(), edits.is_empty());
            assert!(texts.values().all(|text| !SHADERS.sources().iter().any(|(_, own)| own == text)));
        }
        for wrong in [(WALK, "no such text", ""), (WALK, "nodes", ""), ("rays/nowhere", "fn", "")] {
            let error = edited(&[wrong]).unwrap_err().to_string();
            assert!(error.contains("exactly once"), "{error}");
        }
    }
}
