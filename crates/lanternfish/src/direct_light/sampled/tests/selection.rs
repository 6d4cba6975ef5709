//! `selection.wesl` against the same algorithm in Rust, and its properties.

use glam::Vec4;
use lanternfish_gpu::{
    Bindings, ComputeKernel, Frame, Gpu, Profiler, ShaderLibrary, read_back, storage_buffer, storage_buffer_of, testing,
};

use crate::testing::{Random, edited_library, library, probe_of};

use super::super::{DirectSampling, TILES};

/// Most candidates, and vectors of a query and of an answer of the probe.
const MOST: usize = 36;
const QUERY: usize = 10;
const ANSWER: usize = 9;

/// Weights of candidates, the fraction of all light that they are, and the number of rays.
#[derive(Clone, Debug)]
struct Case {
    weights: Vec<f32>,
    fraction: f32,
    rays: u32,
}

impl Case {
    /// The weight above which a candidate is always chosen.
    fn threshold(&self) -> f32 {
        self.worth() / self.rays as f32
    }

    /// Light of all candidates: a weight is at most a candidate's light.
    fn worth(&self) -> f32 {
        self.fraction.recip() * self.weights.iter().sum::<f32>()
    }

    /// Probability of each candidate.
    fn chances(&self) -> Vec<f32> {
        let threshold = self.threshold();
        self.weights.iter().map(|w| if *w >= threshold { 1.0 } else { w / threshold }).collect()
    }

    /// The probability of each chosen candidate; 0 of the others.
    fn selected(&self, u: f32) -> Vec<f32> {
        let (mut place, mut left) = (u, self.rays);
        let select = |chance: &f32| {
            let before = place;
            place += if *chance < 1.0 { *chance } else { 0.0 };
            let is_chosen = left > 0 && (*chance >= 1.0 || place.floor() != before.floor());
            left -= u32::from(is_chosen);
            if is_chosen { *chance } else { 0.0 }
        };
        self.chances().iter().map(select).collect()
    }
}

/// What the shader returns for each candidate, for each number u.
fn on_device(gpu: &Gpu, library: &ShaderLibrary, queries: &[(&Case, f32)]) -> Vec<Vec<f32>> {
    let kernel = probe_of(library, gpu, "testing/light_samples", &[TILES], "selected");
    let of_equal_rays = queries.chunk_by(|(a, _), (b, _)| a.rays == b.rays);
    of_equal_rays.flat_map(|queries| answers(gpu, &kernel, queries)).collect()
}

/// The same for cases of one number of rays.
fn answers(gpu: &Gpu, kernel: &ComputeKernel, queries: &[(&Case, f32)]) -> Vec<Vec<f32>> {
    let mut words = Vec::with_capacity(QUERY * queries.len());
    for (case, u) in queries {
        words.push(Vec4::new(case.weights.len() as f32, *u, case.worth(), 0.0));
        let mut weights = case.weights.clone();
        weights.resize(MOST, 0.0);
        words.extend(weights.chunks(4).map(Vec4::from_slice));
    }
    let sampling = DirectSampling { light_samples: queries[0].0.rays, ..DirectSampling::default() };
    let none = wgpu::BufferUsages::empty();
    let words = storage_buffer_of(&gpu.device, "queries", &words, none).unwrap();
    let answers = storage_buffer(&gpu.device, "answers", (16 * ANSWER * queries.len()) as u64).unwrap();
    let mut profiler = Profiler::new(&gpu.device, &gpu.queue);
    let mut frame = Frame::new(&gpu.device, &gpu.queue, &mut profiler);
    let bindings = Bindings::new().buffer("queries", &words).buffer("answers", &answers);
    let sampling = frame.uniform(&sampling);
    let bindings = bindings.part("direct_sampling", &sampling);
    frame.dispatch(kernel, &bindings, [queries.len().div_ceil(64) as u32, 1, 1]);
    frame.submit();
    let answers: Vec<f32> = read_back(&gpu.device, &gpu.queue, &answers, 4 * ANSWER * queries.len()).unwrap();
    answers.chunks(MOST).zip(queries).map(|(all, (case, _))| all[..case.weights.len()].to_vec()).collect()
}

