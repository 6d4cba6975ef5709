//! `selection.wesl` chooses each candidate as often as it states, and in proportion to its weight.

use glam::Vec4;
use lanternfish_gpu::{
    Bindings, Frame, Gpu, Profiler, ShaderLibrary, read_back, storage_buffer, storage_buffer_of, testing,
};

use super::super::DirectSampling;
use crate::testing::{Random, edited_library, library, probe_of};

/// Candidates, and vectors of a query and of an answer of the probe.
const COUNT: usize = 36;
const QUERY: usize = 10;
const ANSWER: usize = 9;
/// Random numbers of each case, 0..1, at equal distances.
const NUMBERS: usize = 128;
const RAYS: u32 = 4;

/// What is wrong with the selection of a shader, by weights of many kinds that are all light, or a third of it.
fn fault(gpu: &Gpu, library: &ShaderLibrary) -> Result<(), String> {
    let mut random = Random::new(51);
    let mut of = |weight: &dyn Fn(usize, f32) -> f32| (0..COUNT).map(|i| weight(i, random.unit())).collect::<Vec<_>>();
    let weights = [
        of(&|_, _| 1.0),
        of(&|_, u| u + 1e-3),
        of(&|_, u| 10f32.powf(20.0 * u - 10.0)),
        of(&|i, u| {
            if i == 7 { 1e4 } else { u + 1e-3 }
        }),
    ];
    let cases: Vec<_> =
        weights.iter().flat_map(|all| [1.0, 3.0].map(|more| (all, more * all.iter().sum::<f32>()))).collect();
    let mut words = Vec::new();
    for (weights, worth) in &cases {
        for i in 0..NUMBERS {
            words.push(Vec4::new(COUNT as f32, (i as f32 + 0.4) / NUMBERS as f32, *worth, 0.0));
            words.extend(weights.chunks(4).map(Vec4::from_slice));
        }
    }
    let queries = storage_buffer_of(&gpu.device, "queries", &words, wgpu::BufferUsages::empty()).unwrap();
    let count = words.len() / QUERY;
    let answers = storage_buffer(&gpu.device, "answers", (16 * ANSWER * count) as u64).unwrap();
    let kernel = probe_of(library, gpu, "testing/light_samples", &[], "selected");
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let sampling = frame.uniform(&DirectSampling { light_samples: RAYS, ..DirectSampling::default() });
    let bindings = Bindings::new().buffer("queries", &queries).buffer("answers", &answers);
    frame.dispatch(&kernel, &bindings.part("direct_sampling", &sampling), [count.div_ceil(64) as u32, 1, 1]);
    frame.submit();
    let answers: Vec<f32> = read_back(&gpu.device, &gpu.queue, &answers, 4 * ANSWER * count).unwrap();
    for ((weights, worth), answers) in cases.iter().zip(answers.chunks(COUNT * NUMBERS)) {
        for (i, weight) in weights.iter().enumerate() {
            let chance = (weight * RAYS as f32 / worth).min(1.0);
            let chosen: Vec<f32> = answers.iter().skip(i).step_by(COUNT).copied().filter(|it| *it > 0.0).collect();
            // Exact to one at each end of an interval of numbers.
            let is_often = (chosen.len() as f32 - chance * NUMBERS as f32).abs() <= 2.0;
            if !is_often || chosen.iter().any(|stated| (stated / chance - 1.0).abs() > 1e-5) {
                return Err(format!("{i} of chance {chance} is chosen {} times: {chosen:?}", chosen.len()));
            }
        }
    }
    Ok(())
}

#[gpu_test]
fn gpu_candidates_are_selected_by_their_weights(gpu: &Gpu) {
    fault(gpu, &library()).unwrap_or_else(|what| panic!("{what}"));
    // Check that the test can fail.
    for (text, by) in [
        ("weight / selection.threshold", "1.05 * weight / selection.threshold"),
        ("(*selection).place += chance;", "(*selection).place += 0.9 * chance;"),
        (
            "if (*selection).samples_left == 0u { return false; }",
            "if (*selection).samples_left <= 1u { return false; }",
        ),
    ] {
        let found = fault(gpu, &edited_library("direct_light/sampled/selection", text, by));
        assert!(found.is_err(), "{by} instead of {text} is not noticed");
    }
}
