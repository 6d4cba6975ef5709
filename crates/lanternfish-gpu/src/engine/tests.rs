use super::*;
use crate::{primitives::Scan, testing};

#[gpu_test]
fn gpu_an_engine_compiles_each_pipeline_once(gpu: &Gpu) {
    let engine = Engine::new(&gpu.device, &gpu.queue);
    let scan = |label| Scan::new(&gpu.device, label).unwrap();
    let (_, requested) = engine.requested_within(|| scan("test"));
    let once = engine.compilations();
    assert_eq!(once, Compilations { shaders: 1, pipelines: 2 });
    let (_, again) = engine.clone().requested_within(|| scan("test"));
    assert_eq!((engine.compilations(), &again), (once, &requested));
    // Outside of `within` the cache is not used.
    scan("test");
    assert_eq!(engine.compilations(), once);
    // Another label is another pipeline (a pass of its own in reports) with the same shader.
    let (_, other) = engine.requested_within(|| scan("other"));
    assert_eq!(engine.compilations(), Compilations { shaders: 1, pipelines: 4 });
    assert!(other != requested);
    engine.forget();
    engine.within(|| scan("test"));
    assert_eq!(engine.compilations(), Compilations { shaders: 2, pipelines: 6 });
}

/// A pipeline in use is never dropped; an unused one is dropped after enough others were used.
#[gpu_test]
fn gpu_an_engine_drops_the_least_recently_used_pipelines(gpu: &Gpu) {
    let engine = Engine::new(&gpu.device, &gpu.queue);
    let scan = |label: &str| engine.within(|| Scan::new(&gpu.device, label).unwrap());
    let compiles = |label: &str| {
        let before = engine.compilations();
        scan(label);
        engine.compilations() != before
    };
    let mut held = Some(scan("held"));
    let spare = SPARE_KERNELS / 2;
    for number in 0..3 * spare {
        scan(&number.to_string());
        // A pipeline that is requested again and again stays.
        assert_eq!(compiles("requested again"), number == 0);
        assert!(engine.kept().kernels <= SPARE_KERNELS + 4, "{:?}", engine.kept());
    }
    assert_eq!(engine.kept().shaders, 1, "all remaining pipelines use it");
    assert!(!compiles(&(3 * spare - 1).to_string()) && !compiles(&(2 * spare + 1).to_string()) && compiles("0"));
    assert!(!compiles("held"), "dropped though it was in use");
    // It was in use until now, so others are dropped before it.
    held.take();
    scan("another");
    assert!(!compiles("held"));
    for number in 0..spare + 2 {
        scan(&format!("more {number}"));
    }
    assert!(compiles("held"), "kept though it is the least recently used");
}

/// A shader is dropped with the last of its pipelines.
#[gpu_test]
fn gpu_an_engine_drops_shaders_without_pipelines(gpu: &Gpu) {
    let engine = Engine::new(&gpu.device, &gpu.queue);
    engine.within(|| crate::primitives::RadixSort::new(&gpu.device, "sort").unwrap());
    let of_sort = engine.kept().shaders;
    assert!(of_sort > 0);
    for number in 0..SPARE_KERNELS {
        engine.within(|| Scan::new(&gpu.device, &number.to_string()).unwrap());
    }
    assert_eq!(engine.kept().shaders, 1);
}
