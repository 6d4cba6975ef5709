mod change;
mod edit;
mod flight;
mod later;
mod motion;
mod steady;

use std::sync::{Arc, Mutex};

use lanternfish_gpu::{PassProgress, PassWatcher, testing};
use lanternfish_scene::generate::demo;

use crate::{
    Renderer, Settings,
    settings::{DebugView, Exposure, Shadows},
};

/// Successive dispatches share a compute pass: a frame of the default settings has few passes for any number of rays per pixel.
#[gpu_test]
fn gpu_a_frame_has_few_compute_passes(gpu: &Gpu) {
    let test = "gpu_a_frame_has_few_compute_passes";
    let scene = demo("cornell").unwrap();
    let settings = Settings::default().with_shadows(Shadows::BVH);
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let mut passes_of_frame = || {
        let before = renderer.profiler.compute_passes();
        let rendering = renderer.render(&uploaded, &scene.cameras[0], [64, 48]).unwrap();
        (renderer.profiler.compute_passes() - before, rendering.report.passes)
    };
    passes_of_frame();
    let (passes, times) = passes_of_frame();
    println!("{passes} compute passes, {} dispatches and render passes timed", times.len());
    let has_timestamps = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    if has_timestamps && !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES) {
        return testing::left_out(test, "this device cannot time dispatches that share a pass");
    }
    // Draws and reads of counts end a pass.
    assert!((1..=9).contains(&passes), "{passes}");
    // Each dispatch is still timed separately.
    assert!(!has_timestamps || times.len() > 40, "{times:?}");
}

/// Watched frames run pass by pass and are the same images.
#[gpu_test]
fn gpu_watched_passes_are_told_in_order_and_change_nothing(gpu: &Gpu) {
    let scene = demo("cornell").unwrap();
    let image = |watcher: Option<PassWatcher>| {
        let settings = Settings::direct_light().with_shadows(Shadows::BVH);
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), settings).unwrap();
        let uploaded = renderer.upload(&scene).unwrap();
        renderer.watch_passes(watcher);
        renderer.render(&uploaded, &scene.cameras[0], [64, 48]).unwrap()
    };
    let told = Arc::new(Mutex::new(Vec::new()));
    let watcher = {
        let told = Arc::clone(&told);
        Box::new(move |pass: PassProgress<'_>| {
            told.lock().unwrap().push((pass.label.to_owned(), pass.index, pass.count));
        })
    };
    let (watched, alone) = (image(Some(watcher)), image(None));
    assert_eq!(watched.radiance, alone.radiance);
    let told = told.lock().unwrap();
    // Each submission counts its own passes from 0 on.
    let mut next = 0;
    for (label, index, count) in told.iter() {
        assert!(*index == next && index < count, "{label}: {index} of {count}");
        next = (index + 1) % count;
    }
    assert_eq!(next, 0, "the last pass was told");
    let has = |label: &str| told.iter().any(|(told, ..)| told == label);
    assert!(has("shading/forward") && has("output") && told.len() > 10, "{told:?}");
    let timed: Vec<_> = watched.report.passes.iter().map(|pass| pass.name.as_str()).collect();
    assert!(timed.iter().all(|name| has(name)), "{timed:?}");
}

/// A debug view skips passes that it does not show, and the renderer still reports the settings as given.
#[gpu_test]
fn gpu_settings_come_back_as_they_were_given(gpu: &Gpu) {
    for view in [DebugView::BaseColor, DebugView::Normal] {
        let given = Settings::default().with_debug_view(Some(view));
        let mut renderer = Renderer::with_engine(&testing::engine(gpu), given.clone()).unwrap();
        assert_eq!(*renderer.settings(), given);
        renderer.set_exposure(Exposure::Ev(-1.0)).unwrap();
        assert_eq!(*renderer.settings(), given.with_exposure(Exposure::Ev(-1.0)));
    }
}