/// Lists of every length around the number of rays, with weights of many kinds.
fn cases() -> Vec<Case> {
    let mut random = Random::new(51);
    let mut cases = Vec::new();
    for rays in [1, 2, 4, 8] {
        for count in [0, 1, 2, rays as usize - 1, rays as usize, rays as usize + 1, 2 * rays as usize, 32, MOST] {
            let mut of = |weight: &mut dyn FnMut(usize, &mut Random) -> f32| {
                let weights = (0..count).map(|i| weight(i, &mut random)).collect();
                cases.push(Case { weights, fraction: if cases.len() % 2 == 0 { 1.0 } else { 0.3 }, rays });
            };
            of(&mut |_, _| 1.0);
            of(&mut |_, random| random.unit() + 1e-3);
            // Over 20 orders of magnitude.
            of(&mut |_, random| 10f32.powf(random.between(-10.0, 10.0)));
            // As many that dominate as there are rays, or one fewer or more, first or last; the others vanish beside
            // them.
            let rays = rays as usize;
            for (dominating, is_first) in [(1, false), (rays - 1, true), (rays, false), (rays, true), (rays + 1, false)]
            {
                let is_one = |i: usize| if is_first { i < dominating } else { i + dominating >= count };
                of(&mut |i, _| if is_one(i) { 1.0 } else { 1e-12 });
                of(&mut |i, random| if is_one(i) { 1e4 } else { random.unit() + 1e-3 });
            }
        }
    }
    cases
}

/// Numbers per case in 0..1, at equal distances.
const NUMBERS: usize = 128;

/// What is wrong with the selection of a shader.
fn fault(gpu: &Gpu, library: &ShaderLibrary) -> Result<(), String> {
    let cases = cases();
    let number = |i: usize| (i as f32 + 0.4) / NUMBERS as f32;
    let queries: Vec<_> = cases.iter().flat_map(|case| (0..NUMBERS).map(move |i| (case, number(i)))).collect();
    let answers = on_device(gpu, library, &queries);
    let (mut same, mut other) = (0, 0);
    for ((case, u), answer) in queries.iter().zip(&answers) {
        let expected = case.selected(*u);
        let chosen = answer.iter().filter(|chance| **chance > 0.0).count();
        if chosen > case.rays as usize {
            return Err(format!("{chosen} are chosen: {case:?}"));
        }
        for (i, (actual, expected)) in answer.iter().zip(&expected).enumerate() {
            // A sum of up to 36 probabilities that is rounded otherwise may pass a whole number one candidate earlier
            // or later.
            match (*actual > 0.0) == (*expected > 0.0) {
                true => same += 1,
                false => other += 1,
            }
            // Two sums of 36 weights, and divisions.
            if *actual > 0.0 && (actual / case.chances()[i] - 1.0).abs() > 1e-5 {
                return Err(format!("chance {actual} of {i}, not {expected}: {case:?}"));
            }
        }
    }
    println!("{same} decisions as the reference's, {other} others");
    if other * 1000 > same {
        return Err(format!("{other} decisions differ from the reference"));
    }
    for (case, answers) in cases.iter().zip(answers.chunks(NUMBERS)) {
        for (i, chance) in case.chances().iter().enumerate() {
            let count = answers.iter().filter(|answer| answer[i] > 0.0).count();
            // Numbers at equal distances: the count of an interval is exact to one at each of its ends.
            if (count as f32 - chance * NUMBERS as f32).abs() > 2.0 || (*chance == 1.0 && count < NUMBERS) {
                return Err(format!("{i} of chance {chance} is chosen {count} times of {NUMBERS}: {case:?}"));
            }
        }
    }
    Ok(())
}

#[test]
fn the_chances_of_a_selection_are_in_proportion_and_sum_to_the_rays_at_most() {
    for case in cases() {
        let chances = case.chances();
        let sum: f64 = chances.iter().map(|chance| f64::from(*chance)).sum();
        let has_all = chances.iter().all(|chance| *chance < 1.0) && !chances.is_empty();
        let most = f64::from(case.rays) * f64::from(case.fraction);
        assert!(sum < f64::from(case.rays) + 1e-4 && (!has_all || (sum / most - 1.0).abs() < 1e-4), "{sum}: {case:?}");
        for (chance, weight) in chances.iter().zip(&case.weights) {
            let is_in_proportion = *chance == 1.0 || (chance * case.threshold() / weight - 1.0).abs() < 1e-6;
            assert!(*chance > 0.0 && *chance <= 1.0 && is_in_proportion, "{case:?}");
        }
    }
}

#[gpu_test]
fn gpu_candidates_are_selected_by_their_weights(gpu: &Gpu) {
    fault(gpu, &library()).unwrap_or_else(|what| panic!("{what}"));
    // Check that the test can fail.
    let module = "direct_light/sampled/selection";
    for (text, by) in [
        ("weight / selection.threshold", "min(1.05 * weight / selection.threshold, 1.0)"),
        ("(*selection).place += chance;", "(*selection).place += 0.95 * chance;"),
        ("worth / f32(most)", "0.95 * worth / f32(most)"),
        (
            "if (*selection).samples_left == 0u { return false; }",
            "if (*selection).samples_left <= 1u { return false; }",
        ),
    ] {
        let found = fault(gpu, &edited_library(module, text, by));
        println!("{by}: {found:?}");
        assert!(found.is_err(), "{by} instead of {text} is not noticed");
    }
}
