//! Tests that the doctor detects faults.

use lanternfish::shaders::{SHADERS, edit};
use lanternfish_gpu::{Engine, Gpu, ShaderTexts, testing};

use super::{
    checks::{Plan, plans},
    measure::Bench,
    report::Group,
};

/// The values of a check that exceed their limits, with one text of the shaders replaced.
fn faults(gpu: &Gpu, plan: &Plan, edited: Option<(&str, &str, &str)>) -> Vec<String> {
    let gpu = Gpu { device: gpu.device.clone(), queue: gpu.queue.clone(), description: gpu.description.clone() };
    let engine = Engine::new(&gpu.device, &gpu.queue);
    if let Some((module, from, to)) = edited {
        let sources = SHADERS.sources();
        let (_, text) = sources.iter().find(|(path, _)| *path == module).expect("it is a file of the library");
        assert_eq!(text.matches(from).count(), 1, "{module} has {from:?} once");
        edit(&engine, ShaderTexts::from([(module.to_owned(), text.replace(from, to))]));
    }
    let figures = Bench::new(gpu, engine, None).run(plan).map_err(|error| error.to_string());
    let figures = figures.expect("it can be rendered").expect("every adapter can");
    println!("{}: {figures:?}", plan.group.name());
    figures.into_iter().filter(|figure| !figure.passes()).map(|figure| figure.name).collect()
}

/// Checks pass, and detect a wrong constant in what they look at.
fn detect(gpu: &Gpu, edits: &[(Group, &str, (&str, &str, &str))]) {
    for (group, name, edited) in edits {
        let plans = plans();
        let plan = plans.iter().find(|plan| plan.is_quick && plan.group == *group && plan.name.contains(name));
        let plan = plan.expect("--quick makes it");
        assert_eq!(faults(gpu, plan, None), Vec::<String>::new(), "{}: sound shaders", group.name());
        let actual = faults(gpu, plan, Some(*edited));
        assert!(!actual.is_empty(), "{}: blind to {edited:?}", group.name());
    }
}

#[gpu_test]
fn gpu_a_check_detects_a_wrong_constant(gpu: &Gpu) {
    let edited = ("materials/brdf", "return k * k / PI;", "return k * k / 3.0;");
    detect(gpu, &[(Group::Materials, "BRDF", edited)]);
}

#[gpu_test(full)]
fn gpu_each_kind_of_check_detects_a_wrong_constant(gpu: &Gpu) {
    let tree = "light_culling/clustered/build_tree";
    let reflectance = "whole_reflectance(reflector_of_hit(surface), n_dot_l) * (n_dot_l / ";
    let (right, wrong) = (format!("{reflectance}PI)"), format!("{reflectance}3.0)"));
    detect(
        gpu,
        &[
            (
                Group::LightCulling,
                "clustered",
                (tree, "vec4f(p, light.range + margin", "vec4f(p, 0.9 * light.range + margin"),
            ),
            (Group::Shadows, "bvh", ("shadows/visibility", "const LAST = 0.9999;", "const LAST = 0.8;")),
            (Group::IndirectLight, "default", ("indirect/hit_radiance", &right, &wrong)),
        ],
    );
}
