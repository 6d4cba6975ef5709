//! Layouts, and WebGPU's limits, without an adapter.

use lanternfish_gpu::check_layout;

use crate::{
    SHADERS,
    builder::TRIANGLES,
    clustering::iterations_for,
    parameters::{BvhStep, MAX_ITERATIONS, MAX_LEVELS},
};

#[test]
fn every_shader_links_with_the_hosts_layout_and_few_buffers() {
    for (module, features, entries) in [
        ("binary/prepare", &[][..], &["prepare", "encode", "gather"][..]),
        ("binary/prepare", &[TRIANGLES], &["prepare"]),
        ("binary/nearest", &[], &["nearest"]),
        ("binary/plan", &[], &["plan_iteration"]),
        ("binary/merge", &[], &["merge"]),
        ("wide/collapse", &[], &["collapse"]),
        ("wide/plan", &[], &["plan_level"]),
        ("wide/emit", &[], &["emit"]),
        ("wide/refit", &[], &["refit"]),
        ("wide/refit", &[TRIANGLES], &["refit"]),
    ] {
        let shader = SHADERS.link(module, features).unwrap();
        check_layout::<BvhStep>(&shader).unwrap();
        for entry in entries {
            assert!(shader.has_entry(entry), "{module}: {entry}");
            let index = shader.module.entry_points.iter().position(|e| e.name == *entry).unwrap();
            let uses = shader.info.get_entry_point(index);
            let used = shader.module.global_variables.iter().filter(|(handle, _)| !uses[*handle].is_empty());
            let buffers = used.filter(|(_, v)| matches!(v.space, naga::AddressSpace::Storage { .. })).count();
            assert!(buffers <= 8, "{module}, {entry}: {buffers} storage buffers");
        }
    }
}

/// There are enough iterations for halving, and not so many that the binary tree is too high for the levels.
#[test]
fn the_number_of_iterations_is_within_bounds() {
    const { assert!(MAX_ITERATIONS <= 3 * MAX_LEVELS) };
    for count in (1..2_000).chain([1 << 20, (1 << 20) + 1, 16_776_960]) {
        assert!((1u64 << iterations_for(count).min(63)) >= u64::from(count), "{count}");
    }
}
